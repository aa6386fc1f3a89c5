"""Which column is which quantity of a scene: by what `--column` says, or by its name and its unit."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from compare.quantities import Quantities
from scenes.errors import SceneError, quoted
from scenes.kinds import Quantity
from scenes.units import TEMPERATURE, VOLTAGE, Unit, called, parse_unit
from validate.against.tables import Column, Table, in_si, unit_of

IGNORED = "ignore"
"""The name of a column that is left out."""

RISE = {"rise", "delta", "deltat", "dt"}
_DIFFERENCE = re.compile(r"\bT\)?\s*-\s*[\dT]")
AMPERE, WATT = parse_unit("A"), parse_unit("W")
NOTICED, STARTS = 0.005, 0.05
"""How far from room temperature a trace may start, relative to its change, before that is remarked, and before it is
refused, as it would use up the checks' tolerance."""


@dataclass(frozen=True)
class Meaning:
    """What a column is: "time", "ignore", a key of traces.csv or the scene; its unit if said; whether a rise."""

    what: str
    unit: str = ""
    rise: bool = False


@dataclass(frozen=True)
class Match:
    """A quantity's column, its values (SI, temperatures in kelvin), and how it was read if not plainly."""

    key: str
    header: str
    values: np.ndarray
    note: str = ""


@dataclass(frozen=True)
class Subject:
    """The scene that data are of: its quantities, the ``kinds`` and ``values`` of the keys that a column may stand for,
    what messages call the scene and its quantities, and an ``example`` of columns. ``place`` says which quantity a
    column is, by its name and its unit (None where it has none that is known, and is then read by ``bare``), and a note
    on how, or "" and why it is none. ``initial`` is the key of the temperature at the start. ``turned`` says of a
    current's values that they count the other way round. Where several keys end alike, that of the ``main`` section
    is meant."""

    quantities: Quantities
    kinds: Mapping[str, Quantity]
    values: Callable[[str], float | None]
    called: str
    example: str
    place: Callable[[str, Unit, bool], tuple[str, str]]
    bare: Callable[[Column, Meaning | None, float | None], Match | None]
    initial: str
    turned: Callable[[np.ndarray], bool] = lambda _: False
    main: str = ""

    @property
    def names(self) -> dict[str, str]:
        """The quantities by what a user calls them."""
        return self.quantities.names


def match(column: Column, meaning: Meaning | None, subject: Subject, spice: bool, start: float | None) -> Match | str:
    """The quantity that a column is, or why it is none; SceneError where it can't be what it is said to be. ``start``
    is its first value where the file has the run's start, which tells what a temperature without a unit is in."""
    catalogue, unit = subject.quantities, unit_of((meaning.unit if meaning else "") or column.unit)
    if meaning is None and "reduced1d" in column.name.lower():
        return "is of a 1D model"
    if unit is None:
        bare = subject.bare(column, meaning, start)
        return bare or _refused(subject, meaning, column, "has no unit that is known")
    # SPICE calls volts what it knows no unit of.
    volts = spice and unit.powers == VOLTAGE.powers
    key, note = (meaning.what, "") if meaning else subject.place(column.name, unit, volts)
    if not key:
        return note
    wanted = parse_unit(catalogue.units[key])
    if volts and wanted.powers in (AMPERE.powers, WATT.powers):
        unit = wanted
    if unit.powers != wanted.powers and not (volts and wanted.powers == TEMPERATURE.powers):
        return _refused(subject, meaning, column, f"is {called(unit.powers)}, not {called(wanted.powers)}")
    values = in_si(column.values, unit)
    if wanted.powers != TEMPERATURE.powers:
        if wanted.powers == AMPERE.powers and subject.turned(values):
            # A source's own current counts as negative where it delivers.
            values, note = -values, "sign turned to that of the voltage"
        return Match(key, column.name, values, note)
    # A rise in degrees Celsius is one in kelvins.
    rise = is_rise(column.name, meaning) and subject.quantities.word(key) != column.name
    matched = temperature(catalogue, key, column, values - (273.15 if rise and unit.celsius else 0.0), rise, note)
    if volts:
        matched = replace(matched, note=", ".join(filter(None, (matched.note, "volts taken for kelvins"))))
    return matched


def is_rise(name: str, meaning: Meaning | None) -> bool:
    """Whether a column is said to be a rise, or called one."""
    words = set(re.findall(r"[a-z]+", name.lower()))
    return (meaning is not None and meaning.rise) or bool(words & RISE or _DIFFERENCE.search(name))


def refusal(table: Table, reasons: dict[str, str], subject: Subject) -> str:
    """Why no column of a table is a quantity."""
    names = list(subject.names)
    if table.unnamed:
        said = f'--column "{names[0]} ({subject.quantities.units[subject.names[names[0]]]})=2"'
        clock = "" if table.spice else '--column "time (s)=1" '
        return (
            f"its columns have no names: say what they are by their numbers, such as {clock}{said}, or put a row of "
            "names with units on top"
        )
    named = dict.fromkeys(c.name for c in table.columns)
    listed = "; ".join(f"{quoted(name)} {reasons.get(name, 'is the time')}" for name in list(named)[:8])
    return (
        f"none of its columns is {subject.called}: {listed}; name them {subject.example}, or say which they are: "
        f'--column "{names[0]} ({subject.quantities.units[subject.names[names[0]]]})=NAME"'
    )


def _refused(subject: Subject, meaning: Meaning | None, column: Column, why: str) -> str:
    if meaning is None:
        return why
    raise SceneError(f"--column: {quoted(column.name)} can't be the {subject.quantities.word(meaning.what)}: it {why}")


def temperature(catalogue: Quantities, key: str, column: Column, values: np.ndarray, rise: bool, note: str) -> Match:
    """Kelvins as absolute ones. The scene starts at its initial temperature: what starts below half of that is no
    absolute temperature, but a rise."""
    notes = [note] if note else []
    if rise:
        notes.append("a rise")
    elif (first := values[np.isfinite(values)][:1]) < catalogue.initial / 2:
        rise = True
        notes.append(f"a rise, for it starts at {first[0]:.4g} K")
    return Match(key, column.name, values + catalogue.initial * rise, ", ".join(notes))
