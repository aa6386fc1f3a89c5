"""Discretization of 1D models: polynomials along lines by scikit-fem, collocation at Radau's points in time.

C dv/dt = -K v + q(t, v) is integrated by Radau IIA of s points, which has order 2 s - 1 and damps components that are
too fast for a step, however fast (Hairer and Wanner, Solving Ordinary Differential Equations II, section IV.5). With A
the Radau matrix, the stages V = v + h A dV solve

    C V + h A (K V - q) = C v,

which the eigenvectors of A decouple into (C + h r K) w = right-hand side, one for each pair of eigenvalues r. The heat
q depends weakly on the stages, and fixed-point sweeps settle it; a step whose sweeps do not settle is halved.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import lru_cache
from itertools import pairwise
from typing import Any, NamedTuple, Protocol

import numpy as np
import scipy.sparse as sp
from numpy.polynomial import legendre

from scenes.errors import RunawayError

POINTS = 7
"""Radau's points of a step, of order 13: on steps that double, rises are within 1e-6 of the largest."""


class Elements:
    """Elements of a degree between the ``nodes`` (m) of each line.

    ``values`` and ``slopes`` (points, n) take the n unknowns to the points of the quadrature, whose ``weights`` and
    ``places`` along their lines are in m. The potentials of electrodes that no voltage gives, ``terminals`` by the
    number of their boundary, are unknowns behind the unknowns of the lines.
    """

    def __init__(self, nodes: Sequence[np.ndarray], degree: int, terminals: Sequence[int] = ()) -> None:
        from skfem import Basis, ElementLinePp, MeshLine

        self.nodes, self.degree = nodes, degree
        self.first_node = np.cumsum([0, *(len(x) for x in nodes)])
        self.first = np.cumsum([0, *(len(x) - 1 for x in nodes)])
        starts = np.concatenate([f + np.arange(len(x) - 1) for f, x in zip(self.first_node, nodes, strict=False)])
        # Every line from zero on: nodes far from the origin would lose digits.
        mesh = MeshLine(np.concatenate([x - x[0] for x in nodes])[None], np.stack([starts, starts + 1]))
        basis = Basis(mesh, ElementLinePp(degree), intorder=2 * degree + 2)
        self.dofs = basis.element_dofs
        self.terminals = {number: int(basis.N) + k for k, number in enumerate(terminals)}
        self.size = int(basis.N) + len(terminals)
        self.lengths = np.concatenate([np.diff(x) for x in nodes])
        self.points = basis.X.shape[1]
        self.weights = np.asarray(basis.dx).ravel()
        starts_at = np.repeat([x[0] for x in nodes], np.diff(self.first) * self.points)
        self.places = starts_at + np.asarray(basis.global_coordinates())[0].ravel()
        shape = (len(starts), self.points)
        fields = [field[0] for field in basis.basis]
        elements = np.repeat(np.arange(len(starts)), self.points)
        self.values = self._rows(elements, [np.broadcast_to(np.asarray(f), shape) for f in fields])
        self.slopes = self._rows(elements, [np.broadcast_to(f.grad[0], shape) for f in fields])

    def _rows(self, elements: np.ndarray, functions: list[np.ndarray]) -> sp.csr_matrix:
        """(rows, n): one row for each of the ``elements``, from the value of each of its functions."""
        data = np.concatenate([f.ravel() for f in functions])
        columns = np.concatenate([d[elements] for d in self.dofs])
        rows = np.tile(np.arange(len(elements)), len(functions))
        return sp.csr_matrix((data, (rows, columns)), shape=(len(elements), self.size))

    def mass(self, factors: np.ndarray) -> sp.csr_matrix:
        """(n, n): the integrals of products of the functions, times a factor for each element."""
        return self.values.T @ sp.diags_array(np.repeat(factors, self.points) * self.weights) @ self.values

    def stiffness(self, factors: np.ndarray) -> sp.csr_matrix:
        """(n, n): the same of products of their slopes."""
        return self.slopes.T @ sp.diags_array(np.repeat(factors, self.points) * self.weights) @ self.slopes

    def integral(self, factors: np.ndarray) -> np.ndarray:
        """(n,): the integrals of the functions, times a factor for each element."""
        return np.asarray(self.values.T @ (np.repeat(factors, self.points) * self.weights))

    def inside(self, line: int, start: float, stop: float) -> np.ndarray:
        """The points of the quadrature between two nodes of a line (m)."""
        a, b = (self.first[line] + int(np.searchsorted(self.nodes[line], x)) for x in (start, stop))
        return np.arange(a * self.points, b * self.points)

    def mean(self, line: int, start: float, stop: float) -> sp.csr_matrix:
        """(1, n): the mean between two nodes of a line; the value where they are one place."""
        if start == stop:
            return self.at([line], np.array([start]))[0]
        q = self.inside(line, start, stop)
        return sp.csr_matrix(self.weights[None, q] / self.weights[q].sum()) @ self.values[q]

    def unit(self, unknown: int) -> sp.csr_matrix:
        """(1, n): one of the unknowns."""
        return sp.csr_matrix(([1.0], ([0], [unknown])), shape=(1, self.size))

    def end(self, line: int, end: int) -> int:
        """The number of the unknown that is the value at a line's end (0 or 1)."""
        return int(self.first_node[line] if end == 0 else self.first_node[line + 1] - 1)

    def at(self, lines: Sequence[int], places: np.ndarray) -> tuple[sp.csr_matrix, sp.csr_matrix]:
        """(places, n) twice: values and slopes at places (m), each along one of the lines."""
        from skfem import ElementLinePp

        shapes, nodes = ElementLinePp(self.degree), [self.nodes[i] for i in lines]
        inner = np.array([min(max(int(np.searchsorted(x, place, side="right")) - 1, 0), len(x) - 2)
                          for x, place in zip(nodes, places.tolist(), strict=True)], int)  # fmt: skip
        element = self.first[np.asarray(lines)] + inner
        local = (places - [x[k] for x, k in zip(nodes, inner.tolist(), strict=True)]) / self.lengths[element]
        each = [shapes.lbasis(local[None], i) for i in range(len(self.dofs))]
        return (
            self._rows(element, [value for value, _ in each]),
            self._rows(element, [slope[0] / self.lengths[element] for _, slope in each]),
        )


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
    problem: Problem, v: np.ndarray, start: float, stop: float, first: float, growth: float, settled: float,
    steps: list[Step],
) -> np.ndarray:  # fmt: skip
    """Integrate from ``start`` to ``stop`` (s), in steps that grow and are halved where their sweeps do not settle.

    Parameters
    ----------
    v : (n,) array
        The state at the start.
    first : float
        The longest first step (s); each later one ends at ``growth`` times its begin, counted from the start.
    settled : float
        Change, relative to the largest value, that ends the sweeps.
    steps : list
        Takes the steps.

    Raises
    ------
    RunawayError
        Where a step has to be shorter than 1e-10 of the interval.
    """
    length = stop - start
    count = math.ceil(max(math.log(length / first) / math.log(growth), 0.0))
    marks = [start, *(start + length * growth ** np.arange(-count, 0.0)), stop]
    pairs = list(pairwise(marks))[::-1]
    while pairs:
        begin, end = pairs.pop()
        values = _step(problem, v, begin, end, settled)
        if values is not None:
            steps.append(Step(begin, end, values))
            v = values[:, -1]
            continue
        if end - begin < 1e-10 * length:
            raise RunawayError(f"the heating runs away after {begin:.3g} s (thermal runaway)", math.inf)
        middle = (begin + end) / 2
        pairs += [(middle, end), (begin, middle)]
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
