"""Each export, run as its user would: JSON through a general integrator, Python alone, SPICE in ngspice."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from reduced1d.export import export
from reduced1d.ladder.few_states import over_time
from reduced1d.ladder.levels import Levels
from scenes.compact.python import write_module
from scenes.errors import SceneError

TIMES = np.concatenate([np.geomspace(1e-5, 1e-3, 12), np.linspace(2e-3, 0.02, 10)])
CLOSE = 1e-4
"""Of the final rise: the steps of each way to integrate leave 2e-5 or less."""

Traces = dict[str, np.ndarray]
Edit = Callable[[str], str]


@pytest.fixture(scope="module")
def folder(levels: Levels, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return export(levels, "paper", tmp_path_factory.mktemp("export") / "new" / "folder")


@pytest.fixture(scope="module")
def expected(levels: Levels) -> Callable[[float], Traces]:
    """Rises (K) and current (A) of moments:4 after a step of the voltage."""

    def found(voltage: float) -> Traces:
        return over_time(replace(levels.fine.moments(4), voltage=voltage), TIMES)

    return found


def assert_same(found: Traces, exact: Traces) -> None:
    for key in ("peak_K", "end_K", "mean_K", "current_A"):
        scale = abs(exact[key][-1]) if key != "current_A" else abs(exact[key][-1] - exact[key][0])
        assert np.abs(np.asarray(found[key]) - exact[key]).max() < CLOSE * scale, key


def run_json(text: str, voltage: float) -> Traces:
    """The equations as the file has them."""
    model = json.loads(text)
    C, G, s, F = (np.array(model[key]) for key in ("C_J_per_K", "G_W_per_K", "s_ohm", "F_ohm"))
    r, a = model["r_ohm"], model["a_1_per_K"]

    def rate(_: float, T: np.ndarray) -> np.ndarray:
        found: np.ndarray = (-G * T + (voltage / (r + a * s @ T)) ** 2 * (s + a * F @ T)) / C
        return found

    T = solve_ivp(rate, (0, TIMES[-1]), np.zeros(len(C)), t_eval=TIMES, method="Radau", rtol=1e-6, atol=1e-6).y.T
    found = {name.replace("_rise_K", "_K"): T @ row for name, row in model["outputs"].items()}
    return {**found, "current_A": voltage / (r + a * T @ s)}


def run_python(text: str, voltage: float, folder: Path) -> Traces:
    """In a Python that finds neither our packages nor anyone else's, and keeps no compiled copy of another text."""
    (folder / "model.py").write_text(text)
    code = "import json, sys; sys.path.insert(0, sys.argv[1]); import model\nprint(json.dumps([model.ROOM, model.sink("
    code += f"{TIMES.tolist()}, {voltage})]))"
    done = subprocess.run(
        [sys.executable, "-ISB", "-c", code, str(folder)], check=True, capture_output=True, text=True, timeout=60
    )
    room, found = json.loads(done.stdout)
    return {key: np.array(value) - (room if key.endswith("_K") else 0.0) for key, value in found.items()}


def run_spice(text: str, voltage: float, folder: Path) -> Traces:
    """A step of the voltage at the port, at t = 0."""
    (folder / "sink_model.cir").write_text(text)
    (folder / "step.cir").write_text(
        "* step\n.include sink_model.cir\n"
        f"V1 plus 0 PWL(0 0 1n {voltage})\nX1 plus 0 peak end mean sink_model\n.options reltol=1e-6\n"
        ".control\nset wr_singlescale\nset wr_vecnames\ntran 20u 20m 0 20u\n"
        "wrdata out.txt v(peak) v(end) v(mean) i(V1)\nquit\n.endc\n.end\n"
    )
    done = subprocess.run(
        ["ngspice", "-b", "step.cir"], cwd=folder, capture_output=True, text=True, timeout=60, check=False
    )
    out = folder / "out.txt"
    assert out.exists(), done.stdout + done.stderr
    time, peak, end, mean, current = np.loadtxt(out, skiprows=1).T
    late = TIMES >= 1e-4  # ngspice's own steps are 20 us
    assert late.sum() > 12
    found = {"peak_K": peak, "end_K": end, "mean_K": mean, "current_A": -current}
    return {key: np.interp(TIMES[late], time, value) for key, value in found.items()}


def nudged(text: str) -> str:
    """The same file with the first capacity 1 % larger."""
    number = {
        "{": lambda: repr(json.loads(text)["C_J_per_K"][0]),
        '"': lambda: text.split("C = [")[1].split(",")[0],
        "*": lambda: text.split("C1 t1 0 ")[1].split()[0],
    }[text[0]]()
    assert number in text
    return text.replace(number, f"{1.01 * float(number):.12g}", 1)


