"""Equation 20 in isolation, solved exactly: a lump heated at constant voltage through a resistance linear in its rise.

    C dT/dt = V^2 / (R0 (1 + a T)) - G T,   T(0) = 0,   T the rise above room temperature.

Scaled by the linear rise V^2/(R0 G) and the time constant C/G it has one parameter, the feedback b = a V^2/(R0 G):

    dx/ds = 1/(1 + b x) - x.

Its steady states are the roots of b x^2 + x - 1, real for 1 + 4 b >= 0. With q = sqrt(1 + 4 b) they are 2/(1 + q) and
2/(1 - q). On the way from 0 to the first root the right side is positive, so the lump at rest climbs to this root
alone; there the right side falls with slope -2 q/(1 + q) (so it is stable), at the other root, which is
positive only for b < 0, it grows (so that one is unstable). For 1 + 4 b < 0 there is none: thermal runaway. The time at
which a rise is reached is explicit, and is inverted in the progress v, the rise being the steady one times 1 - exp(-v).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from scenes.errors import RunawayError

_LARGEST_EXPONENT = 700.0  # Beyond it exp(-v) is far below the rounding of 1; exp(v) does not overflow yet.


@dataclass(frozen=True)
class Lump:
    """Heat capacity in J/K, conductance to room temperature in W/K, voltage in V, resistance at room temperature in
    ohm and its temperature coefficient in 1/K: the constants of eq 20."""

    capacity: float
    conductance: float
    voltage: float
    resistance: float
    coefficient: float

    @property
    def linear_rise(self) -> float:
        """The steady rise (K) with the resistance held at its room temperature value."""
        return self.voltage**2 / (self.resistance * self.conductance)

    @property
    def feedback(self) -> float:
        """The only parameter of the scaled equation (-): the relative change of resistance over the linear rise."""
        return self.coefficient * self.linear_rise

    @property
    def time_constant(self) -> float:
        return self.capacity / self.conductance


def no_steady_state(voltage: float, limit: float) -> RunawayError:
    """The error of a model without a steady state at ``voltage``, the limit being ``limit`` (both V)."""
    return RunawayError(
        f"the sink has no steady state at {voltage:g} V: above {limit:.6g} V its falling resistance draws more power "
        "than its ends carry away (thermal runaway)", limit,
    )  # fmt: skip


def runaway_voltage(lump: Lump) -> float:
    """The voltage (V) above which no steady state exists; infinite unless the resistance falls with temperature.

    From the discriminant 1 + 4 a V^2/(R0 G) = 0: V = sqrt(R0 G / (4 |a|)).
    """
    if lump.coefficient >= 0:
        return math.inf
    return math.sqrt(lump.resistance * lump.conductance / (-4 * lump.coefficient))


def steady_rise(lump: Lump) -> float:
    """The steady rise (K) that the lump reaches from rest, the smaller of the two where both are positive.

    Raises RunawayError where there is none.
    """
    return lump.linear_rise * 2 / (1 + _root_of_discriminant(lump))


def steady_rounding(lump: Lump) -> float:
    """Relative rounding error of the steady rise: the roots draw together at runaway and lose digits there."""
    q, eps = _root_of_discriminant(lump), float(np.finfo(float).eps)
    # dx/x = -(q - 1)/(2 q) db/b, and at the double root an error of eps in the discriminant leaves sqrt(eps) in q.
    return 8 * eps * (1 + abs(q - 1) / (2 * max(q, math.sqrt(eps))))


def rise_at(lump: Lump, times: np.ndarray) -> np.ndarray:
    """The exact rise (K) at ``times`` (s, any shape, none negative), to rounding.

    Raises ValueError for a negative or infinite time and RunawayError where there is no steady state.
    """
    times = np.asarray(times, float)
    if not np.all((times >= 0) & np.isfinite(times)):
        raise ValueError(f"times must be finite and not negative, not {times.min():g} to {times.max():g} s")
    return -steady_rise(lump) * np.expm1(-progress_at(lump, times))


def time_at_progress(lump: Lump, progress: np.ndarray) -> np.ndarray:
    """The time (s) at which the lump reaches a progress (up to 700): the exact solution of eq 20 in implicit form.

    Partial fractions of ds = (1 + b x) dx / (1 - x - b x^2) with x = 2 u/(1 + q) and r = (q - 1)/(q + 1) give

        s = -1/2 log[(1 - u)(1 + r u)] + 1/(2 q) log[(1 + r u)/(1 - u)],

    and with u = 1 - exp(-v), (1 + r u)/(1 - u) = 1 + c (exp(v) - 1), c = 2 q/(1 + q): no term cancels in the double
    root q = 0, the linear case q = 1 (r = 0) or the current-limited case of large q (r near 1).
    """
    return lump.time_constant * _scaled_time(progress, _root_of_discriminant(lump))


def progress_at(lump: Lump, times: np.ndarray) -> np.ndarray:
    """The progress at ``times`` (s, not negative): ``time_at_progress`` inverted, at most 700."""
    scaled = times / lump.time_constant
    q = _root_of_discriminant(lump)
    m, b, c = (1 + q) / 2, (q - 1) / 2, 2 * q / (1 + q)

    # ds/dv grows from 1/m to m/q: the time is convex in the progress, and Newton's iterates fall to the root.
    v = np.minimum(scaled * m, _LARGEST_EXPONENT)
    while True:
        u = -np.expm1(-v)
        step = (_scaled_time(v, q) - scaled) * m * (np.exp(-v) + c * u) / (1 + b * u)
        v = v - np.maximum(step, 0.0)
        if np.all(step <= 2 * np.finfo(float).eps * v):
            return v


def _root_of_discriminant(lump: Lump) -> float:
    discriminant = 1 + 4 * lump.feedback
    if discriminant < 0:
        raise no_steady_state(lump.voltage, runaway_voltage(lump))
    return math.sqrt(discriminant)


def _scaled_time(v: np.ndarray, q: float) -> np.ndarray:
    u, growth = -np.expm1(-v), np.expm1(v)
    r, c = (q - 1) / (q + 1), 2 * q / (1 + q)
    # The first form is exact for small u even where r is near 1, the second close to u = 1.
    early = np.log1p(np.maximum(-2 / (1 + q) * u - r * u**2, -0.9))
    late = np.log(np.exp(-v) + c * u) - v
    product = np.where(u < 0.5, early, late)
    z = c * growth
    ratio = growth / (1 + q) * np.divide(np.log1p(z), z, out=np.ones_like(z), where=z > 0)
    return ratio - 0.5 * product
