"""What the code was found to give, next to what it should give: the rows of the table, of scenes that are solved for
some of them; and how the table tells them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Literal

import numpy as np

from compare.report.table import Row as Line
from compare.report.table import Table
from fem3d.runs import scene as scene_run
from scenes.model import Scene
from validate.report.verdicts import Report

TITLES = {
    "order in space": "Observed orders of convergence in space (they agree with theory within 0.1)",
    "order in time": "Observed orders of convergence in time (they agree with theory within 0.1)",
    "exact": "Exact solutions (each within its own estimated error, at 1e-4 or better)",
    "published": "Published benchmarks",
    "second code": "Second paths: independent codes",
}
ABOUT = """\
The table of one run of `validate verify`, which is what wrote this page. *Error* is the error that the solver itself
estimates for what it found, plus what is not known of the expected value (the rounding of a printed number, straight
lines in place of a sine). A row agrees where the difference is within that error, and the error is as small as was
asked for; observed orders agree within 0.1 of theory. Temperatures are in kelvin. Of a quantity with several values the
row has the one that is furthest off.

Manufactured solutions are made for this purpose: a smooth field is chosen, and loads on the interior and the faces are
computed such that it is the exact solution. The brick elements are those of the solver; hexahedra are scikit-fem's in
the second path, `validate/verify/reference.py`. L2 and H1 are norms of the error of the whole field.
"""
Outcome = Literal["agrees", "differs", "unresolved", "skipped"]
ORDER_TOLERANCE = 0.1  # that an observed order may be off from theory
ACCURACY = 1e-4  # asked of the solver
SETTLED = 1e-4  # of the scale: the largest estimated error with which an exact case counts as settled


def counts(rows: Sequence[Row]) -> dict[str, int]:
    return {v: sum(row.verdict == v for row in rows) for v in ("agrees", "differs", "unresolved", "skipped")}


def headline(rows: Sequence[Row]) -> str:
    n = counts(rows)
    others = {"differ": n["differs"], "unresolved": n["unresolved"], "skipped": n["skipped"]}
    said = [f"{n['agrees']} of {len(rows) - n['skipped']} rows agree"]
    return ", ".join(said + [f"{count} {word}" for word, count in others.items() if count]) + "."


def _short(rows: Sequence[Row]) -> Table:
    """For a terminal: the rows of a case below its name, with the notes of those that do not agree."""
    cases = groupby(rows, lambda row: row.case)
    lines = [line for case, case_rows in cases for line in (Line([case]), *map(_line, case_rows))]
    return Table(("", "expected", "found", "difference", "error"), lines)


def _line(row: Row) -> Line:
    if row.skipped:
        return Line([f"  skipped: {row.note}"])
    said = ""
    if row.verdict != "agrees":
        why = "" if row.limit is None or row.verdict == "differs" else f"the error exceeds {row.limit:.1e}"
        said = f"{row.verdict}: {'; '.join(filter(None, (why, row.note)))}"
    return Line([row.named, *_numbers(row, 0)], row.verdict, said)


def _numbers(row: Row, digits: int) -> list[str]:
    if row.unit == "order":
        return [f"{row.expected:g}", f"{row.computed:.3f}", f"{row.difference:+.3f}", f"{row.error:g}"]
    return [f"{row.expected:.7g}", f"{row.computed:.7g}", f"{row.difference:+.1e}", f"{row.error:.{digits}e}"]


def _full(rows: Sequence[Row]) -> Table:
    heads = ("case", "quantity", "expected", "found", "difference", "error", "verdict", "source")
    cells = []
    for row in rows:
        many = f", worst of {row.count}" if row.count > 1 else ""
        numbers = [""] * 5 if row.skipped else [f"{row.named}{many}", *_numbers(row, 1)]
        cells.append([row.case, *numbers, row.verdict, row.note])
    return Table(heads, cells, "<<>>>><<")


@dataclass(frozen=True)
class Row:
    """One quantity of one case.

    ``expected``, ``computed`` and ``error``, the estimated error of the latter (with what is not known of the expected
    value), are in ``unit``; ``limit`` is the largest error with which the case is settled (``None``: any). ``note`` is
    a source, or the reason why a row was skipped. ``count`` says over how many values the row is the worst. Where
    ``at_least`` is set, more than expected is as good.
    """

    family: str
    case: str
    quantity: str
    unit: str
    expected: float
    computed: float
    error: float
    limit: float | None = None
    note: str = ""
    count: int = 1
    skipped: bool = False
    at_least: bool = False

    @property
    def named(self) -> str:
        named = f"{self.quantity} ({self.unit})" if self.unit not in ("", "order") else self.quantity
        return f"{named}, at least" if self.at_least else named

    @property
    def difference(self) -> float:
        """Computed less expected, in the row's unit."""
        return self.computed - self.expected

    @property
    def verdict(self) -> Outcome:
        """Whether the difference is within the estimated error, and that error as small as was asked for."""
        if self.skipped:
            return "skipped"
        off = -self.difference if self.at_least else abs(self.difference)
        if not (math.isfinite(self.error) and off <= self.error):
            return "differs"
        return "unresolved" if self.limit is not None and self.error > self.limit else "agrees"


