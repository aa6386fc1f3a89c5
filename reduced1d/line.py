"""High-order elements on a line, and the modes of their matrices.

On each element stand the two linear hats and the integrated Legendre polynomials of Szabo and Babuska (Finite Element
Analysis, 1991, section 3.1), whose slopes are orthonormal: the stiffness of the inner functions is the identity.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
import scipy.linalg
from numpy.polynomial import legendre


@dataclass(frozen=True, eq=False)
class Line:
    """Elements: their ``lengths`` (m), ``degrees`` (at least 2), and the numbers of both their ``nodes``."""

    lengths: Sequence[float]
    degrees: Sequence[int]
    nodes: Sequence[tuple[int, int]]

    @cached_property
    def functions(self) -> list[np.ndarray]:
        """By element the numbers of its functions: of all the nodes' come first, then element by element the inner."""
        ends = 1 + max(max(pair) for pair in self.nodes) + np.cumsum(np.array(self.degrees) - 1)
        return [
            np.r_[pair, end - p + 1 : end] for pair, end, p in zip(self.nodes, ends.tolist(), self.degrees, strict=True)
        ]

    @property
    def size(self) -> int:
        return int(self.functions[-1][-1]) + 1

    def integral(self, densities: np.ndarray) -> np.ndarray:
        """(n,): the integrals of the functions, times a density of each element."""
        integrals = np.zeros(self.size)
        for dofs, length, p, density in zip(self.functions, self.lengths, self.degrees, densities, strict=True):
            integrals[dofs] += density * length / 2 * reference(p)[0][:2].sum(axis=0)  # the hats add up to one
        return integrals

    def products(self, values: np.ndarray, slopes: np.ndarray | None = None) -> np.ndarray:
        """(n, n): integrals of products of the functions, and of their slopes, with a number per element."""
        matrix = np.zeros((self.size, self.size))
        slopes = np.zeros(len(values)) if slopes is None else slopes
        for dofs, h, p, value, slope in zip(self.functions, self.lengths, self.degrees, values, slopes, strict=True):
            mass, stiffness = reference(p)
            matrix[np.ix_(dofs, dofs)] += value * h / 2 * mass + slope * 2 / h * stiffness
        return matrix

    def at(self, element: int, x: float) -> tuple[np.ndarray, np.ndarray]:
        """(n,) twice: the functions at a place in an element, -1 to 1, and their slopes (1/m)."""
        values, slopes = shapes(self.degrees[element], np.array([x]))
        both = np.zeros((2, self.size))
        both[:, self.functions[element]] = values[:, 0], slopes[:, 0] * 2 / self.lengths[element]
        return both[0], both[1]


@lru_cache
def reference(degree: int) -> tuple[np.ndarray, np.ndarray]:
    """Mass and stiffness (degree + 1 squared) on the interval (-1, 1)."""
    x, w = legendre.leggauss(degree + 1)
    values, slopes = shapes(degree, x)
    return (values * w) @ values.T, (slopes * w) @ slopes.T


def shapes(degree: int, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Values and slopes (degree + 1, points) on (-1, 1): the hats of both ends, then the integrated polynomials."""
    p, norms = legendre.legvander(x, degree).T, np.sqrt(np.arange(2, degree + 1) - 0.5)[:, None]
    values = np.concatenate([[(1 - x) / 2, (1 + x) / 2], (p[2:] - p[:-2]) / (2 * norms)])
    return values, np.concatenate([np.outer([-0.5, 0.5], np.ones(len(x))), norms * p[1:-1]])


def modes(capacity: np.ndarray, conductance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rates (n,) in 1/s, ascending, and modes (n, n) in which the capacity (J/K) is one and the conductance (W/K) the
    rates. The pencil is solved for time constants, so that the slow modes keep full precision."""
    times, vectors = scipy.linalg.eigh(capacity, conductance)
    rates = 1 / times[::-1]
    return rates, vectors[:, ::-1] * np.sqrt(rates)
