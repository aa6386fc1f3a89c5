"""The table of a verification as text, as a page in markdown and as JSON."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from itertools import groupby
from typing import Any

from validate.report.summary import as_json
from validate.report.table import Row as Line
from validate.report.table import Section, Style, Table
from validate.verify.answers import Row

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
    return {v: sum(row.verdict == v for row in rows) for v in ("agrees", "differs", "unresolved", "skipped")}


def headline(rows: Sequence[Row]) -> str:
    n = counts(rows)
    others = {"differ": n["differs"], "unresolved": n["unresolved"], "skipped": n["skipped"]}
    said = [f"{n['agrees']} of {len(rows) - n['skipped']} rows agree"]
    return ", ".join(said + [f"{count} {word}" for word, count in others.items() if count]) + "."


def text(rows: Sequence[Row], style: Style) -> str:
    """The tables for a terminal, with the notes of rows that do not agree."""
    parts = [style.paint(headline(rows), "heading")]
    heads = ("", "expected", "found", "difference", "error")
    for family, of_family in groupby(rows, lambda row: row.family):
        lines: list[Line] = []
        for case, of_case in groupby(of_family, lambda row: row.case):
            lines += [Line([case]), *map(_line, of_case)]
        parts.append(Section(TITLES.get(family, family), [Table(heads, lines)]).text(style))
    return "\n\n".join(parts)


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
        return [f"{row.expected:g}", f"{row.found:.3f}", f"{row.difference:+.3f}", f"{row.error:g}"]
    return [f"{row.expected:.7g}", f"{row.found:.7g}", f"{row.difference:+.1e}", f"{row.error:.{digits}e}"]


def markdown(rows: Sequence[Row], versions: dict[str, str]) -> str:
    heads = ("case", "quantity", "expected", "found", "difference", "error", "verdict", "source")
    tables = [
        (TITLES.get(family, family), Table(heads, [_cells(row) for row in of_family], "<<>>>><<"))
        for family, of_family in groupby(rows, lambda row: row.family)
    ]
    return page("Code verification", ABOUT, f"**{headline(rows)}**", versions, tables)


def page(title: str, about: str, said: str, versions: dict[str, str], tables: Sequence[tuple[str, Table]]) -> str:
    """A page of the documentation with tables under their titles."""
    with_what = ", ".join(f"{name} {value}" for name, value in versions.items())
    lines = [f"# {title}", "", about, said, "", f"{with_what}.", ""]
    for name, table in tables:
        lines += [f"## {name}", "", *table.markdown()]
    return "\n".join(lines)


def _cells(row: Row) -> list[str]:
    if row.skipped:
        return [row.case, "", "", "", "", "", "skipped", row.note]
    many = f", worst of {row.count}" if row.count > 1 else ""
    return [row.case, f"{row.named}{many}", *_numbers(row, 1), row.verdict, row.note]


def document(rows: Sequence[Row], versions: dict[str, str], seconds: float) -> dict[str, Any]:
    return as_document(rows, versions, seconds, ("difference", "verdict"), counts=counts(rows))


def as_document(
    rows: Sequence[Any], versions: dict[str, str], seconds: float, derived: Sequence[str], **more: Any
) -> dict[str, Any]:
    """Rows as JSON types, their fields and what is ``derived`` from them."""
    listed = [asdict(row) | {name: getattr(row, name) for name in derived} for row in rows]
    found = {"schema": 1, "provenance": versions, "timing_s": seconds, **more, "rows": listed}
    return {key: as_json(value) for key, value in found.items()}
