"""Losses to the air, which eq 20 leaves out: up to which coefficient that does, and what a lumped term gives.

The sink is solved in 3D with the top of beam and pads cooled at some coefficients, and without air. *Left out* is the
value without air less that with it, over the steady value with it. *Lumped* is what eq 20 with a term h L w dT_c makes
of the same: by how much the air changes the 1D value, less by how much it changes the 3D value, each over its own
steady value without air, so that the reduction's other faults cancel; over that again with air.

A limit is where the size of a difference first passes the tolerance, found as a root, each trial a run of its own.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from compare.verdict import Check, Comparison, judged, relative, spread
from fem3d.runs.sink import solve as solve_3d
from reduced1d import ladder
from scenes.formats import percent, quantity
from scenes.plan import Request
from scenes.result import Estimate, Result
from scenes.sink import OF_A_SINK, Sink

QUANTITIES = {name: OF_A_SINK[name].steady for name in ("peak", "mean", "end", "current")}
STILL = 10.0
"""W/(m2 K): the usual value for still air, from the 2 to 25 of free convection in gases (Cengel, Heat Transfer, chapter
1; Incropera and DeWitt alike), measured on bodies of centimetres and more."""
CONDUCTIVITY = 0.0263
"""W/(m K) of air at 300 K, within a percent (Carroll et al., J. Chem. Eng. Data 13, 1968: 0.0264 at 25 C)."""
COEFFICIENTS = (1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1e3, 2e3, 5e3, 1e4, 2e4, 5e4, 1e5)
CLOSE = 1e-3  # Relative tolerance of the search for a limit.

Limits = dict[str, Estimate | None]
"""By quantity the largest coefficient (W/(m2 K)) at which a difference stays within its tolerance, with its error;
``None`` where it does at all of them."""


@dataclass(frozen=True)
class OverTime:
    """Leaving out the air on the way: by quantity the ``largest`` difference over the run and ``until`` when (s) it
    stays within the tolerance (infinite: to the end), for each coefficient; and the ``limits`` over the run."""

    largest: dict[str, np.ndarray]
    until: dict[str, np.ndarray]
    limits: Limits


@dataclass(frozen=True)
class Air:
    """For each quantity and coefficient (W/(m2 K)) what is ``left_out`` and what is ``lumped`` in the steady state, and
    their limits; ``over_time`` where the run has traces. ``at`` is the coefficient of the checks, ``conduction`` what
    air at rest conducts at this size, with the largest difference there, ``conducted``; and ``gap`` what it would
    through the space under the beam, as high as the oxide is thick."""

    coefficients: np.ndarray
    left_out: dict[str, np.ndarray]
    lumped: dict[str, np.ndarray]
    limits: Limits
    lumped_limits: Limits
    over_time: OverTime | None
    at: float
    conduction: float
    conducted: float
    gap: float
    checks: tuple[Check, ...]

    def document(self) -> dict[str, Any]:
        document = {
            "coefficient_W_per_m2_K": self.coefficients.tolist(),
            "left_out": {name: values.tolist() for name, values in self.left_out.items()},
            "lumped": {name: values.tolist() for name, values in self.lumped.items()},
            "left_out_within_tolerance_up_to_W_per_m2_K": _document(self.limits),
            "lumped_within_tolerance_up_to_W_per_m2_K": _document(self.lumped_limits),
            "still_air_W_per_m2_K": STILL,
            "conduction_at_this_size_W_per_m2_K": self.conduction,
            "conduction_below_W_per_m2_K": self.gap,
        }
        if self.over_time is not None:
            until = {n: [t if math.isfinite(t) else None for t in v] for n, v in self.over_time.until.items()}
            document["over_time"] = {
                "left_out_largest": {name: values.tolist() for name, values in self.over_time.largest.items()},
                "left_out_within_tolerance_until_s": until,
                "left_out_within_tolerance_up_to_W_per_m2_K": _document(self.over_time.limits),
            }
        return document


def _document(limits: Limits) -> dict[str, Any]:
    return {name: limit and {"value": limit.value, "error": limit.error} for name, limit in limits.items()}


def conduction(sink: Sink) -> float:
    """The coefficient (W/(m2 K)) of air at rest above the beam: it conducts from one side of a thin plate, L long and w
    wide, with the shape factor pi L / ln(4 L / w) (Holman, Heat Transfer, chapter 3: a plate in the surface of a half
    space). It is that of a slender elliptic disc, 2 pi a / K(e) with a = L / 2 and K -> ln(4 L / w)."""
    long, short = sorted((sink.row_length, sink.width), reverse=True)
    return math.pi * CONDUCTIVITY / (short * math.log(4 * long / short))


class _Runs:
    """The sink at any coefficient, in both models, each solved once."""

    def __init__(self, sink: Sink, transient: bool, say: Callable[[str], None]) -> None:
        self.sink, self._say = sink, say
        self._request = Request(models=("fem3d",), transient=transient)
        self._at = lru_cache(maxsize=None)(self._solved)
        self.bare, self.bare_1d = self._at(0.0)

    def _solved(self, coefficient: float) -> tuple[Result, Result]:
        self._say(f"with {coefficient:.4g} W/(m2 K) to the air")
        cooled = replace(self.sink, convection_coefficient=coefficient)
        return solve_3d(cooled, self._request), ladder.solve(cooled, "paper", steady_only=True)

    def cooled(self, coefficient: float) -> Result:
        return self._at(float(coefficient))[0]

    def left_out(self, name: str, coefficient: float) -> Estimate:
        """Of a quantity in the steady state."""
        key = QUANTITIES[name]
        inputs = {"predicted": self.bare.steady[key], "measured": self.cooled(coefficient).steady[key]}
        return Estimate(relative(*(e.value for e in inputs.values())), spread(relative, inputs))

    def lumped(self, name: str, coefficient: float) -> Estimate:
        """Of a quantity in the steady state."""
        key, value = QUANTITIES[name], self._at(float(coefficient))[1].steady[QUANTITIES[name]].value
        left_out, ratio = self.left_out(name, coefficient), value / self.bare_1d.steady[key].value
        return Estimate(ratio * (1 + left_out.value) - 1, ratio * left_out.error)

    def course(self, name: str, coefficient: float) -> tuple[np.ndarray, np.ndarray, float]:
        """Of leaving it out over time: times (s), differences there, and their error."""
        key, result = QUANTITIES[name], self.cooled(coefficient)
        bare, cooled = self.bare.over_time, result.over_time
        trace, final = key.replace("_rise_K", "_K"), result.steady[key]
        without = np.interp(cooled.time, bare.time, bare.values[trace])
        error = (bare.errors[trace] + cooled.errors[trace] + final.error) / abs(final.value)
        return cooled.time, (without - cooled.values[trace]) / final.value, error

    def largest(self, name: str, coefficient: float) -> Estimate:
        """The largest of leaving it out over the run."""
        _, off, error = self.course(name, coefficient)
        return Estimate(float(off[np.abs(off).argmax()]), error)


def of_sink(sink: Sink, say: Callable[[str], None], transient: bool = True) -> Air:
    """The air's effect on a sink, over time too if ``transient``. RunawayError where there is no steady state."""
    at = sink.convection_coefficient or STILL
    runs, places = _Runs(sink, transient, say), np.unique(np.append(COEFFICIENTS, at))

    def by_coefficient(effect: Callable[[str, float], Estimate]) -> tuple[dict[str, np.ndarray], Limits]:
        values = {name: np.array([effect(name, h).value for h in places]) for name in QUANTITIES}
        limits: Limits = {
            name: _limit(lambda h, name=name: effect(name, h), places, sink.tolerance(f"air_{name}"))  # type: ignore[misc]
            for name in QUANTITIES
        }
        return values, limits

    over_time = None
    if transient:
        until = {
            name: np.array([_until(*runs.course(name, h)[:2], sink.tolerance(f"air_{name}")) for h in places])
            for name in QUANTITIES
        }
        largest, limits = by_coefficient(runs.largest)
        over_time = OverTime(largest, until, limits)
    (left_out, limits), (lumped, lumped_limits) = by_coefficient(runs.left_out), by_coefficient(runs.lumped)
    still = conduction(sink)
    conducted = max(abs(runs.left_out(name, still).value) for name in QUANTITIES)
    air = Air(
        places, left_out, lumped, limits, lumped_limits, over_time, at, still, conducted,
        CONDUCTIVITY / sink.oxide_thickness, (),
    )  # fmt: skip
    made = tuple(judged(f"air_{name}", _comparison(runs, name, air), sink, True) for name in QUANTITIES)
    return replace(air, checks=made)


