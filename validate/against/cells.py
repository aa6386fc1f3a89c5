"""Rows of text as numbers: where one cell ends and the next begins, decimal commas, thousands, and empty cells."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence

import numpy as np

from scenes.errors import SceneError, printable, quoted

_BLANK = re.compile(r"[\s,;]*")
_GROUPED = {
    group: re.compile(rf"[-+]?[1-9]\d{{0,2}}(?:\{group}\d{{3}})+(?P<part>\{point}\d*)?(?:[eE][-+]?\d+)?")
    for group, point in ((".", ","), (",", "."))
}
"""Numbers with a mark between thousands (1.000,0 and 1,000.0), by that mark."""


def is_blank(line: str) -> bool:
    """Whether a line has nothing but separators, as spreadsheets write below a table."""
    return _BLANK.fullmatch(line) is not None


def separator_of(line: str) -> str | None:
    """What stands between the numbers of a row; ``None`` is blank space."""
    for mark in ("\t", ";", ",", None):
        cells = cells_of(line, mark)
        if len(cells) > 1 and are_numbers(cells, mark):
            return mark
    return max(",;\t", key=line.count)


def cells_of(line: str, separator: str | None) -> list[str]:
    if separator is None:
        return line.split()
    return [cell.strip() for cell in next(csv.reader([line], delimiter=separator, skipinitialspace=True))]


def are_numbers(cells: Sequence[str], separator: str | None) -> bool:
    """Whether cells are numbers or empty, at least one a number."""
    try:
        return any([bool(cell) and _number(cell, separator) is not None for cell in cells])
    except ValueError:
        return False


def fitted(rows: Sequence[list[str]], names: int) -> list[list[str]]:
    """Rows without what a separator behind the last cell makes of it: no wider than their widest filled row, or than
    the number of ``names`` where empty columns have some."""
    filled = max((k + 1 for row in rows for k, cell in enumerate(row) if cell), default=0)
    width = max(filled, min(names, max(map(len, rows), default=0)))
    return [row if any(row[width:]) else row[:width] for row in rows]


def numbers(
    where: str, rows: Sequence[Sequence[str]], lines: Sequence[int], separator: str | None
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """(rows, columns) from texts, not a number where a cell is empty, and where that is. SceneError, which begins with
    ``where``, with the line of the first cell that is no number, or of a row of another length."""
    if not rows:
        raise SceneError(f"{where} has no rows of numbers")
    width = len(rows[0])
    for line, cells in zip(lines, rows, strict=True):
        if len(cells) != width:
            raise SceneError(f"{where}, row {line}: {len(cells)} columns where the first row has {width}")
    values = np.full((len(rows), width), np.nan)
    empty = np.zeros((len(rows), width), dtype=bool)
    for j, column in enumerate(zip(*rows, strict=True)):
        group = _group(column)
        for i, cell in enumerate(column):
            empty[i, j] = not cell
            try:
                values[i, j] = _number(cell, separator, group) if cell else np.nan
            except ValueError:
                raise SceneError(f"{where}, row {lines[i]}: {quoted(printable(cell))} is not a number") from None
    return values, empty


def _group(cells: Sequence[str]) -> str:
    """The mark between thousands in a column's numbers, "" for none. A single mark may be the decimal one: it takes a
    number with both kinds to tell."""
    for cell in cells:
        if "." in cell and "," in cell:
            return next((g for g, one in _GROUPED.items() if (m := one.fullmatch(cell)) and m.group("part")), "")
    return ""


def _number(cell: str, separator: str | None, group: str | None = None) -> float:
    """The number of a cell; ValueError where it is none. Where commas separate no columns one may be the decimal mark,
    as it is in any column whose thousands are apart by points."""
    group = _group([cell]) if group is None else group
    if group and _GROUPED[group].fullmatch(cell):
        cell = cell.replace(group, "")
    return float(cell if separator == "," and group != "." else cell.replace(",", "."))
