"""The twelve checks on three sinks, solved in 3D: each verdict as declared, and no check that has one verdict only.

They are chosen apart: the built-in one, on which some of the paper's equations hold; one on which none does, as the
current crosses the pads, the wind takes most of the heat and the resistance grows; and one that is what the equations
take for granted, a beam as wide as its pads, whose anchors are thick oxide under all of them.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import pytest

from compare.checks import evaluate
from compare.pipeline import compared
from compare.verdict import Check
from scenes.checks import DEFAULT_TOLERANCES
from scenes.loading import load
from scenes.plan import Request

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
    found = compared(load("sink", [*SINKS[name], f"run.accuracy={accuracy}"]), Request(figures=False))
    return {check.id: check for check in found.checks}


@pytest.mark.parametrize("check", DEFAULT_TOLERANCES)
@pytest.mark.parametrize("name", SINKS)
def test_the_verdict_is_the_declared_one(name: str, check: str) -> None:
    found = checks_of(name, COARSE)[check]
    assert found.verdict == ("differs" if check in DIFFER[name] else "agrees")
    assert bool(found.because) == (check in DIFFER[name])
    # A finer solution is within both errors, as bounds must be; of the imbalance, which has none, within rounding.
    finer = checks_of(name, FINE)[check]
    assert abs(found.difference - finer.difference) <= found.u_num + finer.u_num + 1e-10
    assert finer.u_num <= found.u_num


def test_each_check_can_come_out_either_way() -> None:
    """Declared of different sinks: a check that saw nothing of them could not be both. Energy is lost by no sink."""
    either = {check for check in DEFAULT_TOLERANCES if {check in found for found in DIFFER.values()} == {True, False}}
    assert either == set(DEFAULT_TOLERANCES) - {"energy"}
    sink = load("sink", [f"run.accuracy={COARSE}"])
    found = compared(sink, Request(transient=False, models=("fem3d",))).solved
    lossy = replace(found, details={**found.details, "energy_imbalance": 2e-8})
    verdicts = {check.id: check.verdict for check in evaluate(sink, Request(models=("fem3d",)), lossy, None)}
    assert verdicts["energy"] == "differs"


def test_another_sink_s_solution_is_caught() -> None:
    """The built-in sink's checks on the 3D solution of a sink with oxide half as thick: what stands on it moves."""
    sink = load("sink", [f"run.accuracy={COARSE}"])
    own, other = (compared(s, Request(figures=False)) for s in (sink, replace(sink, oxide_thickness=1e-6)))
    assert own.reduced1d is not None
    steady = Request(transient=False)
    found = {check.id: check for check in evaluate(sink, steady, other.solved, own.reduced1d)}
    right = {check.id: check for check in own.checks}
    moved = {name for name, check in found.items() if abs(check.difference - right[name].difference) > 2 * check.u_num}
    assert {"eq14", "eq18", "fig4"} <= moved
