"""Which column is which quantity of the sink: by its words, by its unit, or by the place of a point."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from compare.against.columns import Column, Table, unit_of
from scenes.dimensions import POWER, TEMPERATURE, TIME, VOLTAGE
from scenes.errors import printable
from scenes.sink import Sink

_AMPERE = unit_of("A")
assert _AMPERE is not None
CURRENT_POWERS = _AMPERE.powers

_WORDS = {
    "peak_K": ("peak", "max", "maximum", "centre", "center", "middle", "midpoint", "mid"),
    "end_K": ("end", "edge", "anchor"),
    "mean_K": ("mean", "average", "avg", "aveop", "equivalent"),
}
_RISE = ("rise", "dt", "delta")
_IGNORED = ("reduced1d",)
_POINT = re.compile(r"\(\s*([^()\[\],]+)\s*,\s*([^()\[\],]+)\s*,\s*([^()\[\],]+)\s*\)")
_NEAR = 1e-3
"""Of the beam's length: how near a point must be to the place of a quantity."""


@dataclass(frozen=True)
class Match:
    """A quantity's column, its values in SI units (temperatures in kelvin), and how it was read where that is not
    plain."""

    key: str
    header: str
    values: np.ndarray
    note: str = ""


def is_time(column: Column) -> bool:
    """Whether a column is the time."""
    unit = unit_of(column.unit)
    name = re.split(r"[\s(\[_]", column.name.lower())[0]
    return name in ("time", "t") and unit is not None and unit.powers == TIME.powers


def match(column: Column, sink: Sink, volts_are_kelvins: bool) -> Match | str:
    """The quantity that a column is, or why it is none."""
    unit = unit_of(column.unit)
    words = set(re.findall(r"[a-z0-9]+", column.name.lower()))
    if any(word in words for word in _IGNORED):
        return "is of a 1D model"
    if unit is None:
        return "has no unit"
    values = column.values * 10.0**unit.exponent
    if unit.powers == CURRENT_POWERS:
        return _positive(Match("current_A", column.name, values), sink)
    if unit.powers == POWER.powers:
        return Match("power_W", column.name, values)
    kelvins = unit.powers == TEMPERATURE.powers
    if not kelvins and not (volts_are_kelvins and unit.powers == VOLTAGE.powers):
        return "is no temperature, current or power"
    key = _by_words(column.name) or _by_place(column.name, sink)
    if key is None:
        return "names no place (peak, end or mean)"
    if unit.celsius:
        return Match(key, column.name, values + 273.15)
    if any(word in words for word in _RISE):
        return Match(key, column.name, values + sink.room_temperature, "a rise")
    if not kelvins and abs(float(values[0])) < 1.0:
        return Match(key, column.name, values + sink.room_temperature, "volts from 0 on: a rise in kelvins")
    return Match(key, column.name, values, "" if kelvins else "volts taken for kelvins")


def refusal(table: Table, found: dict[str, str]) -> str:
    """A sentence on columns of which none could be used."""
    listed = "; ".join(f'"{printable(c.name, 50)}" {found.get(c.name, "is the time")}' for c in table.columns[:8])
    return (
        f"none of its columns is a quantity of the sink: {listed}; name them with place and unit, such as "
        '"peak (K)", "end (degC)", "mean temperature (K)", "current (mA)", "power (W)"'
    )


def _by_words(name: str) -> str | None:
    """The place that a name's words tell; ``None`` for none or several."""
    words = re.findall(r"[a-z]+", name.lower())
    found = {key for key, known in _WORDS.items() for word in words if word in known}
    if found == {"end_K", "mean_K"}:
        return "end_K"  # a mean over an end, which is what the quantity is
    return found.pop() if len(found) == 1 else None


def _by_place(name: str, sink: Sink) -> str | None:
    """The place of a point in the scene's coordinates (m): the beam's centre, or an end of its axis."""
    at = _POINT.search(name)
    if at is None:
        return None
    try:
        x, y, z = (float(part) for part in at.groups())
    except ValueError:
        return None
    near = _NEAR * sink.length
    if abs(x) > near or not -near <= z <= sink.thickness + near:
        return None
    if abs(y - sink.length / 2) <= near:
        return "peak_K"
    return "end_K" if min(abs(y), abs(y - sink.length)) <= near else None


def _positive(found: Match, sink: Sink) -> Match:
    """A source's own current counts as negative where it delivers: turned to the sign of the drive."""
    middle = float(np.median(found.values))
    if middle * sink.voltage >= 0:
        return found
    return Match(found.key, found.header, -found.values, "sign turned to that of the voltage")
