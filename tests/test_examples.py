"""The examples run as they are (`test_my_sink.py` is collected by itself), and a failing assertion reads well."""

import json
import os
import runpy
import shutil
import subprocess
import sys
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import compare
from fem3d.runs import scene as scene_run
from scenes.errors import SceneError
from scenes.loading import load
from scenes.model import AnyScene
from scenes.result import Result

ROOT = Path(__file__).parents[1]
SAID = {
    "designer.py": ["10um", "agrees", "eq14"],
    "modeller.py": ["against_mean: differs", "lumped.csv"],
    "student.py": ["Equation 13", "in 3D it is 266"],
}


@pytest.mark.parametrize("name", SAID)
def test_an_example_runs(name, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    runpy.run_path(str(ROOT / "examples" / name), run_name="__main__")
    said = capsys.readouterr()
    assert said.err == ""
    assert all(text in said.out for text in SAID[name])
    # Nothing is left behind.
    assert list(tmp_path.iterdir()) == []


def plate_series(source: tuple[float, float], target: tuple[float, float]) -> float:
    """Sum the cosine series of a plate of 13 W/(m K), 3 x 3 x 0.5 mm, heated at a point: rise of another point in K/W.

    The source is a Gaussian of 3 um, so that the series converges; the bottom is at room temperature.
    """
    a = np.pi * np.arange(1500) / 3e-3
    g = np.maximum(np.hypot(a[:, None], a), 1e-30)
    depth = np.tanh(g * 0.5e-3) / (13.0 * g) * np.exp(-((3e-6 * g) ** 2) / 2)
    weight = np.where(a > 0, 2.0, 1.0)
    x, y = (weight * np.cos(a * p) * np.cos(a * q) for p, q in zip(source, target, strict=True))
    return float(x @ depth @ y) / 3e-3**2


def test_crosstalk_of_an_array_agrees_with_plate_series():
    example = runpy.run_path(str(ROOT / "examples" / "array.py"))
    # On a poor conductor the crosstalk is a larger part of the rise, so that a coarser solution has its digits.
    poor = ["substrate.thickness=0.5mm", "materials.substrate.thermal_conductivity=13", "run.accuracy=5e-3"]
    found = example["crosstalk"](load("sink", poor), 2, 400e-6)
    # The oxide blocks are 1150 um apart at the ends of each beam, and 50 um long; half of the heat leaves through each,
    # more of it on the side of the beam: between the middle and the inner end of a block.
    feet = [[[(1.5e-3 + x, 1.5e-3 + y) for y in (-at, at)] for x in (-200e-6, 200e-6)] for at in (575e-6, 550e-6)]
    low, high = (np.mean([[plate_series(p, q) for p in a] for q in b]) for a, b in feet)
    assert found.error[0, 1] < 0.01 * low
    assert high - low < 0.02 * low
    assert low - found.error[0, 1] < found.value[0, 1] < high + found.error[0, 1]


def test_array_takes_any_conductivity_and_refuses_overlap():
    example = runpy.run_path(str(ROOT / "examples" / "array.py"))
    anisotropic = ["substrate.thickness=0.5mm", "accuracy=5e-2", "materials.substrate.thermal_conductivity=[65,65,65]"]
    plain = ["substrate.thickness=0.5mm", "accuracy=5e-2", "materials.substrate.thermal_conductivity=65"]
    one, other = (example["crosstalk"](load("sink", settings), 2, 400e-6) for settings in (anisotropic, plain))
    assert one.value == pytest.approx(other.value, rel=1e-9)
    with pytest.raises(SceneError, match="lets pads touch"):
        example["crosstalk"](load("sink", plain), 2, 100e-6)


@pytest.mark.long
def test_the_notebook_runs(monkeypatch, capsys):
    """Its cells as a script, with the folder that it lies in on the path, as a notebook has it."""
    monkeypatch.syspath_prepend(str(ROOT / "examples"))
    cells = json.loads((ROOT / "examples" / "own_model.ipynb").read_text(encoding="utf-8"))["cells"]
    names: dict[str, Any] = {}
    for cell in cells:
        assert not cell.get("outputs"), "what it finds is made when the pages are built"
        if cell["cell_type"] == "code":
            exec("".join(cell["source"]), names)
    assert names["run"].check("heater_over_time").verdict == "differs"
    assert capsys.readouterr().out.count("differs") == 5


@pytest.mark.long
def test_one_lumped_model_in_four_forms(tmp_path, monkeypatch):
    """Each form's differences are the function's, within the errors of its own steps and rows."""
    monkeypatch.chdir(tmp_path)
    runpy.run_path(str(ROOT / "examples" / "lumped.py"), run_name="__main__")
    found = {"function": f"{ROOT / 'examples' / 'lumped.py'}:hotplate", "table": "lumped.csv"}
    if shutil.which("ngspice"):
        found["circuit"] = str(ROOT / "examples" / "lumped.cir")
    if find_spec("pythonfmu") and find_spec("fmpy"):
        from pythonfmu.builder import FmuBuilder

        FmuBuilder.build_FMU(ROOT / "examples" / "lumped_fmu.py", dest=tmp_path)
        found["FMU"] = "HotPlate.fmu"
    # In 3D each scene is solved once, whatever models it is held against.
    solved: dict[str, Result] = {}

    def once(scene: AnyScene, *more: object, **options: object) -> Result:
        key = repr((replace(scene, model=None), options))
        if key not in solved:
            solved[key] = solve(scene, *more, **options)
        return solved[key]

    solve = scene_run.solve
    monkeypatch.setattr(scene_run, "solve", once)
    names, coarse = {"circuit": ["model.outputs.heat to the left=v(left)"]}, ["run.accuracy=2e-2"]
    checks = {
        form: compare.solve("hotplate", model=model, overrides=[*coarse, *names.get(form, ())]).checks
        for form, model in found.items()
    }
    wanted = checks.pop("function")
    assert list(wanted) == ["heater_over_time", "current_over_time", "heat to the left_over_time"]
    for form, of_form in checks.items():
        assert list(of_form) == list(wanted)
        for name, check in of_form.items():
            assert abs(check.difference - wanted[name].difference) <= check.u_num - 0.9 * wanted[name].u_num, form
    # A film half as thick again is another model.
    heavier = compare.solve("hotplate", model=found["table"], overrides=[*coarse, "parameters.film=0.75 um"]).checks
    assert abs(heavier["heater_over_time"].difference - wanted["heater_over_time"].difference) > 0.05


@pytest.mark.long
def test_what_is_solved_in_one_screen_is_what_the_toolkit_solves():
    """scikit-fem's own elements on one mesh against the toolkit's bricks: within 1 %, as the paper's model isn't."""
    plain = runpy.run_path(str(ROOT / "examples" / "plain_scikit_fem.py"))
    assert len((ROOT / "examples" / "plain_scikit_fem.py").read_text(encoding="utf-8").splitlines()) <= 80
    run = compare.run("sink", voltage=1, steady=True)
    for name, value in (("peak_rise_K", plain["peak"]), ("mean_rise_K", plain["mean"]), ("power_W", plain["power"])):
        assert value == pytest.approx(run.fem3d.steady[name].value, rel=0.01)
    assert plain["peak"] != pytest.approx(run.reduced1d.steady["peak_rise_K"].value, rel=0.01)


@pytest.mark.long
def test_a_failing_assertion_reads_well(tmp_path):
    """As a user would see it: both values, the difference, the tolerance, the numerical error, no line of this code."""
    (tmp_path / "test_mine.py").write_text(
        "import scenes\nfrom compare.testing import assert_reduction_agrees\n"
        "def test_peak(): assert_reduction_agrees(scenes.load('sink'), peak=0.05)\n",
        encoding="utf-8",
    )
    env = {**os.environ, "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "test_mine.py"]
    found = subprocess.run(
        command, cwd=tmp_path, env=env, capture_output=True, encoding="utf-8", timeout=120, check=False
    )
    assert found.returncode == 1
    for text in ("1D 18.99", "3D 20.33", "\N{PLUS-MINUS SIGN}", "difference -6.56", "tolerance of 5"):
        assert text in found.stdout
    assert "compare/testing.py" not in found.stdout
