"""Raw files of ngspice and LTspice, as text or binary.

The header of a raw file is "name: value" lines, then "Variables:" with number, name and type of each, then "Values:"
or "Binary:" with the numbers point by point (Berkeley spice3). LTspice writes its header in UTF-16, values other than
the time as single precision, and marks times of interpolated points with a minus sign.
"""

import re

import numpy as np

from compare.data.columns import Column, find_unit, parse_number
from scenes.errors import SceneError, quoted

_UNITS = {"voltage": "V", "current": "A", "time": "s", "power": "W", "temperature": "K"}
"""Units by a part of a variable's type, such as device_current."""
_VARIABLES = re.compile(rb"^(Variables:.*?)^(Values|Binary):[ \t]*\r?\n", re.DOTALL | re.MULTILINE)


def is_raw(data: bytes) -> bool:
    """Return whether the content of a file is a raw file."""
    head = data[:8000].replace(b"\0", b"")
    return head.startswith(b"Title:") and b"Plotname:" in head


def read(data: bytes, plot: str = "transient") -> tuple[str, list[Column]]:
    """Read the kind of a file, and the columns of its one analysis that a pattern ``plot`` finds. Raises SceneError."""
    data, start, names, columns = _with_plain_headers(data), 0, [], list[Column]()
    while head := _VARIABLES.search(data, start):
        fields = dict(re.findall(r"^([^:\n]+):[ \t]*(.*?)\s*$", data[start : head.start()].decode("latin-1"), re.M))
        split = (line.split() for line in head[1].decode("latin-1").splitlines()[1:])
        variables = [words for words in split if len(words) > 1]
        points, flags = fields.get("No. Points", ""), fields.get("Flags", "")
        if not (points.isascii() and points.isdigit() and int(points) and variables):
            raise SceneError(f"a run with {len(variables)} variables and {quoted(points)} points (No. Points) is none")
        if "fastaccess" in flags.lower():
            raise SceneError("it is in LTspice's fast access format: simulate again without it, or export the text")
        if parse_number(offset := fields.get("Offset", "0")):
            raise SceneError(f"its times count from {offset} s (Offset), where LTspice began to save: save from 0 on")
        width = len(variables) * (2 if "complex" in flags else 1)
        if head[2] == b"Binary":
            is_single = "LTspice" in fields.get("Command", "") and "double" not in flags and "complex" not in flags
            row = np.dtype([("first", "<f8"), ("rest", "<f4" if is_single else "<f8", (width - 1,))])
            rows = np.frombuffer(data, row, min(int(points), (len(data) - head.end()) // row.itemsize), head.end())
            values = np.column_stack([rows["first"], rows["rest"]])
            start = head.end() + row.itemsize * int(points)
        else:
            following = data.find(b"Title:", head.end())
            start = len(data) if following < 0 else following
            values = _read_values(data[head.end() : start].decode("latin-1"), width, int(points))
        names.append(fields.get("Plotname", ""))
        if not re.search(plot, names[-1].lower()):
            continue
        if columns:
            raise SceneError(f"there are several analyses, {', '.join(map(quoted, names))}: write one of them only")
        if len(values) != int(points):
            raise SceneError(f"the file is cut off after {len(values)} of {points} points")
        for (_, name, *types), column in zip(variables, values.T, strict=False):
            unit = next((unit for kind, unit in _UNITS.items() if kind in "".join(types).lower()), "")
            # A transient analysis has no times below zero: the minus sign is LTspice's mark.
            columns.append(Column(name, find_unit(unit), np.abs(column) if unit == "s" else column, spice=True))
    if not columns:
        listed = f" but {', '.join(map(quoted, names[:4]))}" if names else ""
        raise SceneError(f"there is no {plot.replace('|', ' or ')} analysis{listed}: export one")
    return "raw file", columns


def _with_plain_headers(data: bytes) -> bytes:
    """Recode the UTF-16 header of LTspice as Latin-1; the numbers of a binary file stay."""
    if data[1:2] != b"\0":
        return data
    end = re.search(rb"B\0i\0n\0a\0r\0y\0:\0(\r\0)?\n\0", data)
    at = len(data) if end is None else end.end()
    return data[:at].decode("utf-16-le", "replace").encode("latin-1", "replace") + data[at:]


def _read_values(text: str, width: int, points: int) -> np.ndarray:
    """(points, width): numbers of a text, without the number of the point before its first value and what follows."""
    cells = text.replace(",", " ").split()[: points * (width + 1)]
    try:
        values = np.array([float(cell) for k, cell in enumerate(cells) if k % (width + 1)])
    except ValueError:
        return np.empty((0, width))
    return values[: len(values) // width * width].reshape(-1, width)
