"""Circular and hyperbolic functions of one signed argument z, smooth through z = 0: r = sqrt(|z|) is an angle for
z > 0 and a hyperbolic argument for z < 0.

For z < 0 every function here carries a factor exp(-r), so that quotients of them stay finite for fins many healing
lengths long. (They are combinations of the Stumpff functions of celestial mechanics; c is C_0, s is C_1.)
"""

from __future__ import annotations

import math

import numpy as np

# p = sum over n of 2 n (-z)^(n-1) / (2n + 1)!; for |z| < 1 the twelve terms are exact to rounding.
_SERIES = np.array([(-1) ** (n - 1) * 2 * n / math.factorial(2 * n + 1) for n in range(1, 13)])
_SLOPE_SERIES = _SERIES[1:] * np.arange(1, 12)


def c(z: np.ndarray) -> np.ndarray:
    """cos r, or cosh r exp(-r)."""
    r = np.sqrt(np.abs(z))
    return np.where(z > 0, np.cos(r), (1 + np.exp(-2 * r)) / 2)


def s(z: np.ndarray) -> np.ndarray:
    """sin r / r, or sinh r / r exp(-r); 1 at z = 0."""
    r = np.sqrt(np.abs(z))
    positive = np.where(r > 0, r, 1.0)
    return np.where(r > 0, np.where(z > 0, np.sin(positive), -np.expm1(-2 * positive) / 2) / positive, 1.0)


def p(z: np.ndarray) -> np.ndarray:
    """(s - c) / z, from a series about z = 0 where the difference would cancel; 1/3 at z = 0."""
    near = np.abs(z) < 1
    far = np.where(near, 1.0, z)
    return np.where(near, _near_zero(z, _SERIES), (s(far) - c(far)) / far)


def p_slope(z: np.ndarray) -> np.ndarray:
    """The derivative of the unscaled p, (s - 3 p) / (2 z), carrying p's factor."""
    near = np.abs(z) < 1
    far = np.where(near, 1.0, z)
    return np.where(near, _near_zero(z, _SLOPE_SERIES), (s(far) - 3 * p(far)) / (2 * far))


def _near_zero(z: np.ndarray, coefficients: np.ndarray) -> np.ndarray:
    inside = np.clip(z, -1.0, 1.0)
    return np.polynomial.polynomial.polyval(inside, coefficients) * np.exp(-np.sqrt(np.maximum(-inside, 0.0)))
