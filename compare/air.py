"""Losses to the air, which eq 20 leaves out: up to which coefficient that does, and what a lumped term gives.

The sink is solved in 3D with the top of beam and pads cooled at some coefficients, and without air. *Left out* is the
steady value without air over that with it, less 1. *Lumped* is what eq 20 with a term h L w dT_c makes of the same: the
change of the 1D value over that of the 3D value, less 1, so that the reduction's other faults cancel.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from compare.verdict import Check, Comparison, judged, relative, spread
from fem3d.run import solve as solve_3d
from reduced1d import ladder
from scenes.formats import percent, quantity
from scenes.plan import Request
from scenes.result import Estimate, Result
from scenes.sink import Sink

QUANTITIES = {"peak": "peak_rise_K", "mean": "mean_rise_K", "end": "end_rise_K", "current": "current_A"}
STILL = 10.0
"""W/(m2 K): what is usually taken for still air, from the 2 to 25 of free convection in gases (Incropera and DeWitt,
Fundamentals of Heat and Mass Transfer, Table 1.1), which are those of bodies of centimetres and more."""
CONDUCTIVITY = 0.0263
"""W/(m K) of air at 300 K (the same, Table A.4)."""
COEFFICIENTS = (1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1e3, 2e3, 5e3, 1e4, 2e4, 5e4, 1e5)


@dataclass(frozen=True)
class Air:
    """For each quantity and coefficient (W/(m2 K)) what is ``left_out`` and what is ``lumped``, and the largest
    coefficient at which each stays within the tolerance (None: at all of them). ``at`` is the coefficient of the
    checks, ``conduction`` what air at rest conducts at this size, and ``gap`` what it would through the space under the
    beam, as high as the oxide is thick."""

    coefficients: np.ndarray
    left_out: dict[str, np.ndarray]
    lumped: dict[str, np.ndarray]
    limits: dict[str, float | None]
    lumped_limits: dict[str, float | None]
    at: float
    conduction: float
    gap: float
    checks: tuple[Check, ...]

    def document(self) -> dict[str, Any]:
        """What summary.json says of it."""
        return {
            "coefficient_W_per_m2_K": self.coefficients.tolist(),
            "left_out": {name: values.tolist() for name, values in self.left_out.items()},
            "lumped": {name: values.tolist() for name, values in self.lumped.items()},
            "left_out_within_tolerance_up_to_W_per_m2_K": self.limits,
            "lumped_within_tolerance_up_to_W_per_m2_K": self.lumped_limits,
            "still_air_W_per_m2_K": STILL,
            "conduction_at_this_size_W_per_m2_K": self.conduction,
            "conduction_below_W_per_m2_K": self.gap,
        }


def conduction(sink: Sink) -> float:
    """The coefficient (W/(m2 K)) of air at rest above the beam: it conducts from a thin plate, L long and w wide, with
    the shape factor 2 pi L / ln(4 L / w), half of it from one side (Holman, Heat Transfer, Table 3-1)."""
    long, short = sorted((sink.row_length, sink.width), reverse=True)
    return math.pi * CONDUCTIVITY / (short * math.log(4 * long / short))


def of_sink(sink: Sink, say: Callable[[str], None]) -> Air:
    """The effect of the air on a sink in the steady state. Raises RunawayError where there is none."""
    at = sink.convection_coefficient or STILL
    places = np.unique(np.append(COEFFICIENTS, at))
    request = Request(models=("fem3d",), transient=False)

    def both(coefficient: float) -> tuple[Result, Result]:
        say(f"with {coefficient:.4g} W/(m2 K) to the air")
        cooled = replace(sink, convection_coefficient=float(coefficient))
        return solve_3d(cooled, request), ladder.solve(cooled, "paper", steady_only=True)

    bare, results = both(0.0), [both(coefficient) for coefficient in places]
    left_out, lumped = {}, {}
    for name, key in QUANTITIES.items():
        three, one = (np.array([r[model].steady[key].value for r in results]) for model in (0, 1))
        left_out[name] = bare[0].steady[key].value / three - 1
        lumped[name] = (one / bare[1].steady[key].value) * (1 + left_out[name]) - 1
    own = results[int(np.abs(places - at).argmin())][0]
    limits, lumped_limits = (
        {name: _limit(places, values, sink.tolerance(f"air_{name}")) for name, values in of.items()}
        for of in (left_out, lumped)
    )
    found = Air(
        places, left_out, lumped, limits, lumped_limits, at, conduction(sink), CONDUCTIVITY / sink.oxide_thickness, ()
    )
    made = tuple(judged(f"air_{name}", _comparison(sink, name, bare[0], own, found), sink, True) for name in QUANTITIES)
    return replace(found, checks=made)


def _limit(coefficients: np.ndarray, off: np.ndarray, tolerance: float) -> float | None:
    """Where the size of a difference first passes the tolerance, linear between coefficients in their logarithms."""
    beyond = np.flatnonzero(np.abs(off) > tolerance)
    if not len(beyond):
        return None
    i = int(beyond[0])
    if i == 0:
        return float(coefficients[0])
    sizes, places = np.log(np.abs(off[i - 1 : i + 1])), np.log(coefficients[i - 1 : i + 1])
    return float(np.exp(np.interp(np.log(tolerance), sizes, places)))


def _comparison(sink: Sink, name: str, bare: Result, own: Result, found: Air) -> Comparison:
    inputs = {"predicted": bare.steady[QUANTITIES[name]], "measured": own.steady[QUANTITIES[name]]}
    values = {side: given.value for side, given in inputs.items()}
    unit = "A" if name == "current" else "K"
    return Comparison(
        f"3D {name} without air", values["predicted"], values["measured"], unit, relative(**values),
        _error(inputs), lambda: _because(sink, name, bare, found), relative_to="the value with the air",
    )  # fmt: skip


def _error(inputs: dict[str, Estimate]) -> float:
    return spread(relative, inputs)


def _because(sink: Sink, name: str, bare: Result, found: Air) -> str:
    """The air's conductance against that of the anchors, the limit, and what the air is like at this size."""
    loss = found.at * sink.spans * sink.length * sink.width
    anchors = bare.steady["heat_out_W"].value / bare.steady["mean_rise_K"].value
    limit = found.limits[name]
    up_to = "at every coefficient tried" if limit is None else f"up to {limit:.3g} W/(m2 K)"
    return (
        f"at {found.at:.4g} W/(m2 K) the air takes {quantity(loss, 'W', 3)} per kelvin from the beam, "
        f"{percent(loss / anchors)} of what its mounts do, {quantity(anchors, 'W', 3)}; it may be left out {up_to}; "
        f"air at rest conducts {found.conduction:.3g} W/(m2 K) at this size, not the {STILL:g} of large bodies"
    )
