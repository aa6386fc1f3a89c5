"""The L-stable and stiffly accurate diagonally implicit Runge-Kutta method of order 4 of Hairer and Wanner (Solving
Ordinary Differential Equations II, 2nd ed., table IV.6.5), and its use on the matrices of any program.

A problem M du/dt + K u = load(u) has the ``size``, ``mass`` M and ``stiffness`` K, which multiply by @, the ``load`` at
a state and ``factors(a, b)``, which solves with a M + b K.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from scenes.errors import NumericsError

ORDER, GAMMA = 4, 1 / 4
TABLEAU: tuple[tuple[float, ...], ...] = (
    (1 / 4,),
    (1 / 2, 1 / 4),
    (17 / 50, -1 / 25, 1 / 4),
    (371 / 1360, -137 / 2720, 15 / 544, 1 / 4),
    (25 / 24, -49 / 48, 125 / 16, -85 / 12, 1 / 4),
)
MOST_ITERATIONS = 400


def solve_steady(problem: Any, tolerance: float) -> np.ndarray:
    """Return the steady state (size,) by Picard's iteration with one factorization; raise NumericsError without one."""
    solve, state = problem.factors(0.0, 1.0), np.zeros(problem.size)
    for _ in range(MOST_ITERATIONS):
        state, old = solve(problem.load(state)), state
        if np.linalg.norm(state - old) <= tolerance * np.linalg.norm(state):
            return state
    raise NumericsError("Picard's iteration doesn't converge")


def march(problem: Any, times: np.ndarray, tolerance: float) -> Iterator[np.ndarray]:
    """Yield the state (size,) at each of some times (s, from 0), one step each; equal steps share a factorization."""
    state, rate = np.zeros((2, problem.size))
    length = np.nan
    yield state
    for step in np.diff(times):
        if not abs(step - length) <= 1e-9 * step:
            length = float(step)
            solve = problem.factors(1.0, GAMMA * length)
        rates: list[np.ndarray] = []
        for weights in TABLEAU:
            start = state + length * sum((w * r for w, r in zip(weights, rates, strict=False)), 0 * state)
            for _ in range(MOST_ITERATIONS):
                stage = start + GAMMA * length * rate
                change = solve(problem.load(stage) - problem.mass @ rate - problem.stiffness @ stage)
                rate = rate + change
                if length * np.linalg.norm(change) <= tolerance * np.linalg.norm(stage):
                    break
            rates.append(rate)
        state = start + GAMMA * length * rate
        yield state