def _limit(off: Callable[[float], Estimate], coefficients: np.ndarray, tolerance: float) -> Estimate | None:
    """Where the size of a difference first passes the tolerance, and what its error and the search leave of that."""
    from scipy.optimize import brentq

    def excess(log: float) -> float:
        # Nearly straight in the logarithms; a difference that changes its sign is as small as may be there. Trials are
        # as far apart as the search is close, so that quantities have some in common.
        return math.log(max(abs(off(math.exp(CLOSE * round(log / CLOSE))).value) / tolerance, 1e-6))

    first_outside = next((i for i, h in enumerate(coefficients) if abs(off(h).value) > tolerance), None)
    if first_outside is None:
        return None
    high = math.log(coefficients[first_outside])
    low = math.log(coefficients[first_outside - 1]) if first_outside else high + math.log(1e-6)
    value = math.exp(brentq(excess, low, high, xtol=CLOSE))
    steep = (excess(high) - excess(low)) / (high - low)
    return Estimate(value, value * (2 * CLOSE + off(coefficients[first_outside]).error / tolerance / steep))


def _until(time: np.ndarray, off: np.ndarray, tolerance: float) -> float:
    """When (s) the size of a difference first passes the tolerance, linear between the times; infinite where never."""
    size = np.abs(off)
    outside = np.flatnonzero(size > tolerance)
    if not len(outside):
        return math.inf
    i = int(outside[0])
    return float(np.interp(tolerance, size[i - 1 : i + 1], time[i - 1 : i + 1])) if i else float(time[0])


