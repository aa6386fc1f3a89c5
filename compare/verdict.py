"""A comparison, and the verdict on it, given the error of the 3D solution (ASME V&V 20)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from scenes.formats import difference_text, percent

if TYPE_CHECKING:
    from scenes.device import Device
    from scenes.model import Declared
    from scenes.result import Estimate, Result, Traces
    from scenes.sink import Sink

PAPERS = ("paper", "reduced1d")
"""What the paper's own model is called as a result."""

COVERS = 2.0
"""Standard uncertainties of a normal distribution within which 95 % lie (GUM 6.3.3)."""

Verdict = Literal["agrees", "differs", "unresolved"]
Sense = Literal["equal", "at least", "at most"]
"""What is claimed of the measured value: that it equals the predicted one, or one side only."""


@dataclass(frozen=True)
class Check:
    """One comparison with 3D.

    Attributes
    ----------
    predicted, measured : the reduction, or the claim, and 3D, in ``unit``
    difference, tolerance, u_num : relative; u_num bounds the numerical error of the difference
    expected : the verdict that the scene declares, None without a declaration
    because : the reason, where the verdict is not "agrees"
    time : time (s) of the largest difference over time
    sense : of a one-sided claim the difference is the shortfall of the measured value
    relative_to : the scale of the difference in words
    own : False for an equation of the paper's where another 1D model was chosen
    u_input, u_data : relative standard uncertainties by inputs and data; the verdict counts u_data twice (95 %)
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
    u_input: float | None = None
    u_data: float | None = None

    @property
    def known_to(self) -> float:
        """The bound of the difference that the verdict counts."""
        return self.u_num + COVERS * (self.u_data or 0.0)


def judge(difference: float, tolerance: float, u_num: float) -> Verdict:
    """Judge a difference with the error bound ``u_num``, all three relative.

    "differs" or "agrees" where every value within the error is beyond or within the tolerance, else "unresolved".
    """
    if abs(difference) - u_num > tolerance:
        return "differs"
    return "agrees" if abs(difference) + u_num <= tolerance else "unresolved"


def relative(predicted: float, measured: float) -> float:
    """predicted / measured - 1, infinite where only the latter is zero."""
    if measured == 0:
        return 0.0 if predicted == 0 else float("inf")
    return predicted / measured - 1


def spread(function: Callable[..., float], inputs: Mapping[str, Estimate]) -> float:
    """Return the sum, over the inputs, of the larger change of a function when one is moved up or down by its error.

    It is a sum, not a root of squares, because the errors are bounds and come from one mesh.
    """
    values = {name: estimate.value for name, estimate in inputs.items()}
    middle, total = function(**values), 0.0
    for name, estimate in inputs.items():
        moved = (function(**(values | {name: estimate.value + sign * estimate.error})) for sign in (1, -1))
        total += max(abs(value - middle) for value in moved)
    return total


@dataclass(frozen=True)
class Models:
    """The sink as ``given``, with its laws of the temperature, and the results of the models.

    ``single`` is 3D of one span alone, of a row of spans.
    """

    given: Sink
    fem3d: Result
    reduced1d: Result | None
    single: Result | None = None

    @property
    def sink(self) -> Sink:
        """The sink with constant properties, as the paper's equations take it."""
        return self.given.plain

    def steady(self, key: str) -> float:
        return self.fem3d.steady[key].value

    def reduction(self) -> Result:
        """The 1D result; ValueError where there is none."""
        if self.reduced1d is None:
            raise ValueError("this check needs the 1D model")
        return self.reduced1d

    def papers(self) -> bool:
        """Whether the reduction is the paper's own."""
        return self.reduction().model in PAPERS

    def traces(self) -> tuple[Traces, Traces]:
        """The traces of 1D and of 3D; ValueError where there are none."""
        return self.reduction().over_time, self.fem3d.over_time


@dataclass(frozen=True)
class Comparison:
    """A difference with its numerical error, both relative, and the two values in ``unit``.

    ``reason`` is the sentence for a difference, or a function that writes it; ``relative_to`` names the scale.
    """

    title: str
    predicted: float
    measured: float
    unit: str
    difference: float
    u_num: float
    reason: str | Callable[[], str]
    time: float | None = None
    sense: Sense = "equal"
    relative_to: str = ""
    u_data: float | None = None


def unit_of(key: str) -> str:
    """The unit that a quantity's name ends in: "anchor_resistance_K_per_W" is in K/W."""
    return "K/W" if key.endswith("K_per_W") else key.rpartition("_")[2]


def of_formula(
    models: Models, key: str, title: str, formula: Callable[..., float], reason: Callable[[float], str],
    **inputs: str | Estimate,
) -> Comparison:  # fmt: skip
    """Compare a formula with the steady 3D quantity ``key``: predicted / measured - 1.

    The ``inputs`` are names of 3D quantities or estimates; their errors count (`spread`). ``reason`` takes the
    predicted value.
    """
    measured = models.fem3d.steady[key]
    estimates = {
        name: models.fem3d.steady[source] if isinstance(source, str) else source for name, source in inputs.items()
    }
    predicted = formula(**{name: source.value for name, source in estimates.items()})

    def difference(measured_: float, **values: float) -> float:
        return relative(formula(**values), measured_)

    return Comparison(
        title, predicted, measured.value, unit_of(key), relative(predicted, measured.value),
        spread(difference, {**estimates, "measured_": measured}), lambda: reason(predicted), relative_to="the 3D value",
    )  # fmt: skip


def expected(scene: Sink | Device | Declared, check: str) -> Verdict | None:
    """Return the verdict that a scene declares; checks that are not in its list agree."""
    if scene.expected_to_differ is None:
        return None
    return "differs" if check in scene.expected_to_differ else "agrees"


def judged(name: str, comparison: Comparison, scene: Sink | Device | Declared, always: bool = False) -> Check:
    """The check of a comparison, with its verdict; ``always`` gives the reason whatever the verdict is."""
    tolerance = scene.tolerance(name)
    known_to = comparison.u_num + COVERS * (comparison.u_data or 0.0)
    verdict, because = judge(comparison.difference, tolerance, known_to), ""
    if verdict == "differs" or always:
        because = comparison.reason if isinstance(comparison.reason, str) else comparison.reason()
    elif verdict == "unresolved":
        because = (
            f"{difference_text(comparison.difference, known_to, 'give or take')} may be on either side of the "
            f"tolerance of {percent(tolerance)}: ask for a smaller accuracy"
        )
    return Check(
        name, comparison.title, comparison.predicted, comparison.measured, comparison.unit, comparison.difference,
        tolerance, comparison.u_num, verdict, expected(scene, name), because, comparison.time, comparison.sense,
        comparison.relative_to, u_data=comparison.u_data,
    )  # fmt: skip


def contradicts(check: Check, scene: Sink | Device | Declared, strict: bool) -> bool:
    """Return whether a check contradicts the scene: a declared verdict, or a tolerance that the scene itself sets.

    ``strict`` expects every undeclared check to agree, and takes "unresolved" for a contradiction. An equation that the
    chosen model does not use contradicts nothing.
    """
    if not check.own or (check.verdict == "unresolved" and not strict):
        return False
    if strict or check.expected is not None:
        return check.verdict != (check.expected or "agrees")
    declared = "slope" if check.id.startswith("slope_") else check.id
    return declared in scene.tolerances and check.verdict == "differs"


def contrary(checks: Iterable[Check], scene: Sink | Device | Declared, strict: bool = False) -> list[Check]:
    return [check for check in checks if contradicts(check, scene, strict)]
