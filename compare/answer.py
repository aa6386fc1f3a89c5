"""The answer of a run in a sentence: how far a 1D model is from 3D, where, and why."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from compare.verdict import Check, Verdict
from scenes.formats import difference_text, percent, quantity

MORE = 1.1
"""A difference over time larger than this many times the steady one has a cause of its own."""
SHOWN = 3
"""Quantities that a sentence has room for."""


@dataclass(frozen=True)
class Claim:
    """The relative difference of a quantity, 1D less 3D, with its error bound.

    ``where`` is the quantity in a sentence; ``time`` (s) of the largest difference, None in the steady state;
    ``remark`` adds detail.
    """

    where: str
    difference: float
    u_num: float
    verdict: Verdict
    time: float | None = None
    remark: str = ""

    @property
    def most(self) -> float:
        """A bound of its size."""
        return abs(self.difference) + self.u_num

    @property
    def size(self) -> str:
        """Its size with the error where that matters, or a bound where it has no sign: "6.6 % low at the peak"."""
        when = "" if self.time is None else f" (at {quantity(self.time, 's', 3)})"
        if abs(self.difference) <= self.u_num:
            limit = ", all that 3D is known to," if self.verdict == "unresolved" else ""
            return f"within {bound(self.most)}{limit} of 3D at {self.where}{when}"
        size = percent(abs(self.difference))
        if 10 * self.u_num > abs(self.difference):
            size = difference_text(abs(self.difference), self.u_num, "give or take").removeprefix("+")
        return f"{size} {'low' if self.difference < 0 else 'high'} at {self.where}{when}"

    def repeats(self, steady: Sequence[Claim]) -> bool:
        """Whether a difference over time is the steady one again."""
        rest = next((other for other in steady if other.where == self.where), None)
        if rest is None or self.difference * rest.difference < 0:
            return False
        return abs(self.difference) <= MORE * abs(rest.difference) + self.u_num + rest.u_num


def claim(check: Check, where: str, remark: str = "") -> Claim:
    """Return the claim of a check."""
    return Claim(where, check.difference, check.u_num, check.verdict, check.time, remark)


def answer(who: str, claims: Sequence[Claim], why: Callable[[Sequence[Claim]], str] = lambda _: "") -> str:
    """Return the sentences about a model ``who``; ``why`` names the causes of some claims."""
    steady, course = ([each for each in claims if (each.time is None) is at_rest] for at_rest in (True, False))
    far = [each for each in course if each.verdict != "agrees" and not each.repeats(steady)]
    said = [f"{who} is {_list(steady, '')} in the steady state{why(steady)}"] if steady else []
    if far:
        start = "On the way it is" if steady else f"{who} is"
        said.append(f"{start} up to {_list(far, ', relative to the final rise' * bool(steady))}{why(far)}")
    elif course and all(each.verdict == "agrees" for each in claims):
        most, before = (max((each.most for each in some), default=0.0) for some in (course, steady))
        near = "no farther" if most <= before else f"within {bound(most)} of {'the final rise' if steady else '3D'}"
        said = [f"{said[0]}, and {near} on the way" if steady else f"{who} is {near} at {_places(course)} over time"]
    return f"{'. '.join(said)}."


def _places(claims: Sequence[Claim]) -> str:
    return " and ".join(each.where for each in claims) if len(claims) <= SHOWN else f"{len(claims)} quantities"


def _list(claims: Sequence[Claim], ending: str) -> str:
    """Up to three claims, the largest first where there are more, and the bound of the rest."""
    agree = [each for each in claims if each.verdict == "agrees"]
    if len(agree) == len(claims) and (len(claims) > 2 or all(abs(each.difference) <= each.u_num for each in claims)):
        return f"within {bound(max(each.most for each in claims))} of 3D at {_places(claims)}"
    shown = list(claims)
    if len(claims) > 2:
        shown = sorted((each for each in claims if each not in agree), key=lambda each: -abs(each.difference))[:SHOWN]
    rest = [each for each in claims if each not in shown]
    near = [each.most for each in rest if each in agree]
    said = " and ".join(each.size for each in shown) + ending
    said += next((f": {each.remark}" for each in shown if each.remark), "")
    said += f", {len(rest) - len(near)} more differ" * (len(near) < len(rest))
    return said + (f", the rest within {bound(max(near))}" if near else "")


def bound(ratio: float) -> str:
    """Return a ratio in percent, rounded up to two digits."""
    if not 0 < ratio < math.inf:
        return percent(ratio)
    step = 10.0 ** (math.floor(math.log10(ratio)) - 1)
    return percent(math.ceil(ratio / step - 1e-9) * step)
