"""Times between which the exact solution of eq 20 may be interpolated linearly."""

from __future__ import annotations

import numpy as np

from reduced1d.lumped import Lump, progress_at, rise_at_progress, time_at_progress

_FINEST = 1e-8
_MOST_TIMES = 2_000_000


def progress_grid(lump: Lump, end_time: float, accuracy: float) -> np.ndarray:
    """Progress values from 0 to that at ``end_time`` (s), ascending, whose times and rises can be joined by straight
    lines: the rise stays within ``accuracy`` of the final rise, the current within ``accuracy`` of itself.

    Intervals are halved until this holds. The deviation from the chord is known at one inner point, a fraction f of
    the interval away from its nearer end. A rise is concave in time, so the deviation is concave too, and nowhere
    exceeds the one seen by more than 1/f; the same holds for the current where it is convex, which is everywhere but
    close to an inflection for negative temperature coefficients. (The tests look at the whole of the curves.)

    An accuracy below 1e-8 is taken as 1e-8, which takes some ten thousand times: no table or figure shows less, and
    the halving would not end where the chords' rounding exceeds the accuracy.

    Raises RunawayError where there is no steady state, ArithmeticError where millions of times would be needed.
    """
    accuracy = max(accuracy, _FINEST)
    last = float(progress_at(lump, np.array(end_time)))
    grid = np.linspace(0.0, last, 9)
    if not last > 0:
        return grid[:1]

    def curves(v: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        rise = rise_at_progress(lump, v)
        return time_at_progress(lump, v), rise, 1 / (1 + lump.coefficient * rise)

    while grid.size < _MOST_TIMES:
        middle = (grid[1:] + grid[:-1]) / 2
        (time, rise, conductance), (inner, rise_inner, conductance_inner) = curves(grid), curves(middle)
        nearer = np.minimum(inner - time[:-1], time[1:] - inner) / np.diff(time)
        rise_off = np.abs(rise_inner - np.interp(inner, time, rise)) / max(rise[-1], np.finfo(float).tiny)
        current_off = np.abs(conductance_inner - np.interp(inner, time, conductance)) / conductance_inner
        too_far = np.maximum(rise_off, current_off) > accuracy * nearer
        if not too_far.any():
            return grid
        grid = np.sort(np.concatenate([grid, middle[too_far]]))
    raise ArithmeticError(f"more than {_MOST_TIMES} times are needed for linear interpolation within {accuracy:g}")
