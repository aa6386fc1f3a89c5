"""Reduce a linear state space that currents heat to the fewest states that hold an accuracy.

With z = (1, inputs g, states a) the equations are

    (A z) c = S z,    da/dt = F z + sum_p c_i c_j Q_p z - I d(1, g)/dt,
    rows = Y z + W dg/dt + R da/dt + sum_i c_i U_i z + sum_p c_i c_j P_p z

for current fields c, whose pairs p = (i, j) have i <= j. The states are coefficients of fields that are orthonormal in
the heat capacity, so that the part of F on the states is symmetric. A step dg of given temperatures takes the heat
I dg at once. The states of `statespace.runtime` are b = a + I (1, g), so that no input is differentiated there.

Combinations of the fields are ordered by their effect on the outputs; the reduced model is the smallest leading part
that stays within the accuracy of every reference run, the error bound of the run included. Source: Antoulas,
Approximation of Large-Scale Dynamical Systems, 2005, chapter 11.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import astuple, dataclass, replace
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from scenes.model import Schedule, Value
from scenes.result import Result
from statespace.runtime import CompactModel, Given

SOONER = 3.0  # the first shift is the earliest time over this: fields of a shift hold responses from a tenth of it on

Times = tuple[float, float] | None
"""The earliest time and the slowest response (s) of a model; None of a model of the steady state."""
Errors = dict[str, dict[str, dict[str, dict[str, float]]]]
"""By run, kind ("steady" or "over time") and output: the "error" in its unit and the "relative" one."""


@dataclass(frozen=True, eq=False)
class Row:
    """A row of the outputs: its parts of Y (z,), W (inputs,), R (n,), U (fields, z) and P (pairs, z)."""

    y: Any = 0.0
    w: Any = 0.0
    r: Any = 0.0
    u: Any = 0.0
    p: Any = 0.0

    def __add__(self, other: Row) -> Row:
        return Row(*(a + b for a, b in zip(astuple(self), astuple(other), strict=True)))

    def __rmul__(self, factor: float) -> Row:
        return Row(*(factor * part for part in astuple(self)))


class Port(NamedTuple):
    """The quantity that goes with an input.

    row : the row of the current or heat that enters or, where heat is given, of the mean temperature that it meets
    unit, size : the unit of the row, and the watts of one unit of the input, 1 where the input is no heat
    """

    row: int
    unit: str
    size: float = 1.0


@dataclass(frozen=True, eq=False)
class StateSpace:
    """A state space with outputs and a port per input.

    Attributes
    ----------
    matrices : dict
        The matrices of the equations by their letters.
    outputs : dict
        By name the numbers of the rows, their reduction ("mean", "max", "min" or "measured"), and the unit.
    kelvin : float
        The size of the rise of a state of size one (K).
    """

    matrices: dict[str, np.ndarray]
    outputs: dict[str, tuple[list[int], str, str]]
    ports: list[Port]
    kelvin: float

    @staticmethod
    def of_rows(
        system: Mapping[str, np.ndarray], outputs: Mapping[str, tuple[list[Row], str, str]],
        ports: Sequence[tuple[Row, str, float]], kelvin: float,
    ) -> StateSpace:  # fmt: skip
        """Make the state space of a ``system`` A, S, F, Q and I, with the rows of its outputs and ports."""
        rows = [row for each, _, _ in outputs.values() for row in each] + [row for row, _, _ in ports]
        (n, z), fields, pairs = system["F"].shape, len(system["S"]), len(system["Q"])
        shapes = {"Y": (z,), "W": (z - n - 1,), "R": (n,), "U": (fields, z), "P": (pairs, z)}
        parts = zip(*map(astuple, rows), strict=True)
        read = {letter: np.array([np.zeros(shape) + one for one in each])
                for (letter, shape), each in zip(shapes.items(), parts, strict=True)}  # fmt: skip
        read |= {letter: np.moveaxis(read[letter], 0, 1) for letter in "UP"}
        numbers, first = {}, 0
        for name, (read_rows, how, unit) in outputs.items():
            numbers[name] = list(range(first, first + len(read_rows))), how, unit
            first += len(read_rows)
        numbered = [Port(first + k, unit, size) for k, (_, unit, size) in enumerate(ports)]
        return StateSpace({**system, **read}, numbers, numbered, kelvin)

    @property
    def states(self) -> int:
        return len(self.matrices["F"])

    @property
    def given(self) -> int:
        """How many entries of z precede the states."""
        return int(self.matrices["I"].shape[1])

    def within(self, basis: np.ndarray) -> StateSpace:
        """Project the state space on the orthonormal columns of a basis (n, k)."""
        m, given = dict(self.matrices), self.given
        for letter in "ASFQYUP":
            m[letter] = np.concatenate([m[letter][..., :given], m[letter][..., given:] @ basis], axis=-1)
        m |= {letter: basis.T @ m[letter] for letter in "FQI"}
        return replace(self, matrices=m | {"R": m["R"] @ basis})

    @property
    def thermal(self) -> list[int]:
        """The rows of the outputs in kelvin."""
        return [row for rows, _, unit in self.outputs.values() if unit == "K" for row in rows]

    def amplitudes(self, b: np.ndarray, g: np.ndarray) -> np.ndarray:
        """(times, n): the states a for states b (times, n) of the modes and inputs g (times, inputs)."""
        given = np.concatenate([np.ones((len(g), 1)), g], axis=1)
        return np.asarray(b @ self.in_modes()[1].T - given @ self.matrices["I"].T)

    def in_modes(self) -> tuple[dict[str, np.ndarray], np.ndarray]:
        """Return the matrices of `statespace.runtime` with states b that decay on their own, each in units of its
        largest effect on a temperature, and a matrix T (n, n) with a = T b - I (1, g)."""
        given = self.given
        rates, modes = self.modes()
        m = self.within(modes).matrices
        m["F"][:, given:] = -np.diag(rates)
        jump = m.pop("I")
        for letter in "ASFQYUP":
            m[letter][..., :given] -= m[letter][..., given:] @ jump
        R = m.pop("R")
        m |= {"Y": m["Y"] + R @ m["F"], "P": m["P"] + R @ m["Q"], "W": m["W"] - R @ jump[:, 1:]}
        size = np.abs(m["Y"][self.thermal, given:]).max(axis=0, initial=0.0)
        unit = np.maximum(size, 0.1 * self.kelvin)
        for letter in "ASFQYUP":
            m[letter][..., given:] /= unit
        m |= {letter: unit[:, None] * m[letter] for letter in "FQ"}
        return m, modes / unit

    def modes(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the decay rates (n,) in 1/s, ascending, and the modes (n, n)."""
        inner = -self.matrices["F"][:, self.given :]
        rates, modes = np.linalg.eigh((inner + inner.T) / 2)
        return np.maximum(rates, 0.0), modes

    def leading(self, steps: np.ndarray, rest: np.ndarray, times: Times) -> np.ndarray:
        """Order the directions of the state space by their effect on the outputs.

        Parameters
        ----------
        steps, rest : (inputs,) arrays
            The size of a step of each input, and the input at rest.

        Returns
        -------
        (n, n) array
            Orthonormal directions in the order of their effect on the responses to the steps, in their norm and on the
            rows, each relative to its largest value.
        """
        m, n, given = self.matrices, self.states, self.given
        rates, modes = self.modes()
        rates = np.maximum(rates, 1e-12 * rates.max(initial=0.0))[:, None]
        still = np.concatenate([[1.0], rest, np.zeros(n)])
        # A pair of currents is as large as steps of the voltages make it.
        largest = np.abs(np.linalg.solve(m["A"] @ still, m["S"][:, 1:given] * steps)).max(axis=1, initial=0.0)
        first, second = np.triu_indices(len(largest))
        sizes = largest[first] * largest[second]
        loads = [m["F"][:, 1:given] * steps]
        for heat, size in zip(m["Q"], sizes, strict=True):
            cold = size * (heat @ still)
            steady = modes @ ((modes.T @ cold) / rates[:, 0])
            loads += [cold[:, None], size * heat[:, 1:given] * steps, (size * heat[:, given:] @ steady)[:, None]]
        heating, decaying = modes.T @ np.hstack(loads), modes.T @ (m["I"][:, 1:] * steps)
        responses = [heating / rates]
        for g in [] if times is None else np.geomspace(times[0] / SOONER, max(times), 12):
            responses += [g * heating / (1 + g * rates), decaying / (1 + g * rates)]
        states = modes @ np.column_stack(responses)
        rows = m["Y"][:, given:]
        size = np.abs(rows @ states).max(axis=1, initial=0.0)
        read = rows[size > 0] / size[size > 0, None]
        whole = float(np.linalg.norm(states, axis=0).max(initial=1e-300))
        weighed = np.linalg.cholesky(np.eye(n) / whole**2 + read.T @ read)
        ordered = np.linalg.svd(weighed.T @ states, full_matrices=True)[0]
        return np.linalg.qr(np.linalg.solve(weighed.T, ordered))[0]


