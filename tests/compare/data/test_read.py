"""Reading other tools' tables: the content of each kind of file, refusals that name the fault, and of several runs in
one file the scene's own."""

import struct
from dataclasses import replace

import numpy as np
import pytest

from scenes.errors import SceneError
from tests.compare.data import SINK, found

HEADER = "Title: thermal network\nDate: Tue Mar 3 10:00:00 2026\nPlotname: {name}\nFlags: real\nNo. Variables: 4\n\
No. Points: 3\nVariables:\n\t0\ttime\ttime\n\t1\tv(peak)\tvoltage\n\t2\tv(end)\tvoltage\n\t3\ti(vdrive)\tcurrent\n"
POINTS = ((0.0, 0.0, 0.0, -3.3e-3), (1e-3, 7.0, 2.0, -3.2e-3), (2e-3, 8.0, 3.0, -3.1e-3))


def raw(kind: str) -> bytes:
    head = HEADER.format(name="Transient Analysis").encode()
    if kind == "binary":
        return head + b"Binary:\n" + b"".join(struct.pack("<4d", *point) for point in POINTS)
    body = "Values:\n"
    for k, point in enumerate(POINTS):
        body += f"{k}\t\t{point[0]:.15e}\n" + "".join(f"\t{value:.15e}\n" for value in point[1:]) + "\n"
    if kind == "after another":
        other = HEADER.format(name="Operating Point").replace("No. Points: 3", "No. Points: 1")
        return f"{other}Values:\n0\t\t0\n\t1\n\t1\n\t1\n\n".encode() + head + body.encode() + b"R,{v},d_{v}\n1,2,3\n"
    return head + body.encode()


@pytest.mark.parametrize("kind", ["binary", "after another"])
def test_an_ngspice_raw_file(kind, tmp_path):
    data = found(tmp_path, raw(kind), "current=i(vdrive)")
    assert data.time == pytest.approx([0.0, 1e-3, 2e-3])
    assert data.values["peak_K"] == pytest.approx([293.0, 300.0, 301.0])
    assert data.values["end_K"] == pytest.approx([293.0, 295.0, 296.0])
    assert data.values["current_A"] == pytest.approx([3.3e-3, 3.2e-3, 3.1e-3])
    assert "sign" in data.report["read_as"]["current_A"]
    assert "rise" in data.report["read_as"]["peak_K"]
    if kind == "binary":
        with pytest.raises(SceneError, match="2 of 3 points"):
            found(tmp_path, raw(kind)[:-3])


def test_what_ngspice_prints(tmp_path):
    """With the header repeated on a second page, and rows kept apart from a second table."""
    page = "Index   time            v(peak)         v(mean)         \n" + "-" * 80 + "\n"
    rows = [f"{k}\t{k * 1e-3:.6e}\t{293 + k:.6e}\t{293 + k / 2:.6e}\t\n" for k in range(6)]
    other = "Index   time            i(vdrive)       \n0\t0.0\t1.0\n"
    data = found(
        tmp_path, "Circuit: thermal\n\n" + page + "".join(rows[:3]) + "\n" + page + "".join(rows[3:]) + "\n" + other
    )
    assert data.values["peak_K"] == pytest.approx(293.0 + np.arange(6))
    assert set(data.values) == {"peak_K", "mean_K"}


def test_what_is_left_out_is_said(tmp_path):
    data = found(tmp_path, "time (ms),peak (K),stress (MPa)\n0,293,1\n1,294,2\n2,295,3\n")
    assert data.report["left_out"] == {"stress (MPa)": "is called as no quantity of the scene"}
    assert 'peak is "peak (K)"' in data.said
    assert 'left out: "stress (MPa)", it is called as no' in data.said


TIMES = np.array([0.0, 1e-3, 5e-3, 20e-3])
VOLTS = (0.5, 1.0, 2.0)
HEAD = "% Model:              active_sink.mph\n% Version:            COMSOL 6.2.0.339\n"


def peak(volts: float) -> np.ndarray:
    return 293.0 + 20.0 * volts**2 * np.array([0.0, 0.5, 0.9, 1.0])


def below(name: str = "V0 (V)", factor: float = 1.0, volts: tuple[float, ...] = VOLTS) -> str:
    """Blocks below one another, as a table of a parametric sweep over time has them."""
    rows = [f"{factor * v:<24g}  {t:<24g}  {k:.9g}" for v in volts for t, k in zip(TIMES, peak(v), strict=True)]
    return f"{HEAD}% {name}  Time (s)  peak (K)\n" + "\n".join(rows) + "\n"


