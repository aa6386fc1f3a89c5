"""The twelve checks on three sinks, solved in 3D: each verdict as declared, and no check that has one verdict only.

On the built-in sink some of the paper's equations hold. On the second none holds, because the current crosses the
pads, the wind takes most of the heat and the resistance grows. The third meets the assumptions of the equations: a beam
as wide as its pads, with thick oxide under the whole pads.
"""

from dataclasses import replace
from functools import cache

import pytest

import compare
from compare.kinds import KINDS
from compare.options import Options
from compare.verdict import Check
from scenes.checks import DEFAULT_TOLERANCES
from scenes.errors import NumericsError
from scenes.loading import load
from tests.conftest import judged
from validate.cli import main

SINKS = {
    "built-in": [],
    "wind": ["drive.electrodes=pad-edge", "drive.voltage=5", "environment.convection_coefficient=10000"],
    "prisms": [
        "sink.length=4mm", "sink.width=150um", "sink.thickness=20um", "anchor.oxide_length=150um", "drive.voltage=0.2",
        "anchor.oxide_width=150um", "anchor.oxide_thickness=500um", "anchor.oxide_offset=0um",
    ],
}  # fmt: skip
DIFFER = {
    "built-in": {"eq14", "eq18", "fig4", "fig6_peak", "fig6_end", "fig7_current"},
    "wind": set(DEFAULT_TOLERANCES) - {"energy"},
    "prisms": set(),
}
COARSE, FINE = 1e-2, 1e-3


@cache
def checks_of(name: str, accuracy: float) -> dict[str, Check]:
    found = KINDS["sink"].compare(load("sink", [*SINKS[name], f"run.accuracy={accuracy}"]), Options(figures=False))
    return {check.id: check for check in found.checks}


@pytest.mark.parametrize("check", DEFAULT_TOLERANCES)
@pytest.mark.parametrize("name", SINKS)
def test_the_verdict_is_the_declared_one(name, check):
    found = checks_of(name, COARSE)[check]
    assert found.verdict == ("differs" if check in DIFFER[name] else "agrees")
    assert bool(found.because) == (check in DIFFER[name])
    # A finer solution is within both errors, as bounds must be; of the imbalance, which has none, within rounding.
    finer = checks_of(name, FINE)[check]
    assert abs(found.difference - finer.difference) <= found.u_num + finer.u_num + 1e-10
    assert finer.u_num <= found.u_num


def test_each_check_can_come_out_either_way():
    """Both verdicts are declared: a check that ignores the sink could not have both. No sink loses energy."""
    either = {check for check in DEFAULT_TOLERANCES if {check in found for found in DIFFER.values()} == {True, False}}
    assert either == set(DEFAULT_TOLERANCES) - {"energy"}
    sink = load("sink", [f"run.accuracy={COARSE}"])
    found = KINDS["sink"].compare(sink, Options(steady=True, only="3d")).solved
    lossy = replace(found, details={**found.details, "energy_imbalance": 2e-8})
    assert judged(sink, lossy, None, Options(only="3d", steady=True))["energy"].verdict == "differs"


def test_a_thickness_at_the_end_of_its_range_is_solved():
    """The peak rises above the end as at any thickness: the power falls with it as the conductance does."""
    found = compare.run(load("sink", ["sink.thickness=1nm", "run.accuracy=1e-2"]), steady=True)
    peak = found.fem3d.steady["peak_rise_K"]
    assert peak.error < 1e-2 * peak.value
    end = found.fem3d.steady["end_rise_K"]
    assert peak.value - end.value == pytest.approx(1 / (8 * 6e-5 * 130), rel=1e-2)


def test_where_3d_fails_the_command_says_so(capsys, tmp_path, monkeypatch):
    def fails(*_: object) -> None:
        raise NumericsError("it does not converge")

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("fem3d.runs.sink.solve", fails)
    assert main(["sink", "--steady", "--no-figures", "--quiet"]) == 3
    assert capsys.readouterr().err == "validate: it does not converge\n"
    assert main(["sink", "--only", "1d", "--no-figures", "--quiet"]) == 0
