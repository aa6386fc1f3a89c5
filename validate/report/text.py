"""What runs of every kind say in the terminal: the answer, the plan, what was found, and where it is kept."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from validate.report import of
from validate.report.table import WIDTH, Style, wrapped

if TYPE_CHECKING:
    from compare.outcome import Outcome
    from compare.verdict import Check
    from scenes.plan import Step

_STAGES = {
    "fem3d": "3D", "device": "runs", "device in 3D": "runs in 3D", "design": "designer's questions", "why": "why",
    "air": "air", "sensitivities": "sensitivities", "fit": "fit", "export": "export", "files": "files",
    "figures": "figures",
}  # fmt: skip


def headline(outcome: Outcome[Any], contrary: Sequence[Check], style: Style) -> str:
    """The answer of a run, and how many checks differ; ``contrary`` are those that contradict the scene."""
    return of(outcome.scene).headline(outcome, contrary, style)


def found_text(outcome: Outcome[Any], contrary: Sequence[Check], style: Style) -> str:
    """Everything that a run found, its answer first, the warnings last."""
    sections = (section.text(style) for section in of(outcome.scene).sections(outcome, contrary, style))
    return "\n\n".join(filter(None, (headline(outcome, contrary, style), *sections, *warnings_text(outcome))))


def warnings_text(outcome: Outcome[Any]) -> list[str]:
    """The remarks on a run, each a paragraph."""
    return [wrapped(f"Warning: {text.rstrip('.')}.") for text in outcome.warnings]


def outcome_text(
    outcome: Outcome[Any], contrary: Sequence[Check], style: Style, planned: tuple[Step, ...] | None = None
) -> str:
    """The same, and where it is kept; of a plan that has been printed (``planned``) what turned out otherwise."""
    parts = [found_text(outcome, contrary, style)]
    changed = [step for step in outcome.plan if planned is not None and step not in planned]
    parts += [plan_text(changed, style, "As it turned out")] * bool(changed)
    if outcome.exported is not None:
        what, folder = outcome.exported
        parts.append(wrapped(f"Exported {what} to {_shown(folder)}/"))
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
    here = Path.cwd()
    return folder.relative_to(here) if folder.is_relative_to(here) else folder
