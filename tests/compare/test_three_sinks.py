"""The twelve checks on three sinks, and the ladder of reductions on sinks that served no tuning, solved in 3D.

On the built-in sink some of the paper's equations hold. On the second none holds, because the current crosses the
pads, the wind takes most of the heat and the resistance grows. The third meets the assumptions of the equations: a beam
as wide as its pads, with thick oxide under the whole pads. No check has one verdict only."""

import math
from dataclasses import replace
from functools import cache

import pytest

import compare
from compare.options import Options
from compare.verdict import Check
from scenes.checks import DEFAULT_TOLERANCES
from tests.conftest import judged

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
    return compare.run("sink", overrides=[*SINKS[name], f"run.accuracy={accuracy}"]).checks


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


def test_lost_energy_is_detected():
    run = compare.run("sink", accuracy=COARSE, steady=True, only="3d")
    lossy = replace(run.fem3d, details={**run.fem3d.details, "energy_imbalance": 2e-8})
    assert judged(run.scene, lossy, None, Options(only="3d", steady=True))["energy"].verdict == "differs"


def test_a_thickness_at_the_end_of_its_range_is_solved():
    """The peak rises above the end as at any thickness: the power falls with it as the conductance does."""
    found = compare.run("sink", overrides=["sink.thickness=1nm"], accuracy=1e-2, steady=True)
    peak = found.fem3d.steady["peak_rise_K"]
    assert peak.error < 1e-2 * peak.value
    end = found.fem3d.steady["end_rise_K"]
    assert peak.value - end.value == pytest.approx(1 / (8 * 6e-5 * 130), rel=1e-2)


UNTUNED = {
    "default": {},
    "narrow": {"sink.width": "20um"},
    "thick": {"sink.thickness": "5um"},
    "wide oxide": {"anchor.oxide_length": "100um", "anchor.oxide_width": "100um"},
    "pad-edge": {"drive.electrodes": "pad-edge"},
}
LIMITS = {"fin": (2e-3, 2e-2), "plate": (1e-3, 1e-3), "moments:3": (5e-3, 3e-3), "moments:4": (1e-3, 1.5e-3)}
"""Largest distance from 3D over time, relative to the final rise: at the peak and at the ends."""


@pytest.mark.long
@pytest.mark.parametrize("reduction", LIMITS)
@pytest.mark.parametrize("sink", UNTUNED)
def test_reduction_stays_near_3d(sink, reduction):
    run = compare.run("sink", overrides=UNTUNED[sink], accuracy=2e-4, reduction=reduction)
    for name, limit in zip(("fig6_peak", "fig6_end"), LIMITS[reduction], strict=True):
        check = run.check(name)
        assert abs(check.difference) <= limit + check.u_num


@pytest.mark.parametrize("dropped", ["paper", "anchored", "fin-massless"])
def test_dropped_assumption_costs_accuracy(dropped):
    """Each rung below the fin exceeds a limit of the fin, so that the limits can fail."""
    run = compare.run("sink", accuracy=1e-3, reduction=dropped)
    checks = [run.check(name) for name in ("fig6_peak", "fig6_end")]
    assert any(abs(c.difference) - c.u_num > limit for c, limit in zip(checks, LIMITS["fin"], strict=True))


@pytest.mark.parametrize(("sink", "reduction"), [("default", "paper"), ("pad-edge", "moments:4")])
def test_shares_of_assumptions_add_up(sink, reduction):
    run = compare.run("sink", overrides=UNTUNED[sink], accuracy=1e-2, reduction=reduction, why=True)
    assert len(run.why.steady) == len(run.why.transient) == 3
    for split in (*run.why.steady, *run.why.transient):
        total, whole = math.fsum(part.value for part in split.parts), split.difference
        assert abs(total - whole.value) <= whole.error + 1e-9 * abs(whole.value)
        if reduction == "paper":
            largest = max(split.parts, key=lambda part: abs(part.value))
            assert abs(total - largest.value - whole.value) > whole.error
    for split, name in zip(run.why.steady, ("peak_rise_K", "end_rise_K", "current_A"), strict=True):
        difference = run.reduced1d.steady[name].value - run.fem3d.steady[name].value
        assert split.difference.value == pytest.approx(difference, rel=1e-9)


@pytest.mark.long
def test_plate_estimates_its_own_error():
    """For silicon of 10 um the neglected resistance across the layer is 0.1 %; the estimate is right within a half."""
    run = compare.run("sink", overrides=["sink.thickness=10um"], accuracy=1e-4, reduction="plate", steady=True)
    name = "anchor_resistance_K_per_W"
    exact = run.fem3d.steady[name]
    off = abs(run.reduced1d.steady[name].value / exact.value - 1)
    assert exact.error / exact.value < 0.1 * off
    assert off / 1.5 < run.reduced1d.details["thin_plate_remainder"] < 1.5 * off
