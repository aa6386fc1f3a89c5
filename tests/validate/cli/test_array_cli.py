"""Rows of sinks on one substrate from the command line: the table, the summary, the figure, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fem3d.runs import array
from scenes.array import SinkArray
from scenes.loading import load
from tests.validate.cli import summary
from validate.cli import main

PLATE = ("substrate.thickness=0.5mm", "array.columns=4", "array.driven=[1,3]")
SET = [word for setting in PLATE for word in ("--set", setting)]


@pytest.mark.long
def test_a_row_is_told_and_kept(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["sink", *SET, "--accuracy", "1e-2", "--out", str(tmp_path / "row")]) == 0
    text = capsys.readouterr().out
    assert max(map(len, text.splitlines())) <= 80
    assert "elements 1, 3 are driven" in " ".join(text.split())
    assert "2, idle" in text
    assert " mK" in text
    found = summary(tmp_path / "row")
    assert {"array.png", "array.svg", "report.html", "summary.json"} <= {p.name for p in (tmp_path / "row").iterdir()}
    steady, matrix = found["fem3d"]["steady"], np.array(found["crosstalk"])
    # What warms the idle second one is its two neighbours' powers through the matrix; the driven ones' heat each other
    # by 1e-4 of what they are, which moves their powers by less than that.
    power = steady["sink1_mean_rise_K"]["value"] / matrix[0, 0]
    assert steady["sink2_mean_rise_K"]["value"] == pytest.approx((matrix[1, 0] + matrix[1, 2]) * power, rel=1e-3)
    assert matrix == pytest.approx(matrix.T, rel=1e-6)
    assert steady["sink2_current_A"]["value"] == 0.0
    assert found["driven"] == [1, 3]
    by_pitch = found["crosstalk_by_pitch"]
    assert [round(each["substrate_thickness_m"] / 0.5e-3, 6) for each in by_pitch] == list(array.THICKNESSES)
    assert all(np.all(np.diff(each["part"]) < 0) for each in by_pitch)


def test_a_file_of_several_is_an_array() -> None:
    found = load("sink", PLATE)
    assert isinstance(found, SinkArray)
    assert found.driven == (1, 3)
    assert found.element.count == 1
    assert len([b for b in found.scene().boxes if b.name.endswith("beam")]) == 4
    assert load("sink", ("substrate.thickness=0.5mm",)).kind == "sink"


@pytest.mark.parametrize(
    "words",
    [
        ("sink", "--why"), ("sink", "--left-out"), ("sink", "--sensitivities"), ("sink", "--only", "1d"),
        ("sink", "--reduction", "fin"), ("sink", "--export", "model"),
        ("sweep", "sink", "--vary", "drive.voltage=1:2:2"),
    ],
)  # fmt: skip
def test_what_is_of_one_sink_says_so(words: tuple[str, ...], capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*words, *SET]) == 2
    said = capsys.readouterr().err
    assert len(said.strip().splitlines()) == 1
    assert "array.columns = 4" in said or "neighbours" in said
    assert not list(Path().iterdir())
