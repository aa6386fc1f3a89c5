"""Data of a free scene: a bar whose tip and mean have series over time, held against 3D and against a user's model; its
conductivity and the model's time constant are fitted."""

from pathlib import Path

import numpy as np
import pytest

import compare
from compare import quantities
from validate.cli import main

K, LENGTH, HEAT, CAPACITY = 50.0, 1e-4, 1e12, 2500 * 800
KEY = "material.film.thermal_conductivity"
TIMES = np.linspace(5e-6, 5e-4, 80)


def exact(k: float, times: np.ndarray) -> dict[str, np.ndarray]:
    """Tip and mean of a bar of conductivity ``k`` (W/(m K)) that is heated throughout and cold at one end (K): the
    steady parabola less its modes (Carslaw and Jaeger, 3.14). At rest where ``times`` are infinite."""
    n = np.arange(400)
    a = (n + 0.5) * np.pi
    decay = np.exp(-np.outer(np.minimum(times, 1.0), a**2 * k / (CAPACITY * LENGTH**2)))
    top = HEAT * LENGTH**2 / k
    tip = 0.5 - decay @ (2 * (-1.0) ** n / a**3)
    mean = 1 / 3 - decay @ (2 / a**4)
    return {"tip": 300 + top * tip, "bar mean": 300 + top * mean}


def lines(values: dict[str, np.ndarray]) -> str:
    rows = zip(TIMES * 1e3, *values.values(), strict=True)
    heads = ["time (ms)", *(f"{name} (K)" for name in values)]
    return "\n".join([",".join(heads), *(",".join(f"{v:.9g}" for v in row) for row in rows)]) + "\n"


def written(path: Path, times: np.ndarray, k: float, off: float = 0.0) -> Path:
    """A file of exact traces, or of values at rest, with noise of 0.1 K and the mean off."""
    rng, found = np.random.default_rng(4), exact(k, times)
    noisy = {name: v + 0.1 * rng.standard_normal(len(times)) for name, v in found.items()}
    noisy["bar mean"] = noisy["bar mean"] + off
    rows = [f"{name}, {v[0] - 273.15:.9g} degC" for name, v in noisy.items()] if np.isinf(times[-1]) else []
    path.write_text("\n".join(rows) if rows else lines(noisy), encoding="utf-8")
    return path


@pytest.mark.parametrize("at_rest", [False, True])
def test_the_command(at_rest, steady, transient, model, ran):
    """A mean that is measured 2 K too hot: 3D is off by -2 K, and the lumped model shows its own error."""
    scene = steady if at_rest else transient
    file = written(scene.parent / "mine.csv", quantities.AT_REST if at_rest else TIMES, K, 2.0)
    given = f"--model {model}:bar --against {file} --data-uncertainty 0.1K --uncertain {KEY}=0.1%"
    summary, _ = ran(f"solve {scene} {given}")
    found = {(s["model"], s["quantity"], s["where"]): s for s in summary["validation"]["statements"]}
    mean = found["3D", "bar mean", "end"]
    assert mean["interval"][0] < -2 < mean["interval"][1]
    assert mean["seen"]
    assert not found["3D", "tip", "end"]["seen"]
    # At rest the model's formula is the exact one; over time its one constant is not the bar's.
    assert found["1D", "tip", "end"]["seen"] is not at_rest
    checks = {check["id"]: check for check in summary["checks"]}
    rise = 200 / 3 if at_rest else float(exact(K, TIMES)["bar mean"][-1]) - 300
    assert checks["against_bar mean"]["difference"] == pytest.approx(2 / rise, abs=0.003)
    # The mean of all rows at rest is in proportion to 1/k: 0.1 % of k is 0.1 % of the measured mean.
    if at_rest:
        assert checks["against_bar mean"]["u_input"] == pytest.approx(1e-3 * (1 + 2 / rise), rel=0.01)
    assert checks["against_tip"]["verdict"] == "agrees"


@pytest.mark.long
@pytest.mark.parametrize("at_rest", [False, True])
def test_a_key_is_fitted_in_3d(at_rest, steady, transient, ran):
    scene = steady if at_rest else transient
    file = written(scene.parent / "mine.csv", quantities.AT_REST if at_rest else TIMES, 43.0)
    given = f"--against {file} --data-uncertainty 0.1K --calibrate film.thermal_conductivity"
    given += " --set run.output_times=[1e-4]" * (not at_rest)  # errors hold from end_time/10 on
    summary, said = ran(f"solve {scene} {given}")
    assert "not validated by them" in said
    found = summary["calibration"]["keys"][KEY]
    assert found["start"] == K
    assert found["interval"][0] < 43 < found["interval"][1]
    assert found["relative_u"] < 0.002
    assert summary["scene"]["material"][0]["thermal_conductivity"] == found["value"]
    assert summary["calibration"]["points"] == (2 if at_rest else 2 * int((TIMES >= 5e-5).sum()))


@pytest.mark.parametrize(("text", "more", "said"), [
    ("time (ms),tipp (K)\n0,300\n1,301\n2,302\n", [], "none of its columns is a quantity of the scene, tip (K)"),
    ("time (ms),tip (A)\n0,1\n1,2\n2,3\n", [], "not a temperature"),
    ("tip, 400 K\n", [], "a list of steady values, and the scene is compared over time: give traces"),
    ("time (ms),tip (K)\n0,350\n0.2,390\n0.4,395\n", [], "--set scene.initial_temperature=350"),
    ("time (ms),tip (K)\n0,300\n0.2,390\n0.4,395\n", ["--calibrate", KEY], "give --data-uncertainty"),
    ("time (ms),tip (K)\n0,300\n0.2,390\n0.4,395\n", ["--data-uncertainty", "1A"], "is none, with its unit, of"),
    ("time (ms),tip (K)\n0,300\n0.2,390\n0.4,395\n",
     ["--data-uncertainty", "1K", "--calibrate", "film.conductivity"], "names no number"),
])  # fmt: skip
def test_refused(text, more, said, transient, capsys):
    file = transient.parent / "mine.csv"
    file.write_text(text, encoding="utf-8")
    out = transient.parent / "run"
    assert main(["solve", str(transient), "--against", str(file), "--out", str(out), *more]) == 2
    message = capsys.readouterr().err
    assert said in message
    assert message.count("\n") == 1
    assert not out.exists()


@pytest.mark.long
def test_data_of_which_few_rows_can_be_compared_are_told_so(tmp_path):
    """Four of the five rows of a square wave are at its jumps, or at the start."""
    file = tmp_path / "mine.csv"
    file.write_text("time (ms),heater (K)\n0,293\n1,300\n2,302\n3,310\n4,297\n", encoding="utf-8")
    with_few = compare.solve("hotplate", against=file, accuracy=1e-2).outcome.warnings
    assert any("mine.csv: 1 of 5 rows are compared" in text for text in with_few)
    file.write_text("time (ms),heater (K)\n0,293\n0.9,343\n1.9,297\n2.9,343\n4,297\n", encoding="utf-8")
    with_most = compare.solve("hotplate", against=file, accuracy=1e-2).outcome.warnings
    assert not any("rows are compared" in text for text in with_most)


def test_a_steady_scene_takes_the_last_row_of_traces(steady):
    file = written(steady.parent / "mine.csv", TIMES, K)
    data = compare.solve(steady, against=file).outcome.options.against
    assert data.at_rest
    assert "the last of 80 rows with numbers is taken for the steady state" in data.said
