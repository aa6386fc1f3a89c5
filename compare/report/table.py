"""Tables and sections of reports in text, HTML and Markdown, and entries of summary.json that all kinds share."""

import re
import sys
import textwrap
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from html import escape
from typing import Any

from compare.outcome import Outcome
from scenes.errors import columns
from scenes.formats import cut
from scenes.result import Result

WIDTH = 80  # Columns of a terminal that texts are written for.
_COLOURS = {"agrees": "32", "differs": "31", "unresolved": "33", "heading": "1"}
MARKS = {"agrees": ("\N{CHECK MARK}", "+"), "differs": ("\N{BALLOT X}", "x"), "unresolved": ("?", "?")}
Cells = Sequence[str]


@dataclass(frozen=True)
class Style:
    """Colours; ASCII only (every verdict is a word, too); ``page`` for report.html, with room for everything."""

    colour: bool = False
    ascii_only: bool = False
    page: bool = False

    def paint(self, text: str, kind: str) -> str:
        """The text in a verdict's colour, or bold for a "heading"."""
        return f"\x1b[{_COLOURS[kind]}m{text}\x1b[0m" if self.colour else text

    def mark(self, verdict: str) -> str:
        """One sign for a verdict, in its colour."""
        return self.paint(MARKS[verdict][self.ascii_only], verdict) if verdict else " "

    def head(self, *texts: str) -> str:
        """Wrap paragraphs at the head of a report, in bold; without empty ones."""
        return "\n".join(self.paint(wrapped(text), "heading") for text in texts if text)

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

    def text(self, style: Style) -> str:
        """Format for a terminal of 80 columns, a verdict's mark in front and its word coloured.

        Where a line is too long, columns move together; then the first, or a second text column, is cut short.
        """
        stacks = [head.split("\n") for head in self.heads]
        depth = max(map(len, stacks))
        tops = list(zip(*([""] * (depth - len(stack)) + stack for stack in stacks), strict=True))
        full = [*tops, *(row.cells for row in self.marked if len(row.cells) == len(stacks))]
        widths = [max(map(len, column)) for column in zip(*full, strict=True)]
        gaps, room = max(len(widths) - 1, 1), WIDTH - 2
        gap = " " * max(min((room - sum(widths)) // gaps, 3), 1)
        short = int(self.aligned.startswith("<<"))
        widths[short] = min(widths[short], max(room - sum(widths) + widths[short] - gaps, 12))

        def line(cells: Cells) -> str:
            cells = [cut(c, widths[short]) if i == short else c for i, c in enumerate(cells)]
            return gap.join(f"{c:{side}{w}}" for c, side, w in zip(cells, self.aligned, widths, strict=True)).rstrip()

        lines = [style.paint(f"  {line(cells)}".rstrip(), "heading") for cells in tops]
        for row in self.marked:
            said = line(row.cells) if len(row.cells) == len(widths) else cut(row.cells[0], room)
            if row.verdict and said.endswith(row.verdict):
                said = said.removesuffix(row.verdict) + style.paint(row.verdict, row.verdict)
            lines += [f"{style.mark(row.verdict)} {said}", *[wrapped(row.below, "    ", "    ")] * bool(row.below)]
        return "\n".join(lines)

    def markdown(self) -> list[str]:
        """Format as Markdown; the sentence below a single cell stands beside it."""
        lines = [list(self.heads), ["---" if side == "<" else "--:" for side in self.aligned]]
        for row in self.marked:
            cells = [*row.cells, *[row.below] * (len(row.cells) == 1)]
            lines.append([cell.replace("|", "\\|") for cell in cells] + [""] * (len(self.heads) - len(cells)))
        return [*(f"| {' | '.join(cells)} |" for cells in lines), ""]

    def html(self) -> str:
        """For a page, a verdict with its sign and in its colour."""
        numbers, rows = [i for i, side in enumerate(self.aligned) if side == ">"], []
        heads, across = [html_text(" ".join(head.split())) for head in self.heads], f'colspan="{len(self.heads)}"'
        for row in self.marked:
            cells = [html_text(cell) for cell in row.cells]
            if row.verdict:
                at = -1 if cells[-1] == row.verdict else 0
                cells[at] = f'<span class="word {row.verdict}">{MARKS[row.verdict][0]} {cells[at]}</span>'
            single = f'<tr class="kind"><th {across}>{cells[0]}</th></tr>'
            rows.append(single if len(cells) == 1 else _html_row(cells, numbers))
            rows += [f'<tr class="because"><td {across}>{html_text(row.below)}</td></tr>'] * bool(row.below)
        body = "\n".join(rows)
        return f"<table><thead>{_html_row(heads, numbers, 'th')}</thead>\n<tbody>\n{body}\n</tbody></table>"


@dataclass(frozen=True)
class Section:
    """A part of a report: tables and paragraphs; a terminal prints the title only if ``headed``."""

    title: str
    parts: Sequence[Table | str]
    headed: bool = True

    def text(self, style: Style) -> str:
        """Format for a terminal; empty without content."""
        lines = [style.paint(self.title, "heading")] if self.headed else []
        parts = [each.text(style) if isinstance(each, Table) else wrapped(each, "  ", "    ") for each in self.filled]
        return "\n".join(lines + parts) if parts else ""

    def html(self) -> str:
        """Format for a page, under a heading; empty without content."""
        parts = (
            f'<div class="wide">{part.html()}</div>' if isinstance(part, Table) else f"<p>{html_text(part)}</p>"
            for part in self.filled
        )  # fmt: skip
        return html_section(self.title, *parts)

    @property
    def filled(self) -> list[Table | str]:
        return [part for part in self.parts if part]


def sentences(texts: Sequence[str]) -> list[str]:
    """Each ended with a full stop."""
    return [f"{text.rstrip('.')}." for text in texts]


def wrapped(text: str, first: str = "", then: str = "  ") -> str:
    """Wrap lines at 80 columns or the terminal's width, without separating a number from its unit."""
    kept = re.sub(r"(?<=\d) (?=[A-Za-z%±])|(?<=±) ", "\N{NO-BREAK SPACE}", text)
    filled = textwrap.fill(
        kept, columns(sys.stdout, WIDTH), initial_indent=first, subsequent_indent=then, break_on_hyphens=False
    )
    return filled.replace("\N{NO-BREAK SPACE}", " ")


def short_key(key: str) -> str:
    """A key without its section, where it is as clear: "silicon.density"."""
    for section in ("materials.", "environment.", "material.", "boundary.", "box."):
        key = key.removeprefix(section)
    return key


def html_text(value: object) -> str:
    """Escaped, with the numbers of an exponent or a unit kept on one line with it."""
    return re.sub(r"(?<=\d) (?=[A-Za-z%\N{PLUS-MINUS SIGN}])", "&nbsp;", escape(str(value)))


def html_section(title: str, *content: str) -> str:
    """A section under a heading, or nothing where it has no content."""
    filled = "\n".join(filter(None, content))
    anchor = title.lower().replace(" ", "-")
    return f'<section id="{anchor}"><h2>{html_text(title)}</h2>\n{filled}\n</section>' if filled else ""


def _html_row(cells: Sequence[str], numbers: Sequence[int], cell: str = "td") -> str:
    """A row of cells that are HTML; columns in ``numbers`` stand to the right."""
    looks = [' class="n"' * (i in numbers) for i in range(len(cells))]
    return f"<tr>{''.join(f'<{cell}{look}>{each}</{cell}>' for look, each in zip(looks, cells, strict=True))}</tr>"


def steady_document(result: Result, *details: str) -> dict[str, Any]:
    """Return steady values with their errors, and some of the details of a 3D result."""
    named = {"dofs" if name == "unknowns" else name: result.details.get(name) for name in details}
    return {"steady": {key: asdict(estimate) for key, estimate in result.steady.items()}, **named}


def checks_document(outcome: Outcome[Any]) -> list[dict[str, Any]]:
    """Return the checks without the uncertainties that they lack."""
    entries = [asdict(check) for check in outcome.checks]
    for entry in entries:
        entry["time_s"] = entry.pop("time")
        for name in ("u_input", "u_data", "time_s"):
            if entry[name] is None:
                del entry[name]
    return entries