@dataclass(frozen=True, eq=False)
class Reference:
    """A run of the full model, with the value of each input by its name.

    times : (n,), instants in s at which the outputs are compared; None in the steady state
    values, errors, scales : by output, values (n,) or a number, their error bound, and the size of relative errors
    """

    inputs: Mapping[str, Given]
    times: np.ndarray | None
    values: Mapping[str, np.ndarray]
    errors: Mapping[str, float]
    scales: Mapping[str, float]

    @staticmethod
    def of_result(
        inputs: Mapping[str, Value], result: Result, scales: Mapping[str, float], at: Any = slice(None)
    ) -> Reference:
        """The run of a result, of its traces at some of their times if it has any."""
        tables = {n: (v.times, v.values) if isinstance(v, Schedule) else v for n, v in inputs.items()}
        if result.traces is None:
            values = {n: np.array(e.value) for n, e in result.steady.items()}
            return Reference(tables, None, values, {n: e.error for n, e in result.steady.items()}, scales)
        traces = result.traces
        return Reference(tables, traces.time[at], {n: v[at] for n, v in traces.values.items()}, traces.errors, scales)

    def compare(self, model: CompactModel) -> dict[str, dict[str, float]]:
        """Bound the errors of a model: its distance from this run plus the error bound of the run."""
        found: Mapping[str, Any]
        found = model.steady(self.inputs) if self.times is None else model.simulate(self.times, self.inputs)
        return {
            name: relative(float(np.abs(found[name] - value).max()) + self.errors[name], self.scales[name])
            for name, value in self.values.items()
        }


