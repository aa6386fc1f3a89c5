"""The quantities of a scene: names, units, and the base of each scale. A sink has fixed names, others have probes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from scenes import physics
from scenes.checks import FIRST_TIME
from scenes.errors import quoted
from scenes.model import UNITS
from scenes.result import Result, Traces
from scenes.sink import OF_A_SINK

OF_A_DEVICE = {
    "sink_K": ("sink temperature", "K"), "sensor_K": ("sensor temperature", "K"), "sink_V": ("sink voltage", "V"),
    "sensor_V": ("sensor voltage", "V"), "sink_power_W": ("sink power", "W"), "sensor_power_W": ("sensor power", "W"),
    "polymer_flux_W": ("heat into polymer", "W"),
}  # fmt: skip
"""Words and units of the device's quantities."""
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
    initial : temperature (K) from which rises count
    end : end of the run (s)
    first, traces : first time (s) at which errors hold, and the 3D traces, which narrow it
    edges : times (s) at which a drive jumps
    words : the user's word for a quantity
    final : by trace the steady quantity that its differences are relative to; else its own largest value
    steady : whether there is the steady state alone
    """

    units: Mapping[str, str]
    initial: float
    end: float = np.inf
    first: float = 0.0
    traces: Traces | None = None
    edges: tuple[float, ...] = ()
    words: Mapping[str, str] = field(default_factory=dict)
    final: Mapping[str, str] = field(default_factory=dict)
    steady: bool = False

    def base(self, name: str) -> float:
        """Return the value from which the scale of a quantity counts."""
        return self.initial if self.units[name] == "K" else 0.0

    def word(self, name: str) -> str:
        """Return the user's word for a quantity."""
        return self.words.get(name, name)

    @property
    def since(self) -> float:
        """The time (s) from which errors of traces hold."""
        return self.first if self.traces is None else max(self.first, self.traces.since)

    @property
    def names(self) -> dict[str, str]:
        """The names by the user's words."""
        return {self.word(name): name for name in self.units}

    def sure(self, times: np.ndarray) -> np.ndarray:
        """Return (times,): whether errors hold; always in the steady state."""
        mask: np.ndarray = (times >= self.first * (1 - 1e-9)) & (times <= self.end * (1 + 1e-9))
        if self.traces is not None:
            mask &= self.traces.sure(times)
        for edge in self.edges:
            mask &= np.abs(times - edge) > EDGE * min(self.end, float(times[-1]))
        return mask | ~np.isfinite(times)


def called(name: str) -> str:
    """Quote a name of several words for a sentence."""
    return quoted(name) if " " in name else name


def of(scene: Any, fem3d: Result | None = None) -> Quantities:
    """Return the quantities of a sink or a free scene; ``fem3d`` narrows the times at which errors hold."""
    if scene.kind == "sink":
        traced = {entry.trace: (name, entry) for name, entry in OF_A_SINK.items() if entry.trace}
        return Quantities(
            {trace: entry.unit for trace, (_, entry) in traced.items()}, scene.room_temperature, scene.end_time,
            FIRST_TIME, words={trace: name for trace, (name, _) in traced.items()},
            final={trace: entry.steady for trace, (_, entry) in traced.items()},
        )  # fmt: skip
    units = {probe.name: UNITS[probe.quantity] for probe in scene.probes}
    traces, edges = None if fem3d is None else fem3d.traces, physics.jumps(physics.driving(scene))
    return Quantities(units, scene.initial_temperature, scene.end_time, 0.0, traces, edges, steady=scene.steady)
