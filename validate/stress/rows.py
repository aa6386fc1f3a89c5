"""What one test of robustness came to: a row of the table."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

Outcome = Literal["holds", "breaks", "as predicted", "failed"]


@dataclass(frozen=True)
class Row:
    """A measure that should stay below a bound.

    ``what`` was run over ``extremes``; ``measure`` names the worst number found, ``found``, and ``bound`` its limit.
    ``ours`` is false for methods that are only there to be compared with: that one of them breaks is a finding, not a
    fault. ``said`` tells more: where the worst is, what broke.
    """

    group: str
    what: str
    extremes: str
    measure: str
    found: float
    bound: float
    ours: bool = True
    said: str = ""

    @property
    def verdict(self) -> Outcome:
        """Whether the bound holds."""
        if math.isnan(self.found):
            return "failed"
        if self.found <= self.bound:
            return "holds"
        return "breaks" if self.ours else "as predicted"


def failed(group: str, what: str, error: BaseException) -> Row:
    """A row for a test that ended in an error."""
    return Row(group, what, "", "ended", math.nan, 0.0, True, f"{type(error).__name__}: {error}")
