"""How hot each material gets, the warning where that is past what its data hold to, and when a scene is hottest."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from reduced1d.painted import Reduction
from scenes.dimensions import TIME
from scenes.model import Material
from scenes.result import Traces

MOST = 100
"""How many instants of a transient are looked at beside those at which a trace is largest or least."""
_AT_ONCE = 16


@dataclass(frozen=True)
class Hottest:
    """A temperature (K), and when (s) it is reached; ``None`` in the steady state."""

    temperature: float
    time: float | None = None

    @property
    def when(self) -> str:
        """In words."""
        return "in the steady state" if self.time is None else f"at {TIME.show(float(f'{self.time:.3g}'))}"


def moments(traces: Traces | None, most: int = MOST) -> np.ndarray:
    """Times (s) spread over the rows of traces, with those at which any of them is largest or least."""
    if traces is None:
        return np.empty(0)
    rows = np.linspace(0, len(traces.time) - 1, min(most, len(traces.time))).astype(int)
    ends = [k for values in traces.values.values() for k in (int(values.argmax()), int(values.argmin()))]
    return np.asarray(np.unique(traces.time[np.concatenate([rows, ends])]))


def by_material(fields: Any, times: np.ndarray) -> dict[str, Hottest]:
    """The hottest place and moment of each material: of the steady state, if there is one, and of some times (s)."""
    found: dict[str, Hottest] = {}
    corners = {name: np.unique(fields.hexes[fields.material == k]) for k, name in enumerate(fields.material_names)}

    def look(temperatures: np.ndarray, time: float | None) -> None:
        for name, points in corners.items():
            top = float(temperatures[points].max(initial=-np.inf))
            if name not in found or top > found[name].temperature:
                found[name] = Hottest(top, time)

    if fields.has_steady:
        look(fields.steady, None)
    for first in range(0, len(times), _AT_ONCE):
        some = times[first : first + _AT_ONCE]
        for time, temperatures in zip(some, fields.at(some), strict=True):
            look(temperatures, float(time))
    return found


def of_painted(model: Reduction) -> dict[str, Hottest]:
    """The same of a sink's 1D model: the beam's middle, and the top of an oxide block."""
    sink = model.sink
    beam = [0.0, sink.length / 2, sink.thickness / 2]
    oxide = [0.0, -sink.anchor_distance - sink.oxide_length / 2, -1e-6 * sink.oxide_thickness]
    points = np.array([beam, oxide])
    found: dict[str, Hottest] = {}
    for time in (None, *model.time):
        for material, rise in zip((sink.silicon, sink.oxide), model.rise(points, time), strict=True):
            top = Hottest(sink.room_temperature + float(rise), time)
            if material.name not in found or top.temperature > found[material.name].temperature:
                found[material.name] = top
    return found


def farthest(fields: Any, times: np.ndarray, initial: float) -> tuple[float, bool]:
    """The time (s) at which the field is farthest from its ``initial`` temperature (K) anywhere, and whether above."""
    far, at, above = -1.0, float(times[-1]), True
    for first in range(0, len(times), _AT_ONCE):
        some = times[first : first + _AT_ONCE]
        for time, rise in zip(some, fields.at(some) - initial, strict=True):
            if np.abs(rise).max() > far:
                far, at, above = float(np.abs(rise).max()), float(time), bool(rise.max() >= -rise.min())
    return at, above


def past(materials: Sequence[Material], fields: Any, times: np.ndarray) -> list[str]:
    """The warnings of a 3D run. Nothing is sampled where no place can be too hot."""
    limits = [m.valid_to for m in materials if m.valid_to is not None]
    if not limits or fields.ceiling(times) <= min(limits):
        return []
    return warnings(materials, by_material(fields, times))


def warnings(materials: Iterable[Material], reached: Mapping[str, Hottest]) -> list[str]:
    """A sentence for each material that gets hotter than it is valid to."""
    found = []
    for m in dict.fromkeys(materials):
        if m.valid_to is not None and m.name in reached and reached[m.name].temperature > m.valid_to:
            top = reached[m.name]
            found.append(
                f"{m.name} reaches {top.temperature:,.0f} K {top.when}, past the {m.valid_to:,.0f} K of its valid_to, "
                "where it softens, melts or decomposes: what is computed beyond that describes no real part"
            )
    return found
