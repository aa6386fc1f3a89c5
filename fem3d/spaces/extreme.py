"""The largest or smallest value of a function over parts of cells.

A lattice in every cell selects the halves, quarters or eighths of cells that may hold the extreme. Lattices of half the
size around each best point then converge. The gain of the last lattice estimates the remainder: the error near an
extreme is quadratic in the spacing, so that all further lattices together would gain a third of the last gain.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import NamedTuple

import numpy as np

from fem3d.spaces.domain import Patch
from fem3d.spaces.integrals import AT_ONCE, Space

FINE, TURNS = 5, 6  # points along each side of a finer lattice, and how many there are: to 1/128 of a side
# The top of a cell may lie above its best lattice point by this fraction of the span of the function on the lattice.
MISSED = 0.1
CANDIDATES = 24  # parts of cells for each time, at most: as many cells may share a vertex
IRRATIONAL = np.sqrt([2.0, 3.0, 5.0])  # no two lattice points have one product with these


class Place(NamedTuple):
    """The cell of an extreme, and its reference point (3,)."""

    cell: int
    point: np.ndarray

    def row(self, space: Space) -> np.ndarray:
        """(functions,): the row that reads a function there."""
        row = np.zeros(space.size)
        row[space.dofs[:, self.cell]] = space.at(self.point[:, None])[0]
        return row


class Extreme:
    """The largest value (``sign`` 1) or the smallest one (-1) over some parts of cells."""

    def __init__(self, space: Space, patches: Sequence[Patch], sign: float) -> None:
        self._space, self._sign = space, sign
        self._simplex = len(space.mesh.t) == 4
        self._patches = [p for p in patches if len(p[0])]

    def __call__(self, fields: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(times,) twice: extremes of the sums of functions (r, functions) with weights (times, r), and the estimated
        remainder of the search for each."""
        values, doubts, _ = self._search(fields, weights)
        return self._sign * values, doubts

    def where(self, function: np.ndarray) -> Place:
        """Return the place of the extreme of a function (functions,)."""
        return self._search(function[None], np.ones((1, 1)))[2][0]

    def _search(self, fields: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray, list[Place]]:
        values, doubts = np.full(len(weights), -np.inf), np.zeros(len(weights))
        places = [Place(-1, np.zeros(3))] * len(weights)
        for cells, corner, sides in self._patches:
            points = self._inside(np.array(list(product(np.linspace(0, 1, self._space.p + 2), repeat=len(sides)))))
            local = self._sign * fields[:, self._space.dofs[:, cells]]
            samples = np.tensordot(local, self._space.at((corner + points @ sides).T), (1, 1))
            step = max(1, AT_ONCE // samples[0].size)
            for start in range(0, len(weights), step):
                some = weights[start : start + step]
                times, cell, point, tops = self._candidates(np.tensordot(some, samples, (-1, 0)), points)
                functions = np.empty((len(times), local.shape[1]))
                for c in np.unique(cell):
                    functions[cell == c] = some[times[cell == c]] @ local[:, :, c]
                at, tops, left = self._close(functions, points[point], tops, corner, sides)
                for n in np.argsort(tops, kind="stable").tolist():
                    when = start + int(times[n])
                    if tops[n] > values[when]:
                        values[when], doubts[when] = tops[n], left[n]
                        places[when] = Place(int(cells[cell[n]]), corner + at[n] @ sides)
        return values, doubts, places

    @staticmethod
    def _candidates(values: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, ...]:
        """Times, cells, best points and values of all parts of cells that may hold the extreme, for values (times,
        cells, points); parts are halves of a line, quarters of a side and eighths of a cell."""
        part = (points > 0.5) @ 2 ** np.arange(points.shape[1])
        members = [np.flatnonzero(part == k) for k in np.unique(part)]
        best = np.stack([at[values[..., at].argmax(axis=-1)] for at in members], axis=-1)
        tops = np.take_along_axis(values, best, axis=-1)
        bound = tops + MISSED * np.ptp(values, axis=-1, keepdims=True)
        most = min(CANDIDATES, tops[0].size)
        least = np.partition(tops.reshape(len(tops), -1), -most, axis=1)[:, -most]
        found = (bound >= tops.max(axis=(1, 2), keepdims=True)) & (tops >= least[:, None, None])
        times, cell, _ = np.nonzero(found)
        return times, cell, best[found], tops[found]

    def _close(
        self, functions: np.ndarray, places: np.ndarray, values: np.ndarray, corner: np.ndarray, sides: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(n, sides) and (n,) twice: the tops of functions (n, functions of a cell) near some places (n, sides) with
        ``values`` (n,), the values there, and the gains of the last lattice."""
        around = np.array(list(product(np.linspace(-1, 1, FINE), repeat=len(sides))))
        gains = np.zeros(len(functions))
        for turn in range(1, TURNS + 1):
            _, first, group = np.unique(places @ IRRATIONAL[: len(sides)], return_index=True, return_inverse=True)
            for k, middle in enumerate(places[first]):
                near = self._inside(np.clip(middle + 0.5**turn * around, 0.0, 1.0))
                members = np.flatnonzero(group == k)
                each = functions[members] @ self._space.at((corner + near @ sides).T).T
                best = each.argmax(axis=1)
                gains[members] = each[np.arange(len(members)), best] - values[members]
                values[members], places[members] = each[np.arange(len(members)), best], near[best]
        return places, values, np.maximum(gains, 0.0)

    def _inside(self, points: np.ndarray) -> np.ndarray:
        """The points (n, sides) that lie inside their part, a triangle or a tetrahedron on tetrahedra."""
        return points[points.sum(axis=1) <= 1 + 1e-12] if self._simplex else points