@pytest.mark.parametrize("volts", VOLTS)
@pytest.mark.parametrize(
    "text", [below(), below("voltage (mV)", 1e3), below("drive.voltage")], ids=["below", "in mV", "by its path"]
)
def test_the_run_of_the_scene_is_taken(text, volts, tmp_path):
    """At each of the three voltages; the first block would be 4 and 16 times off."""
    data = found(tmp_path, text, scene=replace(SINK, voltage=volts))
    assert data.time == pytest.approx(TIMES)
    assert data.values["peak_K"] == pytest.approx(peak(volts))
    assert "drive.voltage" in data.report["run"]
    assert data.report["run"] in data.said


def test_a_parameter_of_another_name(tmp_path):
    """Refused with the choices, which --column resolves; so is a column that stands for no voltage."""
    text = below("Ua (V)")
    with pytest.raises(SceneError, match=r"repeat or step back.*--column KEY="):
        found(tmp_path, text)
    for name in ("drive.voltage", "voltage"):
        assert found(tmp_path, text, f"{name}=Ua (V)").values["peak_K"] == pytest.approx(peak(1.0))
    with pytest.raises(SceneError, match="not a length"):
        found(tmp_path, below(), "sink.width=V0 (V)")


def test_two_parameters(tmp_path):
    """A run matches where all do; where one alone does, rows of several runs are left, and that is refused."""
    rows = [
        f"{v} {w} {1e3 * t:g} {293 + (k - 293) * w / 100:.9g}"
        for w in (50, 100) for v in VOLTS for t, k in zip(TIMES, peak(v), strict=True)
    ]  # fmt: skip
    text = f"{HEAD}% V0 (V)  {{}}  Time (ms)  peak (K)\n" + "\n".join(rows) + "\n"
    data = found(tmp_path, text.format("width (um)"))
    assert data.values["peak_K"] == pytest.approx(peak(1.0))
    assert "sink.width" in data.report["run"]
    with pytest.raises(SceneError, match=r"repeat or step back.*--column KEY"):
        found(tmp_path, text.format("w0 (um)"))
    data = found(tmp_path, text.format("w0 (um)"), "sink.width=w0 (um)")
    assert data.values["peak_K"] == pytest.approx(peak(1.0))


def test_one_value_of_a_key_is_held_against_the_scenes(tmp_path):
    """A single run at another voltage is refused like one of many; a column without a key of its name is reported."""
    assert found(tmp_path, below(volts=(1.0,))).report["run"] == "the run at V0 = 1 V (drive.voltage)"
    with pytest.raises(SceneError, match=r"no run of this scene.*V0 = 1 V.*: --set drive\.voltage=2V"):
        found(tmp_path, below(volts=(2.0,)))
    assert "tbeam (um)" in found(tmp_path, below("tbeam (um)", volts=(2.0,))).report["left_out"]


@pytest.mark.parametrize("second", [[0.0, 1.0, 2.0], [1.5, 3.0, 4.0]])
def test_times_that_repeat_or_step_back_are_not_merged(second, tmp_path):
    rows = [f"{t},{293 + t}" for t in (0.0, 1.0, 2.0, *second)]
    with pytest.raises(SceneError, match="repeat or step back"):
        found(tmp_path, "time (ms),peak (K)\n" + "\n".join(rows))


def test_a_voltage_that_varies_over_time_is_no_parameter(tmp_path):
    text = "time (ms),voltage (V),peak (K)\n0,0,293\n1,1,294\n2,1.01,295\n"
    data = found(tmp_path, text)
    assert len(data.time) == 3
    assert "varies over time" in data.report["left_out"]["voltage (V)"]
    with pytest.raises(SceneError, match="varies over time"):
        found(tmp_path, text, "voltage=voltage (V)")


def test_a_column_without_numbers_in_the_run_is_left_out(tmp_path):
    rows = [
        f"{v},{t:g},{k:g},{k * v if v < 1 else ''}" for v in (0.5, 1) for t, k in zip(TIMES, peak(1.0), strict=True)
    ]
    data = found(tmp_path, "\n".join(["V0 (V),Time (s),peak (K),end (K)", *rows]))
    assert data.report["left_out"] == {"end (K)": "has no number in this run"}


def test_steady_values_of_a_sink_are_refused_without_the_cure_of_other_scenes(tmp_path):
    with pytest.raises(SceneError, match=r"a list of steady values.*: give traces$"):
        found(tmp_path, "peak, 313.3 K\nend, 297.4 K\n")
