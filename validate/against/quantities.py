"""Which column is which quantity of the sink: by what `--column` says, its words, its unit, or the place of a point."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

import numpy as np

from compare.against import QUANTITIES
from scenes.errors import SceneError, quoted
from scenes.sink import Sink
from scenes.units import POWER, TEMPERATURE, VOLTAGE, parse_unit
from validate.against.tables import Column, Table, in_si, unit_of

IGNORED = "ignore"
"""What a column is called that is to be left out."""

_WORDS = {
    "peak_K": ("peak", "max", "maximum", "maxop", "centre", "center", "middle", "midpoint", "mid"),
    "end_K": ("end", "edge", "anchor"),
    "mean_K": ("mean", "average", "avg", "ave", "aveop", "equivalent"),
}
_RISE = {"rise", "delta", "deltat", "dt"}
_OF_TEMPERATURE = {"t", "temp", "temperature", *_RISE}
_DIFFERENCE = re.compile(r"\bT\)?\s*-\s*[\dT]")
_POINT = re.compile(r"\(\s*([^()\[\],]+)\s*,\s*([^()\[\],]+)\s*,\s*([^()\[\],]+)\s*\)")
_AMPERE, _KELVIN = parse_unit("A"), parse_unit("K")
_LENGTHS = {"m": 1.0, "mm": 1e-3, "um": 1e-6}
NOTICED, STARTS = 0.005, 0.05
"""How far from room temperature a trace may start, of its own change: what is said, and what the checks' own tolerance
would be spent on."""
_NEAR = 1e-3
"""Of the beam's length: how near a point must be to the place of a quantity."""


@dataclass(frozen=True)
class Meaning:
    """What a column is: "time", "ignore", a key of traces.csv or the scene; its unit where that is said, else ""; and
    whether it is a rise."""

    what: str
    unit: str = ""
    rise: bool = False


@dataclass(frozen=True)
class Match:
    """A quantity's column, its values in SI units (temperatures in kelvin), and how it was read where that is not
    plain."""

    key: str
    header: str
    values: np.ndarray
    note: str = ""


def match(column: Column, meaning: Meaning | None, sink: Sink, spice: bool, start: float | None) -> Match | str:
    """The quantity that a column is, or why it is none; SceneError where it can't be what it is said to be. ``start``
    is its first value where the file has the run's start, which tells what a temperature without a unit is in."""
    unit = unit_of((meaning.unit if meaning else "") or column.unit)
    words = set(re.findall(r"[a-z]+", column.name.lower()))
    if meaning is None and "reduced1d" in column.name.lower():
        return "is of a 1D model"
    if unit is None:
        bare = _bare(column, meaning, sink, start)
        return bare or _refused(meaning, column, "has no unit that is known")
    # SPICE calls volts what it knows no unit of.
    volts = spice and unit.powers == VOLTAGE.powers
    if volts and meaning is not None and meaning.what in ("current_A", "power_W"):
        unit = unit_of(meaning.what.rpartition("_")[2]) or unit
    values = in_si(column.values, unit)
    if unit.powers == _AMPERE.powers:
        found = Match("current_A", column.name, values)
        if float(np.nanmedian(values)) * sink.voltage < 0:
            # A source's own current counts as negative where it delivers.
            found = replace(found, values=-values, note="sign turned to that of the voltage")
    elif unit.powers == POWER.powers:
        found = Match("power_W", column.name, values)
    elif unit.powers == TEMPERATURE.powers or volts:
        key, note = (meaning.what, "") if meaning else _place(column.name, sink)
        if not key.endswith("_K"):
            return _refused(meaning, column, note or "is a temperature")
        # A rise in degrees Celsius is one in kelvins.
        rise = (meaning is not None and meaning.rise) or bool(words & _RISE or _DIFFERENCE.search(column.name))
        found = _temperature(key, column, values - (273.15 if rise and unit.celsius else 0.0), rise, note, sink)
        if volts:
            found = replace(found, note=", ".join(filter(None, (found.note, "volts taken for kelvins"))))
    else:
        return _refused(meaning, column, "is no temperature, current or power")
    if meaning is not None and meaning.what != found.key:
        return _refused(meaning, column, f"is the {_called(found.key)} by its unit")
    return found


