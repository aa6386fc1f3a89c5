"""The table of a verification as text, as a page in markdown and as JSON."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby
from typing import TYPE_CHECKING, Any

from validate.verify.answers import Row

if TYPE_CHECKING:
    from validate.report.table import Style

TITLES = {
    "order in space": "Observed orders of convergence in space (they agree with theory within 0.1)",
    "order in time": "Observed orders of convergence in time (they agree with theory within 0.1)",
    "exact": "Exact solutions (each within its own estimated error, at 1e-4 or better)",
    "published": "Published benchmarks",
    "second code": "A second, independent code",
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


def counts(rows: Sequence[Row]) -> dict[str, int]:
    """How many rows have each verdict."""
    return {v: sum(row.verdict == v for row in rows) for v in ("agrees", "differs", "unresolved", "skipped")}


def headline(rows: Sequence[Row]) -> str:
    """The outcome in one line."""
    n = counts(rows)
    said = f"{n['agrees']} of {len(rows) - n['skipped']} rows agree"
    for verdict in ("differs", "unresolved", "skipped"):
        if n[verdict]:
            said += f", {n[verdict]} {'differ' if verdict == 'differs' else verdict}"
    return said + "."


def text(rows: Sequence[Row], style: Style) -> str:
    """The table for a terminal, 80 columns wide; the notes of rows that do not agree follow."""
    lines = [style.paint(headline(rows), "heading")]
    for family, of_family in groupby(rows, lambda row: row.family):
        lines += ["", style.paint(TITLES.get(family, family), "heading")]
        heads = ("expected", "found", "difference", "error")
        lines.append(f"  {'':30}{heads[0]:>14}{heads[1]:>14}{heads[2]:>11}{heads[3]:>9}")
        for case, of_case in groupby(of_family, lambda row: row.case):
            lines.append(f"  {case}")
            for row in of_case:
                lines += _line(row, style)
    return "\n".join(lines)


def _line(row: Row, style: Style) -> list[str]:
    from validate.report.table import wrapped

    if row.skipped:
        return [f"    skipped: {row.note}"]
    mark = style.paint(style.mark(row.verdict), row.verdict)
    name = f"{row.quantity} ({row.unit})" if row.unit not in ("", "order") else row.quantity
    if row.unit == "order":
        numbers = f"{row.expected:>14g}{row.found:>14.3f}{row.difference:>+11.3f}{row.error:>9g}"
    else:
        numbers = f"{row.expected:>14.7g}{row.found:>14.7g}{row.difference:>+11.1e}{row.error:>9.0e}"
    lines = [f"  {mark} {name}"] if len(name) > 28 else []
    lines.append(f"  {mark if not lines else ' '} {name if not lines else '':<28}{numbers}")
    if row.verdict != "agrees":
        why = "" if row.limit is None or row.verdict == "differs" else f"the error exceeds {row.limit:.1e}"
        lines.append(wrapped(f"    {row.verdict}: {'; '.join(filter(None, (why, row.note)))}"))
    return lines


def markdown(rows: Sequence[Row], versions: dict[str, str]) -> str:
    """The page of the documentation."""
    lines = ["# Code verification", "", ABOUT, f"**{headline(rows)}**", ""]
    lines += [", ".join(f"{name} {value}" for name, value in versions.items()) + ".", ""]
    for family, of_family in groupby(rows, lambda row: row.family):
        lines += [f"## {TITLES.get(family, family)}", ""]
        heads = ("case", "quantity", "expected", "found", "difference", "error", "verdict", "source")
        lines += ["| " + " | ".join(heads) + " |", "|---|---|--:|--:|--:|--:|---|---|"]
        lines += ["| " + " | ".join(_cells(row)) + " |" for row in of_family]
        lines.append("")
    return "\n".join(lines)


def _cells(row: Row) -> list[str]:
    if row.skipped:
        return [row.case, "", "", "", "", "", "skipped", row.note]
    if row.unit == "order":
        return [row.case, row.quantity, f"{row.expected:g}", f"{row.found:.3f}", f"{row.difference:+.3f}",
                f"{row.error:g}", row.verdict, row.note]  # fmt: skip
    unit = f" ({row.unit})" if row.unit else ""
    many = f", worst of {row.count}" if row.count > 1 else ""
    return [row.case, row.quantity + unit + many, f"{row.expected:.7g}", f"{row.found:.7g}", f"{row.difference:+.1e}",
            f"{row.error:.1e}", row.verdict, row.note]  # fmt: skip


def document(rows: Sequence[Row], versions: dict[str, str], seconds: float) -> dict[str, Any]:
    """The table as JSON types."""
    from dataclasses import asdict

    from validate.report.summary import as_json

    found = as_json({
        "schema": 1, "provenance": versions, "timing_s": seconds, "counts": counts(rows),
        "rows": [asdict(row) | {"difference": row.difference, "verdict": row.verdict} for row in rows],
    })  # fmt: skip
    assert isinstance(found, dict)
    return found
