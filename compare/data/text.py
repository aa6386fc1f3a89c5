"""Tables of numbers in text files, and lists of values.

A table is a block of rows of numbers. The last row of text above them has the names of the columns, or their units
below their names. Rows that start with "#" or "%" are remarks; the last remark has the names where no other row does.
Without names the first column is the time, in s.
"""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from compare.data.columns import Column, find_unit, make_column, parse_number
from scenes.errors import SceneError, contents, quoted, reason

LIST = "list of values"
"""The kind of a file of rows "probe, value"."""
_DIALECTS = (("\t", "."), ("\t", ","), (";", "."), (";", ","), (",", "."), (",", ","), (None, "."), (None, ","))
"""Separators (``None`` is blank space) and decimal marks; of equal ones the first is taken."""
_PAIR = re.compile(r"([-+]?[\d.]+(?:,\d+)?(?:[eEdD][-+]?\d+)?)\s*(?![\s\d.,])(.*)")
_HEADERS = r",(?! )", r"\t+|\s{2,}", r"(?<=[)\]])\s++(?=[A-Za-z])", r"[,;]?\s+", r"[,;]"
"""Separators of names in a header; inside a name without quotes a space follows the comma."""


def read_bytes(path: Path, option: str = "--against") -> bytes:
    """Read the content of a file of 200 MB at most. Raises SceneError."""
    try:
        return contents(path, 200, f"{option} {quoted(path)}", "export fewer rows")
    except OSError as error:
        raise SceneError(f"{option} {quoted(path)} cannot be read: {reason(error)}") from None


def read(data: bytes) -> tuple[str, list[Column]]:
    """Read the kind and the columns of a text file. Raises SceneError with the row that cannot be read."""
    text = _decode(data)
    remarks: list[str] = []
    lines: list[tuple[int, str]] = []
    for number, line in enumerate(text.splitlines(), 1):
        bare = line.strip().lstrip('"')
        if bare[:1] in ("%", "#") and parse_number(re.split(r"[\s,;]", bare)[0]) is None:
            remarks.append(line.strip().replace(bare[0], "", 1).strip())
        elif line.strip(" \t,;\r") and not (number == 1 and line.startswith("sep=")):
            lines.append((number, line))
    of_comsol = text.lstrip('" \r\n').startswith("%")
    if of_comsol and any(re.search(r" @ .*=", remark) or remark in ("Data", "Grid", "X") for remark in remarks):
        raise SceneError(
            "it has times or runs beside one another, as data exports of COMSOL (spreadsheet, sectionwise, grid) do: "
            "export a table of point evaluations, with a row for each time"
        )
    if any(line.startswith("Step Information:") for _, line in lines):
        raise SceneError("LTspice's text has several runs, from .step: export the text of one run")
    if not lines:
        raise SceneError("it has no rows: give a row of names with units, then numbers")
    try:
        if pairs := _read_pairs([line for _, line in lines]):
            return LIST, pairs
        columns = _read_block(lines, remarks, of_comsol)
    except csv.Error as error:
        raise SceneError(f"it is no table of numbers: {reason(error)}") from None
    return "COMSOL table" if of_comsol else "table", columns


def _decode(data: bytes) -> str:
    """Decode UTF-8, UTF-16 or else Windows' Western code page. Raises SceneError for other content."""
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        return data.decode("utf-16", "replace")
    if b"\0" in data[:4000]:
        raise SceneError("it is binary, but no raw file of ngspice or LTspice: save the table as text or CSV")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("cp1252", "replace")


def _split(line: str, separator: str | None) -> list[str]:
    """The cells of a row; ``None`` separates at blank space."""
    if separator and '"' in line:
        return [cell.strip() for cell in next(csv.reader([line], delimiter=separator, skipinitialspace=True))]
    return [cell.strip() for cell in line.split(separator)]


def _read_pairs(lines: Sequence[str]) -> list[Column]:
    """Columns of one row from rows "probe, value" or "probe, value, unit"; empty where there are other rows."""
    separator = next((mark for mark in "\t;,=" if any(mark in line for line in lines)), ",")
    columns: dict[str, Column] = {}
    for number, line in enumerate(lines):
        name, *cells = _split(line, separator)
        match = _PAIR.fullmatch(" ".join(filter(None, cells)))
        if not match or not name.strip("-+.0123456789,eE :/"):
            if number:
                return []
            continue  # The first row may have names.
        unit = match[2].strip("()[] ")
        if name in columns:
            raise SceneError(f"{quoted(name)} stands twice: give each probe one value")
        if unit and find_unit(unit) is None:
            raise SceneError(f"{quoted(name)} has an unknown unit {quoted(unit)}")
        value = parse_number(match[1].replace(",", "."))
        columns[name] = make_column(name, np.array([value], float), unit)
    return list(columns.values())


