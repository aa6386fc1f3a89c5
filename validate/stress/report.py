"""The table of the stress tests as text, as a page in markdown and as JSON."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby
from typing import Any

from validate.report.table import Style, Table, wrapped
from validate.stress.rows import Row

ABOUT = """\
The table of one run of `validate stress`, which is what wrote this page. A row says what was run, over which extremes,
and the worst that was found of a measure that should stay below the bound; what breaks says so. "As predicted" marks
methods that are not this toolkit's and are there to be compared with: Crank-Nicolson rings, explicit Euler blows up.
"""
_MARKS = {"holds": "agrees", "breaks": "differs", "failed": "differs", "as predicted": "unresolved"}


def broken(rows: Sequence[Row]) -> list[Row]:
    """The rows that break although they should hold."""
    return [row for row in rows if row.verdict in ("breaks", "failed")]


def headline(rows: Sequence[Row]) -> str:
    """The outcome in one line."""
    bad = broken(rows)
    said = f"{sum(row.verdict == 'holds' for row in rows)} of {len(rows)} rows hold"
    predicted = sum(row.verdict == "as predicted" for row in rows)
    said += f", {predicted} break as predicted" if predicted else ""
    return said + (f", {len(bad)} break." if bad else ".")


def text(rows: Sequence[Row], style: Style) -> str:
    """The table for a terminal, 80 columns wide."""
    lines = [style.paint(headline(rows), "heading")]
    for group, of_group in groupby(rows, lambda row: row.group):
        lines += ["", style.paint(group.capitalize(), "heading")]
        for row in of_group:
            kind = _MARKS[row.verdict]
            about = f"{row.what}: {row.extremes}" if row.extremes else row.what
            lines.append(f"  {style.mark(kind)} {wrapped(about, '', '    ')}")
            numbers = f"{row.measure} {row.found:.3g} (at most {row.bound:.3g}), {row.verdict}"
            lines.append(wrapped("; ".join(filter(None, (numbers, row.said))), "      ", "      "))
    return "\n".join(lines)


def markdown(rows: Sequence[Row], versions: dict[str, str], seed: int) -> str:
    """The page of the documentation."""
    lines = ["# Numerical stability and robustness", "", ABOUT, f"**{headline(rows)}** Seed {seed}.", ""]
    lines += [", ".join(f"{name} {value}" for name, value in versions.items()) + ".", ""]
    for group, of_group in groupby(rows, lambda row: row.group):
        heads = ("what", "extremes", "measure", "found", "bound", "verdict", "")
        cells = [
            (row.what, row.extremes, row.measure, f"{row.found:.3g}", f"{row.bound:.3g}", row.verdict, row.said)
            for row in of_group
        ]
        lines += [f"## {group.capitalize()}", "", *Table(heads, cells, "<<<>><<").markdown()]
    return "\n".join(lines)


def document(rows: Sequence[Row], versions: dict[str, str], seconds: float) -> dict[str, Any]:
    """The table as JSON types."""
    from dataclasses import asdict

    from validate.report.summary import as_json

    found = as_json({
        "schema": 1, "provenance": versions, "timing_s": seconds, "broken": len(broken(rows)),
        "rows": [asdict(row) | {"verdict": row.verdict} for row in rows],
    })  # fmt: skip
    assert isinstance(found, dict)
    return found
