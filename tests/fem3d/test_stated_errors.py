"""A stated error includes every error that a run can see: the residual of the heat balance, sums of voltages,
and too few rows."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from fem3d.problems.heat import HeatProblem
from fem3d.results import fields
from fem3d.runs.scene import solve
from scenes.model import Boundary, Box, Material, Probe, Scene, Schedule

SIDE, LENGTH = 2e-6, 1e-4
SILICON = Material("silicon", 130.0, 2330.0, 712.0, 6e-5, 0.0, 293.0)
BAR = Box("bar", SILICON, (0.0, 0.0, 0.0), (LENGTH, SIDE, SIDE))


def end(name: str, x: float, value: float | Schedule, kind: str = "temperature") -> Boundary:
    return Boundary(name, kind, (x, 0.0, 0.0), (x, SIDE, SIDE), value)


def through(name: str, x: float, quantity: str = "heat_flow") -> Probe:
    return Probe(name, (x, 0.0, 0.0), (x, SIDE, SIDE), quantity)


def test_an_error_is_at_least_what_the_heat_balance_leaves(monkeypatch):
    """A part in a million of the rise by rounding, which no degree of the functions shows."""
    half = LENGTH / 2
    boxes = replace(BAR, upper=(half, SIDE, SIDE)), replace(BAR, name="end", lower=(half, 0.0, 0.0))
    ends = (end("hot", 0.0, 303.0), end("cold", LENGTH, 293.0))
    tip = Probe("tip", (half, 0.0, 0.0), (half, 0.0, 0.0))
    scene = Scene("bar", boxes, ends, (tip, through("in", 0.0)), steady=True, accuracy=1e-3)
    flow = 130.0 * SIDE**2 * 10.0 / LENGTH
    true = solve(scene)
    assert true.details["energy_imbalance"] < 1e-12
    assert true.steady["in"].error < 2e-10 * flow
    improve = HeatProblem.improve

    def rounded(self: HeatProblem, rise: np.ndarray, source: np.ndarray) -> np.ndarray:
        found = improve(self, rise, source)
        found[: self.free] *= 1 + 1e-6
        return found

    monkeypatch.setattr(HeatProblem, "improve", rounded)
    found = solve(scene)
    off = abs(found.steady["in"].value - flow)
    assert found.details["energy_imbalance"] > 1e-7
    assert off > 1e-7 * flow
    assert off <= found.steady["in"].error < 3 * off
    assert abs(found.steady["tip"].value - 298.0) <= found.steady["tip"].error


def test_a_balance_of_nothing_is_not_stated():
    """At one temperature flows are rounding, and their sum over their sizes is anything up to 2."""
    everywhere = (end("left", 0.0, 320.0), end("right", LENGTH, 320.0))
    film = Boundary("top", "convection", (0.0, 0.0, SIDE), (LENGTH, SIDE, SIDE), 1e3, 320.0)
    for boundaries in (everywhere, (*everywhere, film), (film,)):
        found = solve(Scene("bar", (BAR,), boundaries, (through("in", 0.0),), steady=True, accuracy=1e-3))
        assert found.details["energy_imbalance"] == 0.0


def l_shaped(one: Schedule, other: Schedule, accuracy: float) -> Scene:
    """Currents around a corner, driven from both of its ends."""
    leg = Box("leg", SILICON, (0.0, 0.0, 0.0), (SIDE, 5e-6, SIDE))
    foot = Box("foot", SILICON, (SIDE, 0.0, 0.0), (5e-6, SIDE, SIDE))
    top = Boundary("top", "voltage", (0.0, 5e-6, 0.0), (SIDE, 5e-6, SIDE), one)
    right = Boundary("right", "voltage", (5e-6, 0.0, 0.0), (5e-6, SIDE, SIDE), other)
    out = Probe("out", top.lower, top.upper, "current")
    return Scene("corner", (leg, foot), (top, right), (out,), end_time=1e-3, accuracy=accuracy)


def ramp(to: float) -> Schedule:
    return Schedule((0.0, 1e-3), (0.0, to))


@pytest.mark.long
def test_errors_of_voltages_that_nearly_cancel_are_of_what_is_left():
    """1 V against 0.9 V: the current of each alone, within 3e-2, is ten times the current."""
    found = solve(l_shaped(ramp(1.0), ramp(0.9), 3e-2))
    alone = solve(l_shaped(ramp(0.1), ramp(0.0), 1e-3)).over_time
    off = abs(found.over_time.values["out"][-1] - alone.values["out"][-1])
    error = found.over_time.errors["out"]
    assert off <= error + alone.errors["out"]
    assert error <= 3e-2 * abs(alone.values["out"][-1])
    assert not found.details["warnings"]
    # An uncertain result is stated as such: equal voltages but for a part in 1e6.
    barely = solve(l_shaped(ramp(1.0), ramp(1.0 - 1e-6), 3e-2))
    assert [w for w in barely.details["warnings"] if "vary apart add up to" in w]


@pytest.mark.long
def test_rows_that_are_too_few_are_said(monkeypatch):
    steps = tuple(t for n in range(3) for t in (n * 1e-5, (n + 1) * 1e-5))
    square = Schedule(steps, tuple(v for n in range(3) for v in (n % 2, n % 2)))
    source = Schedule(square.times, tuple(1e14 * v for v in square.values))
    tip = Probe("tip", (LENGTH, 0.0, 0.0), (LENGTH, 0.0, 0.0))
    boxes = (replace(BAR, heat_source=source),)
    scene = Scene("bar", boxes, (end("cold", 0.0, 293.0),), (tip,), end_time=3e-5, accuracy=1e-3)
    enough = solve(scene)
    assert not enough.details["warnings"]
    monkeypatch.setattr(fields, "MOST_ROWS", 16)
    few = solve(scene)
    (said,) = few.details["warnings"]
    assert "rows of the traces are as many as are made" in said
    assert few.over_time.errors["tip"] > 2 * enough.over_time.errors["tip"]
    times = np.concatenate([np.linspace(a, b, 50)[1:-1] for a, b in pairwise(np.unique(steps))])
    dense, sparse = (np.interp(times, r.over_time.time, r.over_time.values["tip"]) for r in (enough, few))
    assert np.abs(dense - sparse).max() <= few.over_time.errors["tip"] + enough.over_time.errors["tip"]
