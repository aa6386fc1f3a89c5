"""The changes that CONTRIBUTING shows apply, and then do work."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

pytestmark = pytest.mark.needs("git")
ROOT = Path(__file__).parents[1]
PACKAGES = ("scenes", "meshes", "fem3d", "reduced1d", "statespace", "compare", "validate")
DIFFS = re.findall(r"```diff\n(.*?)```", (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8"), re.DOTALL)
FILE = re.compile(r"^\+\+\+ b/(.*)$", re.MULTILINE)


RUNS = {
    "check": "--steady --no-figures",
    "pads": "--steady --no-figures --set drive.electrodes=pad-edge",
    "reduction": "--no-figures --why --reduction fin-cold-oxide",
    "analysis": "--only 1d",
    "option": "--only 1d --steady --no-figures --width 20um",
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The results of some runs of the sink in a copy of the packages with all changes applied."""
    where = tmp_path_factory.mktemp("changed")
    for name in PACKAGES:
        shutil.copytree(ROOT / name, where / name, ignore=shutil.ignore_patterns("__pycache__"))
    for diff in DIFFS:
        subprocess.run(["git", "apply", "-"], input=diff, cwd=where, encoding="utf-8", check=True)
    commands = [["sink", "--accuracy", "1e-2", "--out", name, *given.split()] for name, given in RUNS.items()]
    code = f"import sys; from validate.cli import main; sys.exit(max(main(command) for command in {commands}))"
    command, environment = [sys.executable, "-P", "-c", code], {**os.environ, "PYTHONPATH": str(where)}
    subprocess.run(command, cwd=where, check=True, capture_output=True, encoding="utf-8", env=environment)
    return where


def summary(folder: Path, name: str) -> dict[str, Any]:
    return json.loads((folder / name / "summary.json").read_text(encoding="utf-8"))


def test_each_change_applies_and_touches_few_files():
    for diff in DIFFS:
        subprocess.run(["git", "apply", "--check", "-"], input=diff, cwd=ROOT, encoding="utf-8", check=True)
    assert [len(FILE.findall(diff)) for diff in DIFFS] == [2, 2, 2, 1]


@pytest.mark.long
def test_the_check(folder):
    """It agrees on the built-in sink, and differs where the pads are heated too."""
    for name, verdict in (("check", "agrees"), ("pads", "differs")):
        found = summary(folder, name)
        (check,) = [check for check in found["checks"] if check["id"] == "ends"]
        values = (found["fem3d"]["steady"][key]["value"] for key in ("end_flow_W", "heat_out_W"))
        assert (check["predicted"] / 2, check["measured"]) == tuple(values)
        assert check["verdict"] == verdict
        assert ("come from the pads" in check["because"]) == (verdict == "differs")
        assert "ends" in next(step["reason"] for step in found["plan"] if step["step"] == "checks")


@pytest.mark.long
def test_the_reduction(folder):
    found = summary(folder, "reduction")
    assert found["reduced1d"]["name"] == "fin-cold-oxide"
    assert found["why"]["steady"]["peak"]["parts"][0]["assumption"] == "oxide capacity"
    assert {check["model"] for check in found["checks"] if check["id"].startswith("fig6")} == {"fin-cold-oxide"}


@pytest.mark.long
def test_the_analysis(folder):
    found = summary(folder, "analysis")
    assert found["power"]["paper"]["largest_W"] > 3e-3
    assert "power" in [step["step"] for step in found["plan"]]


@pytest.mark.long
def test_the_option(folder):
    assert summary(folder, "option")["scene"]["sink"]["width"] == 20e-6
