"""The changes that CONTRIBUTING shows can be made, in at most three files each, and then do what it says."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
PACKAGES = ("scenes", "meshes", "fem3d", "reduced1d", "compare", "validate")
DIFFS = re.findall(r"```diff\n(.*?)```", (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8"), re.DOTALL)
FILE = re.compile(r"^\+\+\+ b/(.*)$", re.MULTILINE)


def changed(diff: str, where: Path) -> Path:
    """A copy of the packages with a diff applied."""
    for name in PACKAGES:
        shutil.copytree(ROOT / name, where / name, ignore=shutil.ignore_patterns("__pycache__"))
    subprocess.run(["git", "apply", "-"], input=diff, cwd=where, text=True, check=True)
    return where


def summary(root: Path, options: str) -> dict[str, Any]:
    """What a run of the sink in a copy of the packages finds."""
    code = "import sys; from validate.cli import main; sys.exit(main())"
    command = [sys.executable, "-P", "-c", code, "sink", "--accuracy", "1e-2", "--out", "run", *options.split()]
    subprocess.run(
        command, cwd=root, check=True, capture_output=True, text=True, env={**os.environ, "PYTHONPATH": str(root)}
    )
    found = json.loads((root / "run" / "summary.json").read_text(encoding="utf-8"))
    assert isinstance(found, dict)
    return found


def test_each_change_is_in_three_files_at_most() -> None:
    assert len(DIFFS) == 3
    assert all(1 <= len(FILE.findall(diff)) <= 3 for diff in DIFFS)


def test_the_check(tmp_path: Path) -> None:
    """It agrees on the built-in sink, and differs where the pads are heated too."""
    copy = changed(DIFFS[0], tmp_path)
    for options, verdict in (("", "agrees"), (" --set drive.electrodes=pad-edge", "differs")):
        found = summary(copy, f"--steady --no-figures{options}")
        (check,) = [check for check in found["checks"] if check["id"] == "ends"]
        values = (found["fem3d"]["steady"][key]["value"] for key in ("end_flow_W", "heat_out_W"))
        assert (check["predicted"] / 2, check["measured"]) == tuple(values)
        assert check["verdict"] == verdict
        assert ("come from the pads" in check["because"]) == (verdict == "differs")
        assert "ends" in next(step["reason"] for step in found["plan"] if step["step"] == "checks")


def test_the_reduction(tmp_path: Path) -> None:
    copy = changed(DIFFS[1], tmp_path)
    found = summary(copy, "--no-figures --why --reduction fin-cold-oxide")
    assert found["reduced1d"]["name"] == "fin-cold-oxide"
    assert found["why"]["steady"]["peak"]["parts"][0]["assumption"] == "oxide capacity"
    assert {check["model"] for check in found["checks"] if check["id"].startswith("fig6")} == {"fin-cold-oxide"}


def test_the_figure(tmp_path: Path) -> None:
    found = summary(changed(DIFFS[2], tmp_path), "--only 1d")
    assert {"figure_power.png", "figure_power.svg"} <= set(found["files"])
    assert "Power against time" in (tmp_path / "run" / "figure_power.svg").read_text(encoding="utf-8")
    assert "figure_power" in [step["step"] for step in found["plan"]]
