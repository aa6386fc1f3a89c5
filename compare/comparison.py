"""What a definition of a check is given, and what it finds, before a tolerance judges it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from compare.verdict import Sense, relative, spread
from scenes.result import Estimate, Result
from scenes.sink import Sink


@dataclass(frozen=True)
class Models:
    """The sink and the answers to it; ``reduced1d`` is ``None`` where that model was not asked for."""

    sink: Sink
    fem3d: Result
    reduced1d: Result | None

    def estimates(self, **names: str) -> dict[str, Estimate]:
        """Steady 3D quantities under the argument names of a formula."""
        return {argument: self.fem3d.steady[key] for argument, key in names.items()}

    def reduction(self) -> Result:
        """The 1D result; ValueError where there is none."""
        if self.reduced1d is None:
            raise ValueError("this check needs the 1D model")
        return self.reduced1d


@dataclass(frozen=True)
class Comparison:
    """A difference with its numerical error, both relative, and the two values (in ``unit``) that it is of.

    ``reason`` writes the sentence that says why they differ; it is asked for only where they do. ``relative_to`` says
    what the difference is relative to.
    """

    title: str
    predicted: float
    measured: float
    unit: str
    difference: float
    u_num: float
    reason: Callable[[], str]
    time: float | None = None
    sense: Sense = "equal"
    relative_to: str = ""


def of_formula(
    title: str,
    unit: str,
    formula: Callable[..., float],
    inputs: Mapping[str, Estimate],
    measured: Estimate,
    reason: Callable[[float], str],
) -> Comparison:
    """A formula of 3D quantities against another 3D quantity: predicted / measured - 1.

    The error moves with every input's and the measured value's (``compare.verdict.spread``). ``reason`` is given the
    predicted value.
    """
    predicted = formula(**{name: given.value for name, given in inputs.items()})

    def difference(measured_: float, **values: float) -> float:
        return relative(formula(**values), measured_)

    u_num = spread(difference, {**inputs, "measured_": measured})
    return Comparison(
        title, predicted, measured.value, unit, relative(predicted, measured.value), u_num, lambda: reason(predicted),
        relative_to="the 3D value",
    )  # fmt: skip
