"""Few states over time: collocation at Radau's points, on steps that grow with the time since the switch was closed.

Radau IIA with five points is of order 9, and damps what is too fast for a step, however fast (Hairer and Wanner,
Solving Ordinary Differential Equations II, section IV.5). In modes its linear part is one small inverse a mode and
step, which needs no iteration; the resistance's feedback is weak, and a few sweeps over a step settle it. scipy's Radau
method, of order 5 and for anything, takes ten times as long.
"""

from __future__ import annotations

from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.polynomial import legendre

from reduced1d.errors import RunawayError
from reduced1d.ladder.few_states import FewStates
from reduced1d.ladder.steady import runaway_voltage

POINTS = 5
SWEEPS = 25
SETTLED = 1e-11  # of the largest value in a step: the change that ends the sweeps
_FIRST = 1e-4  # of the end time: the first step
_SHORTEST = 1e-10  # of the end time: a step that has to be shorter has run away


def trajectory(model: FewStates, times: np.ndarray, growth: float = 2.0) -> tuple[np.ndarray, np.ndarray]:
    """States (times, n) and currents (times,) at ``times`` (s, ascending, not negative), from rest.

    A step ends at ``growth`` times its start, so that its error is a fixed part of what happens around that time; the
    first ends at or before the first time asked for. One whose sweeps do not settle is taken in halves.

    Raises RunawayError where the feedback outruns every step.
    """
    end = float(times[-1]) if len(times) else 0.0
    states = np.zeros((len(times), model.states))

    def advanced(state: np.ndarray, start: float, stop: float) -> np.ndarray:
        """The state at the end of a step; fills ``states`` within it."""
        values = _step(model, state, stop - start)
        if values is None:
            if stop - start < _SHORTEST * end:
                said = f"at {model.voltage:g} V the heating runs away after {start:.3g} s (thermal runaway)"
                raise RunawayError(said, runaway_voltage(model))
            middle = (start + stop) / 2
            return advanced(advanced(state, start, middle), middle, stop)
        here = slice(*np.searchsorted(times, [start, stop], side="right"))
        states[here] = _weights((times[here] - start) / (stop - start)) @ values.T
        return values[:, -1]

    if end > 0:
        first = min(float(times[times > 0][0]), _FIRST * end)
        count = max(int(np.ceil(np.log(end / first) / np.log(growth))), 1)
        state = np.zeros(model.states)
        for start, stop in pairwise([0.0, *end * growth ** np.arange(-count, 1.0)]):
            state = advanced(state, start, stop)
    return states, model.voltage / (model.resistance + model.coefficient * (states @ model.source))


def _step(model: FewStates, state: np.ndarray, length: float) -> np.ndarray | None:
    """States (n, points + 1) at the start and at the points of a step (s); ``None`` where the sweeps do not settle."""
    matrix = _radau()[0]
    # Of each mode, (1 + rate h A)^-1 applied to 1 and to h A: the decay of its start, and its response to heat.
    inverse = np.linalg.inv(np.eye(POINTS) + length * model.rates[:, None, None] * matrix)
    free, response = inverse.sum(axis=-1) * state[:, None], length * (inverse @ matrix)
    source, feedback = model.source[:, None], model.coefficient * model.feedback
    to_resistance = model.coefficient * model.source
    values = np.repeat(state[:, None], POINTS, axis=1)
    for _ in range(SWEEPS):
        resistance = model.resistance + to_resistance @ values
        if not resistance.min() > 0:
            return None
        heat = (model.voltage / resistance) ** 2 * (source + feedback @ values)
        found = free + np.matmul(response, heat[:, :, None])[:, :, 0]
        change, values = np.abs(found - values).max(), found
        if change <= SETTLED * np.abs(found).max():
            return np.concatenate([state[:, None], values], axis=1)
    return None


@lru_cache(maxsize=1)
def _radau() -> tuple[np.ndarray, np.ndarray]:
    """The matrix A that integrates polynomials through Radau's points in (0, 1] up to each, and the inverse of the
    Vandermonde matrix, in Legendre polynomials, of 0 and the points."""
    # The right Radau points are the zeros of P_q - P_(q-1).
    points = (np.sort(legendre.legroots([0.0] * (POINTS - 1) + [-1.0, 1.0])) + 1) / 2
    powers = np.arange(POINTS)
    vandermonde = points[:, None] ** powers
    integrals = points[:, None] ** (powers + 1) / (powers + 1)
    nodes = np.concatenate([[0.0], points])
    return integrals @ np.linalg.inv(vandermonde), np.linalg.inv(legendre.legvander(2 * nodes - 1, POINTS))


def _weights(tau: np.ndarray) -> np.ndarray:
    """(tau, points + 1): what takes values at a step's start and points to those at parts ``tau`` of the step."""
    found: np.ndarray = legendre.legvander(2 * tau - 1, POINTS) @ _radau()[1]
    return found
