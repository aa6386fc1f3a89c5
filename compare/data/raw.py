"""Raw files of ngspice and LTspice, as text or binary, and the exports of COMSOL.

The header of a raw file is "name: value" lines, then "Variables:" with number, name and type of each, then "Values:" or
"Binary:" with the numbers point by point (Berkeley spice3). LTspice writes its header in UTF-16, values other than the
time as single precision, and marks times of interpolated points with a minus sign.

A data export of COMSOL has a row for each point and a column for each expression and time, "T (K) @ t=1E-3, V0=0.5".
The sectionwise and grid formats have the same columns below one another, each under its header.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from compare.data.columns import Column, find_unit, make_column, parse_number
from scenes.errors import SceneError, quoted

_UNITS = {"time": "s", "power": "W", "temperature": "K"}
_VARIABLES = re.compile(rb"^(Variables:.*?)^(Values|Binary):[ \t]*\r?\n", re.DOTALL | re.MULTILINE)
_MOST_POINTS = 200  # Points of a data export at most: more are a field.


def is_raw(data: bytes) -> bool:
    """Return whether the content of a file is a raw file."""
    head = data[:8000].replace(b"\0", b"")
    return head.startswith(b"Title:") and b"Plotname:" in head


def read(data: bytes, plot: str = "transient") -> tuple[str, list[Column]]:
    """Read the kind of a file, and the columns of the one analysis that is called ``plot``. Raises SceneError."""
    data, start, names, kind, columns = _with_plain_headers(data), 0, [], "", list[Column]()
    while head := _VARIABLES.search(data, start):
        fields = dict(re.findall(r"^([^:\n]+):[ \t]*(.*?)\s*$", data[start : head.start()].decode("latin-1"), re.M))
        variables = [line.split() for line in head.group(1).decode("latin-1").splitlines()[1:] if line.strip()]
        points, flags, program = fields.get("No. Points", ""), fields.get("Flags", ""), fields.get("Command", "")
        if not (points.isascii() and points.isdigit() and int(points) and variables):
            raise SceneError(f"a run with {len(variables)} variables and {quoted(points)} points (No. Points) is none")
        width = len(variables) * (2 if "complex" in flags else 1)
        if head.group(2) == b"Binary":
            single = "LTspice" in program and "double" not in flags and "complex" not in flags
            row = np.dtype([("first", "<f8"), ("rest", "<f4" if single else "<f8", (width - 1,))])
            rows = np.frombuffer(data, row, min(int(points), (len(data) - head.end()) // row.itemsize), head.end())
            values = np.column_stack([rows["first"], rows["rest"]])
            start = head.end() + row.itemsize * int(points)
        else:
            following = data.find(b"Title:", head.end())
            start = len(data) if following < 0 else following
            values = _read_values(data[head.end() : start].decode("latin-1"), width)
        names.append(fields.get("Plotname", ""))
        if plot not in names[-1].lower():
            continue
        if columns:
            raise SceneError(f"there are several {plot} analyses: write one of them only")
        if len(values) != int(points):
            raise SceneError(f"the file is cut off after {len(values)} of {points} points")
        units = [_unit(variable[2].lower() if len(variable) > 2 else "") for variable in variables]
        # A transient analysis has no times below zero: the minus sign is LTspice's mark.
        columns = [
            Column(variable[1], unit, np.abs(column) if unit == "s" else column, spice=True)
            for variable, unit, column in zip(variables, units, values.T, strict=False)
        ]
        kind = f"{'LTspice' if 'LTspice' in program else 'ngspice'} raw file"
    if not columns:
        listed = f" but {', '.join(map(quoted, names[:4]))}" if names else ""
        raise SceneError(f"there is no {plot} analysis{listed}: export one")
    return kind, columns


def _with_plain_headers(data: bytes) -> bytes:
    """Recode the UTF-16 header of LTspice as Latin-1; the numbers of a binary file stay."""
    if data[1:2] != b"\0":
        return data
    end = re.search(rb"B\0i\0n\0a\0r\0y\0:\0(\r\0)?\n\0", data)
    at = len(data) if end is None else end.end()
    return data[:at].decode("utf-16-le", "replace").encode("latin-1", "replace") + data[at:]


def _unit(kind: str) -> str:
    return "V" if "voltage" in kind else "A" if "current" in kind else _UNITS.get(kind, "")


def _read_values(text: str, width: int) -> np.ndarray:
    """(points, width): numbers of a text, without the number of the point before its first value."""
    cells = text.replace(",", " ").split()
    try:
        values = np.array([float(cell) for k, cell in enumerate(cells) if k % (width + 1)])
    except ValueError:
        return np.empty((0, width))
    return values[: len(values) // width * width].reshape(-1, width)


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


def arrange(columns: Sequence[Column], remarks: Sequence[str]) -> list[Column]:
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
        return list(columns)
    stacked: dict[str, Column] = {}
    for k, (behind, block) in enumerate(blocks.items()):
        pairs = re.findall(r"(\w+)\s*=\s*([-+.\deE]+)\s*\[?\s*([^],]*?)\s*(?=[],]|$)", behind)
        headers = {name: f"{name} ({unit or 's'})" if unit or name == "t" else name for name, _, unit in pairs}
        parameters = [make_column(headers[name], np.full(count, parse_number(value))) for name, value, _ in pairs]
        for c in (*parameters, *shared, *block):
            new = stacked.setdefault(c.name, replace(c, values=np.full(count * len(blocks), np.nan)))
            new.values[k * count : (k + 1) * count] = c.values
    return list(stacked.values())
