"""Match the columns of a file to quantities and keys of the scene: by `--column`, or by their names and units."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from compare.data.columns import Column, Table, find_unit, refusing, split_unit, to_si
from compare.data.target import RISE_WORDS, Target
from scenes.errors import SceneError, did_you_mean, quoted
from scenes.units import CURRENT, TEMPERATURE, TIME, VOLTAGE, Unit, called, parse_unit

IGNORED = "ignore"
"""The name of a column that is left out."""
_DIFFERENCE = re.compile(r"\bT\)?\s*-\s*[\dT]")
_NEAR_INITIAL = 0.05
"""Part of the initial temperature (K), or of the change in degC, within which a trace starts there."""
_ZERO = 0.005
"""Part of its change within which a rise starts at zero."""


@dataclass(frozen=True)
class Meaning:
    """The meaning of a column by `--column`: "time", "ignore", a quantity or a key; its unit; whether the column is a
    rise, or the abscissa of a ``curve``."""

    name: str
    unit: str = ""
    rise: bool = False
    curve: bool = False


def read_meanings(target: Target, table: Table, given: Sequence[str]) -> dict[str, Meaning]:
    """Read `--column NAME=COLUMN` as meanings by the names of columns and parameters. Raises SceneError."""
    meanings: dict[str, Meaning] = {}
    for text in given:
        with refusing(f"--column {quoted(text)}"):
            quantity, equals, wanted = (part.strip() for part in text.partition("="))
            if not equals or not quantity or not wanted:
                raise SceneError('give NAME=COLUMN, such as peak="T (K), Point 1"')
            meaning, name = _read_meaning(target, quantity), _find_column(table, wanted)
            if name in meanings:
                raise SceneError(f"{quoted(name)} is the {meanings[name].name} already")
            if meaning.name != IGNORED and meaning.name in (other.name for other in meanings.values()):
                raise SceneError(f"another column is the {meaning.name} already")
            meanings[name] = meaning
    return meanings


def _read_meaning(target: Target, text: str) -> Meaning:
    """The meaning of "time (ms)", "peak rise (K)", "drive.voltage curve" or "ignore"."""
    words = {word.lower(): key for word, key in target.quantities.names.items()}
    name, unit = (text, "") if text.lower() in words else split_unit(text)
    plain = name if name.lower() in words else re.sub(r"\s*\brise\b\s*", "", name, flags=re.IGNORECASE).strip()
    if plain.lower() in ("time", IGNORED, *words):
        return Meaning(words.get(plain.lower(), plain.lower()), unit, plain != name)
    path = target.find_key(plain.removesuffix(" curve"))
    if not path:
        choices = ("time", *target.quantities.names, IGNORED)
        example = "drive.voltage" if "drive.voltage" in target.keys else next(iter(target.keys), "")
        key = f", or a key of the scene such as {example}" if example else ""
        raise SceneError(f"it is no quantity: give {', '.join(choices)}{key}{did_you_mean(plain, choices)}")
    return Meaning(path, unit, curve=plain.endswith(" curve"))


def _find_column(table: Table, wanted: str) -> str:
    """The name of a column: as the header has it, without its unit where that is enough, or by number."""
    names = list(dict.fromkeys(c.name for c in table.columns))
    plain = " ".join(wanted.split())
    loose = [c.name for c in table.columns if plain.lower() in (c.name.lower(), c.plain.lower())]
    if plain in names or len(set(loose)) == 1:
        return plain if plain in names else loose[0]
    if wanted.isdigit() and 0 < int(wanted) <= len(table.columns):
        return table.columns[int(wanted) - 1].name
    shown = ", ".join(map(quoted, names[:12]))
    raise SceneError(f"no column is called so: there are {shown}{did_you_mean(plain, names)}")


def find_time(table: Table, given: Mapping[str, Meaning], target: Target) -> tuple[Column | None, str, list[Column]]:
    """Return the column of times in s, how it was read where that is not plain, and the other columns."""
    columns = list(table.columns)
    named = [c for c in columns if c.name in given and given[c.name].name == "time"]
    free = [c for c in columns if c.powers == TIME.powers and c.name not in given]
    bare = [c for c in columns if c.name.lower() in ("time", "zeit", "t") and not c.unit and c.name not in given]
    # The only column in a unit of time is the time, whatever its name.
    times = named or [c for c in free if c.is_time] or free or bare
    same = [c for c in times if c.unit == times[0].unit and np.array_equal(c.values, times[0].values, equal_nan=True)]
    if not times and target.quantities.steady:
        return None, "", columns
    if not times or len(same) != len(times):
        names = ", ".join(quoted(c.name) for c in (times or columns)[:8])
        problem = "several columns are the time" if times else "no column is the time with its unit"
        raise SceneError(f'{problem}, such as "Time (s)" (or --column "time (s)=NAME"): there are {names}')
    unit = find_unit("s" if times is bare else (given[named[0].name].unit if named else "") or times[0].unit)
    if unit is None or unit.powers != TIME.powers:
        raise SceneError(f'--column: {quoted(times[0].name)} has no unit of time: say it, --column "time (s)=NAME"')
    clock = Column(times[0].name, "s", to_si(times[0].values, unit))
    names_of_time = {c.name for c in times}
    how = "it has no unit and is taken in s" if times is bare else ""
    return clock, how, [c for c in columns if c.name not in names_of_time]


@dataclass(frozen=True)
class Match:
    """The column of a quantity: ``values`` in SI units, temperatures absolute, NaN in rows to leave out."""

    key: str
    header: str
    values: np.ndarray
    note: str = ""


def match_column(column: Column, meaning: Meaning | None, target: Target) -> Match | str:
    """Return the quantity of a column, or why it is none. Raises SceneError where --column gives another unit."""
    if meaning is None and "reduced1d" in column.name.lower():
        return "is of a 1D model"
    key, note = (meaning.name, "") if meaning else target.find_quantity(column)
    if not key:
        return note
    symbol = target.quantities.units[key]
    wanted, unit, notes = parse_unit(symbol), find_unit((meaning.unit if meaning else "") or column.unit), [note]
    bare = unit is None
    if column.spice and unit is not None and unit.powers == VOLTAGE.powers != wanted.powers:
        # A circuit has volts for all that is no current.
        notes.append(f"volts taken for {'kelvins' if symbol == 'K' else symbol}")
        unit = wanted
    elif unit is None:
        notes.append(f"it has no unit and is taken in {symbol}")
        unit = wanted
    if unit.powers != wanted.powers:
        why = f"is {called(unit.powers)}, not {called(wanted.powers)}"
        if meaning is None:
            return why
        raise SceneError(f"--column: {quoted(column.name)} can't be the {target.quantities.word(key)}: it {why}")
    values = to_si(column.values, unit)
    if wanted.powers == TEMPERATURE.powers:
        values, how = _make_absolute(target, key, column, meaning, unit)
        notes.append(how)
        first = next(v for v in column.values if v == v)
        if bare and how.startswith("a rise, for") and abs(first) > _ZERO * np.nanmax(np.abs(column.values - first)):
            initial = target.quantities.initial
            return f"has no unit, and starts at {first:.4g}: neither at 0 nor at {initial:g} K"
    elif wanted.powers == CURRENT.powers and float(np.nanmedian(values)) * target.sign(key) < 0:
        # SPICE counts the current of a source as negative where the source delivers.
        values = -values
        notes.append("sign turned to that of the voltage")
    return Match(key, column.name, values, ", ".join(filter(None, notes)))


def _make_absolute(
    target: Target, key: str, column: Column, meaning: Meaning | None, unit: Unit
) -> tuple[np.ndarray, str]:  # fmt: skip
    """Absolute temperatures (K) of a column, and a note.

    Without a word for a rise, the whole column decides: its numbers other than zero are absolute where they start at
    the initial temperature of the scene, or where all are above half of it. Zeros of such a column are placeholders.
    """
    initial = target.quantities.initial
    words = set(re.findall(r"[a-z]+", column.name.lower()))
    named = bool(words & RISE_WORDS or _DIFFERENCE.search(column.name)) and target.quantities.word(key) != column.name
    if named or (meaning is not None and meaning.rise):
        return column.values * float(unit.factor) + initial, "a rise"
    values = to_si(column.values, unit)
    zero = column.values == 0
    kept = values[~np.isnan(values) & ~zero]
    starts = bool(kept.size) and abs(kept[0] - initial) <= _NEAR_INITIAL * initial
    if not (starts or (kept > initial / 2).all()) or not kept.size:
        first = float(values[~np.isnan(values)][0])
        return values + initial, f"a rise, for it starts at {first:.4g} K"
    if unit.celsius:
        # 0 degC is a temperature, but at the top of a column that goes on at the initial temperature.
        zero &= (np.cumsum(~zero) == 0) & bool(abs(kept[0] - initial) <= _NEAR_INITIAL * np.ptp(kept))
    if not zero.any():
        return values, ""
    return np.where(zero, np.nan, values), f"{zero.sum()} placeholder rows of zeros"


def refusal(table: Table, reasons: Mapping[str, str], target: Target) -> str:
    """Return why no column of a table is a quantity of the scene."""
    names = target.quantities.names
    first = next(iter(names))
    unit = target.quantities.units[names[first]]
    listed = "; ".join(
        f"{quoted(name)} {reasons.get(name, 'is the time')}"
        for name in list(dict.fromkeys(c.name for c in table.columns))[:8]
    )
    return (
        f"none of its columns is {target.called}: {listed}; name them {target.example}, or say which they are: "
        f'--column "{first} ({unit})=NAME"'
    )
