"""What a run says in the terminal, at most 80 columns wide: the verdict first, then the numbers, then the reasons."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from compare.asked import whole
from compare.scope import OF_THE_PAPER, OF_THE_REDUCTION, PAPERS
from compare.verdict import Check, relative
from compare.words import difference_text, percent, quantity, sink_text, with_error

if TYPE_CHECKING:
    from compare.outcome import Outcome
    from scenes.plan import Step
    from scenes.result import Result

WIDTH = 80

QUANTITIES = {
    "peak_rise_K": ("peak rise", "K"),
    "end_rise_K": ("end rise", "K"),
    "mean_rise_K": ("mean rise", "K"),
    "current_A": ("current", "A"),
    "power_W": ("power", "W"),
    "heat_out_W": ("heat to the substrate", "W"),
    "anchor_resistance_K_per_W": ("anchor resistance", "K/W"),
}
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


def outcome_text(
    outcome: Outcome, contrary: Sequence[Check], style: Style, planned: tuple[Step, ...] | None = None
) -> str:
    """Everything about a run, its answer first; ``contrary`` are the checks that contradict the scene, ``planned`` the
    plan if it has been printed, so that only what turned out otherwise is added."""
    parts = [found_text(outcome, contrary, style), _plan_changes(outcome, planned, style)]
    if outcome.exported is not None:
        from reduced1d.ladder import few_states_of

        parts.append(f"Exported {few_states_of(whole(outcome.request).reduction)} to {_shown(outcome.exported)}/")
    parts.append(where_text(outcome))
    return "\n\n".join(part for part in parts if part)


def found_text(outcome: Outcome, contrary: Sequence[Check], style: Style) -> str:
    """The answer, the quantities, the checks with their reasons and, where asked for, the parts of the differences;
    last the warnings."""
    parts = [headline(outcome, contrary, style), quantities_text(outcome, style)]
    if outcome.against is not None:
        parts.append(wrapped(outcome.against.said()))
    if outcome.checks:
        parts.append(checks_text(outcome.checks, style))
    own = [check for check in outcome.checks if check.own]
    parts += [reasons_text(own, contrary, style), _budget(outcome, style), *warnings_text(outcome)]
    return "\n\n".join(part for part in parts if part)


def warnings_text(outcome: Any) -> list[str]:
    """Any kind of run's remarks, each a paragraph."""
    return [wrapped(f"Warning: {text.rstrip('.')}.") for text in outcome.warnings]


def _budget(outcome: Outcome, style: Style) -> str:
    if outcome.why is None:
        return ""
    from validate.report.why_text import budget_text

    return budget_text(outcome.why, style)


def headline(outcome: Outcome, contrary: Sequence[Check], style: Style) -> str:
    """The answer of the run, then how many checks differ, and whether that was known."""
    said = [style.paint(wrapped(outcome.answer), "heading")]
    name = f"{sink_text(outcome.sink)}{_against(outcome)}"
    own = [check for check in outcome.checks if check.own]
    if own:
        said.append(verdict_text(name, own, contrary, outcome.sink.expected_to_differ is not None, style))
    rest = [check for check in outcome.checks if not check.own]
    if rest:
        count = sum(check.verdict == "differs" for check in rest)
        off = f"{count} differs" if count == 1 else f"{count} differ"
        said.append(wrapped(f"Of the paper's own {len(rest)} equations, which are not this model's, {off}."))
    return "\n".join(said)


def _against(outcome: Outcome) -> str:
    """The 1D model, where it is another than the paper's."""
    if outcome.reduced1d is None or outcome.reduced1d.model in PAPERS:
        return ""
    return f", {outcome.reduced1d.model}" + (" against 3D" if outcome.fem3d is not None else "")


def verdict_text(
    name: str, checks: Sequence[Check], contrary: Sequence[Check], declared: bool, style: Style
) -> str:  # fmt: skip
    """How many checks differ, and whether that was known of the scene."""
    count = {v: sum(check.verdict == v for check in checks) for v in ("agrees", "differs", "unresolved")}
    differ = f"{count['differs']} of {len(checks)} checks {'differs' if count['differs'] == 1 else 'differ'}"
    said = f"{name}: {differ if count['agrees'] < len(checks) else f'all {len(checks)} checks agree'}"
    if count["unresolved"]:
        said += f", {count['unresolved']} unresolved"
    if contrary:
        said += f"; not as expected: {', '.join(check.id for check in contrary)}."
    elif declared and count["unresolved"]:
        said += "; the others are as the scene declares."
    elif declared:
        said += ", as the scene declares: all were known."
    else:
        said += "; nothing was declared of this scene beforehand."
    return style.paint(wrapped(said), "heading")


