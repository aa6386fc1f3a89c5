"""The ladder of reductions against 3D, on sinks that served no tuning; and the split of a difference by assumption."""

import math

import pytest

import compare
import scenes
from scenes.errors import RunawayError

SINKS = {
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
@pytest.mark.parametrize("sink", SINKS)
def test_reduction_stays_near_3d(sink, reduction):
    run = compare.run("sink", overrides=SINKS[sink], accuracy=2e-4, reduction=reduction)
    for name, limit in zip(("fig6_peak", "fig6_end"), LIMITS[reduction], strict=True):
        check = run.check(name)
        assert abs(check.difference) <= limit + check.u_num


@pytest.mark.parametrize("dropped", ["paper", "anchored", "fin-massless"])
def test_dropped_assumption_costs_accuracy(dropped):
    """Each rung below the fin exceeds a limit of the fin, so that the limits can fail."""
    run = compare.run("sink", reduction=dropped)
    checks = [run.check(name) for name in ("fig6_peak", "fig6_end")]
    assert any(abs(c.difference) - c.u_num > limit for c, limit in zip(checks, LIMITS["fin"], strict=True))


@pytest.mark.parametrize("sink", ["default", "pad-edge"])
@pytest.mark.parametrize("reduction", ["paper", "moments:4"])
def test_shares_of_assumptions_add_up(sink, reduction):
    run = compare.run("sink", overrides=SINKS[sink], reduction=reduction, why=True)
    assert len(run.why.steady) == len(run.why.transient) == 3
    for split in (*run.why.steady, *run.why.transient):
        total = math.fsum(part.value for part in split.parts)
        assert abs(total - split.total) <= split.error + 1e-9 * abs(split.total)
        if reduction == "paper":
            largest = max(split.parts, key=lambda part: abs(part.value))
            assert abs(total - largest.value - split.total) > split.error
    for split, name in zip(run.why.steady, ("peak_rise_K", "end_rise_K", "current_A"), strict=True):
        difference = run.reduced1d.steady[name].value - run.fem3d.steady[name].value
        assert split.total == pytest.approx(difference, rel=1e-9)


def test_anchor_resistance_is_to_blame_for_the_paper():
    why = compare.run("sink", why=True).why
    assert "anchor resistance" in why.sentence
    for split, least in zip(why.steady, (0.95, 0.99, 0.95), strict=True):
        assert split.parts[0].blame == "anchor resistance"
        assert split.parts[0].value / split.total > least
    assert "pads in the circuit" in compare.run("sink", overrides=SINKS["pad-edge"], why=True).why.sentence


def test_runaway_names_the_model():
    """At 4.2 V with a falling resistance the fin has a steady state; the parabola on the same anchor has none."""
    falling = {"silicon.temperature_coefficient": "-1e-3", "drive.voltage": 4.2}
    assert compare.run("sink", overrides=falling, reduction="fin", steady=True).reduced1d.steady
    with pytest.raises(RunawayError):
        compare.run("sink", overrides=falling, reduction="anchored", steady=True)


@pytest.mark.long
def test_plate_estimates_its_own_error():
    """For silicon of 10 um the neglected resistance across the layer is 0.1 %; the estimate is right within a half."""
    sink = scenes.load("sink", ["sink.thickness=10um", "run.accuracy=1e-4"])
    run = compare.run(sink, reduction="plate", steady=True)
    name = "anchor_resistance_K_per_W"
    exact = run.fem3d.steady[name]
    off = abs(run.reduced1d.steady[name].value / exact.value - 1)
    assert exact.error / exact.value < 0.1 * off
    assert off / 1.5 < run.reduced1d.details["thin_plate_remainder"] < 1.5 * off
