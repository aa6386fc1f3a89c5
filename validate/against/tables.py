"""Columns of numbers as files have them: a name, the unit that stands with it, and the values.

COMSOL's exports have header rows that start with a percent sign, the last of which names the columns; written as text
(columns apart by spaces) or as CSV. Names hold their unit in brackets, a point's place after a comma, and what a column
was solved for after an "@": "Temperature (K), Point: (0, 5E-4, 1E-6)", "T (K) @ t=1E-3, V0=0.5". A table has a row for
every time; a data export has one for every point, and a column for every time.

Plain tables are a row of names with units, then numbers; apart by commas, semicolons, tabs or spaces. ngspice's
`wrdata` and LTspice's export are such tables too: they name vectors without units, or not at all, and may repeat the
time before every vector. Thermal networks have temperatures for voltages: the volts of a node called after a quantity
are taken for kelvins. What ngspice's `print` writes repeats its header on each page; its raw files, as text or binary,
are read in `raw` beside this.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from scenes.errors import SceneError, printable, quoted, reason
from scenes.files import contents
from scenes.units import Unit, UnitError, parse_unit
from validate.against.cells import are_numbers, cells_of, fitted, is_blank, numbers, separator_of

_LARGEST = 200  # MB of a file at most.
_MOST_POINTS = 200  # Points of a COMSOL table at most.
_UNITS = (
    re.compile(r"(?:^|(?<=\s))\(([^()\[\]]{1,20})\)"),
    re.compile(r"\[([^()\[\]]{1,20})\]"),
    re.compile(r"\(([^()\[\]]{1,20})\)"),
    re.compile(r"(?<!\s)\s*+/\s*+([^\s/()\[\]]{1,20})$"),
    re.compile(r"_([^\W_]{1,20})$"),
)
"""Where a column's name has its unit, surest first: "maxop1(T) (K)", "peak [K]", "T(K)", "T / K", "peak_K"."""

_SPACED = (
    r"\t+|\s{2,}",
    # Each name but the first starts after what closes the one before, a unit or a place.
    r"(?<=[)\]])\s++(?=[A-Za-z])",
    # Each name but the first stands before a unit.
    r"(?<!\s)\s++(?=\S+ [(\[])",
    r"\s+",
)
"""What separates two names in a header that blanks separate. Blanks are matched whole or not at all (++), as else a
long run of them would be tried at every length from every place."""
_PRINTED = re.compile(r"^Index\s+time\s+\S", re.MULTILINE)
_WRDATA = re.compile(r"(?:[ -]\d\.\d+e[+-]\d{2,3} )+")
_VECTOR = re.compile(r"[vi]\(|.*#branch$|@", re.IGNORECASE)


@dataclass(frozen=True)
class Column:
    """One column: its header less what follows an " @ ", its unit ("" where it has none), its values, the parameters
    behind the "@" by name, as they are written: {"V0": "0.5"}; and which of its rows are empty, nowhere if nothing is
    said. An empty cell is not a number among the values."""

    name: str
    unit: str
    values: np.ndarray
    at: tuple[tuple[str, str], ...] = ()
    empty: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=bool))

    def of_rows(self, rows: np.ndarray) -> Column:
        """The same of some of its rows, which are true."""
        return replace(self, values=self.values[rows], empty=self.empty[rows] if self.empty.size else self.empty)


@dataclass(frozen=True)
class Table:
    """The columns of a file, and its kind in words.

    ``spice`` says that temperatures may be volts, ``unnamed`` that the file names no columns, and ``notes`` what was
    left out of the file."""

    kind: str
    columns: tuple[Column, ...]
    spice: bool = False
    unnamed: bool = False
    notes: tuple[str, ...] = ()


def read(path: Path, data: bytes) -> Table:
    """The columns of a file that holds text; SceneError where they can't be told, saying why."""
    text = _text(path, data)
    try:
        if text.lstrip().lstrip('"').startswith("%"):
            return _comsol(path, text)
        return _printed(path, text) if _PRINTED.search(text[:20000]) else _plain(path, text)
    except csv.Error as error:
        raise SceneError(f"--against {quoted(path)} is no table of numbers: {reason(error)}") from None


def is_time(column: Column) -> bool:
    """Whether a column is the time by its name and unit."""
    words = re.findall(r"[a-z]+", column.name.lower())
    return has_time(column) and ("time" in words or words[:1] == ["t"])


def has_time(column: Column) -> bool:
    unit = unit_of(column.unit)
    return unit is not None and unit.powers == parse_unit("s").powers


def split(header: str) -> tuple[str, str]:
    """A header without its unit, and the unit; "" where it has none."""
    for place in _UNITS:
        for match in place.finditer(header):
            if unit_of(match.group(1)) is not None:
                rest = f"{header[: match.start()]} {header[match.end() :]}"
                return " ".join(rest.split()), match.group(1).strip()
    return header, ""


