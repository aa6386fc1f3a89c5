"""Curves through the points of a trace, for drawing."""

from __future__ import annotations

import numpy as np


def smooth(x: np.ndarray, y: np.ndarray, at: np.ndarray) -> np.ndarray:
    """The piecewise cubic through (x, y), x ascending, with continuous slope, that rises and falls only where the
    points do (Fritsch and Butland, SIAM J. Sci. Stat. Comput. 5, 1984), at the places ``at``; constant beyond the ends.

    The same as scipy's PchipInterpolator but at the two ends, without importing the rest of scipy.interpolate.
    """
    if len(x) < 3:
        return np.interp(at, x, y)
    step = np.diff(x)
    secant = np.diff(y) / step
    before, after = secant[:-1], secant[1:]
    w1, w2 = 2 * step[1:] + step[:-1], step[1:] + 2 * step[:-1]
    same = before * after > 0
    with np.errstate(divide="ignore", invalid="ignore"):
        inner = np.where(same, (w1 + w2) / (w1 / before + w2 / after), 0.0)
    slope = np.concatenate([secant[:1], inner, secant[-1:]])
    place = np.clip(at, x[0], x[-1])
    i = np.clip(np.searchsorted(x, place, side="right") - 1, 0, len(step) - 1)
    s = (place - x[i]) / step[i]
    left = (1 + 2 * s) * (1 - s) ** 2 * y[i] + s * (1 - s) ** 2 * step[i] * slope[i]
    return left + s**2 * (3 - 2 * s) * y[i + 1] + s**2 * (s - 1) * step[i] * slope[i + 1]
