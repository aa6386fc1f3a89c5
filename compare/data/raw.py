"""Raw files of ngspice and LTspice, as text or binary.

The header of a raw file is "name: value" lines, then "Variables:" with number, name and type of each, then "Values:" or
"Binary:" with the numbers point by point (Berkeley spice3). LTspice writes its header in UTF-16, values other than the
time as single precision, and marks times of interpolated points with a minus sign.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from compare.data.columns import Column, Table
from scenes.errors import SceneError, quoted

_UNITS = {"time": "s", "power": "W", "temperature": "K"}
_VARIABLES = re.compile(rb"^(Variables:.*?)^(Values|Binary):[ \t]*\r?\n", re.DOTALL | re.MULTILINE)


def is_raw(data: bytes) -> bool:
    """Whether the content of a file is a raw file."""
    head = data[:8000].replace(b"\0", b"")
    return head.startswith(b"Title:") and b"Plotname:" in head


def read(path: Path, data: bytes, plot: str = "transient") -> Table:
    """Read the columns of the one analysis that is called ``plot``. Raises SceneError."""
    data = _with_plain_headers(data)
    start, table, names = 0, None, []
    while head := _VARIABLES.search(data, start):
        header = data[start : head.start()].decode("latin-1")
        variables = [line.split() for line in head.group(1).decode("latin-1").splitlines()[1:] if line.strip()]
        count, points, flags = len(variables), _field(header, "No. Points"), _field(header, "Flags").lower()
        if not (points.isascii() and points.isdigit()):
            raise SceneError(f"--against {quoted(path)}: no number of points in its header (No. Points)")
        if not count or not int(points):
            raise SceneError(f"--against {quoted(path)} has no {'points' if count else 'variables'} in one of its runs")
        numbers = int(points) * count * (2 if "complex" in flags else 1)
        if head.group(2) == b"Binary":
            single = "LTspice" in _field(header, "Command") and "double" not in flags and "complex" not in flags
            row = np.dtype([("first", "<f8"), ("rest", "<f4" if single else "<f8", (numbers // int(points) - 1,))])
            whole = min(int(points), (len(data) - head.end()) // row.itemsize)
            rows = np.frombuffer(data, row, whole, head.end())
            values = np.column_stack([rows["first"], rows["rest"]]).ravel()
            start = head.end() + row.itemsize * int(points)
        else:
            following = data.find(b"Title:", head.end())
            start = len(data) if following < 0 else following
            values = _values(data[head.end() : start].decode("latin-1"), count)
        names.append(_field(header, "Plotname"))
        if plot not in names[-1].lower():
            continue
        if table is not None:
            raise SceneError(f"--against {quoted(path)} has several {plot} analyses: write one of them only")
        if values.size != numbers:
            raise SceneError(f"--against {quoted(path)} is cut off: it has {values.size // count} of {points} points")
        columns = [
            Column(v[1], _unit(v[2].lower() if len(v) > 2 else ""), column, spice=True)
            for v, column in zip(variables, values.reshape(-1, count).T, strict=True)
        ]
        # A transient analysis has no times below zero: the minus sign is LTspice's mark.
        columns = [replace(c, values=np.abs(c.values)) if c.unit == "s" else c for c in columns]
        table = Table("LTspice raw file" if "LTspice" in header else "ngspice raw file", tuple(columns))
    if table is None:
        listed = f": it has {', '.join(map(quoted, names[:4]))}" if names else ""
        raise SceneError(f"--against {quoted(path)} has no {plot} analysis{listed}: export one")
    return table


def _with_plain_headers(data: bytes) -> bytes:
    """Recode the UTF-16 header of LTspice as Latin-1; the numbers of a binary file stay."""
    if data[1:2] != b"\0":
        return data
    end = re.search(rb"B\0i\0n\0a\0r\0y\0:\0(\r\0)?\n\0", data)
    if end is None:
        return data.decode("utf-16-le", "replace").encode("latin-1", "replace")
    return data[: end.end()].decode("utf-16-le", "replace").encode("latin-1", "replace") + data[end.end() :]


def _unit(kind: str) -> str:
    return "V" if "voltage" in kind else "A" if "current" in kind else _UNITS.get(kind, "")


def _values(text: str, count: int) -> np.ndarray:
    """Numbers of the values' section, without the number of the point before its first value."""
    cells = text.replace(",", " ").split()
    try:
        return np.array([float(cell) for k, cell in enumerate(cells) if k % (count + 1)])
    except ValueError:
        return np.empty(0)


def _field(header: str, name: str) -> str:
    match = re.search(rf"^{re.escape(name)}:[ \t]*(.*)$", header, re.MULTILINE)
    return match.group(1).strip() if match else ""
