"""Diagonally implicit Runge-Kutta methods, L-stable and stiffly accurate, by order: rows of their tableaux; and the
plainest way to a transient and to a steady state with them, on the matrices of any program, those of the sink too: of
M du/dt + K u = load(u) a problem has the ``size``, ``mass`` M (J/K) and ``stiffness`` K (W/K), which multiply by @, the
``load`` (W) at a rise (K), and ``factors(a, b)``, which solves with a M + b K.

Orders 2 and 3: Alexander, SIAM J. Numer. Anal. 14, 1977, 1006. Order 4: Hairer and Wanner, Solving Ordinary
Differential Equations II, 2nd ed., table IV.6.5.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from reduced1d.equations import room_resistivity
from scenes.errors import NumericsError
from scenes.sink import Sink

_HALF = 1 - 0.5**0.5
# The middle root of x^3 - 3 x^2 + 3 x / 2 - 1 / 6, for which the method of order 3 is L-stable.
_GAMMA = float(np.sort(np.roots([1.0, -3.0, 1.5, -1 / 6]).real)[1])
_B = -1.5 * _GAMMA**2 + 4 * _GAMMA - 0.25
METHODS: dict[int, tuple[tuple[float, ...], ...]] = {
    2: ((_HALF,), (1 - _HALF, _HALF)),
    3: ((_GAMMA,), ((1 - _GAMMA) / 2, _GAMMA), (_B, 1 - _B - _GAMMA, _GAMMA)),
    4: (
        (1 / 4,),
        (1 / 2, 1 / 4),
        (17 / 50, -1 / 25, 1 / 4),
        (371 / 1360, -137 / 2720, 15 / 544, 1 / 4),
        (25 / 24, -49 / 48, 125 / 16, -85 / 12, 1 / 4),
    ),
}
MOST_STEPS = 400  # of an iteration
COPIES = 4


def settle(problem: Any, tolerance: float) -> np.ndarray:
    """(size,): the steady rise (K) by Picard's iteration with one factorization; NumericsError where it doesn't
    converge to a part of the rise, the ``tolerance``."""
    solve, rise = problem.factors(0.0, 1.0), np.zeros(problem.size)
    for _ in range(MOST_STEPS):
        new = solve(problem.load(rise))
        rise, change = new, np.linalg.norm(new - rise)
        if change <= tolerance * np.linalg.norm(new):
            return rise
    raise NumericsError("Picard's iteration doesn't converge")


def march(
    problem: Any, times: np.ndarray, order: int, tolerance: float
) -> Iterator[tuple[np.ndarray, np.ndarray]]:  # fmt: skip
    """Rise (K) and its rate (K/s), (size,) each, at each of some times (s, from 0), every interval being a step of
    the method of some order and equal ones in a row one factorization. Each stage starts from the last one's rate."""
    method = METHODS[order]
    gamma, length = method[0][0], np.nan
    rise, rate = np.zeros((2, problem.size))
    yield rise, rate
    for step in np.diff(times):
        if not abs(step - length) <= 1e-9 * step:
            length = float(step)
            solve = problem.factors(1.0, gamma * length)
        rates: list[np.ndarray] = []
        for weights in method:
            start = rise
            for weight, earlier in zip(weights, rates, strict=False):
                start = start + (length * weight) * earlier
            for _ in range(MOST_STEPS):
                stage = start + gamma * length * rate
                change = solve(problem.load(stage) - problem.mass @ rate - problem.stiffness @ stage)
                rate = rate + change
                if length * np.linalg.norm(change) <= tolerance * np.linalg.norm(stage):
                    break
            rates.append(rate)
        rise = start + gamma * length * rate
        yield rise, rate


class Uniform:
    """The Joule load of a state of a quarter of a sink, and the quantities, where the current density doesn't vary.

    ``peak``, ``end`` and ``mean`` (size,) say how the rises follow from a state; ``volume`` (size,) is each
    function's integral over the quarter of the beam (m3), and ``weighed`` makes of a rise that of its product with it.
    """

    def __init__(
        self, sink: Sink, peak: np.ndarray, end: np.ndarray, mean: np.ndarray,
        weighed: Callable[[np.ndarray], np.ndarray],
    ) -> None:  # fmt: skip
        self.sink, self.rows, self.weighed = sink, (peak, end, mean), weighed
        self.volume = mean * (sink.length * sink.cross_section / COPIES)
        rho, coefficient = room_resistivity(sink.silicon, sink.room_temperature)
        self.rho = rho, rho * coefficient

    def current(self, rise: np.ndarray) -> float:
        ratio = self.sink.length / self.sink.cross_section
        return float(self.sink.voltage / ((self.rho[0] + self.rho[1] * (self.rows[2] @ rise)) * ratio))

    def load(self, rise: np.ndarray) -> np.ndarray:
        """The Joule load (W) at a rise."""
        density = self.current(rise) / self.sink.cross_section
        return density**2 * (self.rho[0] * self.volume + self.rho[1] * self.weighed(rise))

    def quantities(self, rise: np.ndarray) -> list[float]:
        """The rises (K) of peak, end and mean, and the current (A)."""
        return [*(float(row @ rise) for row in self.rows), self.current(rise)]
