"""The inputs of a scene: voltages, given and ambient temperatures, fluxes, sources; and their values over time.

Every input is a sum over channels of a constant times the channel's value, so that matrices and loads are assembled
once and time enters through a few numbers: channel 0 is the constant 1, and each schedule of the scene adds one.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np

from scenes.model import AnyScene, Schedule, Value, is_zero, values
from statespace.runtime import interpolate

OWN = "the scene"  # The name of the run with the scene's own inputs.
UNITS = {"voltage": "V", "temperature": "K", "ambient": "K", "heat_flux": "W/m2", "heat_source": "W/m3"}
"""The unit of each kind of input."""


@dataclass(frozen=True)
class Channel:
    """An input of a scene.

    item, kind : name of a boundary, box or source, and the kind of value, as a key of the scene
    value, rest : its value in the scene, and at rest
    step : the size of the step by which it is tried alone
    """

    item: str
    kind: str
    value: Value
    rest: float
    step: float

    @property
    def name(self) -> str:
        """As the scene's keys: "left electrode.voltage"."""
        return f"{self.item}.{self.kind}"

    @property
    def range(self) -> tuple[float, float]:
        """The tested range: a voltage of either sign, others from rest to a step away, and the scene's own values."""
        tried = (self.rest - self.step if self.kind == "voltage" else self.rest, self.rest + self.step)
        return min(*tried, *values(self.value)), max(*tried, *values(self.value))

    @property
    def largest(self) -> float:
        """The value of largest size in the scene."""
        return max(values(self.value), key=abs)


def channels(scene: AnyScene) -> tuple[Channel, ...]:
    """The inputs of a scene. A step is as large as the largest input of its kind, or 1 K."""
    start = scene.initial_temperature
    channels = []
    for b in scene.boundaries:
        if b.kind == "convection":
            if not is_zero(b.value):
                channels.append(Channel(b.name, "ambient", b.ambient, start, 0.0))
        else:
            channels.append(Channel(b.name, b.kind, b.value, start if b.kind == "temperature" else 0.0, 0.0))
    channels += [Channel(s.name, "heat_source", s.heat_source, 0.0, 0.0)
                 for s in getattr(scene, scene.heated[1]) if not is_zero(s.heat_source)]  # fmt: skip
    return tuple(replace(c, step=_largest([d for d in channels if UNITS[d.kind] == UNITS[c.kind]])) for c in channels)


def _largest(alike: list[Channel]) -> float:
    return max(abs(v - c.rest) for c in alike for v in values(c.value)) or 1.0


def driven(scene: Any, values_by_name: Mapping[str, Value]) -> Any:
    """The scene (or its symmetric part) with other values of channels, by their names."""

    def boundary(b: Any) -> Any:
        if b.kind == "convection":
            return replace(b, ambient=values_by_name.get(f"{b.name}.ambient", b.ambient))
        return replace(b, value=values_by_name.get(f"{b.name}.{b.kind}", b.value))

    def source(s: Any) -> Any:
        return replace(s, heat_source=values_by_name.get(f"{s.name}.heat_source", s.heat_source))

    key = scene.heated[1]
    return replace(
        scene, boundaries=tuple(map(boundary, scene.boundaries)), **{key: tuple(map(source, getattr(scene, key)))}
    )


def apart(scene: AnyScene, inputs: tuple[Channel, ...]) -> AnyScene:
    """Give every channel a schedule of its own, with a first time before the start that no other has."""
    schedules = {}
    for number, c in enumerate(inputs):
        value = c.value if isinstance(c.value, Schedule) else Schedule((0.0,), (c.value,))
        first = min(-1.0, *value.times) - 1.0 - number
        schedules[c.name] = Schedule((first, *value.times), (value.values[0], *value.values))
    return driven(scene, schedules)


def scenarios(scene: AnyScene, inputs: tuple[Channel, ...]) -> dict[str, AnyScene]:
    """Make the scenes by which a model is judged: the scene itself, and a step of each channel alone from rest."""
    rest = {c.name: c.rest for c in inputs}
    steps = {f"step of {c.name}": driven(scene, rest | {c.name: c.rest + c.step}) for c in inputs}
    return {OWN: scene, **steps}


@dataclass(frozen=True)
class Inputs:
    """The schedules of a scene, in order of appearance."""

    schedules: tuple[Schedule, ...]

    @property
    def count(self) -> int:
        """How many channels."""
        return 1 + len(self.schedules)

    def split(self, value: Value) -> np.ndarray:
        """(channels,): the coefficients of a value."""
        coefficients = np.zeros(self.count)
        if isinstance(value, Schedule):
            coefficients[1 + self.schedules.index(value)] = 1.0
        else:
            coefficients[0] = value
        return coefficients

    def knots(self, end: float) -> np.ndarray:
        """The instants (s) inside (0, end) at which a schedule bends or jumps."""
        knots = np.unique(np.concatenate([np.empty(0), *(knots for knots, _ in self._points)]))
        return knots[(knots > 0.0) & (knots < end)]

    def at(self, times: np.ndarray | float, side: Literal["left", "right"] = "right") -> np.ndarray:
        """(..., channels): the values at a time or times, after a jump there, or on its "left"."""
        values = [interpolate(*points, times, side)[0] for points in self._points]
        return np.stack([np.ones(np.shape(times)), *values], axis=-1)

    def jumps(self, times: np.ndarray | float) -> np.ndarray:
        """(..., channels): by how much the values jump at a time or times."""
        twice = [np.isin(times, at[1:][np.diff(at) == 0]) for at, _ in self._points]  # else both limits are rounded
        return np.stack([np.zeros(np.shape(times)), *twice], axis=-1) * (self.at(times) - self.at(times, "left"))

    def rates(self, times: np.ndarray | float) -> np.ndarray:
        """(..., channels): the rates (1/s), after a bend there."""
        rates = [interpolate(*points, times)[1] for points in self._points]
        return np.stack([np.zeros(np.shape(times)), *rates], axis=-1)

    @cached_property
    def _points(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Times and values of each schedule, as arrays: time steps use them thousands of times."""
        return [(np.array(s.times), np.array(s.values)) for s in self.schedules]

    def largest(self, end: float) -> np.ndarray:
        """(channels,): the largest absolute value of each up to ``end``."""
        times = np.concatenate([[0.0], self.knots(end), [end]])
        return np.abs(np.concatenate([self.at(times), self.at(times[1:], "left")])).max(axis=0)


def value(given: Value, times: np.ndarray) -> np.ndarray:
    """(times,): a value at some times (s)."""
    if not isinstance(given, Schedule):
        return np.full(len(times), float(given))
    return interpolate(np.array(given.times), np.array(given.values), times)[0]
