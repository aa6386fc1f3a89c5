"""Tables of rows that judge, as text, as a page in Markdown and as JSON."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from itertools import groupby
from typing import Any

from benchmarks.rows import Row
from compare.report.table import Row as Line
from compare.report.table import Section, Style, Table
from validate.report.summary import as_json

MARKS = {"as predicted": "unresolved", "skipped": ""}
VERDICTS = ("agrees", "differs", "unresolved", "as predicted", "skipped")


def counts(rows: Sequence[Row]) -> dict[str, int]:
    """Return the number of rows by verdict."""
    count: Counter[str] = Counter(row.verdict for row in rows)
    return {verdict: count[verdict] for verdict in VERDICTS}


def headline(rows: Sequence[Row]) -> str:
    """Return how many rows agree and how many do not."""
    number = counts(rows)
    words = {"differs": "differ", "unresolved": "unresolved", "as predicted": "fail as predicted", "skipped": "skipped"}
    others = [f"{number[verdict]} {word}" for verdict, word in words.items() if number[verdict]]
    return ", ".join([f"{number['agrees']} of {len(rows) - number['skipped']} rows agree", *others]) + "."


def text(rows: Sequence[Row], style: Style) -> str:
    """Return the tables for a terminal: the rows of a case below its name, with the notes of rows that do not agree."""
    parts = [style.paint(headline(rows), "heading")]
    for group, members in groupby(rows, lambda row: row.group):
        lines = []
        for case, each in groupby(members, lambda row: row.case):
            lines.append(Line([case]))
            lines += [_line(row) for row in each]
        table = Table(("", "found", "expected", "within"), lines)
        parts.append(Section(_title(group), [table]).text(style))
    return "\n\n".join(parts)


def _line(row: Row) -> Line:
    if row.skipped:
        return Line([f"  skipped: {row.note}"])
    agrees = row.verdict == "agrees"
    vague = f"only within {row.bound:.1e}, not {row.settled:.1e}" if row.verdict == "unresolved" else ""
    below = "" if agrees else ": ".join(filter(None, (row.verdict, vague, row.note)))
    return Line([_quantity(row), *_numbers(row)], MARKS.get(row.verdict, row.verdict), below)


def markdown(rows: Sequence[Row], title: str, about: str, versions: Mapping[str, str], more: str = "") -> str:
    """Return the page; it has ``more`` beside the headline."""
    programs = ", ".join(f"{name} {version}" for name, version in versions.items())
    lines = [f"# {title}", "", about, f"**{headline(rows)}**{more}", "", f"{programs}.", ""]
    heads = ("case", "quantity", "found", "expected", "within", "verdict", "note")
    for group, members in groupby(rows, lambda row: row.group):
        cells = [[row.case, _quantity(row), *_numbers(row), row.verdict, row.note] for row in members]
        lines += [f"## {_title(group)}", "", *Table(heads, cells, "<<>>><<").markdown()]
    return "\n".join(lines)


def document(rows: Sequence[Row], versions: Mapping[str, str], seconds: float) -> dict[str, Any]:
    """Return the rows as JSON."""
    listed = [asdict(row) | {"difference": row.difference, "verdict": row.verdict} for row in rows]
    content = {"schema": 2, "provenance": versions, "timing_s": seconds, "counts": counts(rows), "rows": listed}
    return {key: as_json(value) for key, value in content.items()}


def _title(group: str) -> str:
    return group[:1].upper() + group[1:]


def _quantity(row: Row) -> str:
    return f"{row.quantity} ({row.unit})" if row.unit else row.quantity


def _numbers(row: Row) -> tuple[str, str, str]:
    """Return value, expected value and bound, with digits down to a hundredth of the bound."""
    if row.skipped:
        return "", "", ""
    ratio = abs(row.expected) / row.bound if row.bound > 0 and row.expected else 1.0
    digits = min(max(math.ceil(math.log10(ratio)) + 2, 3), 12) if math.isfinite(ratio) and ratio > 0 else 3
    sign = "" if row.relation == "near" else f"{row.relation} "
    return f"{row.found:.{digits}g}", f"{sign}{row.expected:.{digits}g}", f"{row.bound:.3g}" if row.bound else ""
