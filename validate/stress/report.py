"""What tests of robustness came to: rows of a table, as text, as a page in markdown and as JSON."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any, Literal

from validate.report.table import Style, Table, wrapped
from validate.verify.report import as_document, page

ABOUT = """\
The table of one run of `validate stress`, which is what wrote this page. A row says what was run, over which extremes,
and the worst that was found of a measure that should stay below the bound; what breaks says so. "As predicted" marks
methods that are not this toolkit's and are there to be compared with: Crank-Nicolson rings, explicit Euler blows up.
"""
_MARKS = {"holds": "agrees", "breaks": "differs", "failed": "differs", "as predicted": "unresolved"}


Outcome = Literal["holds", "breaks", "as predicted", "failed"]


@dataclass(frozen=True)
class Row:
    """A measure that should stay below a bound.

    ``what`` was run over ``extremes``; ``measure`` names the worst number found, ``found``, and ``bound`` its limit.
    ``ours`` is false for methods that are only there to be compared with: that one of them breaks is a finding, not a
    fault. ``said`` tells more: where the worst is, what broke.
    """

    group: str
    what: str
    extremes: str
    measure: str
    found: float
    bound: float
    ours: bool = True
    said: str = ""

    @property
    def verdict(self) -> Outcome:
        if math.isnan(self.found):
            return "failed"
        if self.found <= self.bound:
            return "holds"
        return "breaks" if self.ours else "as predicted"


def failed(group: str, what: str, error: BaseException) -> Row:
    return Row(group, what, "", "ended", math.nan, 0.0, True, f"{type(error).__name__}: {error}")


def broken(rows: Sequence[Row]) -> list[Row]:
    """The rows that break although they should hold."""
    return [row for row in rows if row.verdict in ("breaks", "failed")]


def headline(rows: Sequence[Row]) -> str:
    predicted, bad = sum(row.verdict == "as predicted" for row in rows), len(broken(rows))
    said = f"{len(rows) - predicted - bad} of {len(rows)} rows hold"
    said += f", {predicted} break as predicted" if predicted else ""
    return said + (f", {bad} break." if bad else ".")


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
    heads = ("what", "extremes", "measure", "found", "bound", "verdict", "")
    tables = []
    for group, of_group in groupby(rows, lambda row: row.group):
        cells = [
            (row.what, row.extremes, row.measure, f"{row.found:.3g}", f"{row.bound:.3g}", row.verdict, row.said)
            for row in of_group
        ]
        tables.append((group.capitalize(), Table(heads, cells, "<<<>><<")))
    return page("Numerical stability and robustness", ABOUT, f"**{headline(rows)}** Seed {seed}.", versions, tables)


def document(rows: Sequence[Row], versions: dict[str, str], seconds: float) -> dict[str, Any]:
    return as_document(rows, versions, seconds, ("verdict",), broken=len(broken(rows)))
