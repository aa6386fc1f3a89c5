"""Tables of numbers in text files.

A table is a block of rows of numbers. The last row of text above them has the names of the columns, or their units
below their names. Rows that start with "#" or "%" are remarks; the last remark has the names where no other row does.
"""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from compare.data import raw
from compare.data.columns import SHEET_ERROR, Column, find_unit, make_column, parse_number, split_unit
from scenes.errors import SceneError, contents, printable, quoted, reason

_LARGEST = 200  # MB of a file at most.
_LONGEST_LIST = 100_000  # Bytes of a list of steady values at most; a scene has some hundred probes.
_SAMPLE = 400  # Rows that decide on separators and decimal marks.
_DIALECTS = (("\t", "."), ("\t", ","), (";", "."), (";", ","), (",", "."), (",", ","), (None, "."), (None, ","))
"""Separators (``None`` is blank space) and decimal marks; of equal ones the first is taken."""
_RULE = re.compile(r"[-=_*+|\s]+")
_WRDATA = re.compile(r"(?:[ -]\d\.\d+e[+-]\d{2,3} )+")
_PAIR = re.compile(r"([-+]?[\d.]+(?:,\d+)?(?:[eEdD][-+]?\d+)?)(?:\t([^\t]*)| *([^\t]*))")
_STEP = re.compile(r"Step Information:(.*?)(?:\(|$)")
_SPICE_FACTORS = {"t": 1e12, "g": 1e9, "meg": 1e6, "k": 1e3, "m": 1e-3, "u": 1e-6, "µ": 1e-6, "n": 1e-9, "p": 1e-12,
                  "f": 1e-15}  # fmt: skip
_HEADERS = (
    r",(?! )",  # Inside a name without quotes a space follows the comma.
    r"\t+|\s{2,}",
    r"(?<=[)\]])\s++(?=[A-Za-z])",  # Each name but the first starts after the bracket of a unit or a place.
    r"(?<!\s)\s++(?=\S+ [(\[])",  # Each name but the first stands before a unit.
    r"\s+",
    r"[,;]",
)
"""Separators of names in a header. Possessive blanks (++) keep the time linear in their number."""


def read_bytes(path: Path, option: str = "--against") -> bytes:
    """Read the content of a file. Raises SceneError."""
    try:
        return contents(path, _LARGEST, f"{option} {quoted(path)}", "export fewer rows")
    except OSError as error:
        raise SceneError(f"{option} {quoted(path)} cannot be read: {reason(error)}") from None


def _decode(data: bytes) -> str:
    """Decode UTF-8, UTF-16 or else Windows' Western code page. Raises SceneError for other content."""
    if data.startswith((b"PK\3\4", b"\xd0\xcf\x11\xe0")):
        raise SceneError("it is a workbook or an archive: save the table as text or CSV")
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        return data.decode("utf-16", "replace")
    if b"\0" in data[:4000]:
        raise SceneError("it is binary, but no raw file of ngspice or LTspice: export text")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("cp1252", "replace")


def read(data: bytes) -> tuple[str, list[Column]]:
    """Read the kind and the columns of a text file. Raises SceneError with the row that cannot be read."""
    remarks: list[str] = []
    lines: list[tuple[int, str]] = []
    text = _decode(data)
    for number, line in enumerate(text.splitlines(), 1):
        bare = line.strip().lstrip('"')
        if bare.startswith("%") or (bare.startswith("#") and not SHEET_ERROR.match(bare)):
            remarks.append(line.strip().replace(bare[0], "", 1).strip())
        elif line.strip(" \t,;\r") and not (number == 1 and line.startswith("sep=")):
            lines.append((number, line))
    of_comsol = text.lstrip('" \r\n').startswith("%")
    if of_comsol and any(re.fullmatch(r"(Data\b.*|Grid|Coordinates|X)", remark) for remark in remarks):
        return "COMSOL data export", raw.arrange(raw.read_sections(text), remarks)
    if not lines:
        raise SceneError("it has no rows: give a row of names with units, then numbers")
    try:
        return _read_block(lines, remarks, of_comsol)
    except csv.Error as error:
        raise SceneError(f"it is no table of numbers: {reason(error)}") from None


