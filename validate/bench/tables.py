"""Tables of what was measured: as markdown for the page, in columns for a terminal."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from validate.report.table import WIDTH

Row = Mapping[str, Any]
Cells = Callable[[Row], tuple[str, ...]]


@dataclass(frozen=True)
class Table:
    """Rows of cells under their heads, and what failed: a name and why."""

    head: Sequence[str]
    rows: Sequence[tuple[str, ...]] = ()
    failures: Sequence[tuple[str, str]] = ()

    @staticmethod
    def of(head: Sequence[str], found: Sequence[Row], name: Callable[[Row], str], cells: Cells) -> Table:
        """A row for each of what was found that has no "failure": its name, then its cells."""
        rows = [(name(row), *cells(row)) for row in found if not row["failure"]]
        return Table(head, rows, [(name(row), row["failure"]) for row in found if row["failure"]])

    def markdown(self) -> list[str]:
        """The lines, and an empty one after them."""
        blank = [""] * (len(self.head) - 2)
        rows = [*self.rows, *((name, why, *blank) for name, why in self.failures)]
        lines = [self.head, ["---"] * len(self.head), *rows]
        return [*(f"| {' | '.join(cells)} |" for cells in lines), ""]

    def text(self) -> Iterator[str]:
        """Columns as wide as they need; the first is cut short where a row would be wider than a terminal."""
        lines = [self.head, *self.rows]
        widths = [max(len(row[k]) for row in lines) for k in range(len(self.head))]
        widths[0] = min(widths[0], WIDTH - 2 - sum(width + 2 for width in widths[1:]))
        for row in lines:
            first = textwrap.shorten(row[0], widths[0], placeholder=" ...") if row[0] else ""
            others = (f"{cell:>{width}}" for cell, width in zip(row[1:], widths[1:], strict=True))
            yield "  " + "  ".join([f"{first:<{widths[0]}}", *others]).rstrip()
        for name, why in self.failures:
            yield from textwrap.wrap(f"{name}: {why}", WIDTH, subsequent_indent="  ")
