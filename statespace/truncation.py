"""Which sums of states matter most to what is read, and how few of them hold an accuracy."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np


def leading(states: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """(n, n): sums of states, orthonormal and those first that matter most to some responses (n, any) in their own
    size and in what ``rows`` (outputs, n) read, each relative to its largest."""
    size = np.abs(rows @ states).max(axis=1, initial=0.0)
    read = rows[size > 0] / size[size > 0, None]
    whole = float(np.linalg.norm(states, axis=0).max(initial=1e-300))
    weighed = np.linalg.cholesky(np.eye(len(states)) / whole**2 + read.T @ read)
    first = np.linalg.svd(weighed.T @ states, full_matrices=True)[0]
    return np.linalg.qr(np.linalg.solve(weighed.T, first))[0]


def fewest(most: int, worst: Callable[[int], float], accuracy: float) -> int:
    """The smallest number of states, at most ``most``, whose ``worst`` error is found to hold an accuracy; ``most``
    where none does. A number with which a model can't be run doesn't."""

    def exceeds(count: int) -> bool:
        try:
            return worst(count) > accuracy
        except (ArithmeticError, np.linalg.LinAlgError):
            return True

    low, high = 0, min(1, most)
    while high < most and exceeds(high):
        low, high = high, min(2 * high, most)
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if exceeds(middle) else (low, middle)
    return high