References = Mapping[str, Sequence[Reference]]
"""The runs of the full model by name, in the steady state, over time, or both."""


def relative(error: float, scale: float) -> dict[str, float]:
    return {"error": error, "relative": error / scale}


def compare(document: Mapping[str, Any], references: References) -> Errors:
    """Bound the errors of the model of a document by each of several runs."""
    model = CompactModel(document)
    return {
        name: {"steady" if run.times is None else "over time": run.compare(model) for run in runs}
        for name, runs in references.items()
    }


def relative_errors(errors: Errors) -> np.ndarray:
    """Return all relative errors (runs and outputs,)."""
    return np.array([e["relative"] for run in errors.values() for kind in run.values() for e in kind.values()])


def worst(errors: Errors) -> float:
    """Return the largest relative error."""
    return float(relative_errors(errors).max())


def reduce(
    document: Callable[[int], dict[str, Any]], most: int, references: References, accuracy: float, states: int | None,
    full: str,
) -> tuple[dict[str, Any], float]:  # fmt: skip
    """Find the model of fewest states, at most ``most``, within a relative accuracy; or of a number of ``states``.

    ``document(n)`` is the document of the model of the first n directions. The result has "error" too. Errors that
    exceed the accuracy even with ``most`` states may be a tenth larger than there, and "warnings" state the distance
    from the ``full`` model. Also return the largest error with ``most`` states.
    """

    @cache
    def compare_once(count: int) -> Errors:
        return compare(document(count), references)

    def errors(count: int) -> np.ndarray:
        return relative_errors(compare_once(count))

    allowed = np.maximum(accuracy, 1.1 * errors(most))
    count = min(states, most) if states is not None else fewest(most, lambda n: bool((errors(n) <= allowed).all()))
    missed = states is None and errors(count).max() > accuracy
    warnings = [not_reached(accuracy, full, errors(count).max())] if missed else []
    return document(count) | {"error": compare_once(count), "warnings": warnings}, float(errors(most).max())


def not_reached(accuracy: float, full: str, reached: float, because: str = "") -> str:
    """Write the warning of a model that misses its accuracy."""
    return (
        f"the compact model is known to be within {reached:.3g} of {full}, not within {accuracy:g}{because}: see its "
        "errors before you use it"
    )


def fewest(most: int, holds: Callable[[int], bool]) -> int:
    """Bisect for the smallest number of states, at most ``most``, that holds an accuracy.

    A number of states with which the model cannot be run does not hold it; ``most`` is taken where no other does.
    """

    def exceeds(count: int) -> bool:
        try:
            return not holds(count)
        except (ArithmeticError, np.linalg.LinAlgError):
            return True

    low, high = 0, min(1, most)
    while high < most and exceeds(high):
        low, high = high, min(2 * high, most)
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if exceeds(middle) else (low, middle)
    return high
