"""Whether a reduction agrees with the 3D solution, given how well the 3D solution is known (ASME V&V 20)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from scenes.result import Estimate

Verdict = Literal["agrees", "differs", "unresolved"]
Sense = Literal["equal", "at least", "at most"]
"""What is claimed of the measured value: that it equals the predicted one, or one side only."""


@dataclass(frozen=True)
class Check:
    """One comparison of the reduction with the 3D solution.

    ``predicted`` (the reduction) and ``measured`` (3D) are in ``unit``; ``difference``, ``tolerance`` and ``u_num``,
    the bound of the difference's numerical error, are relative. ``expected`` is the verdict that the scene declares,
    ``None`` where it declares nothing. ``because`` says why in a sentence, where the verdict is not "agrees".
    ``time`` (s) is when the largest difference occurs, for the checks over time. Where ``sense`` is one-sided, the
    difference is what the measured value lacks of the claim, none where it holds. ``relative_to`` says in words what
    the difference is relative to. ``own`` is False for an equation of the paper's where another 1D model was chosen,
    which makes no use of it.
    """

    id: str
    title: str
    predicted: float
    measured: float
    unit: str
    difference: float
    tolerance: float
    u_num: float
    verdict: Verdict
    expected: Verdict | None = None
    because: str = ""
    time: float | None = None
    sense: Sense = "equal"
    relative_to: str = ""
    own: bool = True


def judge(difference: float, tolerance: float, u_num: float) -> Verdict:
    """The verdict on a difference that is known to within ``u_num``, all three relative.

    "differs" and "agrees" where every value that the difference may have is beyond or within the tolerance; else
    "unresolved". What is not a number is unresolved.
    """
    if abs(difference) - u_num > tolerance:
        return "differs"
    if abs(difference) + u_num <= tolerance:
        return "agrees"
    return "unresolved"


def relative(predicted: float, measured: float) -> float:
    """predicted / measured - 1, infinite where only the latter is zero."""
    if measured == 0:
        return 0.0 if predicted == 0 else float("inf")
    return predicted / measured - 1


def spread(function: Callable[..., float], inputs: Mapping[str, Estimate]) -> float:
    """How far the errors of the inputs may move a function of them: the sum, over the inputs, of the larger change
    when one is moved up or down by its error.

    A sum, not a root of squares, because the errors are bounds and come from one mesh: nothing says that they are
    independent. Where they would cancel, this is cautious.
    """
    values = {name: given.value for name, given in inputs.items()}
    middle = function(**values)
    total = 0.0
    for name, given in inputs.items():
        moved = (function(**(values | {name: given.value + sign * given.error})) for sign in (1, -1))
        total += max(abs(value - middle) for value in moved)
    return total