def _find_dialect(lines: Sequence[tuple[int, str]]) -> tuple[str | None, str, int, list[bool]]:
    """Separator, decimal mark, number of columns, and the columns of texts, by some 400 rows: most numbers win."""
    tried = []
    for separator, mark in _DIALECTS:
        sample = (_split(line, separator) for _, line in lines[:: len(lines) // 400 + 1])
        parsed = ([parse_number(cell, mark) for cell in cells] for cells in sample)
        rows = [row for row in parsed if len(row) > 1 and any(v is not None and v == v for v in row)]
        width = Counter(map(len, rows)).most_common(1)[0][0] if rows else 0
        columns = list(zip(*(row for row in rows if len(row) == width), strict=True))
        counts = [(column.count(None), sum(v is not None and v == v for v in column)) for column in columns]
        texts, numbers = (sum(count[n] for count in counts) for n in (0, 1))
        tried.append((numbers, -texts, (separator, mark, width, [t > n for t, n in counts])))
    return max(tried, key=lambda each: each[:2])[2]


def _read_block(lines: list[tuple[int, str]], remarks: list[str], of_comsol: bool) -> list[Column]:
    """The columns of the first block of numbers."""
    separator, mark, width, of_texts = _find_dialect(lines)
    rows: list[list[float]] = []
    head: list[str] = []
    pending: list[str] = []
    for number, line in lines:
        cells = _split(line, separator)
        values = [parse_number(cell, mark) for cell in cells]
        has_numbers = any(v is not None and v == v for v in values)
        fits = len(cells) == width and all(v is not None or t for v, t in zip(values, of_texts, strict=True))
        # A page of a listing repeats the header; another header starts another table.
        if rows and has_numbers and pending and (not head or pending[-1].split() != head[-1].split()):
            break
        if has_numbers and fits:
            head, pending = (head if rows else pending), []
            rows.append([np.nan if v is None else v for v in values])
        elif rows and has_numbers and (None not in values or (separator and len(cells) == width)):
            raise SceneError(f"row {number}: {quoted(line.strip())} is not {width} columns of numbers")
        elif line.strip("-=_*+| \t"):
            pending.append(line)
    if not rows:
        raise SceneError(f"it has no rows of numbers: its last row is {quoted(lines[-1][1].strip())}")
    matrix = np.array(rows)
    least = int(np.flatnonzero(~np.isnan(matrix).all(axis=0))[-1]) + 1
    if not head and remarks and (of_comsol or _split_names(remarks[-1], least, width, separator)):
        head = remarks
    if head:
        names, units = _read_names(head, least, width, separator)
    else:  # ngspice's wrdata may write the times before every vector.
        clocks = [k == 0 or bool((column == matrix[:, 0]).all()) for k, column in enumerate(matrix.T[:least])]
        names, units = [c * "time" or f"column {k}" for k, c in enumerate(clocks, 1)], [""] * least
    return [make_column(n or f"column {k + 1}", matrix[:, k], units[k]) for k, n in enumerate(names)]


def _read_names(head: list[str], least: int, most: int, separator: str | None) -> tuple[list[str], list[str]]:
    """The names and units of the columns from the rows above them."""
    last = _split_names(head[-1], least, most, separator)
    if last is None:
        raise SceneError(f"its header {quoted(head[-1].strip())} has another number of columns than the rows below it")
    units = [name.strip("()[] ") for name in last]
    if not any(units) or not all(u in ("", "-", "1") or find_unit(u) for u in units):
        return last, [""] * len(last)
    above = _split_names(head[-2], len(units), len(units), separator) if len(head) > 1 else None
    return above or units, units


def _split_names(line: str, least: int, most: int, separator: str | None) -> list[str] | None:
    """The names in a header row; ``None`` where no way to split the row gives ``least`` to ``most`` of them."""
    bare = line.strip("\r\n ")
    ways = [] if separator is None else [_split(bare, separator)]
    ways += [[name.strip('" ') for name in re.split(pattern, bare.strip())] for pattern in _HEADERS]
    for cells in ways:
        while len(cells) > least and not cells[-1]:
            cells.pop()
    return next((cells for cells in ways if least <= len(cells) <= most), None)
