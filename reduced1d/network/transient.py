"""A network over time: collocation at Radau's points, on steps that grow with the time since anything changed.

The linear part is four sparse factorizations a step, decoupled by the eigenvectors of Radau's matrix;
how heat follows the temperature through the resistances is settled by sweeps over the step, which is taken in halves
where they do not settle.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np

from reduced1d.network.circuit import factor
from reduced1d.network.model import Model
from reduced1d.radau import radau, within
from scenes.errors import RunawayError

POINTS = 7
"""Number of Radau's points in a step: values between them are those of their polynomial, whose error is the largest in
a long step."""
SWEEPS = 30
ROUNDING = 1e-8  # of the largest rise in a step: changes below this that no longer shrink are rounding
SHORTEST = 1e-10  # of the end time: a step that has to be shorter has run away


@dataclass(frozen=True, eq=False)
class History:
    """A network from rest on: the ends of its steps (s), and in each the free rises (f, points + 1) at its start and
    points."""

    model: Model
    marks: tuple[float, ...]
    values: tuple[np.ndarray, ...]

    def at(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Rises (n, times), potentials (n, times) and inputs (inputs, times) at ascending times (s); at a jump inputs
        and held ends are those after it."""
        model = self.model
        x = np.array([model.inputs.at(t) for t in times.tolist()]).reshape(len(times), -1).T
        rises = np.zeros((model.elements.size, len(times)))
        if model.heat is not None:
            free_rises = np.zeros((model.heat.free.shape[1], len(times)))
            for start, stop, values in zip(self.marks, self.marks[1:], self.values, strict=False):
                columns = slice(*np.searchsorted(times, [start, stop], side="right"))
                free_rises[:, columns] = values @ within(POINTS, (times[columns] - start) / (stop - start)).T
            rises = model.heat.free @ free_rises + model.heat.fixed @ x
        potentials = np.zeros_like(rises) if model.current is None else model.potentials(rises, x)
        return rises, potentials, x


def history(model: Model, end: float, first: float, growth: float, settled: float) -> History:
    """The network from rest at the initial temperature up to an ``end`` (s). A step ends at ``growth`` times its start,
    since the last jump or bend of an input, and the ``first`` (s) after that. A change of ``settled`` times the largest
    rise in a step ends its sweeps.

    Raises RunawayError where the heating outruns every step.
    """
    if model.heat is None or not end > 0:
        return History(model, (0.0,), ())
    march = _March(model, end, settled)
    march.run(growth, first)
    return History(model, tuple(march.marks), tuple(march.values))


