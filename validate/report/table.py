"""What runs of every kind say in the terminal, at most 80 columns wide: the style, the plan, tables, remarks, files."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from validate.report import of

if TYPE_CHECKING:
    from compare.outcome import Outcome
    from compare.verdict import Check
    from scenes.plan import Step

WIDTH = 80
_STAGES = {"fem3d": "3D", "device": "runs", "design": "designer's questions", "files": "files", "figures": "figures"}
_COLOURS = {"agrees": "32", "differs": "31", "unresolved": "33", "heading": "1"}
_MARKS = {"agrees": ("\N{CHECK MARK}", "+"), "differs": ("\N{BALLOT X}", "x"), "unresolved": ("?", "?")}


@dataclass(frozen=True)
class Style:
    """Whether to colour, and whether to keep to ASCII; every verdict is a word as well."""

    colour: bool = False
    ascii_only: bool = False

    def paint(self, text: str, kind: str) -> str:
        """The text in a verdict's colour, or bold for a "heading"."""
        return f"\x1b[{_COLOURS[kind]}m{text}\x1b[0m" if self.colour else text

    def mark(self, verdict: str) -> str:
        """One sign for a verdict."""
        return _MARKS[verdict][self.ascii_only]

    @property
    def plus_minus(self) -> str:
        """The sign between a value and its error."""
        return "+-" if self.ascii_only else "\N{PLUS-MINUS SIGN}"


def headline(outcome: Outcome[Any], contrary: Sequence[Check], style: Style) -> str:
    """The answer of a run, and how many checks differ; ``contrary`` are those that contradict the scene."""
    said: str = of(outcome.scene).headline(outcome, contrary, style)
    return said


def found_text(outcome: Outcome[Any], contrary: Sequence[Check], style: Style) -> str:
    """Everything that a run found, its answer first, the warnings last."""
    parts = [headline(outcome, contrary, style), *of(outcome.scene).tables(outcome, contrary, style)]
    return "\n\n".join(part for part in [*parts, *warnings_text(outcome)] if part)


def warnings_text(outcome: Outcome[Any]) -> list[str]:
    """The remarks on a run, each a paragraph."""
    return [wrapped(f"Warning: {text.rstrip('.')}.") for text in outcome.warnings]


def outcome_text(
    outcome: Outcome[Any], contrary: Sequence[Check], style: Style, planned: tuple[Step, ...] | None = None
) -> str:
    """The same, and where it is kept; of a plan that has been printed (``planned``) what turned out otherwise."""
    changed = [step for step in outcome.plan if planned is not None and step not in planned]
    parts = [found_text(outcome, contrary, style)]
    if changed:
        parts.append(plan_text(changed, style).replace("Plan", "As it turned out", 1))
    if outcome.exported is not None:
        what, folder = outcome.exported
        parts.append(wrapped(f"Exported {what} to {_shown(folder)}/"))
    return "\n\n".join([*parts, where_text(outcome)])


def plan_text(steps: Sequence[Step], style: Style) -> str:
    """The plan: what is done and what is skipped, each with its reason."""
    lines = [style.paint("Plan", "heading")]
    for step in steps:
        text = f"{'-' if step.state == 'skipped' else '+'} {step.state:<8}{step.step}: {step.reason}"
        lines.append(textwrap.fill(text, WIDTH, initial_indent="  ", subsequent_indent=" " * 12))
    return "\n".join(lines)


def listed(head: str, sentences: Sequence[str], style: Style) -> str:
    """Sentences under a heading; nothing where there are none."""
    lines = [wrapped(f"{text.rstrip('.')}.", "  ", "    ") for text in sentences]
    return "\n".join([style.paint(head, "heading"), *lines]) if lines else ""


def declared(check: Check) -> str:
    """What the scene declares of a check that came out otherwise."""
    if check.expected is not None and check.verdict != check.expected:
        return f"the scene declares that it {check.expected} (checks.expect_differs)"
    return ""


def columns_text(rows: Sequence[Sequence[str]], left: int, style: Style) -> list[str]:
    """Lines of a table, the first its heading: ``left`` columns stand to the left, the rest to the right. No two
    columns ever touch; they move together where the line would be too long."""
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    gaps = len(widths) - 1
    gap = " " * max(min((WIDTH - sum(widths)) // gaps, 3), 1)
    sides = ["<" if i < left else ">" for i in range(len(widths))]
    lines = [
        gap.join(f"{cell:{side}{width}}" for cell, side, width in zip(row, sides, widths, strict=True)).rstrip()
        for row in rows
    ]
    return [style.paint(lines[0], "heading"), *lines[1:]]


def where_text(outcome: Outcome[Any]) -> str:
    """Where a run's results are, what is there, how long it took, and which earlier run they replace."""
    files, timing = outcome.files, outcome.timing
    kinds = (["report.html"] if "report.html" in files else []) + ["summary.json"]
    kinds += ["traces.csv"] if "traces.csv" in files else []
    figures = {Path(file).stem for file in files if file.endswith(".svg")}
    kinds += [f"{len(figures)} figure{'s' * (len(figures) > 1)}"] if figures else []
    kinds += ["fem3d.pvd"] if "fem3d.pvd" in files else []
    parts = [f"{name} {timing[key]:.1f} s" for key, name in _STAGES.items() if key in timing]
    spent = f"Took {timing['total']:.1f} s" + (f" ({', '.join(parts)})" if parts else "")
    # A path is not broken over lines, so that it can be copied.
    said = f"{', '.join(kinds)}. {spent}." + (f" Replaces {outcome.replaced}." if outcome.replaced else "")
    return f"Results in {_shown(outcome.folder)}/\n" + wrapped(said, "  ", "  ")


def _shown(folder: Path) -> Path:
    """Relative to where the user is, where it is below that."""
    here = Path.cwd()
    return folder.relative_to(here) if folder.is_relative_to(here) else folder


def wrapped(text: str, first: str = "", then: str = "  ") -> str:
    """Lines of at most 80 columns in which no number loses its unit."""
    kept = re.sub(r"(?<=\d) (?=[A-Za-z%±])|(?<=±) ", "\N{NO-BREAK SPACE}", text)
    filled = textwrap.fill(kept, WIDTH, initial_indent=first, subsequent_indent=then, break_on_hyphens=False)
    return filled.replace("\N{NO-BREAK SPACE}", " ")
