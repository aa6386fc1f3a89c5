"""What the code was found to give, next to what it should give: the rows of the table, and scenes that are solved for
some of them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from fem3d import solve_scene
from scenes.model import Scene

Outcome = Literal["agrees", "differs", "unresolved", "skipped"]

ORDER_TOLERANCE = 0.1  # that an observed order may be off from theory


@dataclass(frozen=True)
class Row:
    """One quantity of one case.

    ``expected``, ``found`` and ``error``, the estimated error of what was found (with what is not known of the expected
    value), are in ``unit``; ``limit`` is the largest error with which the case is settled (``None``: any). ``note`` is
    a source, or the reason why a row was skipped. ``count`` says over how many values the row is the worst.
    """

    family: str
    case: str
    quantity: str
    unit: str
    expected: float
    found: float
    error: float
    limit: float | None = None
    note: str = ""
    count: int = 1
    skipped: bool = False

    @property
    def named(self) -> str:
        return f"{self.quantity} ({self.unit})" if self.unit not in ("", "order") else self.quantity

    @property
    def difference(self) -> float:
        """Found less expected, in the row's unit."""
        return self.found - self.expected

    @property
    def verdict(self) -> Outcome:
        """Whether the difference is within the estimated error, and that error as small as was asked for."""
        if self.skipped:
            return "skipped"
        if not (math.isfinite(self.error) and abs(self.difference) <= self.error):
            return "differs"
        return "unresolved" if self.limit is not None and self.error > self.limit else "agrees"


def order_row(family: str, case: str, quantity: str, theory: float, observed: float, note: str = "") -> Row:
    """The observed order of convergence against the theoretical one; they agree within `ORDER_TOLERANCE`."""
    return Row(family, case, quantity, "order", theory, observed, ORDER_TOLERANCE, note=note)


def observed_order(errors: Sequence[float], ratio: float) -> float:
    """The order from two errors, (coarse, fine), on meshes or steps whose sizes are ``ratio`` (> 1) apart."""
    coarse, fine = errors
    return math.log(coarse / fine) / math.log(ratio) if coarse > 0 and fine > 0 else math.nan


def skipped(family: str, case: str, reason: str) -> Row:
    return Row(family, case, "", "", math.nan, math.nan, math.nan, note=reason, skipped=True)


ACCURACY = 1e-4  # asked of the solver
SETTLED = 1e-4  # of the scale: the largest estimated error with which an exact case counts as settled


@dataclass(frozen=True)
class Expected:
    """What a probe should read: a number or, for a transient, one per output time, in ``unit`` (temperatures in K).

    ``scale`` is what errors are measured against: the largest rise, flow or current. ``unsure`` is how far the
    expected value may be off itself: rounding of a printed one, the approximation in a scene. ``settled`` is the part
    of the scale that the estimated error may reach; ``None`` for any.
    """

    probe: str
    unit: str
    value: float | np.ndarray
    scale: float
    unsure: float = 0.0
    name: str = ""
    settled: float | None = SETTLED
    note: str = ""


def rows(family: str, case: str, scene: Scene, expected: Sequence[Expected], note: str = "") -> Iterator[Row]:
    """Solves the scene and compares; of a trace the row shows the instant that is furthest off."""
    result = solve_scene.solve(scene)
    for each in expected:
        values = np.atleast_1d(np.asarray(each.value, dtype=float))
        if result.traces is None:
            estimate = result.steady[each.probe]
            found, error = np.array([estimate.value]), estimate.error
        else:
            found = np.interp(scene.output_times, result.traces.time, result.traces.values[each.probe])
            error = result.traces.errors[each.probe]
        worst = int(np.abs(found - values).argmax())
        limit = None if each.settled is None else each.settled * each.scale + each.unsure
        yield Row(
            family, case, each.name or each.probe, each.unit, float(values[worst]), float(found[worst]),
            error + each.unsure, limit, each.note or note, len(values),
        )  # fmt: skip
