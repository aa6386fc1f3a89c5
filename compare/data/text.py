"""Tables of numbers in text files, and lists of values.

A table is a block of rows of numbers. The last row of text above them has the names of the columns, or their units
below their names. Rows that start with "#" or "%" are remarks; the last remark has the names where no other row does.
Without names the first column is the time, in s.
"""

import csv
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from itertools import zip_longest
from math import inf, isfinite, isinf, nan
from pathlib import Path

import numpy as np

from compare.data.columns import Column, find_unit, make_column, parse_number, split_unit
from scenes.errors import SceneError, contents, quoted, reason

LIST = "list of values"
"""The kind of a file of rows "probe, value"."""
_DIALECTS = (("\t", "."), ("\t", ","), (";", "."), (";", ","), (",", "."), (",", ","), (None, "."), (None, ","))
"""Separators (``None`` is blank space) and decimal marks; of equal ones the first is taken."""
_PAIR = re.compile(r"([-+]?[\d.]+(?:,\d+)?(?:[eEdD][-+]?\d+)?|(?i:nan|n/?a)|-+)\s*(?![\s\d.,])(.*)")
_SENSORS = re.compile(r".*(?i:typ).*(\n(?i:type |tc[ -]?)?[BEJKNRST]?)+")
"""Cells of the types of thermocouples, which are neither names nor units."""
_BESIDE = re.compile(r'^"?%\s*(Data|Grid|X|.* @ .*=.*?)"?\s*$', re.MULTILINE)
"""Remarks of COMSOL's data exports."""
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
    if _BESIDE.search(text):
        raise SceneError(
            "it has times or runs beside one another, as data exports of COMSOL (spreadsheet, sectionwise, grid) do: "
            "export a table of point evaluations, with a row for each time"
        )
    if re.search("^Step Information:", text, re.MULTILINE):
        raise SceneError("LTspice's text has several runs, from .step: export the text of one run")
    remarks, lines = list[str](), list[tuple[int, str]]()
    for number, line in enumerate(text.splitlines(), 1):
        bare = line.strip().lstrip('"')
        if bare[:1] in ("%", "#") and not np.isnan(parse_number(re.split(r"[\s,;]", bare)[0])):
            remarks.append(line.strip().replace(bare[0], "", 1).strip())
        elif line.strip(" \t,;\r"):
            lines.append((number, line))
    if not lines:
        raise SceneError("it has no rows: give a row of names with units, then numbers")
    try:
        if pairs := _read_pairs([line.strip() for _, line in lines]):
            return LIST, pairs
        return _read_block(lines, remarks, of_comsol=text.lstrip('" \r\n').startswith("%"))
    except csv.Error as error:
        raise SceneError(f"it is no table of numbers: {reason(error)}") from None


def _decode(data: bytes) -> str:
    """Decode UTF-8, UTF-16 or else Windows' Western code page. Raises SceneError for other content."""
    if data.startswith((b"\xff\xfe", b"\xfe\xff")) or data[1:4:2] == b"\0\0":
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
    separator = next((m for m in "\t;,=:" if 2 * sum(m in line for line in lines) > len(lines)), None)
    columns, common = dict[str, Column](), None
    if 2 * sum(line[:1].isdigit() for line in lines) > len(lines):  # times or dates
        return []
    for number, line in enumerate(lines):
        name, *cells = _split(line, separator)
        match, name = _PAIR.fullmatch(" ".join([*filter(None, cells)][:2])), name.strip('" :')
        if not match or not name.strip("-+.0123456789,dDeETZ :/"):  # a number, a date or a time
            if number and re.search(r"\d", line):
                return []
            # Rows above the values may have names, and the unit of all values.
            common = next(filter(None, (split_unit(cell)[1] for cell in cells)), None)
            continue
        if name in columns:
            raise SceneError(f"{quoted(name)} stands twice: give each probe one value")
        column = make_column(name, np.array([parse_number(match[1].replace(",", "."))]), match[2].strip("()[] "))
        columns[name] = replace(column, unit=column.unit or common)
    return list(columns.values())


