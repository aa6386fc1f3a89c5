"""Reading other tools' tables: the content of each kind of file, and refusals that name the fault."""

import struct

import numpy as np
import pytest

from compare.data import read
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
        return f"{other}Values:\n0\t\t0\n\t1\n\t1\n\t1\n\n".encode() + head + body.encode()
    return head + body.encode()


@pytest.mark.parametrize("kind", ["binary", "after another"])
def test_an_ngspice_raw_file(kind, tmp_path):
    data = found(tmp_path, raw(kind))
    assert data.time == pytest.approx([0.0, 1e-3, 2e-3])
    assert data.values["peak_K"] == pytest.approx([293.0, 300.0, 301.0])
    assert data.values["end_K"] == pytest.approx([293.0, 295.0, 296.0])
    assert data.values["current_A"] == pytest.approx([3.3e-3, 3.2e-3, 3.1e-3])
    assert "sign" in data.how["current_A"]
    assert "rise" in data.how["peak_K"]
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


REFUSED = {
    "": "no rows",
    "time (s),peak (K)\n": "no rows",
    "1,2\n3,4\n5,6\n": 'there are "column 1", "column 2"',
    "time,peak (K)\n0,1\n1,2\n2,3\n": "covers 0 s to 2.00 s",
    "Time,peak (K)\n0,1\n1,2\n2,3\n".replace("Time", "Clock"): "no column is the time",
    "time (s),peak (K)\n,1\n,2\n,3\n": "the time, is empty",
    "time (s);peak (K);end (K)\n0;;1\n1;2;\n2;3;\n": 'every row is empty in one of "peak .K.", "end .K."',
    'time (s),peak (K)\n0,"' + "1" * 140_000 + '"\n': "is no table of numbers: field larger",
    "time (s),p (K)\n0,1\n1,2\n2,3\n": "names no place",
    "time (s),peak stress\n0,1\n1,2\n2,3\n": "has no unit",
    "time (s),peak (V)\n0,1\n1,2\n2,3\n": "no temperature",
    "time (s),peak (K),max (K)\n0,1,1\n1,2,2\n2,3,3\n": "both",
    "time (s),peak (K)\n0,1\n1,abc\n2,3\n": "row 3",
    "time (s),peak (K)\n0,1\n1\n2,3\n": "columns",
    "time (s),peak (K)\n0,1\n1,inf\n2,3\n": "finite",
    "time (s),peak (K)\n0,1\n1,2\n": "three",
    "% Model: a\n% Time (s)  T (K)\n0 1 2\n1 2 3\n2 3 4\n": "another number of columns",
}


@pytest.mark.parametrize("text", REFUSED)
def test_refusals_say_what_was_found(text, tmp_path):
    with pytest.raises(SceneError, match=REFUSED[text]) as caught:
        found(tmp_path, text)
    assert "\n" not in str(caught.value)
    assert "a.csv" in str(caught.value)


@pytest.mark.parametrize("points", ["\N{SUPERSCRIPT TWO}", "0"])
def test_a_raw_file_of_nothing(points, tmp_path):
    with pytest.raises(SceneError, match="a run with 4 variables and"):
        found(tmp_path, raw("ascii").decode().replace("No. Points: 3", f"No. Points: {points}").encode("latin-1"))


def test_binary_that_is_no_raw_file(tmp_path):
    with pytest.raises(SceneError, match="binary"):
        found(tmp_path, bytes(range(256)))
    with pytest.raises(SceneError, match="save the table as text or CSV"):
        found(tmp_path, b"PK\3\4" + bytes(100))
    with pytest.raises(SceneError, match="cannot be read"):
        read(tmp_path / "none.csv", SINK)


def test_what_is_left_out_is_said(tmp_path):
    data = found(tmp_path, "time (ms),peak (K),stress (MPa)\n0,293,1\n1,294,2\n2,295,3\n")
    assert data.left_out == {"stress (MPa)": "has no unit that is known"}
    assert 'peak is "peak (K)"' in data.said()
    assert 'left out: "stress (MPa)", it has no unit' in data.said()
