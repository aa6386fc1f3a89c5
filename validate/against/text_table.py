"""Plain tables: a row of names with units, then numbers; apart by commas, semicolons, tabs or spaces.

ngspice's `wrdata` and LTspice's export are such tables too: they name vectors without units, or not at all, and may
repeat the time before every vector.
"""

from __future__ import annotations

import csv
import re
from pathlib import Path

import numpy as np

from scenes.errors import SceneError, quoted
from validate.against.columns import Column, Table, column, names, numbers
from validate.against.ngspice import unit_of_name

_WRDATA = re.compile(r"(?:[ -]\d\.\d+e[+-]\d{2,3} )+")
_VECTOR = re.compile(r"[vi]\(|.*#branch$|@", re.IGNORECASE)


def read(path: Path, text: str) -> Table:
    """The columns; SceneError where there are no rows. Rows that start with # are remarks, the last of which names the
    columns where nothing else does."""
    remarks: list[str] = []
    kept: list[tuple[int, str]] = []
    for number, line in enumerate(text.splitlines(), 1):
        if line.lstrip().startswith("#"):
            remarks.append(line.lstrip().lstrip("#"))
        elif line.strip():
            kept.append((number, line))
    if not kept:
        raise SceneError(f"--against {quoted(path)} has no rows: give a row of names with units, then numbers")
    if all(line.rstrip().endswith((",", ";")) for _, line in kept):
        kept = [(number, line.rstrip()[:-1]) for number, line in kept]
    last = kept[-1][1]
    separator = _separator(last)
    headed = not all(_is_number(cell, separator) for cell in _cells(kept[0][1], separator))
    head = kept[0][1] if headed else ""
    # Runs that are appended to a file bring their names with them.
    body = [(number, line) for number, line in kept[headed:] if line.strip() != head.strip() or not headed]
    rows = [_cells(line, separator) for _, line in body]
    if separator != ",":
        # Where the comma separates no columns it may be the decimal one.
        rows = [[cell.replace(",", ".") for cell in row] for row in rows]
    found = numbers(path, rows, [number for number, _ in body])
    count = found.shape[1]
    named = names(head, count, separator) if headed else None
    if headed and named is None:
        raise SceneError(f"--against {quoted(path)}: {len(_cells(head, separator))} names for {count} columns")
    if not headed and remarks:
        named = names(remarks[-1], count, None) or names(remarks[-1], count, separator or ",")
    wrdata = bool(_WRDATA.fullmatch(last))
    if named is None:
        return _unnamed(found, wrdata)
    columns = tuple(column(name, found[:, i]) for i, name in enumerate(named))
    if named[0].lower() == "time" and not any(c.unit for c in columns):
        plain = [name.lower() for name in named]
        if wrdata or plain.count("time") > 1 or any(_VECTOR.match(name) for name in named):
            made = (Column(name, unit_of_name(name), found[:, i]) for i, name in enumerate(named))
            return Table("ngspice wrdata" if wrdata else "SPICE table", tuple(made), spice=True)
    return Table("table", columns) if separator is None else Table("CSV", columns)


def _unnamed(found: np.ndarray, wrdata: bool) -> Table:
    """Columns by their number; of `wrdata` the first is the time, and so may be every other one."""
    units = [""] * found.shape[1]
    if wrdata:
        units = ["s"] + ["V"] * (found.shape[1] - 1)
        if found.shape[1] % 2 == 0 and (found[:, ::2] == found[:, :1]).all():
            units[::2] = ["s"] * (found.shape[1] // 2)
    columns = (Column("time" if unit == "s" else f"column {i + 1}", unit, found[:, i]) for i, unit in enumerate(units))
    return Table("ngspice wrdata" if wrdata else "table", tuple(columns), spice=wrdata, unnamed=True)


def _separator(line: str) -> str | None:
    """What stands between the numbers of a row; ``None`` is blank space."""
    for mark in ("\t", ";", ","):
        cells = _cells(line, mark)
        if len(cells) > 1 and all(_is_number(cell, mark) for cell in cells):
            return mark
    if len(line.split()) > 1 and all(_is_number(cell, None) for cell in line.split()):
        return None
    return max(",;\t", key=line.count)


def _cells(line: str, separator: str | None) -> list[str]:
    if separator is None:
        return line.split()
    return [cell.strip() for cell in next(csv.reader([line], delimiter=separator, skipinitialspace=True))]


def _is_number(cell: str, separator: str | None) -> bool:
    try:
        float(cell if separator == "," else cell.replace(",", "."))
    except ValueError:
        return False
    return True