TABLE = Report[Row](
    "Code verification", ABOUT, headline, lambda row: TITLES.get(row.family, row.family), _short, _full,
    ("difference", "verdict"), lambda rows: {"counts": counts(rows)},
)  # fmt: skip


def order_row(
    family: str, case: str, quantity: str, theory: float, observed: float, note: str = "", at_least: bool = False
) -> Row:
    """The observed order of convergence against the theoretical one; they agree within `ORDER_TOLERANCE`, or where
    theory says what order there is ``at_least``, above it."""
    return Row(family, case, quantity, "order", theory, observed, ORDER_TOLERANCE, note=note, at_least=at_least)


def observed_order(errors: Sequence[float], ratio: float) -> float:
    """The order from two errors, (coarse, fine), on meshes or steps whose sizes are ``ratio`` (> 1) apart."""
    coarse, fine = errors
    return math.log(coarse / fine) / math.log(ratio) if coarse > 0 and fine > 0 else math.nan


def skipped(family: str, case: str, reason: str) -> Row:
    return Row(family, case, "", "", math.nan, math.nan, math.nan, note=reason, skipped=True)


@dataclass(frozen=True)
class Expected:
    """What a probe should read: a number or, for a transient, one per output time, in ``unit`` (temperatures in K).

    ``scale`` is what errors are measured against: the largest rise, flow or current. ``unsure`` is how far the
    expected value may be off itself: rounding of a printed one, the approximation in a scene. ``settled`` is the part
    of the scale that the estimated error may reach; ``None`` for any.
    """

    probe: str
    unit: str
    value: float | np.ndarray
    scale: float
    unsure: float = 0.0
    name: str = ""
    settled: float | None = SETTLED
    note: str = ""


def rows(family: str, case: str, scene: Scene, expected: Sequence[Expected], note: str = "") -> Iterator[Row]:
    """Solves the scene and compares; of a trace the row shows the instant that is furthest off."""
    result = scene_run.solve(scene)
    for each in expected:
        values = np.atleast_1d(np.asarray(each.value, dtype=float))
        if result.traces is None:
            estimate = result.steady[each.probe]
            computed, error = np.array([estimate.value]), estimate.error
        else:
            computed = np.interp(scene.output_times, result.traces.time, result.traces.values[each.probe])
            error = result.traces.errors[each.probe]
        worst = int(np.abs(computed - values).argmax())
        limit = None if each.settled is None else each.settled * each.scale + each.unsure
        yield Row(
            family, case, each.name or each.probe, each.unit, float(values[worst]), float(computed[worst]),
            error + each.unsure, limit, each.note or note, len(values),
        )  # fmt: skip
