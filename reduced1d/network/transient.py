"""A network over time: collocation at Radau's points, on steps that grow with the time since anything changed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from reduced1d.network.circuit import factor
from reduced1d.network.model import Model
from reduced1d.radau import ShortStepError, Step, interpolate, march
from scenes.errors import RunawayError


@dataclass(frozen=True, eq=False)
class History:
    """A network from rest on, by steps of the free rises."""

    model: Model
    steps: tuple[Step, ...]

    @property
    def middles(self) -> np.ndarray:
        """The middles of the steps (s)."""
        return np.array([(step.start + step.stop) / 2 for step in self.steps])

    def at(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Rises (n, times), potentials (n, times) and inputs (inputs, times) at ascending times (s); at a jump inputs
        and held ends have the values after it."""
        model = self.model
        x = np.array([model.inputs.at(t) for t in times.tolist()]).reshape(len(times), -1).T
        rises = np.zeros((model.elements.size, len(times)))
        if model.heat is not None:
            rises = model.heat.fixed @ x
            if self.steps:
                rises = rises + model.heat.free @ interpolate(self.steps, times)
        return rises, model.potentials(rises, x), x


def history(model: Model, end: float, first: float, growth: float, settled: float) -> History:
    """Integrate a network from rest at the initial temperature up to an ``end`` (s).

    A step ends at ``growth`` times its start, since the last jump or bend of an input, and the ``first`` (s) after it.
    A change of ``settled`` times the largest rise in a step ends its sweeps.

    Raises RunawayError where the heating outruns every step.
    """
    steps = list[Step]()
    if model.heat is None or not end > 0:
        return History(model, ())
    problem, inputs = _Problem(model), model.inputs
    v = problem.jumped(np.zeros(problem.capacity.shape[0]), np.zeros(len(inputs.values)), inputs.at(0.0))
    for start, stop in pairwise([0.0, *(t for t in inputs.breaks if 0 < t < end), end]):
        count = max(int(np.ceil(np.log(max((stop - start) / first, 1.0)) / np.log(growth))), 1)
        x = inputs.at(start)
        # Inputs are linear in the interval, up to the values before a jump at its end.
        problem.start, problem.x, problem.slope = start, x, 2 * (inputs.at((start + stop) / 2) - x) / (stop - start)
        marks = [start, *(start + (stop - start) * growth ** np.arange(1.0 - count, 0.0)), stop]
        try:
            v = march(problem, v, marks, settled, end, steps)
        except ShortStepError as error:
            text = f"the network's heating runs away after {error.start:.3g} s (thermal runaway)"
            raise RunawayError(text, np.inf) from None
        v = problem.jumped(v, x + problem.slope * (stop - start), inputs.at(stop))
    return History(model, tuple(steps))


class _Problem:
    """The free rises of a network as a problem of `reduced1d.radau`, with inputs x + slope (t - start)."""

    start: float
    x: np.ndarray
    slope: np.ndarray

    def __init__(self, model: Model) -> None:
        assert model.heat is not None
        self.model, self.circuit, free = model, model.heat, model.heat.free
        self.capacity = (free.T @ model.capacity @ free).tocsc()
        self.stiffness = (free.T @ model.stiffness @ free).tocsc()
        self.lifted = free.T @ model.capacity @ self.circuit.fixed
        self.entering = free.T @ (model.entering - model.stiffness @ self.circuit.fixed)
        self.mass = factor(self.capacity)
        self.potentials: np.ndarray | None = None

    def stored(self, v: np.ndarray) -> np.ndarray:
        return np.asarray(self.capacity @ v)

    def solver(self, shift: complex) -> Callable[[np.ndarray], np.ndarray]:
        solve: Callable[[np.ndarray], np.ndarray] = factor(self.capacity + shift * self.stiffness).solve
        return solve

    def heat(self, times: np.ndarray, stages: np.ndarray) -> np.ndarray:
        inputs = self.x[:, None] + self.slope[:, None] * (times - self.start)
        given = self.entering @ inputs - (self.lifted @ self.slope)[:, None]
        rises = self.circuit.free @ stages + self.circuit.fixed @ inputs
        if self.model.current is not None:
            self.potentials = self.model.potentials(rises, inputs, self.potentials)
            given = given + self.circuit.free.T @ self.model.joule(rises, self.potentials, inputs)
        return np.asarray(given)

    def jumped(self, v: np.ndarray, before: np.ndarray, after: np.ndarray) -> np.ndarray:
        """The free rises after a jump of the inputs: given temperatures take their nodes along, and no heat."""
        step = self.lifted @ (after - before)
        return v - self.mass.solve(step) if np.any(step) else v
