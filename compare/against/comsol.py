"""COMSOL's table export: header rows that start with a percent sign, the last of which names the columns.

Written as text (columns apart by spaces) or as CSV. Names hold their unit in brackets, and a point's place after a
comma: "Temperature (K), Point: (0, 5E-4, 1E-6)".
"""

from __future__ import annotations

import csv
import re
from pathlib import Path

from compare.against.columns import Table, column, numbers
from scenes.errors import SceneError, printable, quoted


def is_one(text: str) -> bool:
    """Whether a text looks like one."""
    return text.lstrip().lstrip('"').startswith("%")


def read(path: Path, text: str) -> Table:
    """The columns; SceneError where header and rows don't fit."""
    lines = [line for line in text.splitlines() if line.strip()]
    head = [line for line in lines if line.lstrip('" \t').startswith("%")]
    body = [line for line in lines if not line.lstrip('" \t').startswith("%")]
    rows = [_cells(line) for line in body]
    found = numbers(path, rows, len(head) + 1)
    names = _names(head[-1], found.shape[1], "," in body[0])
    if names is None:
        raise SceneError(
            f"--against {quoted(path)}: its last header row names another number of columns than the {found.shape[1]} "
            f'below it: "{printable(head[-1], 120)}"'
        )
    return Table("COMSOL table", tuple(column(name, found[:, i]) for i, name in enumerate(names)))


def _cells(line: str) -> list[str]:
    cells = line.split(",") if "," in line else line.split()
    return [cell.strip().strip('"') for cell in cells]


def _names(line: str, count: int, commas: bool) -> list[str] | None:
    """The header's columns by whichever way of separating them, of those for rows apart by commas or by spaces, gives
    as many as there are."""
    plain = line.strip()
    bare = plain.lstrip('"').removeprefix("%").strip()
    if commas:
        # The percent sign may stand inside the first name's quotes or before them.
        inside = ('"' if plain.startswith('"') else "") + bare
        ways = [
            [name.strip() for name in next(csv.reader([inside], skipinitialspace=True))],
            # Inside a name a comma is followed by a space.
            [name.strip('"') for name in re.split(r",(?! )", bare)],
        ]
    else:
        ways = [
            re.split(r"\t+|\s{2,}", bare),
            # Each name but the first starts after what closes the one before, a unit or a place.
            re.split(r"(?<=\))\s+(?=[A-Za-z])", bare),
        ]
    return next((names for names in ways if len(names) == count), None)
