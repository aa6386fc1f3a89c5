"""The one form of every table and text: on a terminal at most 80 columns wide, on a page, and in Markdown; and what
runs of every kind say in the terminal: the answer, the plan, what was found, and where it is kept."""

from __future__ import annotations

import re
import sys
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from compare.verdict import Check
from scenes.errors import columns
from scenes.formats import cut
from scenes.plan import Step
from statespace.document import names
from validate.report import of
from validate.run.outcome import Outcome

WIDTH = 80  # Columns of a terminal that texts are written for.
_COLOURS = {"agrees": "32", "differs": "31", "unresolved": "33", "heading": "1"}
MARKS = {"agrees": ("\N{CHECK MARK}", "+"), "differs": ("\N{BALLOT X}", "x"), "unresolved": ("?", "?")}
_STAGES = {
    "fem3d": "3D", "device": "runs", "device in 3D": "runs in 3D", "design": "designer's questions", "why": "why",
    "left out": "left out", "sensitivities": "sensitivities", "fit": "fit",
    "export": "export", "files": "files", "figures": "figures",
}  # fmt: skip
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
        """For a terminal: no two columns ever touch, and they move together where a line would be too long; then the
        first is cut short, or the second if that is text as well, so that what is asked for by its name has all of it.
        A verdict's mark stands in front, and its word in its colour at the end."""
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
        """The lines, and an empty one after them; what is said below a single cell stands beside it."""
        lines = [list(self.heads), ["---" if side == "<" else "--:" for side in self.aligned]]
        for row in self.marked:
            cells = [*row.cells, *[row.below] * (len(row.cells) == 1)]
            lines.append([cell.replace("|", "\\|") for cell in cells] + [""] * (len(self.heads) - len(cells)))
        return [*(f"| {' | '.join(cells)} |" for cells in lines), ""]


def stacked(name: str) -> str:
    """A name as the head of a narrow column: in lines of its words."""
    return "\n".join(textwrap.wrap(name, 15))


@dataclass(frozen=True)
class Section:
    """A part of a report: tables, paragraphs and lists of sentences; a terminal prints the title only if ``headed``."""

    title: str
    parts: Sequence[Table | str | Sequence[str]]
    headed: bool = True

    def text(self, style: Style) -> str:
        """For a terminal; nothing where there is nothing in it."""
        lines = [style.paint(self.title, "heading")] if self.headed else []
        for part in self.filled:
            if isinstance(part, Table):
                lines.append(part.text(style))
            else:
                lines += [wrapped(part, "  ")] if isinstance(part, str) else [wrapped(s, "  ", "    ") for s in part]
        return "\n".join(lines) if self.filled else ""

    @property
    def filled(self) -> list[Table | str | Sequence[str]]:
        return [part for part in self.parts if part]


def sentences(texts: Sequence[str]) -> list[str]:
    """Each ended with a full stop."""
    return [f"{text.rstrip('.')}." for text in texts]


def wrapped(text: str, first: str = "", then: str = "  ") -> str:
    """Lines of at most 80 columns, and no more than the terminal has, in which no number loses its unit."""
    kept = re.sub(r"(?<=\d) (?=[A-Za-z%±])|(?<=±) ", "\N{NO-BREAK SPACE}", text)
    filled = textwrap.fill(
        kept, columns(sys.stdout, WIDTH), initial_indent=first, subsequent_indent=then, break_on_hyphens=False
    )
    return filled.replace("\N{NO-BREAK SPACE}", " ")


def found_text(outcome: Outcome[Any], contrary: Sequence[Check], style: Style) -> str:
    """Everything that a run found, its answer first, the warnings last."""
    kind = of(outcome.scene)
    sections = (section.text(style) for section in kind.sections(outcome, contrary, style))
    return "\n\n".join(filter(None, (kind.headline(outcome, contrary, style), *sections, *warnings_text(outcome))))


def warnings_text(outcome: Outcome[Any]) -> list[str]:
    """The remarks on a run, each a paragraph."""
    return [wrapped(f"Warning: {text.rstrip('.')}.") for text in outcome.warnings]


def kept_text(outcome: Outcome[Any], style: Style, planned: tuple[Step, ...] | None = None) -> str:
    """Where a run is kept; before that, of a plan that has been printed (``planned``), what turned out otherwise."""
    changed = [step for step in outcome.plan if planned is not None and step not in planned]
    parts = [plan_text(changed, style, "As it turned out")] * bool(changed)
    if outcome.exported is not None:
        exported = outcome.exported
        rows = [tuple(entry.values()) for entry in names(exported.document)]
        said = wrapped(f"Exported {exported.words} to {_shown(exported.folder)}/")
        parts.append(f"{said}\n{Table(('name', 'SPICE node', 'FMU variable'), rows).text(style)}")
    return "\n\n".join([*parts, _where(outcome)])


def plan_text(steps: Sequence[Step], style: Style, title: str = "Plan") -> str:
    """The plan: what is done and what is skipped, each with its reason."""
    lines = [style.paint(title, "heading")]
    for step in steps:
        text = f"{'-' if step.state == 'skipped' else '+'} {step.state:<8}{step.step}: {step.reason}"
        lines.append(textwrap.fill(text, WIDTH, initial_indent="  ", subsequent_indent=" " * 12))
    return "\n".join(lines)


def _where(outcome: Outcome[Any]) -> str:
    """Where a run's results are, what is there, how long it took, and which earlier run they replace."""
    files, timing = outcome.files, outcome.timing
    kinds: list[str] = [name for name in ("report.html", "summary.json", "traces.csv") if name in files]
    figures = sum(file.endswith(".svg") for file in files)
    kinds += [f"{figures} figure{'s' * (figures > 1)}"] * bool(figures) + ["fem3d.pvd"] * ("fem3d.pvd" in files)
    parts = ", ".join(f"{name} {timing[key]:.1f} s" for key, name in _STAGES.items() if key in timing)
    said = f"{', '.join(kinds)}. Took {timing['total']:.1f} s{f' ({parts})' * bool(parts)}."
    said += f" Replaces {outcome.replaced}." if outcome.replaced else ""
    # A path is not broken over lines, so that it can be copied.
    return f"Results in {_shown(outcome.folder)}/\n" + wrapped(said, "  ", "  ")


def _shown(folder: Path) -> Path:
    """Relative to where the user is, where it is below that."""
    current_folder = Path.cwd()
    return folder.relative_to(current_folder) if folder.is_relative_to(current_folder) else folder
