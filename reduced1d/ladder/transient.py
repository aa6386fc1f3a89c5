"""Few states over time: collocation at Radau's points, on steps that grow with the time since the switch was closed.

Radau IIA with five points is of order 9, and damps what is too fast for a step, however fast (Hairer and Wanner,
Solving Ordinary Differential Equations II, section IV.5). In modes its linear part is one small inverse a mode and
step, which also needs no iteration; the resistance's feedback is weak, and a few sweeps over a step settle it.
"""

from __future__ import annotations

from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.polynomial import legendre

from reduced1d.errors import RunawayError
from reduced1d.ladder.few_states import FewStates

POINTS = 5
SWEEPS = 25
_FIRST = 1e-4  # of the end time: the first step
_SHORTEST = 1e-10  # of the end time: a step that has to be shorter has run away


def trajectory(model: FewStates, times: np.ndarray, growth: float = 2.0) -> tuple[np.ndarray, np.ndarray]:
    """States (times, n) and currents (times,) at ``times`` (s, ascending, not negative), from rest.

    A step ends at ``growth`` times its start, so that its error is a fixed part of what happens around that time. In
    the first one nothing faster than a thousandth of the first time asked for is resolved.

    Raises RunawayError where the feedback outruns every step.
    """
    end = float(times[-1]) if len(times) else 0.0
    states = np.zeros((len(times), model.states))
    if end > 0:
        edges = _edges(end, times, growth)
        inverses = _inverses(model.rates, np.diff(edges))
        state = np.zeros(model.states)
        for k, (a, b) in enumerate(pairwise(edges)):
            values = _step(model, state, inverses[k], b - a)
            if values is None:
                state = _in_halves(model, state, times, states, a, b, end)
                continue
            here = slice(np.searchsorted(times, a, side="right"), np.searchsorted(times, b, side="right"))
            states[here] = _inside((times[here] - a) / (b - a)) @ values
            state = values[-1]
    return states, model.voltage / (model.resistance + model.coefficient * (states @ model.source))


def _edges(end: float, times: np.ndarray, growth: float) -> np.ndarray:
    first = min(float(times[times > 0][0]), _FIRST * end)
    count = max(int(np.ceil(np.log(end / first) / np.log(growth))), 1)
    return np.concatenate([[0.0], end * growth ** np.arange(-count, 1.0)])


def _step(model: FewStates, state: np.ndarray, inverse: np.ndarray, length: float) -> np.ndarray | None:
    """States (points + 1, n) at a step's start and points; ``None`` where the sweeps do not settle."""
    matrix = length * _radau()[1]
    values = np.repeat(state[None], POINTS, axis=0)
    scale = None
    for _ in range(SWEEPS):
        resistance = model.resistance + model.coefficient * (values @ model.source)
        if not np.all(resistance > 0):
            return None
        squared = (model.voltage / resistance)[:, None] ** 2
        heat = squared * (model.source + model.coefficient * (values @ model.feedback))
        # (points, n): one inverse a mode, on the values at the points.
        found = np.matmul(inverse, (state + matrix @ heat).T[:, :, None])[:, :, 0].T
        change = float(np.abs(found - values).max())
        scale = max(float(np.abs(found).max()), 1e-300)
        values = found
        if change <= 1e-12 * scale:
            return np.concatenate([state[None], values])
        if not np.isfinite(change):
            break
    return None


def _in_halves(
    model: FewStates, state: np.ndarray, times: np.ndarray, states: np.ndarray, a: float, b: float, end: float
) -> np.ndarray:
    """The step from ``a`` to ``b`` as two, each again in halves where it must be; fills ``states``."""
    if b - a < _SHORTEST * end:
        raise RunawayError(f"at {model.voltage:g} V the heating runs away at {a:.3g} s (thermal runaway)", float("nan"))
    for left, right in ((a, (a + b) / 2), ((a + b) / 2, b)):
        values = _step(model, state, _inverses(model.rates, np.array([right - left]))[0], right - left)
        if values is None:
            state = _in_halves(model, state, times, states, left, right, end)
            continue
        here = slice(np.searchsorted(times, left, side="right"), np.searchsorted(times, right, side="right"))
        states[here] = _inside((times[here] - left) / (right - left)) @ values
        state = values[-1]
    return state


def _inverses(rates: np.ndarray, lengths: np.ndarray) -> np.ndarray:
    """(steps, n, points, points): the inverse of 1 + rate length A for each step and mode."""
    products = np.multiply.outer(lengths, rates)[..., None, None] * _radau()[1]
    found: np.ndarray = np.linalg.inv(np.eye(POINTS) + products)
    return found


@lru_cache(maxsize=1)
def _radau() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Radau's points in (0, 1], the matrix A that integrates polynomials through them up to each, and the inverse of
    the Vandermonde matrix, in Legendre polynomials, of 0 and the points."""
    # The right Radau points are the zeros of P_q - P_(q-1).
    points = (np.sort(legendre.legroots([0.0] * (POINTS - 1) + [-1.0, 1.0])) + 1) / 2
    powers = np.arange(POINTS)
    vandermonde = points[:, None] ** powers
    integrals = points[:, None] ** (powers + 1) / (powers + 1)
    nodes = np.concatenate([[0.0], points])
    return points, integrals @ np.linalg.inv(vandermonde), np.linalg.inv(legendre.legvander(2 * nodes - 1, POINTS))


def _inside(tau: np.ndarray) -> np.ndarray:
    """(tau, points + 1): values at a step's start and points to those at parts ``tau`` of the step."""
    found: np.ndarray = legendre.legvander(2 * tau - 1, POINTS) @ _radau()[2]
    return found
