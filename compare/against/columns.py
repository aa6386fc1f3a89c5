"""Columns of numbers as a file has them: a name, the unit that stands with it, and the values."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from scenes.errors import SceneError, printable, quoted, reason
from scenes.units import Unit, UnitError, parse_unit

_LARGEST = 200_000_000
_BRACKETED = re.compile(r"[(\[]([^()\[\]]{1,20})[)\]]")


@dataclass(frozen=True)
class Column:
    """One column. ``unit`` is the text between the first brackets that hold a unit, or behind the last underscore;
    empty where there is none."""

    name: str
    unit: str
    values: np.ndarray


@dataclass(frozen=True)
class Table:
    """The columns of a file, and what kind of file it is, in words."""

    kind: str
    columns: tuple[Column, ...]


def read_text(path: Path) -> str:
    """The text of a file, in UTF-8 or else Latin-1, as older programs write; SceneError where it can't be had."""
    data = read_bytes(path)
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def read_bytes(path: Path) -> bytes:
    """The content of a file; SceneError where it can't be had."""
    try:
        if path.stat().st_size > _LARGEST:
            raise SceneError(f"--against {quoted(path)} is larger than 200 MB: export fewer rows")
        return path.read_bytes()
    except OSError as error:
        raise SceneError(f"--against {quoted(path)} cannot be read: {reason(error)}") from None


def column(header: str, values: np.ndarray) -> Column:
    """A column from its header: "Temperature (degC), Point 1", "peak [K]", "current_A"."""
    for found in _BRACKETED.finditer(header):
        if unit_of(found.group(1)) is not None:
            return Column(" ".join(header.split()), found.group(1).strip(), values)
    head, _, tail = header.strip().rpartition("_")
    if head and unit_of(tail) is not None:
        return Column(header.strip(), tail, values)
    return Column(" ".join(header.split()), "", values)


def unit_of(text: str) -> Unit | None:
    """A unit, or ``None`` where the text is none."""
    spelled = text.strip().replace("°C", "degC")
    if not spelled or spelled[0].isdigit():
        return None
    try:
        return parse_unit("degC" if spelled in ("C", "oC", "degc") else spelled)
    except UnitError:
        return None


def numbers(path: Path, rows: list[list[str]], first_line: int) -> np.ndarray:
    """(rows, columns) from texts; SceneError with the line of the first that is no number, or has another length."""
    if not rows:
        raise SceneError(f"--against {quoted(path)} has no rows of numbers")
    width = len(rows[0])
    found = np.empty((len(rows), width))
    for i, cells in enumerate(rows):
        if len(cells) != width:
            raise SceneError(
                f"--against {quoted(path)}, row {first_line + i}: {len(cells)} columns where the first row has {width}"
            )
        for j, cell in enumerate(cells):
            try:
                found[i, j] = float(cell)
            except ValueError:
                raise SceneError(
                    f"--against {quoted(path)}, row {first_line + i}: {quoted(printable(cell))} is not a number"
                ) from None
    return found
