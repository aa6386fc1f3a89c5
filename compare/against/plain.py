"""A plain CSV: one row of names with units, then numbers; separated by comma, semicolon or tab."""

from __future__ import annotations

import csv
from pathlib import Path

from compare.against.columns import Table, column, numbers
from scenes.errors import SceneError, quoted


def read(path: Path, text: str) -> Table:
    """The columns; SceneError where there is no row of names. Rows that start with # before it are remarks."""
    lines = [line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")]
    if len(lines) < 2:
        raise SceneError(f"--against {quoted(path)} has no rows: give a row of names with units, then numbers")
    separator = max(",;\t", key=lambda mark: lines[-1].count(mark))
    if separator == "," and ";" in lines[0] and ";" in lines[-1]:
        separator = ";"
    rows = list(csv.reader(lines, delimiter=separator, skipinitialspace=True))
    if all(_is_number(cell) for cell in rows[0]):
        raise SceneError(
            f"--against {quoted(path)}: its first row is numbers already: put names with units there, such as "
            '"time (s)", "peak (K)"'
        )
    cells = [[cell.strip() for cell in row] for row in rows[1:]]
    if separator != ",":
        # Where the comma separates no columns it may be the decimal one.
        cells = [[cell.replace(",", ".") for cell in row] for row in cells]
    found = numbers(path, cells, 2)
    if len(rows[0]) != found.shape[1]:
        raise SceneError(f"--against {quoted(path)}: {len(rows[0])} names for {found.shape[1]} columns")
    return Table("CSV", tuple(column(name, found[:, i]) for i, name in enumerate(rows[0])))


def _is_number(cell: str) -> bool:
    try:
        float(cell.replace(",", "."))
    except ValueError:
        return False
    return True
