"""ngspice's raw files, as text or binary.

Source: the header of a raw file is "name: value" lines, then "Variables:" with number, name and type of each, then
"Values:" or "Binary:" with doubles point by point (Berkeley spice3, the same in ngspice).
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from scenes.errors import SceneError, quoted
from validate.against.tables import Column, Table

_UNITS = {"time": "s", "voltage": "V", "current": "A", "power": "W", "temperature": "K"}
_VARIABLES = re.compile(rb"^(Variables:.*?)^(Values|Binary):[ \t]*\r?\n", re.DOTALL | re.MULTILINE)


def is_one(data: bytes) -> bool:
    head = data[:4000]
    return head.startswith(b"Title:") and b"Plotname:" in head


def read(path: Path, data: bytes, plot: str = "transient") -> Table:
    """The columns of the analysis called ``plot`` in a raw file; SceneError where there are none, or several."""
    start, table = 0, None
    while head := _VARIABLES.search(data, start):
        header = data[start : head.start()].decode("latin-1")
        variables = [line.split() for line in head.group(1).decode("latin-1").splitlines()[1:] if line.strip()]
        count, said = len(variables), _field(header, "No. Points")
        if not (said.isascii() and said.isdigit()):
            raise SceneError(f"--against {quoted(path)}: no number of points in its header (No. Points)")
        if not count or not int(said):
            raise SceneError(f"--against {quoted(path)} has no {'points' if count else 'variables'} in one of its runs")
        cells = count * int(said) * (2 if "complex" in _field(header, "Flags") else 1)
        if head.group(2) == b"Binary":
            start = head.end() + 8 * cells
            held = min(cells, (len(data) - head.end()) // 8)
            values = np.frombuffer(data, "<f8", held, head.end()) if held else np.empty(0)
        else:
            following = data.find(b"Title:", head.end())
            start = len(data) if following < 0 else following
            values = _values(data[head.end() : start].decode("latin-1"), count)
        if plot not in _field(header, "Plotname").lower():
            continue
        if table is not None:
            raise SceneError(f"--against {quoted(path)} has several transient analyses: write one of them only")
        if values.size != cells:
            raise SceneError(f"--against {quoted(path)}: {values.size} numbers where its header tells of {cells}")
        units = (_UNITS.get(v[2].lower(), "") if len(v) > 2 else "" for v in variables)
        columns = zip((v[1] for v in variables), units, values.reshape(-1, count).T, strict=True)
        table = Table("ngspice raw file", tuple(Column(*column) for column in columns), spice=True)
    if table is None:
        raise SceneError(f"--against {quoted(path)} has no transient analysis that could be read")
    return table


def _values(text: str, count: int) -> np.ndarray:
    """Numbers of the values' section, less the number of each point, which stands before its first value."""
    cells = text.replace(",", " ").split()
    try:
        return np.array([float(cell) for k, cell in enumerate(cells) if k % (count + 1)])
    except ValueError:
        return np.empty(0)


def _field(header: str, name: str) -> str:
    match = re.search(rf"^{re.escape(name)}:[ \t]*(.*)$", header, re.MULTILINE)
    return match.group(1).strip() if match else ""