def refusal(table: Table, found: dict[str, str]) -> str:
    if table.unnamed:
        return (
            "its columns have no names: say what they are by their numbers, such as "
            + ("" if table.spice else '--column "time (s)=1" ')
            + '--column "peak (K)=2", or put a row of names with units on top'
        )
    named = dict.fromkeys(c.name for c in table.columns)
    listed = "; ".join(f"{quoted(name)} {found.get(name, 'is the time')}" for name in list(named)[:8])
    return (
        f"none of its columns is a quantity of the sink: {listed}; name them with place and unit, such as "
        '"peak (K)", "end (degC)", "mean temperature (K)", "current (mA)", "power (W)", or say which they are: '
        f'--column "peak (K)=NAME"'
    )


def _refused(meaning: Meaning | None, column: Column, why: str) -> str:
    if meaning is None:
        return why
    raise SceneError(f"--column: {quoted(column.name)} can't be the {_called(meaning.what)}: it {why}")


def _called(what: str) -> str:
    return next((name for name, key in QUANTITIES.items() if key == what), what)


def _temperature(key: str, column: Column, values: np.ndarray, rise: bool, note: str, sink: Sink) -> Match:
    """Kelvins as absolute ones. The scene starts at room temperature: what starts below half of that is no absolute
    temperature, but a rise."""
    notes = [note] if note else []
    if rise:
        notes.append("a rise")
    elif (first := values[np.isfinite(values)][:1]) < sink.room_temperature / 2:
        rise = True
        notes.append(f"a rise, for it starts at {first[0]:.4g} K")
    return Match(key, column.name, values + sink.room_temperature * rise, ", ".join(notes))


def _bare(column: Column, meaning: Meaning | None, sink: Sink, start: float | None) -> Match | None:
    """A temperature without a unit, whose name has no other words than its place: in kelvin where it starts at room
    temperature, at 0 a rise; ``None`` where it is neither."""
    words = set(re.findall(r"[^\W\d_]+", column.name.lower()))
    places = {word for known in _WORDS.values() for word in known}
    plain = words <= _OF_TEMPERATURE | places | {f"t{word}" for word in places}
    key = meaning.what if meaning else (_place(column.name, sink)[0] if plain else "")
    if column.unit or not key.endswith("_K") or start is None:
        return None
    change = float(np.nanmax(np.abs(column.values - start)))
    rise = abs(start) <= NOTICED * change
    at_room = abs(start - sink.room_temperature) <= STARTS * change
    if rise == at_room or (at_room and ((meaning is not None and meaning.rise) or words & _RISE)):
        return None
    note = f"it has no unit, and starts at {start:.4g}: {'a rise in K' if rise else 'in K'}"
    return Match(key, column.name, column.values + sink.room_temperature * rise, note)


def _place(name: str, sink: Sink) -> tuple[str, str]:
    """The quantity whose place a name tells, and a note on how; or "" and why there is none."""
    words = re.findall(r"[a-z]+", name.lower())
    words += [word[1:] for word in words if word.startswith("t")]
    found = {key for key, known in _WORDS.items() for word in words if word in known}
    if found == {"end_K", "mean_K"}:
        return "end_K", ""  # a mean over an end, which is what the quantity is
    if len(found) == 1:
        key = found.pop()
        return key, "taken for the beam's mean" if "aveop" in words else ""
    return _by_point(name, sink) or ("", "names no place (peak, end or mean)" if not found else "names several places")


def _by_point(name: str, sink: Sink) -> tuple[str, str] | None:
    """The same by a point in the scene's coordinates: the beam's centre, or an end of its axis. COMSOL writes them in
    the geometry's unit, which is the largest that puts the point in the sink."""
    at = _POINT.search(name)
    if at is None:
        return None
    try:
        given = [float(part) for part in at.groups()]
    except ValueError:
        return None
    near = _NEAR * sink.length
    for unit, factor in _LENGTHS.items():
        x, y, z = (factor * part for part in given)
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
