"""The quantities and keys of a scene that columns of data may stand for."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from operator import attrgetter
from typing import Any

import numpy as np

from compare import quantities
from compare.data.columns import Table, split_unit
from scenes.errors import quoted
from scenes.functions import number_of
from scenes.keys import SINK
from scenes.model import UNITS, values
from scenes.parameters import SECTION
from scenes.sink import Sink
from scenes.units import TEMPERATURE, Dimension, Powers, dimension_of, parse_unit

IGNORED = "ignore"
"""The name of a column that is left out."""
RISE_WORDS = {"rise", "delta", "deltat", "dt"}

_PLACES = {
    "peak_K": ("peak", "max", "maximum", "maxop", "centre", "center", "middle", "midpoint", "mid"),
    "end_K": ("end", "edge", "anchor"),
    "mean_K": ("mean", "average", "avg", "ave", "aveop", "equivalent"),
}
_BARE_WORDS = {"t", "temp", "temperature", *RISE_WORDS}
_VOLTAGE = re.compile(r"[vu](_?(0|in|app|applied|dc|drive|src|source|tot))?", re.IGNORECASE)
_POINT = re.compile(r"\(\s*([^()\[\],]+)\s*,\s*([^()\[\],]+)\s*,\s*([^()\[\],]+)\s*\)")
_NEAR = 1e-3
"""A point is at the place of a quantity within this part of the extent of the scene."""


@dataclass(frozen=True)
class Meaning:
    """The meaning of a column by `--column`: "time", "ignore", a quantity or a key; its unit; whether the column is a
    rise, or the abscissa of a ``curve``."""

    name: str
    unit: str = ""
    rise: bool = False
    curve: bool = False


class Target:
    """A scene as the target of data.

    ``keys`` are the dimensions of the keys that a column or a parameter may stand for, ``values`` their values,
    ``initial`` is the key of the temperature at the start, ``called`` and ``example`` complete messages.
    """

    called = "a probe of the scene"
    initial = "scene.initial_temperature"

    def __init__(self, scene: Any, keys: Mapping[str, Dimension], values: Mapping[str, float]) -> None:
        self.scene, self.keys, self.values = scene, keys, values
        self.quantities = quantities.of(scene)
        some = [f'"{name} ({unit})"' for name, unit in list(self.quantities.units.items())[:3]]
        self.example = f"as the probes are, such as {', '.join(some)}"

    def show(self, key: str, value: float) -> str:
        """An SI value of a key in words, to six digits."""
        return self.keys[key].show(float(f"{value:.6g}"))

    def key_of(self, name: str) -> str | None:
        """The path of the key that a name stands for; ``None`` for none."""
        paths = [path for path in self.keys if path in (name, f"{SECTION}.{name}")]
        paths = paths or [path for path in self.keys if path.lower() in (name.lower(), f"{SECTION}.{name}".lower())]
        return paths[0] if len(paths) == 1 and name not in self.quantities.units else None

    def find(self, name: str, powers: Powers | None, volts: bool) -> tuple[str, str]:
        """The quantity of a column by its name and the powers of its unit, and a note; or "" and why it is none."""
        bare = split_unit(name)[0]
        node = re.sub(r"^[vi]\((.*)\)$|^(.*)#branch$", r"\1\2", name, flags=re.IGNORECASE)
        spellings = {_plain(text) for text in (name, bare, node, re.sub(r"\brise\b", "", bare, flags=re.IGNORECASE))}
        probes = [probe for probe in self.quantities.units if _plain(probe) in spellings]
        if len(probes) == 1:
            return probes[0], ""
        key, note = self.find_point(name, powers) if powers and not volts else ("", "")
        return key, note or "is called as no probe"

    def places(self, powers: Powers) -> list[tuple[str, Any, Any]]:
        """Quantities of a unit with the lower and upper corner (m) of their places."""
        probes = [p for p in self.scene.probes if p.quantity in ("temperature", "potential")]
        ends = [
            (p, getattr(p, "lower", getattr(p, "at", None)), getattr(p, "upper", getattr(p, "at", None)))
            for p in probes
        ]
        points = [(p, lower) for p, lower, upper in ends if lower is not None and lower == upper]
        return [(p.name, at, at) for p, at in points if parse_unit(UNITS[p.quantity]).powers == powers]

    def find_point(self, name: str, powers: Powers) -> tuple[str, str]:
        """The quantity at the point in a header, in m or in the unit of the geometry, which may be mm or um."""
        places, match = self.places(powers), _POINT.search(name)
        near = _NEAR * max((np.abs(corners).max() for _, *corners in places), default=0.0)
        for unit, factor in (("m", 1.0), ("mm", 1e-3), ("um", 1e-6)):
            try:
                at = factor * np.array([float(text) for text in match.groups()]) if match else np.full(3, np.nan)
            except ValueError:
                break
            found = {key for key, lower, upper in places if np.abs(at - np.clip(at, lower, upper)).max() <= near}
            # In a unit that is too small every point is near the origin.
            if len(found) == 1 and (unit == "m" or np.abs(at).max() > near):
                return found.pop(), "by its place" if unit == "m" else f"by its place in {unit}"
        return "", ""

    def sign(self, key: str) -> float:
        """The sign of a current: of an electrode of the largest voltage 1, of the smallest one -1, otherwise 0."""
        probe = next(p for p in self.scene.probes if p.name == key)
        drives = [b for b in self.scene.boundaries if b.kind == "voltage"]
        own = [b for b in drives if _place(b) == _place(probe)]
        if probe.quantity != "current" or len(own) != 1:
            return 0.0
        value = max(values(own[0].value), key=abs)
        if own[0].series_resistance == np.inf:
            return float(np.sign(value))
        others = [max(values(b.value), key=abs) for b in drives if b is not own[0] and b.series_resistance != np.inf]
        return float(bool(others) and value > max(others)) - float(bool(others) and value < min(others))


class SinkTarget(Target):
    """The sink, whose quantities have many names."""

    called = "a quantity of the sink"
    initial = "room_temperature"

    def __init__(self, sink: Sink) -> None:
        paths = SINK.schema.paths
        kinds = {path: number_of(key.kind) for path, key in paths.items() if key.physical}
        keys = {path: kind.dimension for path, kind in kinds.items() if kind is not None}
        given = {path: attrgetter(paths[path].attribute)(sink) for path in keys}
        super().__init__(sink, keys, {path: v for path, v in given.items() if isinstance(v, int | float)})
        self.example = (
            'with place and unit, such as "peak (K)", "end (degC)", "mean temperature (K)", "current (mA)", "power (W)"'
        )

    def key_of(self, name: str) -> str | None:
        plain = re.sub(r"\s+", "_", name.strip()).lower()
        paths = {path.lower(): path for path in self.keys}
        ends = [path for path in paths if f".{path}".endswith(f".{plain}")]
        ends = [path for path in ends if path == f"{SINK.schema.main}.{plain}"] or ends
        if plain in paths or len(ends) == 1:
            return paths[plain if plain in paths else ends[0]]
        return "drive.voltage" if _VOLTAGE.fullmatch(plain) else None

    def find(self, name: str, powers: Powers | None, volts: bool) -> tuple[str, str]:
        for key, unit in (("current_A", "A"), ("power_W", "W")):
            if powers == parse_unit(unit).powers:
                return key, ""
        if powers is None:
            places = {word for words in _PLACES.values() for word in words}
            if not set(re.findall(r"[^\W\d_]+", name.lower())) <= _BARE_WORDS | places | {
                f"t{word}" for word in places
            }:
                return "", "has no unit that is known"
        elif powers != TEMPERATURE.powers and not volts:
            return "", "is no temperature, current or power"
        words = set(re.findall(r"[a-z]+", name.lower()))
        words |= {word[1:] for word in words if word.startswith("t")}
        keys = {key for key, names in _PLACES.items() if words & set(names)}
        if keys == {"end_K", "mean_K"}:
            return "end_K", ""  # The quantity of an end is the mean over its cross-section.
        if len(keys) == 1:
            return keys.pop(), "taken for the beam's mean" if "aveop" in words else ""
        key, note = ("", "") if keys else self.find_point(name, TEMPERATURE.powers)
        return key, note or ("names several places" if keys else "names no place (peak, end or mean)")

    def places(self, powers: Powers) -> list[tuple[str, Any, Any]]:
        length, height = self.scene.length, self.scene.thickness
        ys = (("peak_K", length / 2), ("end_K", 0.0), ("end_K", length))
        return [(key, (0.0, y, 0.0), (0.0, y, height)) for key, y in ys]

    def sign(self, key: str) -> float:
        return float(np.sign(self.scene.voltage if self.scene.current is None else self.scene.current))


def make_target(scene: Any) -> Target:
    """Make the target of a scene: the sink, or a scene with probes and parameters."""
    if scene.kind == "sink":
        return SinkTarget(scene)
    parameters = scene.parameters
    names = {f"{SECTION}.{name}": name for name in (parameters.free if parameters is not None else ())}
    keys = {path: dimension_of(parameters.powers[name]) for path, name in names.items()}
    return Target(scene, keys, {path: parameters.values[name] for path, name in names.items()})


def refusal(table: Table, reasons: Mapping[str, str], target: Target) -> str:
    """Why no column of a table is a quantity of the scene."""
    names = target.quantities.names
    first = next(iter(names))
    unit = target.quantities.units[names[first]]
    if table.unnamed:
        clock = "" if table.columns[0].unit or target.quantities.steady else '--column "time (s)=1" '
        return (
            f"its columns have no names: say what they are by their numbers, such as {clock}--column "
            f'"{first} ({unit})=2", or put a row of names with units on top'
        )
    listed = "; ".join(
        f"{quoted(name)} {reasons.get(name, 'is the time')}"
        for name in list(dict.fromkeys(c.name for c in table.columns))[:8]
    )
    return (
        f"none of its columns is {target.called}: {listed}; name them {target.example}, or say which they are: "
        f'--column "{first} ({unit})=NAME"'
    )


def _plain(name: str) -> str:
    return re.sub(r"[\s_]+", " ", name).strip().lower()


def _place(item: Any) -> object:
    return item.group if hasattr(item, "group") else (item.lower, item.upper)
