"""The steady state of the reduced problem (of one channel), found along the current.

There runaway is an ordinary maximum.

At a given current the heat equation is linear, and each state on the way from cold to the asked voltage is reached.
The voltage that a current needs rises from zero; with a falling resistance it has a maximum, beyond which no steady
state exists (the fold of thermal runaway).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fem3d.solution.reduced import Reduced

BELOW = 1 - 1e-9  # a fraction of the drive below which the drive that is asked for isn't reached
GROWTH = 1.05  # factor on the current from trial to trial
# Newton's steps at a voltage, the differences that tell its slope, and the change that ends it, over the largest state.
NEWTON, APART, CONVERGED = 50, 1e-6, 1e-11


class OperatingPoint(NamedTuple):
    """States a (r,), current coefficients c (m,), the voltage over the asked one, and whether that is the largest."""

    a: np.ndarray
    c: np.ndarray
    fraction: float
    folded: bool = False


def find(reduced: Reduced) -> OperatingPoint:
    """The operating point that a slowly rising voltage reaches: at the asked voltage, or the fold below it."""
    if not reduced.warm.any():
        c = reduced.currents(np.zeros(reduced.states))
        a = np.linalg.solve(reduced.stiffness, reduced.source[0] + reduced.joule(np.zeros(reduced.states), c))
        return OperatingPoint(a, c, 1.0)
    low, high = at_current(reduced, 0.0), at_current(reduced, 1.0)
    beta_low, beta_high = 0.0, 1.0
    beta_before = 0.0
    while high.fraction < 1.0:
        beta_next = beta_high * GROWTH
        ahead = at_current(reduced, beta_next)
        if ahead.fraction <= high.fraction:
            top, beta_top = _fold(reduced, beta_before, beta_next)
            if top.fraction < 1.0:
                return top._replace(folded=True)
            ahead, beta_next = top, beta_top
        beta_before = beta_high
        low, high, beta_low, beta_high = high, ahead, beta_high, beta_next
    point = _root(reduced, beta_low, beta_high, low, high)
    if not np.isinf(high.fraction) or point.fraction >= BELOW:
        return point
    # Given currents end where the heat feeds itself, with no more of them than that. A voltage may drive nearly as
    # much, too close to it for the current to tell.
    return (_at_drive(reduced, point) if reduced.supply.any() else None) or point._replace(folded=True)


def _at_drive(reduced: Reduced, near: OperatingPoint) -> OperatingPoint | None:
    """The state at the asked voltage from one at a fraction of it, by Newton's method at voltages in between, each
    twice the one before; None where that doesn't lead to a stable one."""
    a, fraction, r = near.a, near.fraction, reduced.states
    if not (fraction > 0 and np.isfinite(a).all()):
        return None

    def missing(a: np.ndarray) -> np.ndarray:
        return reduced.source[0] + reduced.joule(a, fraction * reduced.currents(a)) - a @ reduced.stiffness

    while fraction < 1.0:
        fraction = min(2 * fraction, 1.0)
        for _ in range(NEWTON):
            small = APART * np.abs(a).max() * np.eye(r)
            slope = (missing(a + small) - missing(a - small)).T / (2 * small[0, 0])
            if not np.isfinite(slope).all() or np.linalg.eigvals(slope).real.max() >= 0:
                return None
            change = np.linalg.solve(slope, missing(a))
            a = a - change
            if np.abs(change).max() <= CONVERGED * np.abs(a).max():
                break
        else:
            return None
    return OperatingPoint(a, reduced.currents(a), 1.0)


def at_current(reduced: Reduced, beta: float, near: OperatingPoint | None = None) -> OperatingPoint:
    """The state at beta times the current that the cold conductor would carry; fraction inf where there is none."""
    cold = reduced.carried(reduced.cold[0])
    supply = reduced.cold[0] @ cold
    cold_power = float(supply @ cold)
    a = np.zeros(reduced.states) if near is None else near.a

    def carried(a: np.ndarray) -> tuple[np.ndarray, float]:
        shape = reduced.carried(reduced.dissipation(a))
        fraction = beta * cold_power / float(supply @ shape)
        return fraction * shape, fraction

    c, fraction = carried(a)
    for _ in range(100):
        load, feedback = reduced.linear_joule(c)
        matrix = reduced.stiffness - feedback
        try:
            np.linalg.cholesky(matrix)
        except np.linalg.LinAlgError:
            return OperatingPoint(np.zeros(reduced.states), c, np.inf)
        a = np.linalg.solve(matrix, reduced.source[0] + load)
        old = c
        c, fraction = carried(a)
        if np.abs(c - old).max() <= 1e-13 * np.abs(c).max():
            break
    return OperatingPoint(a, c, fraction if fraction >= 0 else np.inf)


def _root(
    reduced: Reduced, beta_low: float, beta_high: float, low: OperatingPoint, high: OperatingPoint
) -> OperatingPoint:
    """Fraction one between two currents, by bisection until it is finite and then by the Illinois method."""
    f_low, f_high = low.fraction - 1.0, high.fraction - 1.0
    point, below, side = high, low, 0
    for _ in range(200):
        if np.isinf(f_high) or not np.isfinite(f_high):
            beta = (beta_low + beta_high) / 2
        else:
            beta = (beta_low * f_high - beta_high * f_low) / (f_high - f_low)
        point = at_current(reduced, beta, low if np.isinf(high.fraction) else high)
        f = point.fraction - 1.0
        if abs(f) < 1e-13 or beta_high - beta_low < 1e-15 * beta_high:
            break
        if f > 0:
            beta_high, f_high = beta, f
            f_low = f_low / 2 if side == 1 else f_low
            side = 1
        else:
            below, beta_low, f_low = point, beta, f
            f_high = f_high / 2 if side == -1 else f_high
            side = -1
    return point if np.isfinite(point.fraction) else below


def _fold(reduced: Reduced, beta_low: float, beta_high: float) -> tuple[OperatingPoint, float]:
    """The largest voltage between two currents."""
    from scipy.optimize import minimize_scalar  # where there is a fold only: it is slow to load

    optimum = minimize_scalar(
        lambda beta: -at_current(reduced, beta).fraction, bounds=(beta_low, beta_high), method="bounded",
        options={"xatol": 1e-7 * beta_high},
    )  # fmt: skip
    return at_current(reduced, float(optimum.x)), float(optimum.x)
