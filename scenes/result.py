"""The answer of a model to a scene, one type for every model; and the plan of a run, each step with its reason."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    import numpy as np


@dataclass(frozen=True)
class Estimate:
    """A number with an estimated bound of its numerical error, both in the same unit."""

    value: float
    error: float


@dataclass(frozen=True)
class Traces:
    """Quantities over time: ``values[name]`` has one entry per entry of ``time`` (s); ``errors[name]`` bounds the
    numerical error of all that are `sure`, in the unit of the values: from ``since`` (s) on (of a sink from 10 us on),
    but for a while after each of the ``jumps`` of the drives: pairs of its time and that while (s). ``early`` bounds
    them at all other times, where known."""

    time: np.ndarray
    values: dict[str, np.ndarray]
    errors: dict[str, float]
    since: float = 0.0
    jumps: tuple[tuple[float, float], ...] = ()
    early: dict[str, float] = field(default_factory=dict)

    def error_at(self, name: str, times: np.ndarray) -> np.ndarray:
        """Return (n,) the error bound of a quantity at some ``times`` (n,), in s; infinite where none is known."""
        import numpy as np

        return np.where(self.sure(times), self.errors[name], self.early.get(name, np.inf))

    def sure(self, times: np.ndarray) -> np.ndarray:
        """(n,): at which of some ``times`` (n,), in s, the errors hold. If a jump with as long a while follows closely,
        they hold from half way to it on."""
        mask = times >= self.since * (1 - 1e-9)
        for n, (jump, wait) in enumerate(self.jumps, 1):
            following = next((at for at, other in self.jumps[n:] if other >= wait), float(self.time[-1]))
            until = jump + min(wait, (following - jump) / 2) * (1 - 1e-9)
            mask &= ~((times >= jump) & (times < until))
        return mask

    def extremes(self, name: str) -> list[Estimate]:
        """Return the least and the largest value of a quantity; a row with a wide error may have the true extreme."""
        errors, found = self.error_at(name, self.time), []
        for sign in (-1.0, 1.0):
            values, bounds = sign * self.values[name][errors < math.inf], errors[errors < math.inf]
            top = values.max()
            error = max((bounds + (values - top)).max(), (bounds - (values - top)).min())
            found.append(Estimate(float(sign * top), float(error)))
        return found


@dataclass(frozen=True)
class Result:
    """A model's steady state, its traces over time (``None`` for a steady run) and remarks on the run.

    Steady keys are as in summary.json (``peak_rise_K``, ``current_A`` ...), trace keys as in traces.csv without
    the model's name (``peak_K``, ``current_A`` ...). ``details`` holds quantities of some models (unknowns, steps,
    energy imbalance, profiles, fields).
    """

    model: str
    steady: dict[str, Estimate]
    traces: Traces | None = None
    details: dict[str, Any] = field(default_factory=dict)

    @property
    def over_time(self) -> Traces:
        """The traces; ValueError where there are none."""
        if self.traces is None:
            raise ValueError(f"{self.model} was not solved over time")
        return self.traces


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
