"""COMSOL's exports: data by points, sections below one another, and parameters behind an "@" in the headers.

A data export has a row for each point and a column for each expression and time, "T (K) @ t=1E-3, V0=0.5". The
sectionwise and grid formats have the same columns below one another, each under its header.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from compare.data.columns import Column, make_column, parse_number, scale_of, split_unit
from scenes.errors import SceneError, quoted

_MOST_POINTS = 200  # Points of a data export at most: more are a field.


def read_sections(path: Path, text: str) -> list[Column]:
    """The columns of COMSOL's sectionwise and grid formats, which have one below another."""
    sections: dict[str, list[list[float]]] = {}
    name = ""
    for number, line in enumerate(text.splitlines(), 1):
        bare = line.strip()
        if bare.startswith("%"):
            name = bare.lstrip("% ")
            name = name[6:-1] if name.startswith("Data (") else name
        elif bare:
            try:
                sections.setdefault(name, []).append([float(cell) for cell in bare.replace(",", " ").split()])
            except ValueError:
                raise SceneError(
                    f"--against {quoted(path)}, row {number}: {quoted(bare)} is no row of numbers"
                ) from None
    found: dict[str, np.ndarray] = {}
    for name, rows in sections.items():
        if name == "Grid":
            # The first coordinate varies fastest.
            points = np.array(np.meshgrid(*map(np.array, rows), indexing="ij")).T.reshape(-1, len(rows))
            found |= dict(zip("xyz", points.T, strict=False))
        elif name == "Coordinates":
            found |= dict(zip("xyz", np.array(rows).T, strict=False))
        elif not name.startswith("Elements"):
            found[name] = np.concatenate([np.array(row) for row in rows])
    columns = [make_column(name, values) for name, values in found.items()]
    counts = {len(c.values) for c in columns}
    if len(counts) != 1 or not any(c.unit for c in columns):
        raise SceneError(
            f"--against {quoted(path)} is a COMSOL export by sections without a value for each point under headers "
            'such as "T (K) @ t=0": export it as a spreadsheet'
        )
    return columns


def find_places(columns: Sequence[Column]) -> dict[str, np.ndarray]:
    """The coordinates of the points of a data export."""
    return {name: c.values for c in columns if (name := split_unit(c.name)[0].lower()) in ("x", "y", "z")}


def turn(path: Path, columns: Sequence[Column], remarks: Sequence[str]) -> tuple[Column, ...]:
    """Turn a data export: its rows are points, its columns are expressions at parameters, the time among them."""
    units = (re.search(r"Length unit[:,\s\"]+([^\s\",]+)", remark) for remark in remarks)
    length = next((unit for match in units if match and (unit := scale_of(match[1]))), None)
    places = {axis: values * (length.factor if length else 1.0) for axis, values in find_places(columns).items()}
    if len(columns[0].values) > _MOST_POINTS:
        raise SceneError(
            f"--against {quoted(path)} is a field of {len(columns[0].values)} points: export a table of point "
            "evaluations instead"
        )
    points = [", ".join(f"{values[row]:.9g}" for values in places.values()) for row in range(len(columns[0].values))]
    expressions = [c for c in columns if split_unit(c.name)[0].lower() not in places]
    return stack(
        [
            replace(c, name=" @ ".join([f"{name}, Point: ({point})", *behind]), values=c.values[row : row + 1])
            for c in expressions for name, *behind in [c.name.split(" @ ", 1)] for row, point in enumerate(points)
        ]
    )  # fmt: skip


def stack(columns: Sequence[Column]) -> tuple[Column, ...]:
    """Stack columns that stand beside one another for parameters, "T (K) @ t=1E-3, V0=0.5", with a column for each."""
    blocks: dict[str, list[Column]] = {}
    shared: list[Column] = []
    for c in columns:
        name, _, behind = c.name.partition(" @ ")
        (blocks.setdefault(re.sub(r"^\d+:\s*", "", behind), []) if behind else shared).append(replace(c, name=name))
    if not blocks:
        return tuple(columns)
    stacked: dict[str, Column] = {}
    rows, count = len(columns[0].values), len(columns[0].values) * len(blocks)
    for k, (behind, block) in enumerate(blocks.items()):
        pairs = [re.fullmatch(r"\s*(\w+)\s*=\s*([-+.\deE]+)\s*\[?\s*(.*?)\]?\s*", text) for text in behind.split(",")]
        parameters = [
            make_column(f"{pair[1]} ({pair[3] or 's'})" if pair[3] or pair[1] == "t" else pair[1],
                        np.full(rows, parse_number(pair[2])))
            for pair in pairs if pair
        ]  # fmt: skip
        for c in (*parameters, *shared, *block):
            new = stacked.setdefault(c.name, replace(c, values=np.full(count, np.nan)))
            new.values[k * rows : (k + 1) * rows] = c.values
    return tuple(stacked.values())