@pytest.mark.parametrize("voltage", [1.0, 0.3])
def test_json(folder: Path, expected: Callable[[float], Traces], voltage: float) -> None:
    text = (folder / "sink_model.json").read_text()
    assert_same(run_json(text, voltage), expected(voltage))
    with pytest.raises(AssertionError):
        assert_same(run_json(nudged(text), voltage), expected(voltage))


@pytest.mark.parametrize("voltage", [1.0, -0.3])
def test_python(folder: Path, expected: Callable[[float], Traces], voltage: float, tmp_path: Path) -> None:
    text = (folder / "sink_model.py").read_text()
    assert len(text.splitlines()) <= 45
    assert_same(run_python(text, voltage, tmp_path), expected(voltage))
    with pytest.raises(AssertionError):
        assert_same(run_python(nudged(text), voltage, tmp_path), expected(voltage))


@pytest.mark.skipif(shutil.which("ngspice") is None, reason="ngspice is not installed (Debian: apt install ngspice)")
@pytest.mark.parametrize("voltage", [1.0, -0.3])
def test_spice(folder: Path, expected: Callable[[float], Traces], voltage: float, tmp_path: Path) -> None:
    text = (folder / "sink_model.cir").read_text()
    late = {key: value[TIMES >= 1e-4] for key, value in expected(voltage).items()}
    assert_same(run_spice(text, voltage, tmp_path), late)
    with pytest.raises(AssertionError):
        assert_same(run_spice(nudged(text), voltage, tmp_path), late)


def test_a_voltage_that_varies(folder: Path) -> None:
    """Off half way: the sink cools as the slowest mode does."""
    space: dict[str, object] = {}
    exec((folder / "sink_model.py").read_text(), space)
    times = [0.01, 0.01001, 0.016, 0.018]
    found = space["sink"](times, lambda t: 1.0 if t <= 0.01 else 0.0)  # type: ignore[operator]
    peak = np.array(found["peak_K"]) - 293.0
    assert found["current_A"][1:] == [0.0, 0.0, 0.0]
    slowest = max(c / g for c, g in zip(space["C"], space["G"], strict=True))  # type: ignore[call-overload]
    assert peak[3] / peak[2] == pytest.approx(np.exp(-0.002 / slowest), rel=1e-4)


def test_outside_its_range_it_warns(folder: Path) -> None:
    space: dict[str, Any] = {}
    exec((folder / "sink_model.py").read_text(), space)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        space["sink"]([1e-3, 0.02], 1.0)
        space["sink"]([0.02], -1.0)
    with pytest.warns(UserWarning, match=r"^1\.01 V is past the model's range, up to 1 V$"):
        space["sink"]([0.02], 1.01)
    with pytest.warns(UserWarning, match="range") as caught:
        peak = space["sink"]([0.02], 20.0)["peak_K"][0]
    assert peak > 1687
    assert [str(w.message) for w in caught] == [
        "20 V is past the model's range, up to 1 V", f"{peak:.6g} K is past the model's range, up to 1687 K"
    ]  # fmt: skip


def test_what_it_is_good_for_is_said(folder: Path) -> None:
    found = json.loads((folder / "sink_model.json").read_text())["validity"]
    assert found["largest_voltage_V"] == 1.0
    assert found["first_time_s"] == 1e-5
    assert found["highest_temperature_K"] == 1687.0
    assert 0 < max(found["deviation_from_plate"].values()) < 1.5e-3
    for suffix in ("py", "cir"):
        assert found["text"] in (folder / f"sink_model.{suffix}").read_text()


def test_an_export_over_another_is_the_one_that_is_imported(levels: Levels, tmp_path: Path) -> None:
    """Within a second and at equal size Python would take the compiled copy of the first for the second."""
    found = []
    for text in ("ROOM = 1.0", "ROOM = 2.0", "ROOM = 3.0"):
        write_module(tmp_path / "sink_model.py", text)
        code = "import sys; sys.path.insert(0, sys.argv[1]); import sink_model; print(sink_model.ROOM)"
        command = [sys.executable, "-I", "-S", "-c", code, str(tmp_path)]
        found.append(subprocess.run(command, check=True, capture_output=True, text=True, timeout=60).stdout.strip())
    assert found == ["1.0", "2.0", "3.0"]
    before = int((tmp_path / "sink_model.py").stat().st_mtime)
    export(levels, "paper", tmp_path)
    assert int((tmp_path / "sink_model.py").stat().st_mtime) > before


def test_the_number_of_states_is_the_reductions(levels: Levels, tmp_path: Path) -> None:
    export(levels, "moments:2", tmp_path)
    assert len(json.loads((tmp_path / "sink_model.json").read_text())["C_J_per_K"]) == 2


def test_a_folder_that_cannot_be(levels: Levels, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(SceneError, match="--export"):
        export(levels, "paper", tmp_path / "file")
