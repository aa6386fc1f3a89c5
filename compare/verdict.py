"""Checks: two values, their relative difference with its error bound, and the verdict on it (ASME V&V 20)."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal, TypeVar

from scenes.formats import difference_text, percent, quantity
from scenes.model import Declared
from scenes.result import Estimate

PAPER = "paper"
"""The name of the paper's own model."""
COVERS = 2.0
"""Standard uncertainties of a normal distribution within which 95 % lie (GUM 6.3.3)."""

Verdict = Literal["agrees", "differs", "unresolved"]
Sense = Literal["equal", "at least", "at most"]
"""The claim about the measured value: it equals the predicted one, or is on one side of it."""
M = TypeVar("M")
"""The type of the outcome that checks compare models of."""


@dataclass(frozen=True)
class Check:
    """A comparison with 3D, or with a claim, and once it is `judged` the verdict on it.

    Attributes
    ----------
    predicted, measured : the reduction, or the claim, and 3D, in ``unit``
    difference, u_num : relative; u_num bounds the numerical error of the difference
    time : time (s) of the largest difference over time
    sense : of a one-sided claim the difference is the shortfall of the measured value
    relative_to : the scale of the difference in words
    u_input, u_data : relative standard uncertainties by inputs and data; the verdict counts u_data twice (95 %)
    tolerance : of the difference
    expected : the verdict that the scene declares, None without a declaration
    because : why both differ; of a judged check that agrees, empty
    own : False for an equation of the paper's where another 1D model was chosen
    """

    title: str
    predicted: float
    measured: float
    unit: str
    difference: float
    u_num: float
    because: str = ""
    time: float | None = None
    sense: Sense = "equal"
    relative_to: str = ""
    u_data: float | None = None
    u_input: float | None = None
    id: str = ""
    tolerance: float = 0.0
    verdict: Verdict = "unresolved"
    expected: Verdict | None = None
    own: bool = True

    @property
    def known_to(self) -> float:
        """The bound of the difference that the verdict counts."""
        return self.u_num + COVERS * (self.u_data or 0.0)


Definition = tuple[Callable[[M], Check | None], tuple[str, ...]]
"""The function that makes a check from an outcome, None where a model lacks the quantity; and the needs of the check.

A run that lacks one of the needs skips the check.
"""


def judge(difference: float, tolerance: float, u_num: float) -> Verdict:
    """Judge a difference with the error bound ``u_num``, all three relative.

    "differs" or "agrees" where every value within the error is beyond or within the tolerance, else "unresolved".
    """
    if abs(difference) - u_num > tolerance:
        return "differs"
    return "agrees" if abs(difference) + u_num <= tolerance else "unresolved"


def judged(name: str, c: Check, scene: Declared) -> Check:
    """Return the check of a comparison with its verdict; one that agrees needs no reason."""
    tolerance = scene.tolerance(name)
    verdict, because = judge(c.difference, tolerance, c.known_to), c.because
    if verdict == "agrees":
        because = ""
    elif verdict == "unresolved" and math.isfinite(c.known_to):
        off = difference_text(c.difference, c.known_to, "give or take")
        because = f"{off} may be on either side of the tolerance of {percent(tolerance)}: ask for a smaller accuracy"
        because += f"; {c.because}" * bool(c.because)
    declared: Verdict | None = None
    if scene.expected_to_differ is not None:
        declared = "differs" if name in scene.expected_to_differ else "agrees"
    return replace(c, id=name, tolerance=tolerance, verdict=verdict, expected=declared, because=because)


def part(distance: float, scale: float) -> float:
    """Return distance / scale, infinite where only the latter is zero."""
    return distance / scale if scale else (0.0 if not distance else math.inf)


def compared(
    title: str, unit: str, predicted: Estimate, measured: Estimate, note: str = "", scale: Estimate | None = None,
    relative_to: str = "the 3D value", **more: Any,
) -> Check:  # fmt: skip
    """Compare two values, relative to a ``scale``, by default the measured value."""
    off = ratio(predicted, measured)
    if scale is not None:
        off = share(Estimate(predicted.value - measured.value, predicted.error + measured.error), scale)
    whole = f", relative to {relative_to}" * (scale is not None)
    values = f"{quantity(predicted.value, unit)} against {quantity(measured.value, unit)}{whole}"
    sides, reason = (predicted.value, measured.value), f"{values}: {note}".removesuffix(": ")
    return Check(title, *sides, unit, off.value, off.error, reason, relative_to=relative_to, **more)


def spread(function: Callable[..., float], inputs: Mapping[str, Estimate]) -> float:
    """Return the sum, over the inputs, of the larger change of a function when one is moved up or down by its error.

    It is a sum, not a root of squares, because the errors are bounds and come from one mesh.
    """
    values = {name: estimate.value for name, estimate in inputs.items()}
    middle, total = function(**values), 0.0
    for name, estimate in inputs.items():
        moved = (function(**(values | {name: estimate.value + sign * estimate.error})) for sign in (1, -1))
        total += max(0.0 if value == middle else abs(value - middle) if value == value else math.inf for value in moved)
    return total


def ratio(predicted: Estimate, measured: Estimate) -> Estimate:
    """Return predicted / measured - 1 with its error bound, infinite where the measured value may be zero."""
    return _estimated(lambda a, b: part(a - b, b), measured, a=predicted, b=measured)


def share(distance: Estimate, scale: Estimate) -> Estimate:
    """Return distance / scale with its error bound, infinite where the scale may be zero."""
    return _estimated(part, scale, distance=distance, scale=scale)


def _estimated(function: Callable[..., float], divisor: Estimate, **inputs: Estimate) -> Estimate:
    """A function of inputs with its error bound: infinite where the divisor may be zero, none where it is zero."""
    error = 0.0 if divisor == Estimate(0.0, 0.0) else math.inf
    if abs(divisor.value) > divisor.error:
        error = spread(function, inputs)
    return Estimate(function(**{name: each.value for name, each in inputs.items()}), error)


def unit_of(key: str) -> str:
    """Return the unit that a quantity's name ends in: "anchor_resistance_K_per_W" is in K/W."""
    return "K/W" if key.endswith("K_per_W") else key.rpartition("_")[2]


def amount(value: float, unit: str, digits: int = 4) -> str:
    """Write a check's value: "50.70 ms"; "never" for an infinite time, "none" for other values that are not finite."""
    if math.isfinite(value):
        return quantity(value, "" if unit == "1" else unit, digits)
    return "never" if unit == "s" else "none"
