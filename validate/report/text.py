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
    parts = [headline(outcome, contrary, style), *sections, *warnings_text(outcome)]
    return "\n\n".join(part for part in parts if part)


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
