"""Tables that judge: rows with verdicts, in groups, as text, as a page in markdown and as JSON."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from itertools import groupby
from typing import Any, Generic, TypeVar

from compare.report.table import Section, Style, Table
from validate.report.summary import as_json

R = TypeVar("R")


@dataclass(frozen=True)
class Report(Generic[R]):
    """How rows of one kind are told: the ``title`` of the page, what it is ``about``, the ``headline`` of all rows, the
    title of the ``group`` that a row is in, and the tables of a group in ``short``, for a terminal, and in ``full``;
    ``sums`` is what JSON has beside the rows, of which it has the fields and the ``derived`` properties."""

    title: str
    about: str
    headline: Callable[[Sequence[R]], str]
    group: Callable[[R], str]
    short: Callable[[Sequence[R]], Table]
    full: Callable[[Sequence[R]], Table]
    derived: Sequence[str]
    sums: Callable[[Sequence[R]], dict[str, Any]]

    def text(self, rows: Sequence[R], style: Style) -> str:
        parts = [Section(title, [self.short(list(group))]).text(style) for title, group in groupby(rows, self.group)]
        return "\n\n".join([style.paint(self.headline(rows), "heading"), *parts])

    def markdown(self, rows: Sequence[R], versions: dict[str, str], more: str = "") -> str:
        """The page; it says ``more`` beside the headline."""
        with_what = ", ".join(f"{name} {value}" for name, value in versions.items())
        lines = [f"# {self.title}", "", self.about, f"**{self.headline(rows)}**{more}", "", f"{with_what}.", ""]
        for title, group in groupby(rows, self.group):
            lines += [f"## {title}", "", *self.full(list(group)).markdown()]
        return "\n".join(lines)

    def document(self, rows: Sequence[R], versions: dict[str, str], seconds: float) -> dict[str, Any]:
        listed = [asdict(row) | {name: getattr(row, name) for name in self.derived} for row in rows]  # type: ignore[call-overload]
        content = {"schema": 1, "provenance": versions, "timing_s": seconds, **self.sums(rows), "rows": listed}
        return {key: as_json(value) for key, value in content.items()}
