"""The plan of a run: each step with its state, done or skipped, and the reason."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class Step:
    """One line of a plan: a step, whether it is done or skipped, and why, in words."""

    step: str
    state: Literal["done", "skipped"]
    reason: str


def step(name: str, does: str, skipped: str = "") -> Step:
    """Make a line: skipped for a reason, or else done, with its purpose."""
    return Step(name, "skipped", skipped) if skipped else Step(name, "done", does)


def skipped_together(kind: str, skipped: Mapping[str, str]) -> list[Step]:
    """Make one line for all that is skipped for the same reason: "checks fig6_peak, fig6_end"."""
    lines = []
    for reason in dict.fromkeys(skipped.values()):
        names = [name for name, why in skipped.items() if why == reason]
        lines.append(Step(f"{kind} {', '.join(names)}", "skipped", reason))
    return lines


def noted(plan: Iterable[Step], changed: Iterable[Step]) -> tuple[Step, ...]:
    """Replace the lines of a plan that a run carried out otherwise, by their names."""
    instead = {line.step: line for line in changed}
    return tuple(instead.get(line.step, line) for line in plan)
