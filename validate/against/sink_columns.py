"""Which column is which quantity of the sink: by its words, its unit, or the place of a point."""

from __future__ import annotations

import re
from functools import partial
from operator import attrgetter

import numpy as np

from compare import quantities
from scenes.following import number_of
from scenes.keys import SINK
from scenes.sink import Sink
from scenes.units import TEMPERATURE, Unit
from validate.against.quantities import AMPERE, NOTICED, RISE, STARTS, WATT, Match, Meaning, Subject
from validate.against.tables import Column

_WORDS = {
    "peak_K": ("peak", "max", "maximum", "maxop", "centre", "center", "middle", "midpoint", "mid"),
    "end_K": ("end", "edge", "anchor"),
    "mean_K": ("mean", "average", "avg", "ave", "aveop", "equivalent"),
}
_OF_TEMPERATURE = {"t", "temp", "temperature", *RISE}
_POINT = re.compile(r"\(\s*([^()\[\],]+)\s*,\s*([^()\[\],]+)\s*,\s*([^()\[\],]+)\s*\)")
_LENGTHS = {"m": 1.0, "mm": 1e-3, "um": 1e-6}
_NEAR = 1e-3
"""A point counts as a quantity's place within this part of the beam's length."""


def subject(sink: Sink) -> Subject:
    """The sink, whose quantities are called many names."""
    kinds = {p: kind for p, key in SINK.schema.paths.items() if key.physical and (kind := number_of(key.kind))}

    def place(name: str, unit: Unit, volts: bool) -> tuple[str, str]:
        if unit.powers in (AMPERE.powers, WATT.powers):
            return ("current_A" if unit.powers == AMPERE.powers else "power_W"), ""
        if unit.powers == TEMPERATURE.powers or volts:
            return _place(name, sink)
        return "", "is no temperature, current or power"

    return Subject(
        quantities.of(sink), kinds, lambda path: attrgetter(SINK.schema.paths[path].attribute)(sink),
        "a quantity of the sink",
        'with place and unit, such as "peak (K)", "end (degC)", "mean temperature (K)", "current (mA)", "power (W)"',
        place, partial(_bare, sink), "room_temperature",
        lambda values: float(np.nanmedian(values)) * sink.voltage < 0, SINK.schema.main,
    )  # fmt: skip


def _bare(sink: Sink, column: Column, meaning: Meaning | None, start: float | None) -> Match | None:
    """A temperature without a unit, whose name has no other words than its place: in kelvin where it starts at room
    temperature, at 0 a rise; ``None`` where it is neither."""
    words = set(re.findall(r"[^\W\d_]+", column.name.lower()))
    places = {word for words in _WORDS.values() for word in words}
    plain = words <= _OF_TEMPERATURE | places | {f"t{word}" for word in places}
    key = meaning.what if meaning else (_place(column.name, sink)[0] if plain else "")
    if column.unit or not key.endswith("_K") or start is None:
        return None
    change = float(np.nanmax(np.abs(column.values - start)))
    rise = abs(start) <= NOTICED * change
    at_room = abs(start - sink.room_temperature) <= STARTS * change
    if rise == at_room or (at_room and ((meaning is not None and meaning.rise) or words & RISE)):
        return None
    note = f"it has no unit, and starts at {start:.4g}: {'a rise in K' if rise else 'in K'}"
    return Match(key, column.name, column.values + sink.room_temperature * rise, note)


def _place(name: str, sink: Sink) -> tuple[str, str]:
    """The quantity whose place a name tells, and a note on how; or "" and why there is none."""
    words = re.findall(r"[a-z]+", name.lower())
    words += [word[1:] for word in words if word.startswith("t")]
    keys = {key for key, names in _WORDS.items() for word in words if word in names}
    if keys == {"end_K", "mean_K"}:
        return "end_K", ""  # a mean over an end, which is what the quantity is
    if len(keys) == 1:
        key = keys.pop()
        return key, "taken for the beam's mean" if "aveop" in words else ""
    return _by_point(name, sink) or ("", "names no place (peak, end or mean)" if not keys else "names several places")


def _by_point(name: str, sink: Sink) -> tuple[str, str] | None:
    """The same by a point in the scene's coordinates: the beam's centre, or an end of its axis. COMSOL writes them in
    the geometry's unit, which is the largest that puts the point in the sink."""
    at = _POINT.search(name)
    if at is None:
        return None
    try:
        coordinates = [float(part) for part in at.groups()]
    except ValueError:
        return None
    near = _NEAR * sink.length
    for unit, factor in _LENGTHS.items():
        x, y, z = (factor * part for part in coordinates)
        beside = max(sink.width, sink.pad_width) / 2 + near
        along = max(abs(y - sink.length / 2) - sink.length / 2 - sink.pad_length, 0.0)
        if abs(x) > beside or along > near or not -sink.oxide_thickness - near <= z <= sink.thickness + near:
            continue
        said = "" if unit == "m" else f"its place in {unit}"
        if abs(x) > near or z < -near:
            return None
        if abs(y - sink.length / 2) <= near:
            return "peak_K", said
        if min(abs(y), abs(y - sink.length)) <= near:
            return "end_K", ", ".join(filter(None, (said, "a point, taken for the end's mean")))
        return None
    return None
