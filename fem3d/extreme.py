"""The largest or smallest value of a function over parts of cells, found on the polynomials themselves.

A lattice in every cell tells which cells may hold it; in these finer lattices around the best point close in on it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import product
from typing import NamedTuple

import numpy as np

from fem3d.domain import Patch
from fem3d.integrals import Space

CLOSER = 0.5  # of a lattice's extent: that of the next one, two spacings around its best point, for tops lie askew
TURNS = 6  # of closing in: the best point is then within 1/128 of a side
MISSED = 0.1  # of what a function spans on a lattice: by what its top may be higher
APART = 0.4  # of a cell's sides: how far a second top is from the first, which closing in on that doesn't see
CANDIDATES = 24  # cells that are closed in on, at most: as many as share a vertex
AT_ONCE = 4_000_000  # numbers that a block of times may take


class Place(NamedTuple):
    """Where an extreme is: the cell and the reference point (3,)."""

    cell: int
    point: np.ndarray

    def row(self, space: Space) -> np.ndarray:
        """(functions,): what reads a function there."""
        found = np.zeros(space.size)
        found[space.dofs[:, self.cell]] = space.at(self.point[:, None])[0]
        return found


class Extreme:
    """The largest value (``sign`` 1) or the smallest one (-1) over some parts of cells."""

    def __init__(self, space: Space, patches: Sequence[Patch], sign: float) -> None:
        self._space, self._sign = space, sign
        self._simplex = "Tet" in type(space.mesh).__name__
        self._patches = [p for p in patches if len(p[0])]
        self._lattices = [self._lattice(corner, sides) for _, corner, sides in self._patches]

    def __call__(self, fields: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(times,) twice: of the sums of functions (r, functions) with weights (times, r), and what the search may have
        left of each."""
        found, left = np.full(len(weights), -np.inf), np.zeros(len(weights))
        for (cells, corner, sides), points in zip(self._patches, self._lattices, strict=True):
            at, dofs = self._space.at(points), self._space.dofs[:, cells]
            step = max(1, AT_ONCE // max(at.shape[0] * dofs.shape[1], 1))
            samples = self._sign * np.einsum("pn,rnc->rcp", at, fields[:, dofs])
            for start in range(0, len(weights), step):
                values = np.tensordot(weights[start : start + step], samples, (-1, 0))
                for cell, point, at_times in self._candidates(values, points):
                    when = start + at_times
                    own = fields[:, dofs[:, cell]]
                    value, doubt = self._close(own, weights[when], points[:, point], corner, sides)
                    better = value > found[when]
                    found[when], left[when] = np.where(better, value, found[when]), np.where(better, doubt, left[when])
        return self._sign * found, left

    @staticmethod
    def _candidates(values: np.ndarray, points: np.ndarray) -> Iterator[tuple[int, int, np.ndarray]]:
        """Cells with their best point of a lattice (times, cells, points), and the times at which each may hold the
        extreme: a lattice may miss that much of each cell's top. A second top, of which the best point away from the
        first tells, may be the higher one."""
        top, point = values.max(axis=2), values.argmax(axis=2)
        reach, highest = MISSED * (top - values.min(axis=2)), top.max(axis=1)
        ranked = np.argsort(-top, axis=1)[:, :CANDIDATES]
        possible = np.take_along_axis(top + reach, ranked, axis=1) >= highest[:, None]
        cell = np.where(possible, ranked, -1)
        sides = np.maximum(np.ptp(points, axis=1), 1e-300)[:, None]
        for c in np.unique(cell[cell >= 0]).tolist():
            times = np.flatnonzero((cell == c).any(axis=1))
            for p in np.unique(point[times, c]).tolist():
                at = times[point[times, c] == p]
                yield c, p, at
                away = np.flatnonzero((np.abs(points - points[:, [p]]) > APART * sides).any(axis=0))
                if not len(away):
                    continue
                others = values[at, c][:, away]
                rivals = others.max(axis=1) + reach[at, c] >= highest[at]
                second = away[others.argmax(axis=1)]
                for q in np.unique(second[rivals]).tolist():
                    yield c, q, at[rivals & (second == q)]

    def where(self, function: np.ndarray) -> Place:
        """Where that of a function (functions,) is."""
        best: tuple[float, Place] | None = None
        for (cells, corner, sides), points in zip(self._patches, self._lattices, strict=True):
            values = self._sign * (self._space.at(points) @ function[self._space.dofs[:, cells]])
            point, cell = np.unravel_index(int(values.argmax()), values.shape)
            own, at = function[self._space.dofs[:, cells[cell]]], points[:, point]
            extent = sides
            for _ in range(TURNS):
                extent = CLOSER * extent
                near = self._around(at, corner, sides, extent)
                at = near[:, int((self._sign * (self._space.at(near) @ own)).argmax())]
            value = float(self._sign * (self._space.at(at[:, None]) @ own)[0])
            if best is None or value > best[0]:
                best = value, Place(int(cells[cell]), at)
        assert best is not None
        return best[1]

    def _close(
        self, own: np.ndarray, weights: np.ndarray, at: np.ndarray, corner: np.ndarray, sides: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """(times,) twice: the largest values in one cell near a point that is the best of a lattice at all these times,
        each closed in on by itself."""
        functions = weights @ (self._sign * own)
        value = functions @ self._space.at(at[:, None])[0]
        extent, doubt = sides, np.zeros(len(weights))
        groups = [(np.arange(len(weights)), at)]
        for _ in range(TURNS):
            extent, closer = CLOSER * extent, []
            for times, middle in groups:
                near = self._around(middle, corner, sides, extent)
                values = functions[times] @ self._space.at(near).T
                best = values.argmax(axis=1)
                doubt[times] = np.maximum(values.max(axis=1) - value[times], 0.0)
                value[times] += doubt[times]
                closer += [(times[best == b], near[:, b]) for b in np.unique(best)]
            groups = closer
        return value, doubt

    def _lattice(self, corner: np.ndarray, sides: np.ndarray) -> np.ndarray:
        """(3, points): as many points along each side as make a polynomial known there."""
        count = int(getattr(self._space, "p", 2)) + 2
        return self._inside(corner[:, None] + (self._steps(len(sides), count) @ sides).T, corner, sides)

    @staticmethod
    def _steps(n: int, count: int) -> np.ndarray:
        """(points, n): a lattice of the unit cube of n dimensions."""
        return np.array(list(product(np.linspace(0, 1, count), repeat=n)))

    def _around(self, at: np.ndarray, corner: np.ndarray, sides: np.ndarray, extent: np.ndarray) -> np.ndarray:
        """(3, points): a lattice of some extent around a point, inside its part of the cell."""
        steps = self._steps(len(sides), 5) * 2 - 1
        return self._inside(at[:, None] + (steps @ extent).T, corner, sides)

    def _inside(self, points: np.ndarray, corner: np.ndarray, sides: np.ndarray) -> np.ndarray:
        """Points moved or, on simplices, dropped where they lie outside."""
        if not len(sides):
            return corner[:, None]
        along = np.clip(np.linalg.lstsq(sides.T, points - corner[:, None], rcond=None)[0], 0.0, 1.0)
        if self._simplex:
            along = along[:, along.sum(axis=0) <= 1 + 1e-12]
        found: np.ndarray = corner[:, None] + sides.T @ along
        return found
