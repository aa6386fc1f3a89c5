"""What tests of robustness came to: rows of a table, and how it tells them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from compare.report.table import Row as Line
from compare.report.table import Table
from validate.report.verdicts import Report

ABOUT = """\
The table of one run of `validate stress`, which is what wrote this page. A row says what was run, over which extremes,
and the worst that was found of a measure that should stay below the bound; what breaks says so. "As predicted" marks
methods that are not this toolkit's and are there to be compared with: Crank-Nicolson rings, explicit Euler blows up.
A finer solve of a random scene is ten times finer, of a plate four times, with laws of the temperature three times; its
own error counts too.
"""
_MARKS = {"holds": "agrees", "breaks": "differs", "failed": "differs", "as predicted": "unresolved"}


Outcome = Literal["holds", "breaks", "as predicted", "failed"]


@dataclass(frozen=True)
class Row:
    """A measure that should stay below a bound.

    ``what`` was run over ``extremes``; of the ``measure`` ``worst`` is the worst number and ``bound`` the limit.
    ``ours`` is false for methods that are only there to be compared with: that one of them breaks is a finding, not a
    fault. ``said`` tells more: where the worst is, what broke.
    """

    group: str
    what: str
    extremes: str
    measure: str
    worst: float
    bound: float
    ours: bool = True
    said: str = ""

    @property
    def verdict(self) -> Outcome:
        if math.isnan(self.worst):
            return "failed"
        if self.worst <= self.bound:
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


def _short(rows: Sequence[Row]) -> Table:
    """For a terminal: the numbers, and below them what they are of."""
    lines = []
    for row in rows:
        said = "; ".join(filter(None, (row.measure, row.extremes, row.said)))
        said = said if row.verdict == "holds" else f"{row.verdict}: {said}"
        lines.append(Line([row.what, f"{row.worst:.3g}", f"{row.bound:.3g}"], _MARKS[row.verdict], said))
    return Table(("", "found", "at most"), lines)


def _full(rows: Sequence[Row]) -> Table:
    cells = [
        (row.what, row.extremes, row.measure, f"{row.worst:.3g}", f"{row.bound:.3g}", row.verdict, row.said)
        for row in rows
    ]
    return Table(("what", "extremes", "measure", "found", "bound", "verdict", ""), cells, "<<<>><<")


TABLE = Report[Row](
    "Numerical stability and robustness", ABOUT, headline, lambda row: row.group.capitalize(), _short, _full,
    ("verdict",), lambda rows: {"broken": len(broken(rows))},
)  # fmt: skip