def _parse(cells: Sequence[str], mark: str) -> list[float | None]:
    """The numbers of cells, ``None`` for texts."""
    values: list[float | None] = []
    for cell in cells:
        try:
            values.append(parse_number(cell, mark))
        except ValueError:
            values.append(None)
    return values


def _split_cells(line: str, separator: str | None) -> list[str]:
    """The cells of a row; ``None`` separates at blank space."""
    if separator is None:
        return line.split()
    if '"' in line:
        return [cell.strip() for cell in next(csv.reader([line], delimiter=separator, skipinitialspace=True))]
    return [cell.strip() for cell in line.split(separator)]


def _find_dialect(lines: Sequence[tuple[int, str]]) -> tuple[str | None, str, int, list[bool]]:
    """Separator, decimal mark, number of columns, and the columns of texts, by the rows of most numbers."""
    sample = [line for _, line in lines[:: len(lines) // _SAMPLE + 1]]
    best: tuple[str | None, str, int, list[bool]] = (None, ".", 0, [False])
    score = (0, 0)
    for separator, mark in _DIALECTS:
        rows = [_parse(_split_cells(line, separator), mark) for line in sample]
        rows = [row for row in rows if len(row) > 1 and any(x == x and x is not None for x in row)]
        if not rows:
            continue
        width = Counter(map(len, rows)).most_common(1)[0][0]
        columns = list(zip(*(row for row in rows if len(row) == width), strict=True))
        texts = [column.count(None) for column in columns]
        numbers = [sum(x is not None and x == x for x in column) for column in columns]
        if (sum(numbers), -sum(texts)) > score:
            score = sum(numbers), -sum(texts)
            best = separator, mark, width, [t > n for t, n in zip(texts, numbers, strict=True)]
    return best


def _read_block(lines: list[tuple[int, str]], remarks: list[str], of_comsol: bool) -> tuple[str, list[Column]]:
    """The block of numbers, its names and its units."""
    separator, mark, width, is_text = _find_dialect(lines)
    rows: list[list[float]] = []
    steps: list[dict[str, float]] = []
    head: list[str] = []
    pending: list[tuple[int, str]] = []
    step: dict[str, float] = {}
    for number, line in lines:
        if match := _STEP.match(line):
            step = _spice_assignments(match[1])
            continue
        cells = _split_cells(line, separator)
        values = _parse(cells, mark)
        is_wrong = any(v is None and not t for v, t in zip(values, is_text, strict=False))
        has_numbers = any(v is not None and v == v for v in values)
        # A page of a listing repeats the header; another header starts another table.
        if rows and has_numbers and pending and (not head or pending[-1][1].split() != head[-1].split()):
            break
        if has_numbers and len(cells) == width and not is_wrong:
            head, pending = (head if rows else [text for _, text in pending]), []
            rows.append([np.nan if v is None else v for v in values])
            steps.append(step)
        elif rows and has_numbers and (None not in values or (separator and len(cells) == width)):
            raise SceneError(f"row {number}: {quoted(line.strip())} is not {width} columns of numbers")
        elif not _RULE.fullmatch(line):
            pending.append((number, line))
    if not rows:
        raise SceneError(f"it has no rows of numbers: its last row is {quoted(lines[-1][1].strip())}")
    matrix = np.array(rows)
    used = int(np.flatnonzero(~np.isnan(matrix).all(axis=0))[-1]) + 1
    if not head and remarks and (of_comsol or _split_names(remarks[-1], used, width, separator)):
        head = remarks
    wrdata = bool(_WRDATA.fullmatch(lines[-1][1]))
    if not head:
        # The times of `wrdata` may stand before every vector.
        clocks = [wrdata and (k == 0 or (k % 2 == 0 and (matrix[:, k] == matrix[:, 0]).all())) for k in range(used)]
        made = [Column("time" if c else f"column {k + 1}", "s" if c else "", matrix[:, k], spice=wrdata)
                for k, c in enumerate(clocks)]  # fmt: skip
        return "ngspice wrdata" if wrdata else "table", made
    names, units = _read_names(head, used, width, separator)
    columns = [make_column(n or f"column {k + 1}", matrix[:, k], units[k]) for k, n in enumerate(names)]
    columns += [Column(name, "", np.array([s.get(name, np.nan) for s in steps])) for name in step]
    arranged = raw.arrange(columns, remarks if of_comsol else ())
    if of_comsol:
        kind = "COMSOL data export" if raw.find_places(columns) else "COMSOL table"
    else:
        kind = "SPICE table" if any(c.spice for c in columns) else "table" if separator is None else "CSV"
    return "ngspice wrdata" if wrdata else kind, arranged


def _read_names(head: list[str], least: int, most: int, separator: str | None) -> tuple[list[str], list[str]]:
    """The names and units of the columns from the rows above them."""
    last = _split_names(head[-1], least, most, separator)
    if last is None:
        raise SceneError(
            f'its header "{printable(head[-1].strip(), 120)}" has another number of columns than the {most} below it'
        )
    units = [name.strip("()[] ") for name in last]
    if any(units) and all(not u or u in ("-", "1") or find_unit(u) for u in units):
        above = _split_names(head[-2], len(units), len(units), separator) if len(head) > 1 else None
        return above or units, [u if find_unit(u) else "" for u in units]
    return last, [""] * len(last)


def _split_names(line: str, least: int, most: int, separator: str | None) -> list[str] | None:
    """The names in a header row; ``None`` where no way to split the row gives ``least`` to ``most`` of them."""
    bare = line.strip("\r\n ")
    ways = [] if separator is None else [_split_cells(bare, separator)]
    ways += [[name.strip('" ') for name in re.split(pattern, bare.strip())] for pattern in _HEADERS]
    for cells in ways:
        while len(cells) > least and not cells[-1]:
            cells.pop()
    return next((cells for cells in ways if least <= len(cells) <= most), None)


def _spice_assignments(text: str) -> dict[str, float]:
    """The parameters of LTspice's "Vapp=50m Rload=1K"."""
    pairs = re.findall(r"(\S+?)=([-+]?[\d.]+(?:e[-+]?\d+)?)(meg|[a-zµ]?)", text, re.IGNORECASE)
    return {name: float(value) * _SPICE_FACTORS.get(suffix.lower(), 1.0) for name, value, suffix in pairs}


def read_pairs(data: bytes) -> list[Column]:
    """Read rows "probe, value" or "probe, value, unit" as columns of one row; empty where the file has other rows."""
    lines = [line for line in _decode(data[:_LONGEST_LIST]).splitlines() if line.strip(" \t,;")]
    lines = [line for line in lines if line.lstrip()[0] not in "#%" and not line.startswith("sep=")]
    separator = next((mark for mark in "\t;" if any(mark in line for line in lines)), ",")
    rows = [[cell for cell in _split_cells(line, separator) if cell] or [""] for line in lines]
    pairs = [(name, _PAIR.fullmatch("\t".join(cells)), name.strip("-+.0123456789,eE ")) for name, *cells in rows]
    if not all(match and text for _, match, text in pairs[1:]):  # The first row may have names.
        return []
    columns: dict[str, Column] = {}
    for name, match, text in pairs:
        if not match or not text:
            continue
        value, unit = parse_number(match[1].replace(",", ".")), (match[2] or match[3] or "").strip("()[] ")
        if name in columns:
            raise SceneError(f"{quoted(name)} stands twice: give each probe one value")
        if unit and find_unit(unit) is None:
            raise SceneError(f"{quoted(name)} has an unknown unit {quoted(unit)}")
        columns[name] = Column(name, unit or split_unit(name)[1], np.array([value]))
    return list(columns.values())
