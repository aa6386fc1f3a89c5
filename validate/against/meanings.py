"""What `--column` says: "peak=T (K), Point 1", "peak rise (K)=3", "sink.width=w0 (um)", each a name for a column."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from compare.against import QUANTITIES
from scenes.errors import SceneError, did_you_mean, printable, quoted
from validate.against.columns import Table, split
from validate.against.parameters import key_of

IGNORED = "ignore"
"""What a column is called that is to be left out."""


@dataclass(frozen=True)
class Meaning:
    """What a column is: "time", "ignore", a key of traces.csv or the scene; its unit where that is said, else ""; and
    whether it is a rise."""

    what: str
    unit: str = ""
    rise: bool = False


def meanings(table: Table, given: Sequence[str]) -> dict[str, Meaning]:
    """The meaning of columns and of parameters behind an "@" by their names. SceneError for what names no quantity, no
    column, or one of them twice."""
    found: dict[str, Meaning] = {}
    for text in given:
        left, equals, wanted = (part.strip() for part in text.partition("="))
        if not equals or not left or not wanted:
            raise SceneError(f'--column {quoted(text)}: give NAME=COLUMN, such as peak="T (K), Point 1"')
        meaning = _meaning(left)
        name = _column(table, wanted, text)
        if name in found:
            raise SceneError(f"--column {quoted(text)}: {quoted(name)} is the {found[name].what} already")
        if meaning.what != IGNORED and meaning.what in (other.what for other in found.values()):
            raise SceneError(f"--column {quoted(text)}: another column is the {meaning.what} already")
        found[name] = meaning
    return found


def _meaning(left: str) -> Meaning:
    name, unit = split(left)
    rise = bool(re.search(r"\brise\b", name, re.IGNORECASE))
    plain = re.sub(r"\s*\brise\b\s*", "", name, flags=re.IGNORECASE).strip().lower()
    if plain in ("time", IGNORED):
        return Meaning(plain, unit)
    if plain in QUANTITIES:
        return Meaning(QUANTITIES[plain], unit, rise)
    path = key_of(plain)
    if path is None:
        known = ("time", *QUANTITIES, IGNORED)
        raise SceneError(
            f"--column {quoted(left)} is no quantity: give {', '.join(known)}, or a key of the scene such as "
            f"drive.voltage{did_you_mean(plain, known)}"
        )
    return Meaning(path, unit)


def _column(table: Table, wanted: str, text: str) -> str:
    """The name of the column that is wanted: as the header has it, without its unit if that is enough, or by number."""
    names = list(dict.fromkeys(c.name for c in table.columns))
    parameters = list(dict.fromkeys(name for c in table.columns for name, _ in c.at))
    plain = " ".join(wanted.split())
    for found in (*names, *parameters):
        if plain in (found, f"{found} @ {_behind(table, found)}"):
            return found
    loose = [name for name in (*names, *parameters) if plain.lower() in (name.lower(), split(name)[0].lower())]
    if len(loose) == 1:
        return loose[0]
    if wanted.isdigit() and 0 < int(wanted) <= len(table.columns):
        return _numbered(table, int(wanted))
    shown = ", ".join(quoted(name) for name in (*names[:12], *parameters[:4]))
    raise SceneError(f"--column {quoted(text)}: no column is called so: there are {shown}{did_you_mean(plain, names)}")


def _numbered(table: Table, number: int) -> str:
    name = table.columns[number - 1].name
    if sum(c.name == name for c in table.columns) > 1:
        raise SceneError(f"--column: several columns are called {quoted(printable(name))}, so no number tells them")
    return name


def _behind(table: Table, name: str) -> str:
    at: tuple[tuple[str, str], ...] = next((c.at for c in table.columns if c.name == name), ())
    return ", ".join(f"{key}={value}" for key, value in at)
