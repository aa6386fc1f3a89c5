"""The quantities of a scene with their units and scales, and the checks of a model at the probes of a free scene.

A model of a free scene is compared with 3D probe by probe: steady, and at the largest difference over time. The
difference is (model - 3D)/scale. The scale of a temperature is its 3D rise above the initial temperature, over time the
largest rise; of other quantities the 3D value, over time the largest. No difference is relative to kelvins.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from compare.course import Course, ascending
from compare.verdict import Check, compared
from scenes import physics
from scenes.checks import FIRST_TIME
from scenes.model import OVER_TIME, UNITS, AnyScene
from scenes.result import Estimate, Result, Traces
from scenes.sink import OF_A_SINK

EDGE = 1e-5
"""Nothing is compared within this part of the run to either side of a drive's jump."""
AT_REST = np.array([np.inf])
"""The time (s) of data of a steady state: it is reached after infinite time."""


@dataclass(frozen=True)
class Quantities:
    """The quantities of a scene.

    Attributes
    ----------
    units : unit by name
    names : names by the user's words
    initial : temperature (K) from which rises count
    end : end of the run (s)
    first : first time (s) at which errors hold
    traces : the 3D traces, which narrow the times at which errors hold
    edges : times (s) at which a drive jumps
    final : by trace the steady quantity that its differences are relative to; else its own largest value
    steady : whether there is the steady state alone
    """

    units: Mapping[str, str]
    names: Mapping[str, str]
    initial: float
    end: float = np.inf
    first: float = 0.0
    traces: Traces | None = None
    edges: tuple[float, ...] = ()
    final: Mapping[str, str] = field(default_factory=dict)
    steady: bool = False

    def base(self, name: str) -> float:
        """Return the value from which the scale of a quantity counts."""
        return self.initial if self.units[name] == "K" else 0.0

    def whole(self, name: str) -> str:
        """Name the scale of a quantity: a rise or a value."""
        return "rise" if self.units[name] == "K" else "value"

    def word(self, name: str) -> str:
        """Return the user's word for a quantity."""
        return next(word for word, each in self.names.items() if each == name)

    def sure(self, times: np.ndarray) -> np.ndarray:
        """Return (times,): whether errors hold; always in the steady state."""
        mask: np.ndarray = (times >= self.first * (1 - 1e-9)) & (times <= self.end * (1 + 1e-9))
        if self.traces is not None:
            mask &= self.traces.sure(times)
        for edge in self.edges:
            mask &= np.abs(times - edge) > EDGE * min(self.end, float(times[-1]))
        return mask | ~np.isfinite(times)


def of(scene: Any, fem3d: Result | None = None) -> Quantities:
    """Return the quantities of a sink or a free scene; ``fem3d`` narrows the times at which errors hold."""
    if scene.kind == "sink":
        traced = {name: entry for name, entry in OF_A_SINK.items() if entry.trace}
        return Quantities(
            {e.trace: e.unit for e in traced.values()}, {word: e.trace for word, e in traced.items()},
            scene.room_temperature, scene.end_time, FIRST_TIME, final={e.trace: e.steady for e in traced.values()},
        )  # fmt: skip
    units = {probe.name: UNITS[probe.quantity] for probe in scene.probes}
    traces, edges = None if fem3d is None else fem3d.traces, physics.jumps(physics.driving(scene))
    first = 0.0 if traces is None else traces.since
    start, end, names = scene.initial_temperature, scene.end_time, dict(zip(units, units, strict=True))
    return Quantities(units, names, start, end, first, traces, edges, steady=scene.steady)


def compare_probes(scene: AnyScene, fem3d: Result, model: Result) -> dict[str, Check]:
    """Compare every quantity that 3D and a model have, by the ids of checks, in the order of the quantities."""
    catalogue, made = of(scene, fem3d), dict[str, Check]()
    for name, unit in catalogue.units.items():
        if name in model.steady and name in fem3d.steady:
            base, whole = catalogue.base(name), f"the 3D {catalogue.whole(name)}"
            one, three = (replace(r.steady[name], value=r.steady[name].value - base) for r in (model, fem3d))
            made[name] = compared(name, unit, one, three, relative_to=whole)
        if model.traces is not None and fem3d.traces is not None and name in model.traces.values:
            made[f"{name}{OVER_TIME}"] = _over_time(name, catalogue, fem3d.traces, model.traces)
    return made


def _over_time(name: str, catalogue: Quantities, in_3d: Traces, in_1d: Traces) -> Check:
    """Compare at the largest difference over time, at the times at which 3D's error bound holds."""
    time, base = in_1d.time, catalogue.base(name)
    three, one = np.interp(time, ascending(in_3d.time), in_3d.values[name]) - base, in_1d.values[name] - base
    course, rows = Course(time, three, one, catalogue.sure(time), kinks=True), three[in_3d.sure(time)]
    scale = Estimate(float(rows[np.argmax(np.abs(rows))]), in_3d.errors[name])
    error, whole = in_3d.errors[name] + in_1d.errors[name], f"the largest 3D {catalogue.whole(name)}"
    note = course.change(abs(scale.value))
    return course.comparison(f"{name}, trace", catalogue.units[name], error, scale, whole, note)