def unit_of(text: str) -> Unit | None:
    """A unit, or ``None`` where the text is none."""
    spelled = text.strip().replace("°", "deg").replace("\N{MASCULINE ORDINAL INDICATOR}", "deg")
    if not spelled or spelled[0].isdigit():
        return None
    try:
        return parse_unit("degC" if spelled in ("C", "oC", "degc", "deg C") else spelled)
    except UnitError:
        return None


def in_si(values: np.ndarray, unit: Unit) -> np.ndarray:
    """Numbers in a unit as SI values; temperatures as absolute ones."""
    return values * float(unit.factor) + (273.15 if unit.celsius else 0.0)


def read_bytes(path: Path) -> bytes:
    """The content of a file; SceneError where it can't be had."""
    try:
        return contents(path, _LARGEST, f"--against {quoted(path)}", "export fewer rows")
    except OSError as error:
        raise SceneError(f"--against {quoted(path)} cannot be read: {reason(error)}") from None


def _text(path: Path, data: bytes) -> str:
    """The text that a file's content is: UTF-8 or 16, or else Latin-1, as older programs write."""
    if data.startswith(b"PK\3\4"):
        raise SceneError(f"--against {quoted(path)} is a workbook or an archive: save the table as text or CSV")
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        return data.decode("utf-16", "replace")
    if b"\0" in data[:4000]:
        raise SceneError(f"--against {quoted(path)} is binary, but no ngspice raw file: export a table as text")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def _column(header: str, values: np.ndarray, *empty: np.ndarray) -> Column:
    """A column from its header: "Temperature (degC), Point 1", "peak [K]", "T (K) @ V0=0.5"."""
    name, _, behind = " ".join(header.split()).partition(" @ ")
    pairs = (part.partition("=") for part in re.sub(r"^\d+:\s*", "", behind).split(","))
    at = tuple((k.strip(), v.strip()) for k, equals, v in pairs if equals)
    return Column(name, split(name)[1], values, at, *empty)


def _names(line: str, count: int, separator: str | None) -> list[str] | None:
    """The names in a header row above rows whose cells are apart by ``separator`` (``None`` is any blank space);
    ``None`` where no way of reading it gives ``count`` of them."""
    bare = line.strip() if separator is None else line.strip("\r\n ")
    if separator is None:
        ways = [[name.strip('"') for name in re.split(pattern, bare)] for pattern in _SPACED]
    else:
        ways = [cells_of(bare, separator)]
        if separator == ",":
            # Inside a name without quotes a comma is followed by a space.
            ways.append([name.strip('"') for name in re.split(r",(?! )", bare)])
    # A separator may stand behind the last name, too.
    return next((cells[:count] for cells in ways if len(cells) >= count and not any(cells[count:])), None)


def _comsol(path: Path, text: str) -> Table:
    head, body, lines = [], [], []
    for number, line in enumerate(text.splitlines(), 1):
        if line.lstrip('" \t').startswith("%"):
            head.append(line.strip())
        elif line.strip():
            body.append([cell.strip().strip('"') for cell in (line.split(",") if "," in line else line.split())])
            lines.append(number)
            commas = "," in line
    matrix, _ = numbers(f"--against {quoted(path)}", body, lines, ",")
    # The percent sign may stand inside the first name's quotes or before them.
    last = ('"' if head[-1].startswith('"') else "") + head[-1].lstrip('"').removeprefix("%").strip()
    named = _names(last, matrix.shape[1], "," if commas else None)
    if named is None:
        raise SceneError(
            f"--against {quoted(path)}: its last header row names another number of columns than the {matrix.shape[1]} "
            f'below it: "{printable(head[-1], 120)}"'
        )
    columns = tuple(_column(name, values) for name, values in zip(named, matrix.T, strict=True))
    return _by_point(path, columns, head) if any("t" in dict(c.at) for c in columns) else Table("COMSOL table", columns)


def _by_point(path: Path, columns: tuple[Column, ...], head: list[str]) -> Table:
    """A data export turned round: for every point (a row) and expression a column over the times behind the "@"."""
    units = (re.search(r"Length unit[:,\s\"]+([^\s\",]+)", line) for line in head)
    length = next((unit for match in units if match and (unit := unit_of(match.group(1)))), None)
    places = {
        split(c.name)[0].lower(): c.values * (float(length.factor) if length else 1.0)
        for c in columns if split(c.name)[0].lower() in "xyz"
    }  # fmt: skip
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
        try:
            time = float(at["t"])
        except ValueError:
            raise SceneError(f"--against {quoted(path)}: t={quoted(at['t'])} in a header is not a number") from None
        others = tuple(pair for pair in c.at if pair[0] != "t")
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
            for row, course in enumerate(np.array([values[time] for time in times]).T):
                place = ", ".join(f"{places[axis][row]:.9g}" for axis in "xyz" if axis in places)
                header = f"{name}, Point: ({place})" if place else name
                made.append(Column(header, split(name)[1], course, others))
    return Table("COMSOL data export", tuple(made), notes=("times behind t= are taken in s",))


