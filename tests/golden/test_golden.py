"""Compare random scenes with a finer solution of an earlier release (commit 4d8a19b7), within both error bounds.

`scenes.json` has the TOML document of each scene and, by probe, the finer value with its error bound: one number of the
steady state, or one number for each output time of a transient at which the bound holds. No constant is tuned on them.
"""

import json
from pathlib import Path

import numpy as np
import pytest

from validate.cli import main

SCENES = {entry["name"]: entry for entry in json.loads((Path(__file__).parent / "scenes.json").read_text("utf-8"))}

SLOW = ("laws-60044", "boxes-60038", "plates-60004")
ROUNDING = 1e-12  # relative, of reading decimals


@pytest.mark.parametrize("name", [pytest.param(n, marks=[pytest.mark.long] * (n in SLOW)) for n in SCENES])
def test_values_stay_within_error_bounds(name, tmp_path):
    file, folder = tmp_path / "scene.toml", tmp_path / "out"
    file.write_text(SCENES[name]["toml"], encoding="utf-8")
    assert main(["solve", str(file), "--no-figures", "--quiet", "--out", str(folder)]) == 0
    solved = json.loads((folder / "summary.json").read_text("utf-8"))["fem3d"]
    for probe, (finer, bound) in SCENES[name]["steady"].items():
        now = solved["steady"][probe]
        assert abs(now["value"] - finer) <= now["error"] + bound + ROUNDING * abs(finer), probe
    for probe, (times, finer, bound) in SCENES[name]["transient"].items():
        now = solved["transient"]
        rows = [int(np.argmin(np.abs(np.array(now["time_s"]) - time))) for time in times]
        difference = np.abs(np.array(now["values"][probe])[rows] - finer)
        assert difference.max() <= now["errors"][probe] + bound + ROUNDING * np.abs(finer).max(), probe