class _March:
    def __init__(self, model: Model, end: float, settled: float) -> None:
        assert model.heat is not None
        self.model, self.end, self.heat, self.settled = model, end, model.heat, settled
        free = self.heat.free
        self.capacity = (free.T @ model.capacity @ free).tocsc()
        self.stiffness = (free.T @ model.stiffness @ free).tocsc()
        self.lifted = free.T @ model.capacity @ self.heat.fixed
        self.entering = free.T @ (model.entering - model.stiffness @ self.heat.fixed)
        self.mass = factor(self.capacity)
        self.marks, self.values = [0.0], list[np.ndarray]()
        self.potentials: np.ndarray | None = None

    def run(self, growth: float, first: float) -> None:
        """Fills ``marks`` and ``values``."""
        inputs = self.model.inputs
        v = self._jumped(np.zeros(self.capacity.shape[0]), np.zeros(len(inputs.values)), inputs.at(0.0))
        for start, stop in pairwise([0.0, *(t for t in inputs.breaks if 0 < t < self.end), self.end]):
            count = max(int(np.ceil(np.log(max((stop - start) / first, 1.0)) / np.log(growth))), 1)
            marks = [start, *(start + (stop - start) * growth ** np.arange(1.0 - count, 0.0)), stop]
            # The values at the end from within the interval, before a jump there.
            x0, x1 = inputs.at(start), self._until(start, stop)
            for a, b in pairwise(marks):
                v = self._advanced(v, a, b, x0 + (x1 - x0) * (a - start) / (stop - start), (x1 - x0) / (stop - start))
            v = self._jumped(v, x1, inputs.at(stop))

    def _until(self, start: float, stop: float) -> np.ndarray:
        """The inputs at the end of an interval without jumps inside, before one there: they are linear in it."""
        middle = self.model.inputs.at((start + stop) / 2)
        return 2 * middle - self.model.inputs.at(start)

    def _jumped(self, v: np.ndarray, before: np.ndarray, after: np.ndarray) -> np.ndarray:
        """The free rises after a jump of the inputs: given temperatures take their nodes along, and no heat."""
        step = self.lifted @ (after - before)
        return v - self.mass.solve(step) if np.any(step) else v

    def _advanced(self, v: np.ndarray, start: float, stop: float, x: np.ndarray, slope: np.ndarray) -> np.ndarray:
        """The free rises at the end of a step."""
        values = self._step(v, stop - start, x, slope)
        if values is None:
            if stop - start < SHORTEST * self.end:
                raise RunawayError(f"the network's heating runs away after {start:.3g} s (thermal runaway)", np.inf)
            middle = (start + stop) / 2
            v = self._advanced(v, start, middle, x, slope)
            return self._advanced(v, middle, stop, x + slope * (middle - start), slope)
        self.marks.append(stop)
        self.values.append(values)
        return values[:, -1]

    def _step(self, v: np.ndarray, h: float, x: np.ndarray, slope: np.ndarray) -> np.ndarray | None:
        """Free rises (f, points + 1) at the start and at the points of a step (s); None where sweeps do not settle."""
        matrix, (rates, vectors, inverse) = radau(POINTS)[0], _apart()
        places = matrix.sum(axis=1)
        inputs = x[:, None] + slope[:, None] * (h * places)
        given = self.entering @ inputs - (self.lifted @ slope)[:, None]
        start = (self.capacity @ v)[:, None]
        factors = [factor(self.capacity + (h * (r if r.imag else r.real)) * self.stiffness) for r in rates]
        stages, before = np.repeat(v[:, None], POINTS, axis=1), np.inf
        for _ in range(SWEEPS):
            heat = given + self._joule(stages, inputs)
            right = (start + h * heat @ matrix.T) @ inverse.T
            updated = np.zeros((len(v), POINTS))
            for r, lu, one, back in zip(rates, factors, right.T, vectors.T, strict=True):
                part = lu.solve(one if r.imag else one.real)
                updated += (2 if r.imag else 1) * np.real(np.outer(part, back))
            change, stages = float(np.abs(updated - stages).max()), updated
            largest = float(np.abs(updated).max())
            if not np.isfinite(change):
                return None
            rounding = change <= ROUNDING * largest and change >= before / 4
            if change <= self.settled * largest or rounding or not self.model.couples:
                return np.concatenate([v[:, None], stages], axis=1)
            if change > 2 * before:
                return None
            before = change
        return None

    def _joule(self, stages: np.ndarray, inputs: np.ndarray) -> np.ndarray | float:
        """(f, points): the Joule heat at the points of a step."""
        model = self.model
        if model.current is None:
            return 0.0
        rises = self.heat.free @ stages + self.heat.fixed @ inputs
        halves, resistance = model.resistances(rises)
        self.potentials = model.potentials(rises, inputs, self.potentials)
        return np.asarray(self.heat.free.T @ model.joule(halves, model.currents(resistance, self.potentials, inputs)))


@lru_cache(maxsize=1)
def _apart() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The eigenvalues of Radau's matrix, one of each pair, with their vectors and the rows of the vectors' inverse."""
    values, vectors = np.linalg.eig(radau(POINTS)[0])
    kept = np.flatnonzero(values.imag >= 0)
    return values[kept], vectors[:, kept], np.linalg.inv(vectors)[kept]