def _printed(path: Path, text: str) -> Table:
    """The first table of `print`."""
    names: list[str] = []
    rows, lines = [], []
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
    matrix, _ = numbers(f"--against {quoted(path)}", rows, lines, None)
    return Table("ngspice print", _vectors(names, matrix), spice=True, notes=notes)


def _vectors(names: Sequence[str], matrix: np.ndarray) -> tuple[Column, ...]:
    """Columns of SPICE, which writes no units."""

    def unit(name: str) -> str:
        if name == "time":
            return "s"
        return "A" if name.startswith("i(") or name.endswith(("#branch", "[i]")) else "V"

    return tuple(Column(name, unit(name.lower()), values) for name, values in zip(names, matrix.T, strict=True))


def _plain(path: Path, text: str) -> Table:
    """Rows that start with # are remarks, the last of which names the columns where nothing else does."""
    remarks: list[str] = []
    kept: list[tuple[int, str]] = []
    for number, line in enumerate(text.splitlines(), 1):
        if line.lstrip().startswith("#"):
            remarks.append(line.lstrip().lstrip("#"))
        elif not is_blank(line):
            kept.append((number, line))
    if not kept:
        raise SceneError(f"--against {quoted(path)} has no rows: give a row of names with units, then numbers")
    last, head = kept[-1][1], kept[0][1]
    separator = separator_of(last)
    names = cells_of(head, separator)
    headed = not are_numbers(names, separator)
    # Runs that are appended to a file bring their names with them.
    body = [(number, line) for number, line in kept[headed:] if line.strip() != head.strip() or not headed]
    rows = fitted([cells_of(line, separator) for _, line in body], len(names) if headed else 0)
    matrix, empty = numbers(f"--against {quoted(path)}", rows, [number for number, _ in body], separator)
    count = matrix.shape[1]
    named = _names(head, count, separator) if headed else None
    if headed and named is None:
        raise SceneError(f"--against {quoted(path)}: {len(names)} names for {count} columns")
    if not headed and remarks:
        named = _names(remarks[-1], count, None) or _names(remarks[-1], count, separator or ",")
    wrdata = bool(_WRDATA.fullmatch(last))
    if named is None:
        return _unnamed(matrix, empty, wrdata)
    columns = tuple(_column(*column) for column in zip(named, matrix.T, empty.T, strict=True))
    if named[0].lower() == "time" and not any(c.unit for c in columns):
        plain = [name.lower() for name in named]
        if wrdata or plain.count("time") > 1 or any(_VECTOR.match(name) for name in named):
            return Table("ngspice wrdata" if wrdata else "SPICE table", _vectors(named, matrix), spice=True)
    return Table("table" if separator is None else "CSV", columns)


def _unnamed(matrix: np.ndarray, empty: np.ndarray, wrdata: bool) -> Table:
    """Columns by their number; of `wrdata` the first is the time, and so may be every other one."""
    count = matrix.shape[1]
    units = [""] * count
    if wrdata:
        units = ["s"] + ["V"] * (count - 1)
        if count % 2 == 0 and (matrix[:, ::2] == matrix[:, :1]).all():
            units[::2] = ["s"] * (count // 2)
    names = ("time" if unit == "s" else f"column {i + 1}" for i, unit in enumerate(units))
    columns = (Column(*column) for column in zip(names, units, matrix.T, ((),) * count, empty.T, strict=True))
    return Table("ngspice wrdata" if wrdata else "table", tuple(columns), spice=wrdata, unnamed=True)


def pairs(name: str, text: str) -> dict[str, str]:
    """What stands in rows "probe, value", by probe; nothing where the text is no such list. A value may have a decimal
    comma where the two stand apart by a tab or a semicolon."""
    lines = [line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")]
    rows, mark = [["", ""]], ""
    for mark in ("\t", ";", ","):
        rows = fitted([cells_of(line, mark) for line in lines], 2)
        if rows and rows[0][0].lower() in ("probe", "quantity", "name"):
            rows = rows[1:]
        if all(len(row) == 2 for row in rows):
            break
    if any(len(row) != 2 or not row[0] or _is_number(row[0]) for row in rows):
        return {}
    if mark != ",":
        rows = [[probe, re.sub(r"^([-+]?\d+),(?=\d)", r"\1.", value)] for probe, value in rows]
    for n, (probe, _) in enumerate(rows):
        if probe in [other for other, _ in rows[:n]]:
            raise SceneError(f"--against {name}: {quoted(probe)} stands twice: give each probe one value")
    return {probe: value for probe, value in rows}


def _is_number(text: str) -> bool:
    try:
        float(text.replace(",", "."))
    except ValueError:
        return False
    return True
