"""Rows of the tables of `validate verify` and `validate stress`: a number beside its expected value."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

Verdict = Literal["agrees", "differs", "unresolved"]


@dataclass(frozen=True)
class Row:
    """One number, and how far it may be from the expected one.

    Attributes
    ----------
    group : the table that the row is in
    case : the problem that was solved
    quantity : the number's name
    found, expected, bound : in ``unit``; ``bound`` is the error bound of ``found`` and of ``expected``
    unit : of the three numbers
    relation : ``found`` should be near ``expected``, at most or at least as large, up to ``bound``
    settled : the largest ``bound`` with which the row is settled; None for any
    note : the source of the expected value, or where the worst of several numbers is
    """

    group: str
    case: str
    quantity: str = ""
    found: float = math.nan
    expected: float = math.nan
    bound: float = 0.0
    unit: str = ""
    relation: Literal["near", "at most", "at least"] = "near"
    settled: float | None = None
    note: str = ""

    @property
    def difference(self) -> float:
        """``found`` less ``expected``."""
        return self.found - self.expected

    @property
    def verdict(self) -> Verdict:
        """The judgement of the difference, and of the size of the bound."""
        excess = {"near": abs(self.difference), "at most": self.difference, "at least": -self.difference}[self.relation]
        if not (math.isfinite(self.bound) and excess <= self.bound):
            return "differs"
        return "unresolved" if self.settled is not None and self.bound > self.settled else "agrees"


def at_most(group: str, case: str, quantity: str, found: float, limit: float, note: str = "") -> Row:
    """Make a row whose number should be no larger than a limit."""
    return Row(group, case, quantity, found, limit, relation="at most", note=note)


def failed(group: str, case: str, error: BaseException) -> Row:
    """Make a row for a case that ended with an error."""
    return Row(group, case, "whole case", note=f"ended with {type(error).__name__}: {error}")