def _find_dialect(lines: Sequence[tuple[int, str]]) -> tuple[str | None, str, int, np.ndarray]:
    """Separator, decimal mark, number of columns, and the columns of texts, by some 400 rows: most numbers win."""
    tried, sample = [], [line for _, line in lines[:: len(lines) // 400 + 1]]
    for separator, mark in _DIALECTS:
        parsed = ([parse_number(cell, mark) for cell in _split(line, separator)] for line in sample)
        rows = [row for row in parsed if any(map(isfinite, row))]
        width = Counter(map(len, rows)).most_common(1)[0][0] if rows else 0
        table = np.array([row for row in rows if len(row) == width]).reshape(-1, max(width, 1))
        texts, numbers = np.isinf(table).sum(axis=0), np.isfinite(table).sum(axis=0)
        of_texts = (texts > numbers) | ((texts > 0) & (2 * numbers < len(table)))  # remarks beside a few first rows
        whole = table[~np.isinf(table[:, ~of_texts]).any(axis=1)]
        tried.append((np.isfinite(whole).sum(), -np.isinf(whole).sum(), width, (separator, mark, width, of_texts)))
    return max(tried, key=lambda each: each[:3])[-1]


def _read_block(lines: list[tuple[int, str]], remarks: list[str], of_comsol: bool) -> tuple[str, list[Column]]:
    """The kind of a table and the columns of its longest block of numbers."""
    separator, mark, width, of_texts = _find_dialect(lines)
    numeric = np.flatnonzero(~of_texts)
    blocks, pending = [(list[list[float]](), list[str]())], list[str]()
    for number, line in lines:
        cells, (rows, head) = _split(line, separator), blocks[-1]
        values = [parse_number(cell, mark) for cell in cells]
        has_numbers, texts = any(map(isfinite, values)), [isinf(value) for value in values]
        is_text = any(texts) and line.strip("-=_*+|,; \t")
        is_row = (rows and separator) or (len(cells) == width and all(isfinite(values[k]) for k in numeric[:1]))
        if any(texts) and is_row:  # A word such as "OPEN" is a missing number, but "1,234.5" is a wrong one.
            texts = [text and bool(re.search(r"\d", cell)) for text, cell in zip(texts, cells, strict=True)]
            values = [inf if text else nan if isinf(v) else v for text, v in zip(texts, values, strict=True)]
        # A page of a listing repeats the header; below another header that is not a remark another table starts.
        if rows and has_numbers and pending and pending[-1:] != head[-1:]:
            is_header = separator and len([*filter(None, _split(pending[-1], separator))]) == width
            if is_header or not rows[-1][0] < values[0] < inf:
                rows, head = list[list[float]](), list[str]()
                blocks.append((rows, head))
        if has_numbers and len(cells) == width and not any(texts[k] for k in numeric):
            head += [] if rows else pending
            pending = []
            rows.append(values)
        elif rows and has_numbers and (not any(texts) or (len(cells) == width and (separator or not texts[0]))):
            raise SceneError(f"row {number}: {quoted(line.strip())} is not {width} columns of numbers such as 1234.5")
        elif is_text:
            pending.append(line)
    rows, head = max(blocks, key=lambda block: len(block[0]))
    if not rows:
        raise SceneError(f"it has no rows of numbers: its last row is {quoted(lines[-1][1].strip())}")
    for line in head:
        label, *cells = _split(line, separator)
        factors = (parse_number(cell, mark) for cell in cells if label.lower() in ("scale", "factor", "multiplier"))
        if any(isfinite(factor) and factor != 1 for factor in factors):
            raise SceneError(f"{quoted(line)} may be factors of its columns: multiply by them, and delete this row")
    numbered = not head and width > 2 and rows[0] == [*range(width)]  # as pandas numbers columns without names
    matrix = np.array(rows[numbered:])
    matrix[:, np.isinf(matrix).any(axis=0)] = np.nan
    least = int(np.flatnonzero(~np.isnan(matrix).all(axis=0))[-1]) + 1
    above = [_split_names(line, least, width, separator) for line in (head or remarks)[-5:]]
    above = [cells for cells in above if not _SENSORS.fullmatch("\n".join(cells or ()))] or above
    if head + remarks * of_comsol and above[-1] is None:
        last = (head or remarks)[-1].strip()
        raise SceneError(f"its header {quoted(last)} has another number of columns than the rows below it: name each")
    names = [(name, "") for name in above[-1] or []] if above else []
    # Below the names their units may stand, and remarks below these.
    for upper, lower in zip(above[-2::-1], above[:0:-1], strict=False):
        units = [re.sub(r"(?i)^[(\[](.*)[)\]]$|^(units?|einheit)$", r"\1", unit) for unit in lower or []]
        known = [find_unit(unit) is not None for unit in units if unit not in ("", "-", "1")]
        is_plain = known[:1] == [True] or not any(map(isfinite, map(parse_number, upper or [])))
        if upper and is_plain and 2 * sum(known) > len(known):
            names = list(zip_longest(upper, units, fillvalue=""))
            break
    if not names:  # ngspice's wrdata may write the times before every vector.
        clocks = [k == 0 or bool((column == matrix[:, 0]).all()) for k, column in enumerate(matrix.T[:least])]
        names = [("time" * clock, "") for clock in clocks]
    places = enumerate(zip(matrix.T, names, strict=False), 1)
    kind = "COMSOL table" if of_comsol else "table" if len(blocks) == 1 else f"the longest of {len(blocks)} tables"
    return kind, [make_column(name or f"column {k}", values, unit) for k, (values, (name, unit)) in places]


def _split_names(line: str, least: int, most: int, separator: str | None) -> list[str] | None:
    """The names in a header row; ``None`` where no way to split the row gives ``least`` to ``most`` of them."""
    bare = line.strip("\r\n ")
    ways = [] if separator is None else [_split(bare, separator)]
    ways += [[name.strip('" ') for name in re.split(pattern, bare.strip())] for pattern in _HEADERS]
    ways.append(re.findall('"([^"]+)"', bare))
    for cells in ways:
        while len(cells) > least and cells[-1].lower() in ("", "comment"):  # LabVIEW has a column of comments.
            cells.pop()
    return next((cells for cells in ways if least <= len(cells) <= most), None)
