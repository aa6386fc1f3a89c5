"""Reports and tables as text for a terminal, and tables in Markdown."""

import re
import sys
import textwrap
from typing import Any

from compare.outcome import Outcome
from compare.report import Cells, Section, Style, Table, sentences
from scenes.errors import columns
from scenes.formats import cut

WIDTH = 80  # Columns of a terminal that texts are written for.
_COLOURS = {"agrees": "32", "differs": "31", "unresolved": "33", "heading": "1"}
MARKS = {"agrees": ("\N{CHECK MARK}", "+"), "differs": ("\N{BALLOT X}", "x"), "unresolved": ("?", "?")}


def report(outcome: Outcome[Any], style: Style | None = None) -> str:
    """Return the report of a run: alarms, the answer, the sections, the warnings; by default without colours."""
    from validate.report import views

    style = style or Style()
    parts = (section_text(section, style) for section in views.sections(outcome, style))
    said = (wrapped(f"Warning: {text}") for text in sentences(outcome.warnings))
    return "\n\n".join(filter(None, (headline(outcome, style), *parts, *said)))


def headline(outcome: Outcome[Any], style: Style) -> str:
    """Return the first lines of a report: alarms, then the answer."""
    from validate.report import views

    alarms = (f"Warning: {text}" for text in sentences(outcome.alarms))
    said = (*alarms, *views.headline(outcome, style))
    return "\n".join(paint(wrapped(text), "heading", style) for text in said if text)


def section_text(section: Section, style: Style) -> str:
    """Format a section; empty without content."""
    lines = [paint(section.title, "heading", style)] if section.headed else []
    for part in section.filled:
        lines.append(table_text(part, style) if isinstance(part, Table) else wrapped(part, "  ", "    "))
    return "\n".join(lines) if section.filled else ""


def table_text(table: Table, style: Style) -> str:
    """Format a table for 80 columns, a verdict's mark in front and its word coloured.

    Where a line is too long, columns move together. Then a name too long for the first column stands above its row,
    for a reader may have to type it, or a second text column is cut short.
    """
    stacks = [head.split("\n") for head in table.heads]
    depth = max(map(len, stacks))
    tops = list(zip(*([""] * (depth - len(stack)) + stack for stack in stacks), strict=True))
    full = [*tops, *(row.cells for row in table.marked if len(row.cells) == len(stacks))]
    widths = [max(map(len, column)) for column in zip(*full, strict=True)]
    gaps, room = max(len(widths) - 1, 1), WIDTH - 2
    gap = " " * max(min((room - sum(widths)) // gaps, 3), 1)
    short = int(table.aligned.startswith("<<"))
    widths[short] = min(widths[short], max(room - sum(widths) + widths[short] - gaps, 12))

    def line(cells: Cells) -> str:
        cells, above = list(cells), ""
        if len(cells[short]) > widths[short]:
            above = "" if short else f"{cells[0]}\n  "
            cells[short] = cut(cells[short], widths[short]) if short else ""
        padded = (f"{c:{side}{w}}" for c, side, w in zip(cells, table.aligned, widths, strict=True))
        return above + gap.join(padded).rstrip()

    lines = [paint(f"  {line(cells)}".rstrip(), "heading", style) for cells in tops]
    for row in table.marked:
        said = line(row.cells) if len(row.cells) == len(widths) else cut(row.cells[0], room)
        if row.verdict and said.endswith(row.verdict):
            said = said.removesuffix(row.verdict) + paint(row.verdict, row.verdict, style)
        mark = paint(MARKS[row.verdict][style.ascii_only], row.verdict, style) if row.verdict else " "
        lines += [f"{mark} {said}", *[wrapped(row.below, "    ", "    ")] * bool(row.below)]
    return "\n".join(lines)


def paint(text: str, kind: str, style: Style) -> str:
    """The text in a verdict's colour, or bold for a "heading"."""
    return f"\x1b[{_COLOURS[kind]}m{text}\x1b[0m" if style.colour else text


def wrapped(text: str, first: str = "", then: str = "  ") -> str:
    """Wrap lines at 80 columns or the terminal's width, without separating a number from its unit."""
    kept = re.sub(r"(?<=\d) (?=[A-Za-z%±])|(?<=±) ", "\N{NO-BREAK SPACE}", text)
    filled = textwrap.fill(
        kept, columns(sys.stdout, WIDTH), initial_indent=first, subsequent_indent=then, break_on_hyphens=False
    )
    return filled.replace("\N{NO-BREAK SPACE}", " ")


def markdown(table: Table) -> list[str]:
    """Return the lines of a table in Markdown; the sentence below a single cell stands beside it."""
    lines = [list(table.heads), ["---" if side == "<" else "--:" for side in table.aligned]]
    for row in table.marked:
        cells = [*row.cells, *[row.below] * (len(row.cells) == 1)]
        lines.append([cell.replace("|", "\\|") for cell in cells] + [""] * (len(table.heads) - len(cells)))
    return [*(f"| {' | '.join(cells)} |" for cells in lines), ""]
