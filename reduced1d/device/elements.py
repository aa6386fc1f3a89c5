"""High-order elements on the line: mass and stiffness of a stack of slabs, for the heat equation (eq 3).

On each element stand the two linear hats and the integrated Legendre polynomials of Szabo and Babuska (Finite Element
Analysis, 1991, section 3.1), whose derivatives are orthonormal: the stiffness of the inner functions is the identity.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.polynomial import legendre

from reduced1d.device.lumped import Slab


@dataclass(frozen=True)
class Stack:
    """Mass (J/K) and stiffness (W/K) over all shape functions, and the nodes' numbers in them.

    ``mass`` and ``stiffness`` are (n, n); ``interfaces`` holds the indices of the stack's lower face, of the faces
    between slabs and of the upper face; ``slopes[s]`` (2, n) gives the heat flow -k A dT/dx (W, along the stack) at the
    lower and the upper face of slab s, ``contents[s]`` (n,) the heat in it (J/K).

    ``step`` (n,) is a unit step of the upper face's temperature an instant later: zero outside the last element and, in
    it, orthogonal to all polynomials of a degree less that vanish at that face, so that the rest of the stack sees
    nothing yet. An L2 projection of the step would ring through it at once.
    """

    mass: np.ndarray
    stiffness: np.ndarray
    interfaces: tuple[int, ...]
    slopes: tuple[np.ndarray, ...]
    contents: tuple[np.ndarray, ...]
    step: np.ndarray


def assemble(slabs: tuple[Slab, ...], grids: tuple[np.ndarray, ...], degree: int) -> Stack:
    """The stack of slabs, slab s cut at the fractions ``grids[s]`` (0 to 1) into elements of a degree of at least 2."""
    count = sum(len(grid) - 1 for grid in grids)
    n = count * degree + 1
    mass, stiffness = np.zeros((n, n)), np.zeros((n, n))
    slopes, contents = tuple(np.zeros((2, n)) for _ in slabs), tuple(np.zeros(n) for _ in slabs)
    m, k, ends = _reference(degree)
    interfaces, e = [0], 0
    for s, (slab, grid) in enumerate(zip(slabs, grids, strict=True)):
        sizes = np.diff(grid) * slab.thickness
        for i, size in enumerate(sizes):
            at = np.r_[e, e + 1, count + 1 + e * (degree - 1) + np.arange(degree - 1)]
            mass[np.ix_(at, at)] += slab.heat_capacity * slab.area * size / 2 * m
            contents[s][at] += slab.heat_capacity * slab.area * size / 2 * (m[0] + m[1])  # the hats add up to one
            stiffness[np.ix_(at, at)] += slab.conductivity * slab.area * 2 / size * k
            flow = -slab.conductivity * slab.area * 2 / size * ends
            if i == 0:
                slopes[s][0, at] = flow[0]
            if i == len(sizes) - 1:
                slopes[s][1, at] = flow[1]
            e += 1
        interfaces.append(e)
    step, tests = np.zeros(n), np.r_[0, 2:degree]
    step[count], step[at[2:]] = 1.0, -np.linalg.solve(m[tests, 2:], m[tests, 1])
    return Stack(mass, stiffness, tuple(interfaces), slopes, contents, step)


@lru_cache
def _reference(degree: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mass and stiffness (degree + 1 squared) and slopes at the two ends (2, degree + 1) on the interval (-1, 1)."""
    x, w = legendre.leggauss(degree + 1)
    values, slopes = _shapes(x, degree)
    return (values * w) @ values.T, (slopes * w) @ slopes.T, _shapes(np.array([-1.0, 1.0]), degree)[1].T


def _shapes(x: np.ndarray, degree: int) -> tuple[np.ndarray, np.ndarray]:
    """Values and slopes (degree + 1, points): the hats of both ends, then the integrated Legendre polynomials."""
    p = legendre.legvander(x, degree).T
    values, slopes = np.empty((degree + 1, len(x))), np.empty((degree + 1, len(x)))
    values[0], values[1] = (1 - x) / 2, (1 + x) / 2
    slopes[0], slopes[1] = -0.5, 0.5
    for j in range(2, degree + 1):
        values[j] = (p[j] - p[j - 2]) / np.sqrt(2 * (2 * j - 1))
        slopes[j] = np.sqrt((2 * j - 1) / 2) * p[j - 1]
    return values, slopes
