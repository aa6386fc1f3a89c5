"""What one check of the code came to: a row of the table, and its verdict."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

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
    def difference(self) -> float:
        """Found less expected, in the row's unit."""
        return self.found - self.expected

    @property
    def verdict(self) -> Outcome:
        """Whether the difference is within the estimated error, and that error as small as was asked for."""
        if self.skipped:
            return "skipped"
        if not (math.isfinite(self.difference) and math.isfinite(self.error)):
            return "differs"
        if abs(self.difference) > self.error:
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
    """A row that says why a case was not run."""
    return Row(family, case, "", "", math.nan, math.nan, math.nan, note=reason, skipped=True)
