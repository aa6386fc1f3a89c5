"""Collocation at Radau's points: Radau IIA of q points is of order 2 q - 1, and damps what is too fast for a step,
however fast (Hairer and Wanner, Solving Ordinary Differential Equations II, section IV.5)."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.polynomial import legendre


@lru_cache
def radau(count: int) -> tuple[np.ndarray, np.ndarray]:
    """The matrix (count, count) that integrates polynomials through Radau's points in (0, 1] up to each, and the
    inverse (count + 1 squared) of the Vandermonde matrix, in Legendre polynomials, of 0 and the points."""
    # The right Radau points are the zeros of P_q - P_(q-1): real, though numpy 2.5 gives them as complex numbers.
    points = (np.sort(legendre.legroots([0.0] * (count - 1) + [-1.0, 1.0]).real) + 1) / 2
    powers = np.arange(count)
    integrals = points[:, None] ** (powers + 1) / (powers + 1)
    nodes = np.concatenate([[0.0], points])
    vandermonde = points[:, None] ** powers
    return integrals @ np.linalg.inv(vandermonde), np.linalg.inv(legendre.legvander(2 * nodes - 1, count))


def within(count: int, parts: np.ndarray) -> np.ndarray:
    """(parts, count + 1): interpolation from a step's start and points to some parts of the step (0 to 1)."""
    return np.asarray(legendre.legvander(2 * parts - 1, count) @ radau(count)[1])
