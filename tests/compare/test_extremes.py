"""Values at the ends of their stated ranges work, or end with one sentence that names the key and says what to do."""

from __future__ import annotations

from pathlib import Path

import pytest

import compare
from fem3d.errors import NumericsError
from scenes.loading import load
from scenes.validity import cause
from validate.cli import main


def test_a_thickness_at_the_end_of_its_range_is_solved() -> None:
    """The peak rises above the end as at any thickness: the power falls with it as the conductance does."""
    found = compare.run(load("sink", ["sink.thickness=1nm", "run.accuracy=1e-2"]), steady=True)
    peak = found.fem3d.steady["peak_rise_K"]
    assert peak.error < 1e-2 * peak.value
    end = found.fem3d.steady["end_rise_K"]
    assert peak.value - end.value == pytest.approx(1 / (8 * 6e-5 * 130), rel=1e-2)


@pytest.mark.parametrize("setting", ["sink.width=1nm", "sink.length=1m"])
def test_where_3d_fails_the_key_is_named(
    setting: str, capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(*_: object) -> None:
        raise NumericsError("it does not converge")

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("fem3d.run.solve", fails)
    assert main(["sink", "--steady", "--no-figures", "--quiet", "--set", setting]) == 3
    key, _, value = setting.partition("=")
    said = f"validate: it does not converge; {key} = {value.replace('1', '1 ')} is "
    err = capsys.readouterr().err
    assert err.startswith(said)
    assert err.endswith("or see --only 1d\n")
    assert main(["sink", "--steady", "--no-figures", "--quiet"]) == 3
    assert capsys.readouterr().err == "validate: it does not converge\n"
    assert main(["sink", "--only", "1d", "--no-figures", "--quiet", "--set", setting]) == 0


def test_the_key_that_is_farthest_out_is_named() -> None:
    assert cause(load("sink", ["sink.width=1nm", "sink.length=2mm"])).startswith(
        "; sink.width = 1 nm is 100,000 times less than in the built-in sink"
    )
    assert "give a value nearer to 100 um, or so" in cause(load("sink", ["sink.width=1nm"]), ", or so")
    assert "oxide.thermal_conductivity = 0.0001 W/(m K) is 13,800 times less" in cause(
        load("sink", ["oxide.thermal_conductivity=1e-4", "drive.voltage=-2"])
    )
    assert cause(load("sink", ["sink.width=20um", "drive.voltage=-5"])) == ""