def _comparison(runs: _Runs, name: str, air: Air) -> Comparison:
    key, off = QUANTITIES[name], runs.left_out(name, air.at)
    unit = "A" if name == "current" else "K"
    return Comparison(
        f"3D {name} without air", runs.bare.steady[key].value, runs.cooled(air.at).steady[key].value, unit, off.value,
        off.error, lambda: _because(runs.sink, name, runs.bare.steady, air), relative_to="the value with the air",
    )  # fmt: skip


def _because(sink: Sink, name: str, bare: Mapping[str, Estimate], air: Air) -> str:
    """The air's conductance against that of the anchors, the limit, and what the air is like at this size."""
    loss = air.at * sink.spans * sink.length * sink.width
    anchors = bare["heat_out_W"].value / bare["mean_rise_K"].value
    limit = air.limits[name]
    up_to = "at every coefficient tried" if limit is None else f"up to {limit.value:.3g} W/(m2 K)"
    return (
        f"at {air.at:.4g} W/(m2 K) the air takes {quantity(loss, 'W', 3)} per kelvin from the beam, "
        f"{percent(loss / anchors)} of what its mounts do, {quantity(anchors, 'W', 3)}; it may be left out {up_to}; "
        f"air at rest conducts {air.conduction:.3g} W/(m2 K) at this size, not the {STILL:g} of large bodies"
    )
