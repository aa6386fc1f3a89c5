"""An axis of a grid cut into pieces on which a parabola follows the solution: from hp to quadratic cells.

A file for other programs holds quadratic cells at most; the solution has degrees up to eight. So each interval is cut
into as many equal pieces as keep the parabola through three of its values within a tolerance of the solution itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.polynomial import legendre

MOST = 64  # pieces of an interval, at most
GAUSS = 3  # points of a piece along each axis for the means over it
_BETWEEN = np.array([-0.8, -0.5, -0.2, 0.2, 0.5, 0.8])  # where in a piece the parabola is compared with the solution


@dataclass(frozen=True, eq=False)
class CutAxis:
    """Breakpoints (m) of an axis with its intervals cut into ``counts`` equal pieces each. At those breakpoints, by
    number, that are ``torn`` the values on both sides differ: there is an empty piece, from the last double below the
    breakpoint, where what is below is read, to the breakpoint itself."""

    breaks: np.ndarray
    counts: np.ndarray
    torn: tuple[int, ...] = ()

    @cached_property
    def interval(self) -> np.ndarray:
        """(pieces,): the interval that each piece is part of, for empty ones one more than there are."""
        count = len(self.counts)
        each = [[i] * int(n) + [count] * (i + 1 in self.torn) for i, n in enumerate(self.counts)]
        return np.array([i for pieces in each for i in pieces])

    @cached_property
    def edges(self) -> np.ndarray:
        """(pieces + 1,) in m."""
        edges: list[float] = []
        for i, (a, b, n) in enumerate(zip(self.breaks[:-1], self.breaks[1:], self.counts, strict=True)):
            edges += [*np.linspace(a, b, n + 1)[:-1], *([np.nextafter(b, -np.inf)] if i + 1 in self.torn else [])]
        return np.array([*edges, self.breaks[-1]])

    @cached_property
    def points(self) -> np.ndarray:
        """(2 pieces + 1,) in m: ends and middles."""
        points = np.empty(2 * len(self.interval) + 1)
        points[::2] = self.edges
        points[1::2] = (self.edges[:-1] + self.edges[1:]) / 2
        return points

    @cached_property
    def gauss(self) -> np.ndarray:
        """(pieces * GAUSS,) in m: the pieces' Gauss points."""
        half = np.diff(self.edges)[:, None] / 2
        return (self.points[1::2, None] + half * legendre.leggauss(GAUSS)[0]).ravel()

    @cached_property
    def weights(self) -> np.ndarray:
        """(pieces, pieces * GAUSS): the matrix that takes values at the Gauss points to means over the pieces."""
        return np.kron(np.eye(len(self.interval)), legendre.leggauss(GAUSS)[1] / 2)


def samples(breaks: np.ndarray, degrees: np.ndarray) -> np.ndarray:
    """(sum of degree + 1,) in m: points inside every interval at which a polynomial of its degree is known."""
    each = zip(breaks[:-1], breaks[1:], degrees, strict=True)
    return np.concatenate([a + (b - a) * (legendre.leggauss(int(p) + 1)[0] + 1) / 2 for a, b, p in each])


def cut(
    breaks: np.ndarray,
    degrees: np.ndarray,
    lines: Sequence[np.ndarray],
    tolerances: Sequence[float],
    torn: tuple[int, ...] = (),
) -> tuple[CutAxis, float]:
    """The pieces that an axis needs, and how far the parabolas are off at most, over the tolerance.

    ``lines`` holds, for each field, its values (samples, lines) at `samples` on lines along the axis, not numbers where
    there is nothing, and ``tolerances`` how far each field may be off, in its unit; ``torn`` as of `CutAxis`.
    """
    counts, worst, start = [], 0.0, 0
    for degree in degrees.tolist():
        rows = slice(start, start + degree + 1)
        fields = [u[rows][:, np.isfinite(u[rows]).all(axis=0)] for u in lines]
        start += degree + 1
        count = max(1, degree // 2)
        while True:
            off = _distance(degree, count, fields, tolerances)
            if off <= 1.0 or count >= MOST:
                break
            # The distance falls with the third power of the pieces' size.
            count = min(MOST, max(count + 1, int(np.ceil(count * off ** (1 / 3)))))
        counts.append(count)
        worst = max(worst, off)
    return CutAxis(breaks, np.array(counts), torn), worst


def _distance(degree: int, count: int, fields: Sequence[np.ndarray], tolerances: Sequence[float]) -> float:
    """The largest distance of the parabolas of ``count`` pieces from polynomials, over the tolerances."""
    if degree <= 2:
        return 0.0
    edges = np.linspace(-1.0, 1.0, count + 1)
    half = 1.0 / count
    middles, s = edges[:-1] + half, _BETWEEN
    shape = np.stack([s * (s - 1) / 2, 1 - s * s, s * (s + 1) / 2], axis=1)
    to_legendre = np.linalg.inv(legendre.legvander(legendre.leggauss(degree + 1)[0], degree))

    def at(places: np.ndarray) -> np.ndarray:
        return legendre.legvander((middles[:, None] + half * places).ravel(), degree) @ to_legendre

    exact, given = at(s), at(np.array([-1.0, 0.0, 1.0]))
    parabolas = np.einsum("sk,pkn->psn", shape, given.reshape(count, 3, degree + 1)).reshape(exact.shape)
    off = exact - parabolas
    return max(
        (float(np.abs(off @ u).max()) / t for u, t in zip(fields, tolerances, strict=True) if u.size and t > 0),
        default=0.0,
    )
