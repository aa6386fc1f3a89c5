"""The quantities of a scene with their units and scales."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from scenes import physics
from scenes.checks import FIRST_TIME
from scenes.model import UNITS
from scenes.result import Result, Traces
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

    def largest(self, name: str) -> float:
        """Return the largest rise or value of a 3D trace, with its sign, at times at which errors hold."""
        assert self.traces is not None
        rises = self.traces.values[name][self.sure(self.traces.time)] - self.base(name)
        return float(max(rises, key=abs))

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
