"""Few states over time: collocation at Radau's points, on steps that grow with the time since the switch was closed.

Radau IIA with five points is of order 9, and damps what is too fast for a step, however fast (Hairer and Wanner,
Solving Ordinary Differential Equations II, section IV.5). In modes its linear part is one small inverse a mode and
step, which needs no iteration; the resistance's feedback is weak, and a few sweeps over a step settle it.
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
    first ends at or before the first time asked for.

    Raises RunawayError where the feedback outruns every step.
    """
    end = float(times[-1]) if len(times) else 0.0
    states = np.zeros((len(times), model.states))
    if end > 0:
        edges = _edges(end, times, growth)
        operators = _operators(model.rates, np.diff(edges))
        # Which times lie in a step, and the collocation polynomial's weights there.
        of_step = np.searchsorted(times, edges, side="right")
        step = np.clip(np.searchsorted(edges, times, side="left") - 1, 0, None)
        weights = _weights((times - edges[step]) / np.diff(edges)[step])
        state = np.zeros(model.states)
        for k, (a, b) in enumerate(pairwise(edges)):
            values = _step(model, state, operators[0][k], operators[1][k])
            if values is None:
                state = _in_halves(model, state, times, states, a, b, end)
                continue
            here = slice(of_step[k], of_step[k + 1])
            states[here] = weights[here] @ values.T
            state = values[:, -1]
    return states, model.voltage / (model.resistance + model.coefficient * (states @ model.source))


def _edges(end: float, times: np.ndarray, growth: float) -> np.ndarray:
    first = min(float(times[times > 0][0]), _FIRST * end)
    count = max(int(np.ceil(np.log(end / first) / np.log(growth))), 1)
    return np.concatenate([[0.0], end * growth ** np.arange(-count, 1.0)])


def _step(model: FewStates, state: np.ndarray, decay: np.ndarray, response: np.ndarray) -> np.ndarray | None:
    """States (n, points + 1) at a step's start and points; ``None`` where the sweeps do not settle.

    ``decay`` (n, points) of the state and ``response`` (n, points, points) to heat at the points are ``_operators``'s.
    """
    free = decay * state[:, None]
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


def _in_halves(
    model: FewStates, state: np.ndarray, times: np.ndarray, states: np.ndarray, a: float, b: float, end: float
) -> np.ndarray:
    """The step from ``a`` to ``b`` as two, each again in halves where it must be; fills ``states``."""
    if b - a < _SHORTEST * end:
        raise RunawayError(
            f"at {model.voltage:g} V the heating runs away after {a:.3g} s (thermal runaway)", runaway_voltage(model)
        )
    for left, right in ((a, (a + b) / 2), ((a + b) / 2, b)):
        decay, response = _operators(model.rates, np.array([right - left]))
        values = _step(model, state, decay[0], response[0])
        if values is None:
            state = _in_halves(model, state, times, states, left, right, end)
            continue
        here = slice(np.searchsorted(times, left, side="right"), np.searchsorted(times, right, side="right"))
        states[here] = _weights((times[here] - left) / (right - left)) @ values.T
        state = values[:, -1]
    return state


def _operators(rates: np.ndarray, lengths: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """For steps of some lengths (s): the decay (steps, n, points) of each mode's start value to the points, and the
    response (steps, n, points, points) at the points to heat at the points: of (1 + rate h A)^-1 applied to 1 and h A.
    """
    matrix = _radau()[0]
    inverse = np.linalg.inv(np.eye(POINTS) + np.multiply.outer(lengths, rates)[..., None, None] * matrix)
    return inverse.sum(axis=-1), lengths[:, None, None, None] * (inverse @ matrix)


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
