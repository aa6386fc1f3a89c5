"""The quantities and keys of a scene that columns of data may stand for."""

from __future__ import annotations

import re
from typing import Any

import numpy as np

from compare import quantities
from compare.data.columns import Column
from scenes.keys import SINK
from scenes.model import values
from scenes.parameters import SECTION
from scenes.sink import Sink
from scenes.units import TEMPERATURE, Powers, dimension_of, parse_unit
from scenes.varied import every_number

RISE_WORDS = {"rise", "delta", "deltat", "dt"}
_PLACES = {
    "peak_K": {"peak", "max", "maximum", "maxop", "centre", "center", "middle", "midpoint", "mid"},
    "end_K": {"end", "edge", "anchor"},
    "mean_K": {"mean", "average", "avg", "ave", "aveop", "equivalent"},
}
_TEMPERATURES = {"t", "temp", "temperature", *RISE_WORDS}
_VOLTAGE = re.compile(r"[vu](_?(0|in|app|applied|dc|drive|src|source|tot))?", re.IGNORECASE)
_POINT = re.compile(r"\(\s*{0}\s*,\s*{0}\s*,\s*{0}\s*\)".format(r"([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)"))
_NEAR = 1e-3
"""A point is at the place of a quantity within this part of the extent of the scene."""


class Target:
    """A scene with probes and parameters as the target of data.

    ``keys`` are the dimensions of the keys that a column or a parameter may stand for, ``values`` their values,
    ``initial`` is the key of the temperature at the start, ``called`` and ``example`` complete messages.
    """

    called = "a probe of the scene"
    initial = "scene.initial_temperature"

    def __init__(self, scene: Any) -> None:
        self.scene, self.quantities, given = scene, quantities.of(scene), scene.parameters
        free = {} if given is None else {f"{SECTION}.{name}": name for name in given.free}
        self.keys = {path: dimension_of(given.measures[name].powers) for path, name in free.items()}
        self.values = {path: given.values[name] for path, name in free.items()}
        some = [f'"{name} ({unit})"' for name, unit in list(self.quantities.units.items())[:3]]
        self.example = f"as the probes are, such as {', '.join(some)}"

    def show(self, key: str, value: float) -> str:
        """Return an SI value of a key in words, to six digits."""
        return self.keys[key].show(float(f"{value:.6g}"))

    def find_key(self, name: str) -> str:
        """Return the key that a name stands for, "" for none."""
        if name in self.quantities.units:
            return ""
        wanted = name, f"{SECTION}.{name}"
        exact = [path for path in self.keys if path in wanted]
        alike = [path for path in self.keys if path.lower() in (wanted[0].lower(), wanted[1].lower())]
        return next(iter(exact + alike), "")

    def find_quantity(self, column: Column) -> tuple[str, str]:
        """Return the quantity of a column by its name and unit, and a note; or "" and the reason why it is none."""
        node = re.sub(r"^[vi]\((.*)\)$|^(.*)#branch$", r"\1\2", column.name, flags=re.IGNORECASE)
        unnamed = re.sub(r"\brise\b", "", column.plain, flags=re.IGNORECASE)
        spellings = {_plain(text) for text in (column.name, column.plain, node, unnamed)}
        probes = [probe for probe in self.quantities.units if _plain(probe) in spellings]
        if len(probes) == 1:
            return probes[0], ""
        key, note = self._find_point(column.name, None if column.spice else column.powers)
        return key, note or "is called as no probe"

    def _places(self) -> list[tuple[str, Any, Any]]:
        """Quantities with the lower and upper corner (m) of their places."""
        points = [
            (p, getattr(p, "lower", getattr(p, "at", None)), getattr(p, "upper", None)) for p in self.scene.probes
        ]
        return [
            (p.name, lower, lower) for p, lower, upper in points
            if p.quantity in ("temperature", "potential") and lower is not None and upper in (None, lower)
        ]  # fmt: skip

    def _find_point(self, name: str, powers: Powers | None) -> tuple[str, str]:
        """The quantity at the point in a header, in m or in the unit of the geometry, which may be mm or um."""
        units = self.quantities.units
        places = [place for place in self._places() if parse_unit(units[place[0]]).powers == powers]
        match, near = _POINT.search(name), _NEAR * max((np.abs(ends).max() for _, *ends in places), default=0.0)
        point = np.array(match.groups(), float) if match else np.full(3, np.nan)
        for unit, factor in (("m", 1.0), ("mm", 1e-3), ("um", 1e-6)):
            at = factor * point
            keys = {key for key, lower, upper in places if np.abs(at - np.clip(at, lower, upper)).max() <= near}
            # In a unit that is too small every point is near the origin.
            if len(keys) == 1 and (unit == "m" or np.abs(at).max() > near):
                return keys.pop(), "by its place" if unit == "m" else f"by its place in {unit}"
        return "", ""

    def sign(self, key: str) -> float:
        """Return the sign of a current: 1 at an electrode of the largest voltage, -1 of the smallest, otherwise 0."""
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
        super().__init__(sink)
        for path, number in every_number(sink).items():
            self.keys[path], self.values[path] = number.kind.dimension, number.value
        self.example = (
            'with place and unit, such as "peak (K)", "end (degC)", "mean temperature (K)", "current (mA)", "power (W)"'
        )

    def find_key(self, name: str) -> str:
        plain = re.sub(r"\s+", "_", name.strip()).lower()
        ends = [path for path in self.keys if f".{path}".lower().endswith(f".{plain}")]
        ends = [path for path in ends if path.lower() in (plain, f"{SINK.schema.main}.{plain}")] or ends
        if len(ends) == 1:
            return ends[0]
        return "drive.voltage" if _VOLTAGE.fullmatch(plain) else ""

    def find_quantity(self, column: Column) -> tuple[str, str]:
        powers = column.powers
        for key, unit in (("current_A", "A"), ("power_W", "W")):
            if powers == parse_unit(unit).powers:
                return key, ""
        words = set(re.findall(r"[^\W\d_]+", column.name.lower()))
        known = set().union(*_PLACES.values())
        if powers is None and not words <= _TEMPERATURES | known | {f"t{word}" for word in known}:
            return "", "has no unit that is known"
        if powers not in (None, TEMPERATURE.powers) and not column.spice:
            return "", "is no temperature, current or power"
        words |= {word[1:] for word in words if word.startswith("t")}
        keys = {key for key, names in _PLACES.items() if words & names}
        if keys == {"end_K", "mean_K"}:
            return "end_K", ""  # The quantity of an end is the mean over its cross-section.
        if len(keys) == 1:
            return keys.pop(), "taken for the beam's mean" if "aveop" in words else ""
        key, note = ("", "") if keys else self._find_point(column.name, TEMPERATURE.powers)
        return key, note or ("names several places" if keys else "names no place (peak, end or mean)")

    def _places(self) -> list[tuple[str, Any, Any]]:
        length, height = self.scene.length, self.scene.thickness
        ys = (("peak_K", length / 2), ("end_K", 0.0), ("end_K", length))
        return [(key, (0.0, y, 0.0), (0.0, y, height)) for key, y in ys]

    def sign(self, key: str) -> float:
        return float(np.sign(self.scene.voltage if self.scene.current is None else self.scene.current))


def make_target(scene: Any) -> Target:
    """Return the target of a scene: the sink, or a scene with probes and parameters."""
    return SinkTarget(scene) if scene.kind == "sink" else Target(scene)


def _plain(name: str) -> str:
    return re.sub(r"[\s_]+", " ", name).strip().lower()


def _place(item: Any) -> object:
    return item.group if hasattr(item, "group") else (item.lower, item.upper)
