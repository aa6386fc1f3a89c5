"""Times between which traces may be interpolated linearly."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

_MOST_TIMES = 100_000
_FINEST = 1e-8


def time_grid(
    traces: Callable[[np.ndarray], dict[str, np.ndarray]], end_time: float, accuracy: float
) -> np.ndarray:  # fmt: skip
    """Times (s) from 0 to ``end_time`` between which straight lines stay within an accuracy (not below 1e-8) of
    ``traces`` at any times: rises relative to the final one, current and power to themselves.

    Intervals are halved where their middle is off the chord by a third of it: curves without a bend in an interval are
    nowhere farther off than twice that. Raises ArithmeticError where too many times would be needed.
    """
    accuracy = max(accuracy, _FINEST)
    times = np.concatenate([[0.0], end_time * np.geomspace(1e-4, 1.0, 13)])
    while len(times) < _MOST_TIMES:
        middle = (times[1:] + times[:-1]) / 2
        values = traces(np.sort(np.concatenate([times, middle])))
        off = np.zeros(len(middle))
        for key, value in values.items():
            scale = np.abs(value[1::2]) if key in ("current_A", "power_W") else abs(value[-1])
            chord = (value[2::2] + value[:-1:2]) / 2
            off = np.maximum(off, np.abs(value[1::2] - chord) / np.maximum(scale, np.finfo(float).tiny))
        wrong = off > accuracy / 3
        if not wrong.any():
            return times
        times = np.sort(np.concatenate([times, middle[wrong]]))
    raise ArithmeticError(f"more than {_MOST_TIMES} times are needed for linear interpolation within {accuracy:g}")
