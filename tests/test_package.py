"""The wheel holds all that a run needs: built from a copy of the sources, and run with nothing else of this project."""

import json
import os
import shutil
import subprocess
import sys
import zipfile
from importlib import metadata
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("scenes", "meshes", "statespace", "fem3d", "reduced1d", "compare", "benchmarks", "validate")


needs_setuptools = pytest.mark.skipif(
    int(metadata.version("setuptools").partition(".")[0]) < 77, reason="setuptools is older than 77"
)


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """The wheel's content in a folder of its own; nothing is built where the sources are."""
    folder = tmp_path_factory.mktemp("package")
    for name in PACKAGES:
        shutil.copytree(ROOT / name, folder / "source" / name, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, folder / "source")
    build = "import sys; from setuptools.build_meta import build_wheel; build_wheel(sys.argv[1])"
    done = subprocess.run(
        [sys.executable, "-c", build, folder], cwd=folder / "source", capture_output=True, encoding="utf-8"
    )
    assert done.returncode == 0, done.stderr
    (wheel,) = folder.glob("*.whl")
    zipfile.ZipFile(wheel).extractall(folder / "site")
    return folder / "site"


@pytest.mark.long
@needs_setuptools
def test_a_run_of_the_wheel_alone(installed, tmp_path):
    assert {path.parent.name for path in installed.glob("*/py.typed")} == set(PACKAGES)
    # Without site no editable installation is visible; its dependencies are beside numpy.
    where = os.pathsep.join([str(installed), str(Path(np.__file__).parents[1])])
    command = [sys.executable, "-S", "-m", "validate", "sink", "--no-figures", "--steady", "--quiet", "--out", "run"]
    done = subprocess.run(
        command,
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": where},
        capture_output=True,
        encoding="utf-8",
        timeout=120,
    )
    assert done.returncode == 0, done.stderr
    assert "is to blame" in done.stdout
    assert json.loads((tmp_path / "run" / "summary.json").read_text(encoding="utf-8"))["schema"] == 1
    assert (tmp_path / "run" / "report.html").stat().st_size > 10_000
