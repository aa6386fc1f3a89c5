"""Columns of numbers as a file has them: a name, the unit that stands with it, and the values."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from scenes.errors import SceneError, printable, quoted, reason
from scenes.units import Unit, UnitError, parse_unit

_LARGEST = 200_000_000
_UNITS = (
    re.compile(r"(?:^|(?<=\s))\(([^()\[\]]{1,20})\)"),
    re.compile(r"\[([^()\[\]]{1,20})\]"),
    re.compile(r"\(([^()\[\]]{1,20})\)"),
    re.compile(r"\s*/\s*([^\s/()\[\]]{1,20})$"),
    re.compile(r"_([^\W_]{1,20})$"),
)
"""Where a unit stands, the surest place first: "maxop1(T) (K)", "peak [K]", "T(K)", "T / K", "peak_K"."""

_SPACED = (
    r"\t+|\s{2,}",
    # Each name but the first starts after what closes the one before, a unit or a place.
    r"(?<=[)\]])\s+(?=[A-Za-z])",
    # Each name but the first stands before a unit.
    r"\s+(?=\S+ [(\[])",
    r"\s+",
)
"""Where one name ends and the next begins in a row of names apart by blank space."""


@dataclass(frozen=True)
class Column:
    """One column: its header less what follows an " @ ", its unit ("" where it has none), its values, and the
    parameters behind the "@" by name, as they are written: {"V0": "0.5"}."""

    name: str
    unit: str
    values: np.ndarray
    at: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True)
class Table:
    """The columns of a file, and what kind of file it is, in words.

    ``spice`` says that temperatures may be volts, ``unnamed`` that the file names no columns, and ``notes`` what was
    left out of the file."""

    kind: str
    columns: tuple[Column, ...]
    spice: bool = False
    unnamed: bool = False
    notes: tuple[str, ...] = ()


def read_bytes(path: Path) -> bytes:
    """The content of a file; SceneError where it can't be had."""
    try:
        if path.stat().st_size > _LARGEST:
            raise SceneError(f"--against {quoted(path)} is larger than 200 MB: export fewer rows")
        return path.read_bytes()
    except OSError as error:
        raise SceneError(f"--against {quoted(path)} cannot be read: {reason(error)}") from None


def text_of(path: Path, data: bytes) -> str:
    """The text that a file's content is: UTF-8 or 16, or else Latin-1, as older programs write. Raises SceneError."""
    if data.startswith(b"PK\3\4"):
        raise SceneError(f"--against {quoted(path)} is a workbook or an archive: save the table as text or CSV")
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        return data.decode("utf-16", "replace")
    if b"\0" in data[:4000]:
        raise SceneError(f"--against {quoted(path)} is binary, but no ngspice raw file: export a table as text")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def column(header: str, values: np.ndarray) -> Column:
    """A column from its header: "Temperature (degC), Point 1", "peak [K]", "T (K) @ V0=0.5"."""
    name, _, at = " ".join(header.split()).partition(" @ ")
    pairs = (part.partition("=") for part in re.sub(r"^\d+:\s*", "", at).split(","))
    return Column(name, split(name)[1], values, tuple((k.strip(), v.strip()) for k, equals, v in pairs if equals))


def split(header: str) -> tuple[str, str]:
    """A header without its unit, and the unit; "" where it has none."""
    for place in _UNITS:
        for found in place.finditer(header):
            if unit_of(found.group(1)) is not None:
                rest = f"{header[: found.start()]} {header[found.end() :]}"
                return " ".join(rest.split()), found.group(1).strip()
    return header, ""


def names(line: str, count: int, separator: str | None) -> list[str] | None:
    """The names in a header row above rows whose cells are apart by ``separator`` (``None`` is any blank space);
    ``None`` where no way of reading it gives ``count`` of them."""
    bare = line.strip()
    if separator is None:
        ways = [[name.strip('"') for name in re.split(pattern, bare)] for pattern in _SPACED]
    else:
        ways = [[name.strip() for name in next(csv.reader([bare], delimiter=separator, skipinitialspace=True))]]
        if separator == ",":
            # Inside a name without quotes a comma is followed by a space.
            ways.append([name.strip('"') for name in re.split(r",(?! )", bare)])
    return next((found for found in ways if len(found) == count), None)


def unit_of(text: str) -> Unit | None:
    """A unit, or ``None`` where the text is none."""
    spelled = text.strip().replace("°", "deg").replace("\N{MASCULINE ORDINAL INDICATOR}", "deg")
    if not spelled or spelled[0].isdigit():
        return None
    try:
        return parse_unit("degC" if spelled in ("C", "oC", "degc", "deg C") else spelled)
    except UnitError:
        return None


def in_si(values: np.ndarray, unit: Unit) -> np.ndarray:
    """Numbers in a unit as SI values; temperatures as absolute ones."""
    scaled: np.ndarray = values * 10.0**unit.exponent + (273.15 if unit.celsius else 0.0)
    return scaled


def numbers(path: Path, rows: Sequence[Sequence[str]], lines: Sequence[int]) -> np.ndarray:
    """(rows, columns) from texts; SceneError with the line of the first that is no number, or has another length."""
    if not rows:
        raise SceneError(f"--against {quoted(path)} has no rows of numbers")
    width = len(rows[0])
    found = np.empty((len(rows), width))
    for i, cells in enumerate(rows):
        if len(cells) != width:
            raise SceneError(
                f"--against {quoted(path)}, row {lines[i]}: {len(cells)} columns where the first row has {width}"
            )
        for j, cell in enumerate(cells):
            try:
                found[i, j] = float(cell)
            except ValueError:
                raise SceneError(
                    f"--against {quoted(path)}, row {lines[i]}: {quoted(printable(cell))} is not a number"
                ) from None
    return found
