"""A comparison, and the verdict on it, given how well the 3D solution is known (ASME V&V 20)."""

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
    """One comparison of the reduction with the 3D solution.

    ``predicted`` (the reduction) and ``measured`` (3D) are in ``unit``; ``difference``, ``tolerance`` and ``u_num``,
    the bound of the difference's numerical error, are relative. ``expected`` is the verdict that the scene declares,
    ``None`` where it declares nothing. ``because`` says why in a sentence, where the verdict is not "agrees".
    ``time`` (s) is when the largest difference occurs, for the checks over time. Where ``sense`` is one-sided, the
    difference is what the measured value lacks of the claim, none where it holds. ``relative_to`` says in words what
    the difference is relative to. ``own`` is False for an equation of the paper's where another 1D model was chosen,
    which makes no use of it. ``u_input`` is the difference's standard uncertainty by that of the inputs, relative as
    it is; ``None`` where that isn't asked for or isn't known. ``u_data`` is the same by that of data that the 3D
    solution is compared with: the verdict counts it twice (95 %).
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
        """How far off the difference may be, as the verdict counts it."""
        return self.u_num + COVERS * (self.u_data or 0.0)


def judge(difference: float, tolerance: float, u_num: float) -> Verdict:
    """The verdict on a difference that is known to within ``u_num``, all three relative.

    "differs" and "agrees" where every value that the difference may have is beyond or within the tolerance; else
    "unresolved". What is not a number is unresolved.
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
    """How far the errors of the inputs may move a function of them: the sum, over the inputs, of the larger change
    when one is moved up or down by its error.

    A sum, not a root of squares, because the errors are bounds and come from one mesh: nothing says that they are
    independent. Where they would cancel, this is cautious.
    """
    values = {name: estimate.value for name, estimate in inputs.items()}
    middle, total = function(**values), 0.0
    for name, estimate in inputs.items():
        moved = (function(**(values | {name: estimate.value + sign * estimate.error})) for sign in (1, -1))
        total += max(abs(value - middle) for value in moved)
    return total


@dataclass(frozen=True)
class Models:
    """The sink and the answers to it; ``reduced1d`` is ``None`` where that model was not asked for. Of a row of spans
    there is also the 3D answer to a ``single`` one. The sink is ``given`` with its laws of the temperature."""

    given: Sink
    fem3d: Result
    reduced1d: Result | None
    single: Result | None = None

    @property
    def sink(self) -> Sink:
        """The sink as the paper's equations take it."""
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
        """Those of the 1D result and of the 3D one; ValueError where there are none."""
        return self.reduction().over_time, self.fem3d.over_time


@dataclass(frozen=True)
class Comparison:
    """A difference with its numerical error, both relative, and the two values (in ``unit``) that it is of.

    ``reason`` is the sentence that says why they differ, or writes it, where it is asked for. ``relative_to`` says what
    the difference is relative to.
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
    """A formula against the steady 3D quantity ``key``: predicted / measured - 1. Its ``inputs`` are 3D quantities, by
    their names, or given. ``reason`` is given the predicted value.

    The error moves with every input's and the measured value's (``spread``).
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
    """The verdict that a scene declares. Its list of checks that differ is complete: those not in it agree."""
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
    """Whether a check came out other than the scene declares.

    Only what is declared can be contradicted: a verdict that is the opposite of the declared one, or a difference
    beyond a tolerance that the scene itself sets. ``strict`` takes every check without a declaration as expected to
    agree, and takes "unresolved" for a contradiction of either. An equation that is not the chosen model's
    contradicts nothing.
    """
    if not check.own or (check.verdict == "unresolved" and not strict):
        return False
    if strict or check.expected is not None:
        return check.verdict != (check.expected or "agrees")
    declared = "slope" if check.id.startswith("slope_") else check.id
    return declared in scene.tolerances and check.verdict == "differs"


def contrary(checks: Iterable[Check], scene: Sink | Device | Declared, strict: bool = False) -> list[Check]:
    return [check for check in checks if contradicts(check, scene, strict)]
