"""COMSOL's exports: header rows that start with a percent sign, the last of which names the columns.

Written as text (columns apart by spaces) or as CSV. Names hold their unit in brackets, a point's place after a comma,
and what a column was solved for after an "@": "Temperature (K), Point: (0, 5E-4, 1E-6)", "T (K) @ t=1E-3, V0=0.5".
A table has a row for every time; a data export has one for every point, and a column for every time.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from scenes.errors import SceneError, printable, quoted
from validate.against.columns import Column, Table, column, names, numbers, split, unit_of

_MOST_POINTS = 200


def is_one(text: str) -> bool:
    """Whether a text looks like one."""
    return text.lstrip().lstrip('"').startswith("%")


def read(path: Path, text: str) -> Table:
    """The columns; SceneError where header and rows don't fit."""
    head, body, lines = [], [], []
    for number, line in enumerate(text.splitlines(), 1):
        if line.lstrip('" \t').startswith("%"):
            head.append(line.strip())
        elif line.strip():
            body.append([cell.strip().strip('"') for cell in (line.split(",") if "," in line else line.split())])
            lines.append(number)
            commas = "," in line
    found = numbers(path, body, lines)
    # The percent sign may stand inside the first name's quotes or before them.
    last = ('"' if head[-1].startswith('"') else "") + head[-1].lstrip('"').removeprefix("%").strip()
    named = names(last, found.shape[1], "," if commas else None)
    if named is None:
        raise SceneError(
            f"--against {quoted(path)}: its last header row names another number of columns than the {found.shape[1]} "
            f'below it: "{printable(head[-1], 120)}"'
        )
    columns = tuple(column(name, found[:, i]) for i, name in enumerate(named))
    if any("t" in dict(c.at) for c in columns):
        return _by_point(path, columns, _length_unit(head))
    return Table("COMSOL table", columns)


def _by_point(path: Path, columns: tuple[Column, ...], length: float) -> Table:
    """A data export turned round: for every point (a row) and expression a column over the times behind the "@"."""
    places = {split(c.name)[0].lower(): c.values * length for c in columns if split(c.name)[0].lower() in "xyz"}
    points = len(columns[0].values)
    if points > _MOST_POINTS:
        raise SceneError(
            f"--against {quoted(path)} is a field of {points} points: export a table of point evaluations instead"
        )
    groups: dict[tuple[tuple[str, str], ...], dict[str, dict[float, np.ndarray]]] = {}
    for c in columns:
        at = dict(c.at)
        if "t" not in at:
            continue
        others = tuple(pair for pair in c.at if pair[0] != "t")
        try:
            time = float(at["t"])
        except ValueError:
            raise SceneError(f"--against {quoted(path)}: t={quoted(at['t'])} in a header is not a number") from None
        expression = groups.setdefault(others, {}).setdefault(c.name, {})
        if time in expression:
            raise SceneError(f"--against {quoted(path)}: {quoted(c.name)} stands twice at t={at['t']}: export one run")
        expression[time] = c.values
    made: list[Column] = []
    for others, expressions in groups.items():
        times = list(next(iter(expressions.values())))
        made.append(Column("Time (s)", "s", np.array(times), others))
        for name, values in expressions.items():
            if list(values) != times:
                raise SceneError(f"--against {quoted(path)}: {quoted(name)} stands at other times than the rest")
            table = np.array([values[time] for time in times])
            for row in range(points):
                place = ", ".join(f"{places[axis][row]:.9g}" for axis in "xyz" if axis in places)
                header = f"{name}, Point: ({place})" if place else name
                made.append(Column(header, split(name)[1], table[:, row], others))
    return Table("COMSOL data export", tuple(made), notes=("times behind t= are taken in s",))


def _length_unit(head: list[str]) -> float:
    """The unit of coordinates in m, from the header row that tells it."""
    for line in head:
        found = re.search(r"Length unit[:,\s\"]+([^\s\",]+)", line)
        unit = unit_of(found.group(1)) if found else None
        if unit is not None:
            return float(10.0**unit.exponent)
    return 1.0
