"""COMSOL's exports: data by points, sections below one another, and parameters behind an "@" in the headers.

A data export has a row for each point and a column for each expression and time, "T (K) @ t=1E-3, V0=0.5". The
sectionwise and grid formats have the same columns below one another, each under its header.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from compare.data.columns import Column, find_unit, make_column, parse_number
from scenes.errors import SceneError, quoted

_MOST_POINTS = 200  # Points of a data export at most: more are a field.


def read_sections(text: str) -> list[Column]:
    """Read the columns of COMSOL's sectionwise and grid formats, which stand below one another."""
    sections: dict[str, list[list[float]]] = {}
    name = ""
    for number, line in enumerate(text.splitlines(), 1):
        bare = line.strip()
        if bare.startswith("%"):
            name = re.sub(r"^Data \((.*)\)$", r"\1", bare.lstrip("% "))
        elif bare:
            try:
                sections.setdefault(name, []).append([float(cell) for cell in bare.replace(",", " ").split()])
            except ValueError:
                raise SceneError(f"row {number}: {quoted(bare)} is no row of numbers") from None
    values: dict[str, np.ndarray] = {}
    for name, rows in sections.items():
        if name == "Grid":
            # The first coordinate varies fastest.
            points = np.array(np.meshgrid(*map(np.array, rows), indexing="ij")).T.reshape(-1, len(rows))
            values |= dict(zip("xyz", points.T, strict=False))
        elif name == "Coordinates":
            values |= dict(zip("xyz", np.array(rows).T, strict=False))
        elif not name.startswith("Elements"):
            values[name] = np.concatenate([np.array(row) for row in rows])
    columns = [make_column(name, each) for name, each in values.items()]
    if len({len(c.values) for c in columns}) != 1 or not any(c.unit for c in columns):
        raise SceneError(
            'these sections have no value for each point under headers like "T (K) @ t=0": export it as a spreadsheet'
        )
    return columns


def find_places(columns: Sequence[Column]) -> dict[str, Column]:
    """Return the columns of coordinates, by axis."""
    return {c.plain.lower(): c for c in columns if c.plain.lower() in ("x", "y", "z")}


def arrange(columns: Sequence[Column], remarks: Sequence[str]) -> tuple[Column, ...]:
    """Return a column for each expression and point, and for each parameter behind an "@", with the runs below one
    another. Only files with ``remarks`` of COMSOL have points."""
    places = find_places(columns) if remarks else {}
    count = len(columns[0].values)
    if places:
        if count > _MOST_POINTS:
            raise SceneError(f"this is a field of {count} points: export a table of point evaluations instead")
        units = (re.search(r"Length unit[:,\s\"]+([^\s\",]+)", remark) for remark in remarks)
        length = next((float(unit.factor) for match in units if match and (unit := find_unit(match[1]))), 1.0)
        points = [", ".join(f"{c.values[row] * length:.9g}" for c in places.values()) for row in range(count)]
        columns = [
            replace(c, name=" @ ".join([f"{name}, Point: ({point})", *behind]), values=c.values[row : row + 1])
            for c in columns if c not in places.values()
            for name, *behind in [c.name.split(" @ ", 1)] for row, point in enumerate(points)
        ]  # fmt: skip
        count = 1
    blocks: dict[str, list[Column]] = {}
    for c in columns:
        name, _, behind = c.name.partition(" @ ")
        blocks.setdefault(re.sub(r"^\d+:\s*", "", behind), []).append(replace(c, name=name))
    shared = blocks.pop("", [])
    if not blocks:
        return tuple(columns)
    stacked: dict[str, Column] = {}
    for k, (behind, block) in enumerate(blocks.items()):
        pairs = re.findall(r"(\w+)\s*=\s*([-+.\deE]+)\s*\[?\s*([^],]*?)\s*(?=[],]|$)", behind)
        headers = {name: f"{name} ({unit or 's'})" if unit or name == "t" else name for name, _, unit in pairs}
        parameters = [make_column(headers[name], np.full(count, parse_number(value))) for name, value, _ in pairs]
        for c in (*parameters, *shared, *block):
            new = stacked.setdefault(c.name, replace(c, values=np.full(count * len(blocks), np.nan)))
            new.values[k * count : (k + 1) * count] = c.values
    return tuple(stacked.values())
