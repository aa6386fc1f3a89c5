"""Integrate C dv/dt = -K v + q(t, v) by collocation at Radau's points.

Radau IIA of s points has order 2 s - 1 and damps components that are too fast for a step, however fast (Hairer and
Wanner, Solving Ordinary Differential Equations II, section IV.5). With A the Radau matrix, the stages V = v + h A dV
solve

    C V + h A (K V - q) = C v,

which the eigenvectors of A decouple into (C + h r K) w = right-hand side, one for each pair of eigenvalues r. The heat
q depends weakly on the stages, and fixed-point sweeps settle it; a step whose sweeps do not settle is halved.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from itertools import pairwise
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.polynomial import legendre


class ShortStepError(ArithmeticError):
    """A step from a ``start`` (s) would have to be too short: the solution grows without bound."""

    def __init__(self, start: float) -> None:
        super().__init__(f"the solution grows without bound after {start:.3g} s")
        self.start = start


class Problem(Protocol):
    """A heat problem over time, on n states."""

    def stored(self, v: np.ndarray) -> np.ndarray:
        """C v (n,)."""

    def solver(self, shift: complex) -> Callable[[np.ndarray], np.ndarray]:
        """The inverse of C + shift K."""

    def heat(self, times: np.ndarray, stages: np.ndarray) -> np.ndarray | None:
        """q (n, points) at times (s) and stages (n, points); None where there is none."""


class Step(NamedTuple):
    """A step from ``start`` to ``stop`` (s): states (n, points + 1) at its start and at Radau's points."""

    start: float
    stop: float
    values: np.ndarray


POINTS = 7
"""Radau's points of a step, of order 13: on steps that double, rises are within 1e-6 of the largest."""


@lru_cache
def radau() -> tuple[np.ndarray, ...]:
    """Radau's points of (0, 1] and the matrix A; its eigenvalues, one of each pair, with their vectors and the rows of
    the inverse of the vectors; and the inverse Vandermonde matrix, in Legendre polynomials, of 0 and the points."""
    # The right Radau points are the zeros of P_s - P_(s-1): real, though numpy 2.5 gives them as complex numbers.
    points = (np.sort(legendre.legroots([0.0] * (POINTS - 1) + [-1.0, 1.0]).real) + 1) / 2
    powers = np.arange(POINTS)
    integrals = points[:, None] ** (powers + 1) / (powers + 1)
    matrix = integrals @ np.linalg.inv(points[:, None] ** powers)
    values, vectors = np.linalg.eig(matrix)
    kept = np.flatnonzero(values.imag >= 0)
    nodes = np.concatenate([[0.0], points])
    inverse = np.linalg.inv(legendre.legvander(2 * nodes - 1, POINTS))
    return points, matrix, values[kept], vectors[:, kept], np.linalg.inv(vectors)[kept], inverse


def interpolate(steps: Sequence[Step], times: np.ndarray) -> np.ndarray:
    """(n, times): the states at ascending times (s), by the polynomials of the steps."""
    states = np.zeros((len(steps[0].values) if steps else 0, len(times)))
    for start, stop, values in steps:
        columns = slice(*np.searchsorted(times, [start, stop], side="right"))
        part = (times[columns] - start) / (stop - start)
        states[:, columns] = values @ (legendre.legvander(2 * part - 1, POINTS) @ radau()[-1]).T
    return states


def march(
    problem: Problem, v: np.ndarray, marks: Sequence[float], settled: float, end: float, steps: list[Step]
) -> np.ndarray:
    """Integrate from mark to mark (s), in as many halves as needed.

    Parameters
    ----------
    v : (n,) array
        The state at the first mark.
    settled : float
        Change, relative to the largest value, that ends the sweeps.
    end : float
        End of the run (s).
    steps : list
        Takes the steps.

    Raises
    ------
    ShortStepError
        Where a step has to be shorter than 1e-10 of the run.
    """
    pairs = list(pairwise(marks))[::-1]
    while pairs:
        start, stop = pairs.pop()
        values = _step(problem, v, start, stop, settled)
        if values is not None:
            steps.append(Step(start, stop, values))
            v = values[:, -1]
            continue
        if stop - start < 1e-10 * end:
            raise ShortStepError(start)
        middle = (start + stop) / 2
        pairs += [(middle, stop), (start, middle)]
    return v


def _step(problem: Problem, v: np.ndarray, start: float, stop: float, settled: float) -> np.ndarray | None:
    """States (n, points + 1) at the start and the points of a step; None where the sweeps do not settle."""
    places, matrix, rates, vectors, inverse, _ = radau()
    h, stored = stop - start, problem.stored(v)[:, None]
    solvers = [problem.solver(h * (r if r.imag else r.real)) for r in rates]
    stages, before = np.repeat(v[:, None], POINTS, axis=1), np.inf
    for _ in range(30):  # a step that needs more sweeps is halved
        heat: Any = problem.heat(start + h * places, stages)
        if heat is None:
            return None
        right = (stored + h * heat @ matrix.T) @ inverse.T
        updated = np.zeros_like(stages)
        for r, solve, one, back in zip(rates, solvers, right.T, vectors.T, strict=True):
            part = solve(one if r.imag else one.real)
            updated += (2 if r.imag else 1) * np.real(np.outer(part, back))
        change, stages = float(np.abs(updated - stages).max()), updated
        largest = float(np.abs(updated).max())
        if not np.isfinite(change) or change > 2 * before:
            return None
        # Rounding errors no longer shrink.
        if change <= settled * largest or (change <= 1e-8 * largest and change >= before):
            return np.concatenate([v[:, None], stages], axis=1)
        before = change
    return None
