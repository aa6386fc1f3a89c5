"""Reduce a model to the fewest states that hold an accuracy, judged by runs of the full model.

The states of a rich model are ordered by their effect on the outputs. The compact model is the smallest
leading part that stays within the accuracy of every reference run, the error bound of the run included.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from statespace.runtime import CompactModel, Given

Errors = dict[str, dict[str, dict[str, dict[str, float]]]]
"""By run, kind ("steady" or "over time") and output: the "error" in its unit and the "relative" one."""


@dataclass(frozen=True, eq=False)
class Reference:
    """A run of the full model.

    Attributes
    ----------
    inputs : Mapping
        Value of each input by name, a number or (times, values).
    times : (n,) array or None
        Instants in s at which the outputs are compared; None in the steady state.
    values, errors, scales : Mapping
        By output: values (n,) or a number, their error bound, and the size that errors are relative to.
    """

    inputs: Mapping[str, Given]
    times: np.ndarray | None
    values: Mapping[str, np.ndarray]
    errors: Mapping[str, float]
    scales: Mapping[str, float]

    @property
    def kind(self) -> str:
        return "steady" if self.times is None else "over time"

    def compare(self, model: CompactModel) -> dict[str, dict[str, float]]:
        """Bound the errors of a model: its distance from this run plus the error bound of the run."""
        found: Mapping[str, Any]
        found = model.steady(self.inputs) if self.times is None else model.simulate(self.times, self.inputs)
        return {
            name: relative(float(np.abs(found[name] - value).max()) + self.errors[name], self.scales[name])
            for name, value in self.values.items()
        }


def relative(error: float, scale: float) -> dict[str, float]:
    return {"error": error, "relative": error / scale}


def compare(model: CompactModel, references: Mapping[str, Sequence[Reference]]) -> Errors:
    """Bound the errors of a model by each of several runs."""
    return {name: {run.kind: run.compare(model) for run in runs} for name, runs in references.items()}


def worst(errors: Errors) -> float:
    """Return the largest relative error."""
    return max(e["relative"] for run in errors.values() for kind in run.values() for e in kind.values())


def reduce(
    document: Callable[[int], dict[str, Any]], most: int, references: Mapping[str, Sequence[Reference]],
    accuracy: float, states: int | None, full: str,
) -> dict[str, Any]:  # fmt: skip
    """Find the model of fewest states within an accuracy.

    Parameters
    ----------
    document : callable
        The document of the model of the first n states, without errors.
    most : int
        Number of states of the rich model.
    references : Mapping
        Runs of the full model by name.
    accuracy : float
        Largest relative error.
    states : int or None
        A number of states to take whatever the error, or None.
    full : str
        Name of the full model in messages.

    Returns
    -------
    dict
        The document, with "error". Where even ``most`` states miss the accuracy, the fewest whose error is about as
        small, with a sentence in "warnings".
    """
    known: dict[int, Errors] = {}

    def error(count: int) -> float:
        if count not in known:
            known[count] = compare(CompactModel(document(count)), references)
        return worst(known[count])

    count = fewest(most, error, accuracy) if states is None else min(states, most)
    warnings = []
    if error(count) > accuracy and states is None:
        count = fewest(most, error, 1.1 * error(count))
        warnings = [not_reached(accuracy, full, error(count))]
    return document(count) | {"error": known[count], "warnings": warnings}


def not_reached(accuracy: float, full: str, reached: float, because: str = "") -> str:
    """Write the warning of a model that misses its accuracy."""
    return (
        f"the compact model is known to be within {reached:.3g} of {full}, not within {accuracy:g}{because}: see its "
        "errors before you use it"
    )


def fewest(most: int, error: Callable[[int], float], accuracy: float) -> int:
    """Bisect for the smallest number of states, at most ``most``, whose error holds an accuracy.

    A number of states with which the model cannot be run does not hold it; ``most`` is taken where no other does.
    """

    def exceeds(count: int) -> bool:
        try:
            return error(count) > accuracy
        except (ArithmeticError, np.linalg.LinAlgError):
            return True

    low, high = 0, min(1, most)
    while high < most and exceeds(high):
        low, high = high, min(2 * high, most)
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if exceeds(middle) else (low, middle)
    return high


def leading(states: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Order the directions of a state space by their effect on the outputs.

    Parameters
    ----------
    states : (n, any) array
        Responses of the model, as states.
    rows : (outputs, n) array
        How the outputs follow the states.

    Returns
    -------
    (n, n) array
        Orthonormal directions in the order of their effect on the responses, in their norm, and on the outputs, each
        relative to its largest value.
    """
    size = np.abs(rows @ states).max(axis=1, initial=0.0)
    read = rows[size > 0] / size[size > 0, None]
    whole = float(np.linalg.norm(states, axis=0).max(initial=1e-300))
    weighed = np.linalg.cholesky(np.eye(len(states)) / whole**2 + read.T @ read)
    first = np.linalg.svd(weighed.T @ states, full_matrices=True)[0]
    return np.linalg.qr(np.linalg.solve(weighed.T, first))[0]
