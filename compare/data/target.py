"""The quantities and keys of a scene that columns of data may stand for."""

from __future__ import annotations

import re
from typing import Any

import numpy as np

from compare import quantities
from compare.data.columns import Column
from scenes.model import values
from scenes.parameters import SECTION
from scenes.units import CURRENT, POWER, TEMPERATURE, Powers, parse_unit
from scenes.varied import every_number

RISE_WORDS = {"rise", "delta", "deltat", "dt"}
_PLACES = {
    "peak_K": {"peak", "max", "maximum", "maxop", "centre", "center", "middle", "midpoint", "mid"},
    "end_K": {"end", "edge", "anchor"},
    "mean_K": {"mean", "average", "avg", "ave", "aveop", "equivalent"},
}
_VOLTAGE = re.compile(r"[vu](_?(0|in|app|applied|dc|drive|src|source|tot))?", re.IGNORECASE)
_POINT = re.compile(r"\(\s*{0}\s*,\s*{0}\s*,\s*{0}\s*\)".format(r"([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)"))


class Target:
    """A scene with probes and parameters as the target of data.

    ``numbers`` are the keys that a column or a parameter may stand for, ``initial`` is the key of the temperature at
    the start, ``called`` and ``example`` complete messages.
    """

    called = "a probe of the scene"
    initial = "scene.initial_temperature"

    def __init__(self, scene: Any) -> None:
        self.scene, self.quantities = scene, quantities.of(scene)
        self.numbers = {k: n for k, n in every_number(scene).items() if scene.kind == "sink" or k.startswith(SECTION)}
        some = [f'"{name} ({unit})"' for name, unit in list(self.quantities.units.items())[:3]]
        self.example = f"as the probes are, such as {', '.join(some)}"

    def show(self, key: str, value: float) -> str:
        """Return an SI value of a key in words, to six digits."""
        return self.numbers[key].kind.dimension.show(float(f"{value:.6g}"))

    def find_key(self, name: str) -> str:
        """Return the key that ends with a name, of the scene's main section where there are several; "" for none."""
        wanted = "." + re.sub(r"\s+", "_", name.strip())
        for text, ends in ((wanted, str), (wanted.lower(), str.lower)):
            keys = [key for key in self.numbers if ends(f".{key}").endswith(text)]
            keys = [key for key in keys if ends(key) in (text[1:], f"sink{text}")] or keys
            if len(keys) == 1 and name not in self.quantities.units:
                return keys[0]
        return ""

    def find_quantity(self, column: Column) -> tuple[str, str]:
        """Return the quantity of a column by its name and unit, and a note; or "" and the reason why it is none."""
        node = re.sub(r"^[vi]\((.*)\)$|^(.*)#branch$", r"\1\2", column.name, flags=re.IGNORECASE)
        unnamed = re.sub(r"\brise\b", "", column.plain, flags=re.IGNORECASE)
        spellings = {_plain(text) for text in (column.name, column.plain, node, unnamed)}
        probes = [probe for probe in self.quantities.units if _plain(probe) in spellings]
        if len(probes) == 1:
            return probes[0], ""
        key, note = self._find_point(column.name, None if column.spice else column.powers)
        odd = column.unit is None and column.name.endswith((")", "]"))
        return key, note or "is called as no probe" + ", and its unit is unknown" * odd

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
        if not (match := _POINT.search(name)):
            return "", ""
        for unit, factor in (("m", 1.0), ("mm", 1e-3), ("um", 1e-6)):
            at = factor * np.array(match.groups(), float)
            keys = {
                key for key, lower, upper in self._places()
                if parse_unit(self.quantities.units[key]).powers == powers
                and np.abs(at - np.clip(at, lower, upper)).max() <= 1e-3 * np.abs(at).max()
            }  # fmt: skip
            if len(keys) == 1:
                return keys.pop(), "by its place" if unit == "m" else f"by its place in {unit}"
        return "", ""

    def sign(self, key: str) -> float:
        """Return the sign of a current: 1 at an electrode of the largest voltage, -1 of the smallest, otherwise 0."""
        place = _place(next(probe for probe in self.scene.probes if probe.name == key))
        drives = {_place(b): b for b in self.scene.boundaries if b.kind == "voltage"}
        largest = {place: max(values(b.value), key=abs) for place, b in drives.items()}
        if place not in drives:
            return 0.0
        if drives[place].series_resistance == np.inf:  # a given current
            return float(np.sign(largest[place]))
        others = [largest[p] for p, b in drives.items() if p != place and b.series_resistance != np.inf]
        return float((largest[place] > max(others)) - (largest[place] < min(others)) if others else 0)


class SinkTarget(Target):
    """The sink, whose quantities have many names."""

    called = "a quantity of the sink"
    initial = "room_temperature"

    def __init__(self, scene: Any) -> None:
        super().__init__(scene)
        self.example = (
            'with place and unit, such as "peak (K)", "end (degC)", "mean temperature (K)", "current (mA)", "power (W)"'
        )

    def find_key(self, name: str) -> str:
        return super().find_key(name) or ("drive.voltage" if _VOLTAGE.fullmatch(name) else "")

    def find_quantity(self, column: Column) -> tuple[str, str]:
        powers, places = column.powers, set().union(*_PLACES.values())
        if powers in (CURRENT.powers, POWER.powers):
            return "current_A" if powers == CURRENT.powers else "power_W", ""
        words = set(re.findall(r"[^\W\d_]+", column.name.lower()))
        words = {word[1:] if word[0] == "t" and word[1:] in places else word for word in words}
        if powers is None and not words <= {"t", "temp", "temperature"} | RISE_WORDS | places:
            return "", "has no unit that is known"
        if powers not in (None, TEMPERATURE.powers) and not column.spice:
            return "", "is no temperature, current or power"
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
