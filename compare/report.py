"""Tables and sections of reports as data; `validate.report` shows them on a terminal, a page or in Markdown."""

from collections.abc import Sequence
from dataclasses import dataclass

Cells = Sequence[str]


@dataclass(frozen=True)
class Style:
    """Colours; ASCII only (every verdict is a word, too); ``page`` for report.html, with room for everything."""

    colour: bool = False
    ascii_only: bool = False
    page: bool = False

    @property
    def plus_minus(self) -> str:
        return "+-" if self.ascii_only else "\N{PLUS-MINUS SIGN}"


@dataclass(frozen=True)
class Row:
    """Cells, a ``verdict`` that marks them, and a sentence ``below`` them. A single cell heads the rows that follow."""

    cells: Cells
    verdict: str = ""
    below: str = ""


@dataclass(frozen=True)
class Table:
    """Rows under their heads, which may have several lines; ``sides`` has "<" for a column that stands to the left and
    ">" for the others, by default all but the first."""

    heads: Cells
    rows: Sequence[Row | Cells]
    sides: str = ""

    @property
    def aligned(self) -> str:
        return self.sides or "<" + ">" * (len(self.heads) - 1)

    @property
    def marked(self) -> list[Row]:
        return [row if isinstance(row, Row) else Row(row) for row in self.rows]


@dataclass(frozen=True)
class Section:
    """A part of a report: tables and paragraphs; a terminal prints the title only if ``headed``."""

    title: str
    parts: Sequence[Table | str]
    headed: bool = True

    @property
    def filled(self) -> list[Table | str]:
        return [part for part in self.parts if part]


def sentences(texts: Sequence[str]) -> list[str]:
    """Each ended with a full stop."""
    return [f"{text.rstrip('.')}." for text in texts]
