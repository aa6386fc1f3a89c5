"""The paper's way of solving eq 20: the classical Runge-Kutta method of order 4 with a fixed step."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from reduced1d.errors import RunawayError
from reduced1d.lumped import Lump, runaway_voltage, vanishing_time

# Where the method's growth factor |1 + z + z^2/2 + z^3/6 + z^4/24| returns to 1 on the negative real axis.
STABILITY_LIMIT = 2.785293563405282
_MOST_HALVINGS = 12


@dataclass(frozen=True)
class RungeKutta:
    """Rises (K) at equidistant times (s), and the largest error of them (K), estimated by halving the step."""

    times: np.ndarray
    rises: np.ndarray
    error: float


def integrate(rate: Callable[[float], float], start: float, end_time: float, steps: int) -> np.ndarray:
    """The ``steps + 1`` values at equidistant times from 0 to ``end_time`` of dy/dt = rate(y), y(0) = start."""
    values, y, h = np.empty(steps + 1), start, end_time / steps
    values[0] = start
    for i in range(steps):
        k1 = rate(y)
        k2 = rate(y + h / 2 * k1)
        k3 = rate(y + h / 2 * k2)
        k4 = rate(y + h * k3)
        y += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        values[i + 1] = y
    return values


def largest_stable_step(lump: Lump) -> float:
    """The step (s) below which the method is stable all along the rise from rest.

    The decay rate, minus the derivative of eq 20's right side, is largest at the start for a > 0 and never above
    that of the lump without feedback for a < 0.
    """
    return STABILITY_LIMIT * lump.time_constant / (1 + max(lump.feedback, 0.0))


def solve_rk4(lump: Lump, end_time: float, *, accuracy: float = 1e-3, step: float | None = None) -> RungeKutta:
    """Solve eq 20 from rest to ``end_time`` (s), with the given step (s), shortened to divide the end time, or with one
    whose estimated error is within ``accuracy`` of the final rise.

    The first choice is the step at which exponential decay is that accurate, (d h)^4 / (120 e) with the largest decay
    rate d, halved until the estimate agrees. The error of the step h is estimated as 16/15 of its difference from h/2.

    Raises ValueError for a step that is not positive or not stable, RunawayError where the resistance vanishes before
    the end time, and ArithmeticError where halving does not reach the accuracy.
    """
    if end_time >= vanishing_time(lump):
        raise RunawayError(
            f"at {lump.voltage:g} V the resistance vanishes after {vanishing_time(lump):.6g} s (thermal runaway), "
            f"before the end time of {end_time:g} s",
            runaway_voltage(lump),
        )
    limit = largest_stable_step(lump)
    if step is None:
        first = limit / STABILITY_LIMIT * min(1.0, (120 * math.e * accuracy) ** 0.25)
    elif 0 < step < limit:
        first = step
    else:
        raise ValueError(f"the step must be positive and below {limit:.3g} s to be stable, not {step:g} s")
    # A step that divides the end time but for rounding is taken as it is.
    steps = max(1, math.ceil(end_time / first * (1 - 1e-12)))
    coarse = integrate(lump.rate, 0.0, end_time, steps)
    for _ in range(_MOST_HALVINGS):
        fine = integrate(lump.rate, 0.0, end_time, 2 * steps)
        error = float(np.max(np.abs(coarse - fine[::2]))) * 16 / 15
        if step is not None or error <= accuracy * abs(fine[-1]):
            return RungeKutta(np.linspace(0.0, end_time, steps + 1), coarse, error)
        coarse, steps = fine, 2 * steps
    raise ArithmeticError(f"Runge-Kutta steps of {end_time / steps:.3g} s still miss the accuracy of {accuracy:g}")
