"""ngspice's raw files, as text or binary, and what its `print` writes.

Thermal networks have temperatures for voltages: the volts of a node called after a quantity are taken for kelvins.
Source: the header of a raw file is "name: value" lines, then "Variables:" with number, name and type of each, then
"Values:" or "Binary:" with doubles point by point (Berkeley spice3, the same in ngspice).
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from scenes.errors import SceneError, quoted
from validate.against.columns import Column, Table, numbers

_UNITS = {"time": "s", "voltage": "V", "current": "A", "power": "W", "temperature": "K"}
_VARIABLES = re.compile(rb"^(Variables:.*?)^(Values|Binary):[ \t]*\r?\n", re.DOTALL | re.MULTILINE)
_PRINTED = re.compile(r"^Index\s+time\s+\S", re.MULTILINE)


def is_raw(data: bytes) -> bool:
    """Whether the content looks like a raw file."""
    head = data[:4000]
    return head.startswith(b"Title:") and b"Plotname:" in head


def is_printed(text: str) -> bool:
    """Whether the text looks like what `print` writes."""
    return bool(_PRINTED.search(text[:20000]))


def read_raw(path: Path, data: bytes) -> Table:
    """The columns of the transient analysis in a raw file; SceneError where there are none, or several."""
    start, table = 0, None
    while True:
        head = _VARIABLES.search(data, start)
        if head is None:
            break
        header = data[start : head.start()].decode("latin-1")
        variables = [line.split() for line in head.group(1).decode("latin-1").splitlines()[1:] if line.strip()]
        count, points = len(variables), _field(path, header, "No. Points")
        cells = count * points
        if "complex" in _text(header, "Flags"):
            cells *= 2
        if head.group(2) == b"Binary":
            end = head.end() + 8 * cells
            held = min(cells, (len(data) - head.end()) // 8)
            values = np.frombuffer(data, "<f8", held, head.end()) if held else np.empty(0)
        else:
            following = data.find(b"Title:", head.end())
            end = len(data) if following < 0 else following
            values = _values(data[head.end() : end].decode("latin-1"), count)
        start = end
        if "transient" not in _text(header, "Plotname").lower():
            continue
        if table is not None:
            raise SceneError(f"--against {quoted(path)} has several transient analyses: write one of them only")
        if values.size != cells:
            raise SceneError(f"--against {quoted(path)}: {values.size} numbers where its header tells of {cells}")
        names = ((v[1], _UNITS.get(v[2].lower(), "") if len(v) > 2 else "") for v in variables)
        found = values.reshape(points, count)
        columns = tuple(Column(name, unit, found[:, i]) for i, (name, unit) in enumerate(names))
        table = Table("ngspice raw file", columns, spice=True)
    if table is None:
        raise SceneError(f"--against {quoted(path)} has no transient analysis that could be read")
    return table


def read_printed(path: Path, text: str) -> Table:
    """The columns of the first table of `print`, which repeats its header on each page."""
    names: list[str] = []
    rows: list[list[str]] = []
    lines: list[int] = []
    notes: tuple[str, ...] = ()
    for number, line in enumerate(text.splitlines(), 1):
        cells = line.split()
        if cells[:2] == ["Index", "time"]:
            if names and cells[1:] != names:
                notes = (f"what is printed from line {number} on ({', '.join(cells[1:5])}) is left out",)
                break
            names = cells[1:]
        elif names and len(cells) == len(names) + 1 and cells[0].isdigit():
            rows.append(cells[1:])
            lines.append(number)
    found = numbers(path, rows, lines)
    columns = (Column(name, unit_of_name(name), found[:, i]) for i, name in enumerate(names))
    return Table("ngspice print", tuple(columns), spice=True, notes=notes)


def _values(text: str, count: int) -> np.ndarray:
    """Numbers of the values' section, less the number of each point, which stands before its first value."""
    cells = text.replace(",", " ").split()
    step = count + 1
    kept = [cell for k, cell in enumerate(cells) if k % step]
    try:
        return np.array([float(cell) for cell in kept])
    except ValueError:
        return np.empty(0)


def unit_of_name(name: str) -> str:
    """The unit of a vector: SPICE writes none."""
    lower = name.lower()
    if lower == "time":
        return "s"
    return "A" if lower.startswith("i(") or lower.endswith(("#branch", "[i]")) else "V"


def _text(header: str, name: str) -> str:
    found = re.search(rf"^{re.escape(name)}:[ \t]*(.*)$", header, re.MULTILINE)
    return found.group(1).strip() if found else ""


def _field(path: Path, header: str, name: str) -> int:
    said = _text(header, name)
    if not said.isdigit():
        raise SceneError(f"--against {quoted(path)}: no number of points in its header ({name})")
    return int(said)
