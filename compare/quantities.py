"""What the models of a scene answer over time, and data may be of: a name for each quantity, its unit, and where it
counts from. A scene with probes has these; the sink is one with fixed names."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from scenes import physics
from scenes.checks import FIRST_TIME
from scenes.model import UNITS, AnyScene
from scenes.result import Result
from scenes.sink import OF_A_SINK, Sink

EDGE = 1e-5
"""The part of the run to either side of a drive's jump in which nothing is compared."""
AT_REST = np.array([np.inf])
"""The times (s) of data of a steady state: what is reached after all time."""


@dataclass(frozen=True)
class Quantities:
    """What both models answer: ``units`` by name, the ``initial`` temperature (K) above which temperatures rise, the
    ``end`` of the run (s), when (s) the errors over time begin to hold, the ``jumps`` (s) after which they begin again,
    and the ``edges`` (s) at which a drive jumps: a circuit's edge takes a while, and what happens on it is no
    difference of models. ``words`` are what a user calls a quantity, where that is not its name; ``final`` the steady
    quantities that differences of a trace are relative to, where that is not the trace's own largest value. ``steady``
    says that there is the steady state alone."""

    units: Mapping[str, str]
    initial: float
    end: float = np.inf
    start: float = 0.0
    jumps: tuple[float, ...] = ()
    edges: tuple[float, ...] = ()
    words: Mapping[str, str] = field(default_factory=dict)
    final: Mapping[str, str] = field(default_factory=dict)
    steady: bool = False

    def base(self, name: str) -> float:
        """What the scale of a quantity counts from."""
        return self.initial if self.units[name] == "K" else 0.0

    def word(self, name: str) -> str:
        """What a user calls a quantity."""
        return self.words.get(name, name)

    @property
    def names(self) -> dict[str, str]:
        """The quantities by what a user calls them."""
        return {self.word(name): name for name in self.units}

    def sure(self, times: np.ndarray) -> np.ndarray:
        """(times,): where the errors hold, within the run; the steady state is sure."""
        found: np.ndarray = (times >= self.start * (1 - 1e-9)) & (times <= self.end * (1 + 1e-9))
        for jump in self.jumps:
            found &= ~((times >= jump) & (times < jump + self.start * (1 - 1e-9)))
        for edge in self.edges:
            found &= np.abs(times - edge) > EDGE * min(self.end, float(times[-1]))
        return found | ~np.isfinite(times)


def of(scene: Any, fem3d: Result | None = None) -> Quantities:
    """Those of a scene; from when on the errors of ``fem3d`` hold is said by it."""
    return _OF[scene.kind](scene, fem3d)


def _of_sink(sink: Sink, fem3d: Result | None) -> Quantities:
    traced = {name: asked for name, asked in OF_A_SINK.items() if asked.trace}
    return Quantities(
        {asked.trace: asked.unit for asked in traced.values()}, sink.room_temperature, sink.end_time, FIRST_TIME,
        words={asked.trace: name for name, asked in traced.items()},
        final={asked.trace: asked.steady for asked in traced.values()},
    )  # fmt: skip


def _of_free(scene: AnyScene, fem3d: Result | None) -> Quantities:
    start = 0.0 if fem3d is None else fem3d.details.get("accurate_from_s") or 0.0
    jumps, edges = physics.temperature_jumps(scene), physics.jumps(physics.driving(scene))
    units = {probe.name: UNITS[probe.quantity] for probe in scene.probes}
    return Quantities(units, scene.initial_temperature, scene.end_time, start, jumps, edges, steady=scene.steady)


_OF: dict[str, Callable[[Any, Result | None], Quantities]] = {"sink": _of_sink, "free": _of_free}
