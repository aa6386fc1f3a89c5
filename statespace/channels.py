"""The inputs of a scene, each as a channel of its own: voltages, given and ambient temperatures, fluxes, sources."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from scenes.model import AnyScene, Schedule, Value, is_zero, values

OWN = "the scene"  # The name of the run with the scene's own inputs.
UNITS = {"voltage": "V", "temperature": "K", "ambient": "K", "heat_flux": "W/m2", "heat_source": "W/m3"}
"""The unit of each kind of input."""


@dataclass(frozen=True)
class Channel:
    """An input of a scene.

    Attributes
    ----------
    item, kind : str
        Name of a boundary, box or source, and the kind of value, as a key of the scene.
    value, rest : Value, float
        Value in the scene, and at rest.
    step : float
        Size of the step by which the input is tried alone.
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
    return driven(scene, {c.name: schedule(c, k) for k, c in enumerate(inputs)})


def schedule(channel: Channel, number: int) -> Schedule:
    """Schedule of a channel's values, unlike the schedule of any other."""
    value = channel.value
    times, levels = (value.times, value.values) if isinstance(value, Schedule) else ((), (value,))
    first = min(-1.0, *times, 0.0) - 1.0 - number
    return Schedule((first, *times), levels if not times else (levels[0], *levels))


def scenarios(scene: AnyScene, inputs: tuple[Channel, ...]) -> dict[str, AnyScene]:
    """Make the scenes by which a model is judged: the scene itself, and a step of each channel alone from rest."""
    rest = {c.name: c.rest for c in inputs}
    steps = {f"step of {c.name}": driven(scene, rest | {c.name: c.rest + c.step}) for c in inputs}
    return {OWN: scene, **steps}