def plan_text(steps: Sequence[Step], style: Style) -> str:
    """The plan: what is done and what is skipped, each with its reason."""
    lines = [style.paint("Plan", "heading")]
    for step in steps:
        text = f"{'-' if step.state == 'skipped' else '+'} {step.state:<8}{step.step}: {step.reason}"
        lines.append(textwrap.fill(text, WIDTH, initial_indent="  ", subsequent_indent=" " * 12))
    return "\n".join(lines)


def quantities_text(outcome: Outcome, style: Style) -> str:
    """Steady quantities: 3D with its error, 1D, and how far 1D is off."""
    name = outcome.reduced1d.model if _against(outcome) and outcome.reduced1d else "1D"
    heads = ("steady state", "3D" if outcome.fem3d else "", name if outcome.reduced1d else "")
    both = outcome.fem3d is not None and outcome.reduced1d is not None
    lines = [
        style.paint(
            f"  {heads[0]:<23}{heads[1]:>26}{heads[2]:>15}{'1D/3D - 1' if both else '':>13}".rstrip(), "heading"
        )
    ]
    for key, (name, unit) in QUANTITIES.items():
        lines.append(_quantity_line(key, name, unit, outcome.fem3d, outcome.reduced1d, style))
    return "\n".join(lines)


def _quantity_line(
    key: str, name: str, unit: str, fem3d: Result | None, reduced1d: Result | None, style: Style
) -> str:  # fmt: skip
    left, right, off = "", "", ""
    if fem3d is not None:
        found = fem3d.steady[key]
        value, error, shown, places, factor = with_error(found.value, found.error, unit)
        left = f"{value} {style.plus_minus} {error} {shown}"
        if reduced1d is not None:
            other = reduced1d.steady[key].value
            right = f"{other * factor:.{min(places, 4)}f} {shown}"
            off = percent(relative(other, found.value), sign=True)
    elif reduced1d is not None:
        right = quantity(reduced1d.steady[key].value, unit, 6)
    return f"  {name:<23}{left:>26}{right:>15}{off:>13}".rstrip()


def checks_text(checks: Sequence[Check], style: Style) -> str:
    """A line for every check, under what is compared in it."""
    lines = [style.paint(f"  {'check':<40}{'difference':>17}{'tolerance':>10}", "heading")]
    room = max((len(check.id) + 1 for check in checks), default=0)
    for kind, found in by_kind(checks).items():
        lines += [f"  {kind}"] if kind else []
        for check in found:
            difference = difference_text(check.difference, check.u_num, style.plus_minus)
            word = style.paint(check.verdict, check.verdict)
            mark = style.paint(style.mark(check.verdict), check.verdict)
            name = f"{check.id:<{max(room, 14)}}{check.title}"
            lines.append(f"{mark} {name:<40}{difference:>18}{percent(check.tolerance, 1):>8}  {word}")
    return "\n".join(lines)


def by_kind(checks: Sequence[Check]) -> dict[str, list[Check]]:
    """Checks by what is compared in them, in words: one model with the other first."""
    found: dict[str, list[Check]] = {}
    for check in sorted(checks, key=lambda check: check.id not in OF_THE_REDUCTION):
        found.setdefault(kind_of(check.id, check.own), []).append(check)
    return found


def kind_of(check: str, own: bool) -> str:
    """What is compared in a check, by its id, and whether it is of the model that was chosen."""
    if check in OF_THE_REDUCTION:
        return "one model against the other: 1D less 3D"
    if check in OF_THE_PAPER:
        whose = "the paper's equations" if own else "the paper's equations (not this model's)"
        return f"{whose}: 3D numbers in, relative to 3D's own"
    return {"energy": "3D alone"}.get(check, "your data less 3D" if check.startswith("against_") else "")


def reasons_text(checks: Sequence[Check], contrary: Sequence[Check], style: Style) -> str:
    """Why, for every check that gives a reason, and for those that contradict the scene what it declares."""
    lines = []
    declared = {check.id: _declared(check) for check in contrary}
    for check in checks:
        said = "; ".join(text for text in (declared.get(check.id, ""), check.because) if text)
        if said:
            lines.append(wrapped(f"{check.id}: {said}.", "  ", "    "))
    if not lines:
        return ""
    return "\n".join([style.paint("Why", "heading"), *lines])


def _declared(check: Check) -> str:
    if check.expected is not None and check.verdict != check.expected:
        return f"the scene declares that it {check.expected} (checks.expect_differs)"
    return ""


def _plan_changes(outcome: Outcome, planned: tuple[Step, ...] | None, style: Style) -> str:
    if planned is None:
        return ""
    changed = [step for step in outcome.plan if step not in planned]
    if not changed:
        return ""
    return plan_text(changed, style).replace("Plan", "As it turned out", 1)


def where_text(outcome: Any) -> str:
    """Where any kind of run's results are, what is there, how long it took, and which earlier run they replace."""
    files: Sequence[str] = outcome.files
    timing: Mapping[str, float] = outcome.timing
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
