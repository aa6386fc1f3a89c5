"""An axis of a brick mesh cut into pieces on which a parabola follows the solution: from hp to quadratic cells.

A file for other programs holds quadratic cells at most; the solution has degrees up to eight. So each interval is cut
into as many equal pieces as keep the parabola through three of its values within a tolerance of the solution itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.polynomial import legendre

from meshes.axis import Axis, reference

MOST = 64  # pieces of an interval
GAUSS = 3  # points of a piece along each axis for the means over it
_BETWEEN = np.array([-0.8, -0.5, -0.2, 0.2, 0.5, 0.8])  # where in a piece the parabola is compared with the solution


@dataclass(frozen=True, eq=False)
class Pieces:
    """An axis with its intervals cut into ``counts`` equal pieces each."""

    axis: Axis
    counts: np.ndarray

    @cached_property
    def interval(self) -> np.ndarray:
        """(pieces,): the interval that each piece is part of."""
        return np.repeat(np.arange(len(self.counts)), self.counts)

    @cached_property
    def edges(self) -> np.ndarray:
        """(pieces + 1,) in m."""
        parts = [
            np.linspace(a, b, n + 1)[:-1]
            for a, b, n in zip(self.axis.breaks[:-1], self.axis.breaks[1:], self.counts, strict=True)
        ]
        return np.concatenate([*parts, self.axis.breaks[-1:]])

    @cached_property
    def points(self) -> np.ndarray:
        """(2 pieces + 1,) in m: ends and middles."""
        found = np.empty(2 * len(self.interval) + 1)
        found[::2] = self.edges
        found[1::2] = (self.edges[:-1] + self.edges[1:]) / 2
        return found

    @cached_property
    def at_points(self) -> np.ndarray:
        """(points, nodes): the matrix that takes nodal values to values at the points."""
        return self.axis.interpolation(self.points)

    @cached_property
    def at_gauss(self) -> tuple[np.ndarray, np.ndarray]:
        """Twice (pieces * GAUSS, nodes): nodal values to values, and to slopes (1/m), at the pieces' Gauss points."""
        places, _ = legendre.leggauss(GAUSS)
        middles, halves = self.points[1::2], np.diff(self.edges) / 2
        values, slopes = np.zeros((2, len(middles) * GAUSS, self.axis.size))
        for i, degree in enumerate(self.axis.degrees):
            here = np.flatnonzero(self.interval == i)
            a, b = self.axis.breaks[i], self.axis.breaks[i + 1]
            at = (middles[here, None] + halves[here, None] * places).ravel()
            rows = (here[:, None] * GAUSS + np.arange(GAUSS)).ravel()
            nodes = slice(self.axis.offsets[i], self.axis.offsets[i] + degree + 1)
            values[rows, nodes], slopes[rows, nodes] = _basis(int(degree), 2 * (at - a) / (b - a) - 1)
            slopes[rows, nodes] *= 2 / (b - a)
        return values, slopes

    @cached_property
    def weights(self) -> np.ndarray:
        """(pieces, pieces * GAUSS): the matrix that takes values at the Gauss points to means over the pieces."""
        found = np.zeros((len(self.interval), len(self.interval) * GAUSS))
        for i in range(len(self.interval)):
            found[i, i * GAUSS : (i + 1) * GAUSS] = legendre.leggauss(GAUSS)[1] / 2
        return found


def cut(axis: Axis, slabs: Sequence[Sequence[np.ndarray]], tolerances: Sequence[float]) -> tuple[Pieces, float]:
    """The pieces that an axis needs, and how far the parabolas are off at most, over the tolerance.

    ``slabs[i]`` holds, for each field, the values (degree + 1, lines) of interval i on lines along the axis, and
    ``tolerances`` how far each field may be off, in its unit.
    """
    counts, worst = [], 0.0
    for degree, fields in zip(axis.degrees, slabs, strict=True):
        count = max(1, -(-int(degree) // 2))
        while True:
            off = _distance(int(degree), count, fields, tolerances)
            if off <= 1.0 or count >= MOST:
                break
            # The distance falls with the third power of the pieces' size.
            count = min(MOST, max(count + 1, int(np.ceil(count * off ** (1 / 3)))))
        counts.append(count)
        worst = max(worst, off)
    return Pieces(axis, np.array(counts)), worst


def _distance(degree: int, count: int, fields: Sequence[np.ndarray], tolerances: Sequence[float]) -> float:
    """The largest distance of the parabolas of ``count`` pieces from polynomials, over the tolerances."""
    if degree <= 2:
        return 0.0
    edges = np.linspace(-1.0, 1.0, count + 1)
    half = 1.0 / count
    middles = edges[:-1] + half
    s = _BETWEEN
    shape = np.stack([s * (s - 1) / 2, 1 - s * s, s * (s + 1) / 2], axis=1)
    exact = _basis(degree, (middles[:, None] + half * s).ravel())[0]
    given = _basis(degree, (middles[:, None] + half * np.array([-1.0, 0.0, 1.0])).ravel())[0]
    parabolas = np.einsum("sk,pkn->psn", shape, given.reshape(count, 3, degree + 1)).reshape(exact.shape)
    off = exact - parabolas
    return max(
        (float(np.abs(off @ u).max()) / t for u, t in zip(fields, tolerances, strict=True) if u.size and t > 0),
        default=0.0,
    )


def _basis(degree: int, xi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(places, degree + 1) twice: the basis of the reference interval and its derivative at places in it."""
    to_legendre = np.linalg.inv(legendre.legvander(reference(degree).nodes, degree))
    derivative = legendre.legder(np.eye(degree + 1))
    slopes = legendre.legvander(xi, degree - 1) @ derivative @ to_legendre
    return legendre.legvander(xi, degree) @ to_legendre, slopes
