"""Match the columns of a file to quantities: by `--column`, or by their names and units."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from compare.data.columns import Column, Scale, Table, scale_of, split_unit
from compare.data.targets import IGNORED, RISE_WORDS, Meaning, Target
from scenes.errors import SceneError, did_you_mean, printable, quoted
from scenes.units import TEMPERATURE, VOLTAGE, called, parse_unit

_DIFFERENCE = re.compile(r"\bT\)?\s*-\s*[\dT]")
_NEAR_INITIAL = 0.05
"""Part of the initial temperature (K), or of the change in degC, within which a trace starts there."""
_ZERO = 0.005
"""Part of its change within which a rise starts at zero."""


@dataclass(frozen=True)
class Match:
    """The column of a quantity: ``values`` in SI units, temperatures absolute, NaN in rows to leave out."""

    key: str
    header: str
    values: np.ndarray
    note: str = ""


def read_meanings(target: Target, table: Table, given: Sequence[str]) -> dict[str, Meaning]:
    """Read `--column NAME=COLUMN` as meanings by the names of columns and parameters. Raises SceneError."""
    meanings: dict[str, Meaning] = {}
    for text in given:
        quantity, equals, wanted = (part.strip() for part in text.partition("="))
        if not equals or not quantity or not wanted:
            raise SceneError(f'--column {quoted(text)}: give NAME=COLUMN, such as peak="T (K), Point 1"')
        meaning = _read_meaning(target, quantity)
        name = _find_column(table, wanted, text)
        if name in meanings:
            raise SceneError(f"--column {quoted(text)}: {quoted(name)} is the {meanings[name].name} already")
        if meaning.name != IGNORED and meaning.name in (other.name for other in meanings.values()):
            raise SceneError(f"--column {quoted(text)}: another column is the {meaning.name} already")
        meanings[name] = meaning
    return meanings


def _read_meaning(target: Target, quantity: str) -> Meaning:
    name, unit = split_unit(quantity)
    words = {word.lower(): key for word, key in target.quantities.names.items()}
    for text, said in ((quantity, ""), (name, unit)):
        if text.strip().lower() in words:
            return Meaning(words[text.strip().lower()], said)
    plain = re.sub(r"\s*\brise\b\s*", "", name, flags=re.IGNORECASE).strip()
    if plain.lower() in ("time", IGNORED):
        return Meaning(plain.lower(), unit)
    if plain.lower() in words:
        return Meaning(words[plain.lower()], unit, plain.lower() != name.strip().lower())
    path = target.key_of(plain.removesuffix(" curve"))
    if path is None:
        choices = ("time", *target.quantities.names, IGNORED)
        example = "drive.voltage" if "drive.voltage" in target.keys else next(iter(target.keys), "")
        key = f", or a key of the scene such as {example}" if example else ""
        raise SceneError(
            f"--column {quoted(quantity)} is no quantity: give {', '.join(choices)}{key}{did_you_mean(plain, choices)}"
        )
    return Meaning(path, unit, curve=plain.endswith(" curve"))


def _find_column(table: Table, wanted: str, text: str) -> str:
    """The name of a column: as the header has it, without its unit where that is enough, or by number."""
    names = list(dict.fromkeys(c.name for c in table.columns))
    plain = " ".join(wanted.split())
    if plain in names:
        return plain
    loose = [name for name in names if plain.lower() in (name.lower(), split_unit(name)[0].lower())]
    if len(loose) == 1:
        return loose[0]
    if wanted.isdigit() and 0 < int(wanted) <= len(table.columns):
        name = table.columns[int(wanted) - 1].name
        if sum(c.name == name for c in table.columns) > 1:
            raise SceneError(f"--column: several columns are called {quoted(printable(name))}, so no number tells them")
        return name
    shown = ", ".join(map(quoted, names[:12]))
    raise SceneError(f"--column {quoted(text)}: no column is called so: there are {shown}{did_you_mean(plain, names)}")


def match_column(column: Column, meaning: Meaning | None, target: Target) -> Match | str:
    """Find the quantity of a column, or why it is none. Raises SceneError where --column gives another unit."""
    catalogue, scale = target.quantities, scale_of((meaning.unit if meaning else "") or column.unit)
    if meaning is None and "reduced1d" in column.name.lower():
        return "is of a 1D model"
    volts = column.spice and scale is not None and scale.powers == VOLTAGE.powers
    if meaning:
        key, note = meaning.name, ""
    else:
        key, note = target.find(column.name, scale.powers if scale else None, volts)
    if not key:
        return note
    wanted, unit = parse_unit(catalogue.units[key]), catalogue.units[key]
    notes, bare = [note], scale is None
    if volts and wanted.powers != VOLTAGE.powers:
        # A circuit has volts for all that is no current.
        notes.append(f"volts taken for {'kelvins' if unit == 'K' else unit}")
    elif bare:
        notes.append(f"it has no unit and is taken in {unit}")
    if scale is None or notes[1:]:
        scale = Scale(wanted.powers, 1.0)
    if scale.powers != wanted.powers:
        why = f"is {called(scale.powers)}, not {called(wanted.powers)}"
        if meaning is None:
            return why
        raise SceneError(f"--column: {quoted(column.name)} can't be the {catalogue.word(key)}: it {why}")
    values = scale.to_si(column.values)
    if wanted.powers == TEMPERATURE.powers:
        values, said = _absolute(target, key, column, meaning, scale)
        notes.append(said)
        first = next(v for v in column.values if v == v)
        if bare and said.startswith("a rise, for") and abs(first) > _ZERO * np.nanmax(np.abs(column.values - first)):
            return f"has no unit, and starts at {first:.4g}: neither at 0 nor at {catalogue.initial:g} K"
    elif wanted.powers == parse_unit("A").powers and float(np.nanmedian(values)) * target.sign(key) < 0:
        # SPICE counts the current of a source as negative where the source delivers.
        values = -values
        notes.append("sign turned to that of the voltage")
    return Match(key, column.name, values, ", ".join(filter(None, notes)))


def _absolute(
    target: Target, key: str, column: Column, meaning: Meaning | None, scale: Scale
) -> tuple[np.ndarray, str]:  # fmt: skip
    """Absolute temperatures (K) of a column, and a note.

    Without a word for a rise, the whole column decides: its numbers other than zero are absolute where they start at
    the initial temperature of the scene, or where all are above half of it. Zeros of such a column are placeholders.
    """
    initial = target.quantities.initial
    words = set(re.findall(r"[a-z]+", column.name.lower()))
    named = bool(words & RISE_WORDS or _DIFFERENCE.search(column.name)) and target.quantities.word(key) != column.name
    if named or (meaning is not None and meaning.rise):
        return column.values * scale.factor + initial, "a rise"
    values = scale.to_si(column.values)
    zero = column.values == 0
    kept = values[~np.isnan(values) & ~zero]
    starts = bool(kept.size) and abs(kept[0] - initial) <= _NEAR_INITIAL * initial
    if not (starts or (kept > initial / 2).all()) or not kept.size:
        first = float(values[~np.isnan(values)][0])
        return values + initial, f"a rise, for it starts at {first:.4g} K"
    if scale.offset:
        # 0 degC is a temperature, but at the top of a column that goes on at the initial temperature.
        zero &= (np.cumsum(~zero) == 0) & bool(abs(kept[0] - initial) <= _NEAR_INITIAL * np.ptp(kept))
    if not zero.any():
        return values, ""
    return np.where(zero, np.nan, values), f"{zero.sum()} placeholder rows of zeros"
