"""Roots of increasing functions by a safeguarded Newton iteration, all entries of an array at once.

By hand because every run of the sink needs it, and importing scipy.optimize takes it a tenth of a second.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np


def increasing_root(
    function: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]], lower: np.ndarray, upper: np.ndarray
) -> np.ndarray:
    """The x in [lower, upper] with f(x) = 0, f increasing in each entry, to the rounding of f.

    ``function`` maps x to f and its derivative, all of the shape of ``lower`` and ``upper``. The bracket shrinks at
    every evaluation; a Newton step that leaves it, or is longer than half the step before the last, is replaced by a
    bisection. Where f has one sign throughout the bracket the nearer end comes back.
    """
    lower, upper = np.array(lower, float), np.array(upper, float)
    # Starting at the upper end suits convex functions, whose Newton iterates fall monotonically from there.
    x = upper.copy()
    step = older = upper - lower
    # A Newton step at least halves every second time or a bisection halves the bracket, so 2 * 60 exhaust a double.
    for _ in range(120):
        f, slope = function(x)
        upper = np.where(f >= 0, x, upper)
        lower = np.where(f <= 0, x, lower)
        with np.errstate(divide="ignore", invalid="ignore"):
            newton = x - f / slope
        middle = lower + (upper - lower) / 2
        # A NaN compares false, so it falls to the bisection.
        good = (newton >= lower) & (newton <= upper) & (np.abs(newton - x) <= 0.5 * np.abs(older))
        older, following = step, np.where(good, newton, middle)
        step = following - x
        x = following
        if np.all(np.abs(step) <= 2 * np.finfo(float).eps * np.abs(x)):
            break
    return x
