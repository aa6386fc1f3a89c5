"""Search for the largest or smallest value of a field over parts of cells, at some times.

In every cell that can reach the extreme a lattice selects the halves, quarters or eighths of cells that may hold it.
Lattices of half the size around each best point then converge. The gain of the last lattice estimates the remainder:
the error near an extreme is quadratic in the spacing, so that all further lattices together would gain a third of the
last gain.
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
        self.parts = space, patches, sign

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
            points = np.array(list(product(np.linspace(0, 1, self._space.p + 2), repeat=len(sides))))
            points = points[self._inside(points)]
            corners = np.flatnonzero(np.isin(points, (0, 1)).all(axis=1))
            shapes = self._space.at((corner + points @ sides).T)
            local = self._sign * fields[:, self._space.dofs[:, cells]]
            vertices = self._space.unit[self._space.dofs[:, cells[0]]] == 1.0
            step = max(1, AT_ONCE // local[0].size)
            for start in range(0, len(weights), step):
                functions = np.tensordot(weights[start : start + step], local, (1, 0))
                times, cell = self._reaching(functions, shapes, corners, vertices)
                chosen, at, tops = self._candidates(times, functions[times, :, cell], shapes, points)
                times, cell = times[chosen], cell[chosen]
                at, tops, left = self._close(times, functions[times, :, cell], at, tops, corner, sides)
                for n in np.argsort(tops, kind="stable").tolist():
                    if tops[n] > values[when := start + int(times[n])]:
                        values[when], doubts[when] = tops[n], left[n]
                        places[when] = Place(int(cells[cell[n]]), corner + at[n] @ sides)
        return values, doubts, places

    @staticmethod
    def _reaching(
        functions: np.ndarray, shapes: np.ndarray, corners: np.ndarray, vertices: np.ndarray
    ) -> tuple[np.ndarray, ...]:
        """Times and cells whose functions (times, functions of a cell, cells) may reach the extreme.

        With ``shapes`` (points, functions of a cell) at a lattice, a function is at most its largest coefficient of a
        vertex plus the sum of its other coefficients times the largest sizes of their shapes; the extreme is at least
        the largest value at the ``corners``.
        """
        sizes = np.abs(shapes).max(axis=0)
        highest = functions[:, vertices & (sizes > 0)].max(axis=1)
        bounds = highest + np.tensordot(np.abs(functions[:, ~vertices]), sizes[~vertices], (1, 0))
        attained = np.tensordot(functions, shapes[corners], (1, 1)).max(axis=(1, 2))
        return np.nonzero(bounds >= attained[:, None])

    @staticmethod
    def _candidates(
        times: np.ndarray, functions: np.ndarray, shapes: np.ndarray, points: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Which functions (n, functions of a cell) may hold the extreme of their time, their best points of a lattice
        (k, sides) and the values there (k,); each part of a cell has its best point: parts are halves of a line,
        quarters of a side, eighths of a cell."""
        part = (points > 0.5) @ 2 ** np.arange(points.shape[1])
        members = [np.flatnonzero(part == k) for k in np.unique(part)]
        best, tops = np.empty((len(functions), len(members)), int), np.empty((len(functions), len(members)))
        bounds, step = np.empty_like(tops), max(1, AT_ONCE // len(points))
        for some in (slice(i, i + step) for i in range(0, len(functions), step)):
            values = functions[some] @ shapes.T
            best[some] = np.stack([at[values[:, at].argmax(axis=1)] for at in members], axis=1)
            tops[some] = np.take_along_axis(values, best[some], axis=1)
            bounds[some] = tops[some] + MISSED * np.ptp(values, axis=1)[:, None]
        whose = np.repeat(np.arange(len(functions)), len(members))
        order = np.lexsort((-tops.ravel(), times[whose]))
        whose, best, tops, bounds = whose[order], best.flat[order], tops.flat[order], bounds.flat[order]
        # The parts of each time are in a row, the highest one first.
        firsts = np.searchsorted(times[whose], times[whose])
        found = (np.arange(len(order)) - firsts < CANDIDATES) & (bounds >= tops[firsts])
        return whose[found], points[best[found]], tops[found]

    def _close(
        self,
        times: np.ndarray,
        functions: np.ndarray,
        places: np.ndarray,
        values: np.ndarray,
        corner: np.ndarray,
        sides: np.ndarray,
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(n, sides) and (n,) twice: the tops of functions (n, functions of a cell) near some places (n, sides) with
        ``values`` (n,), the values there, and the gains of the last lattice. Functions that cannot reach the top of
        their time any more are left out of finer lattices."""
        around = np.array(list(product(np.linspace(-1, 1, FINE), repeat=len(sides))))
        going, highest = np.arange(len(functions)), np.full(times.max() + 1, -np.inf)
        gains, bounds = np.zeros((2, len(functions)))
        step = max(1, AT_ONCE // (len(around) * functions.shape[1]))
        for turn in range(1, TURNS + 1):
            for some in (going[i : i + step] for i in range(0, len(going), step)):
                # Most tops stay where they are over time.
                middles, same = np.unique(places[some], axis=0, return_inverse=True)
                near = np.clip(middles[:, None] + 0.5**turn * around, 0.0, 1.0)
                shapes = self._space.at((corner + near @ sides).reshape(-1, 3).T).reshape(*near.shape[:2], -1)
                each = (shapes[same] @ functions[some, :, None])[..., 0]
                outside = ~self._inside(near)[same]
                lowest = np.where(outside, np.inf, each).min(axis=1)
                each[outside] = -np.inf
                best = each.argmax(axis=1)
                tops = each[np.arange(len(each)), best]
                gains[some], values[some] = np.maximum(tops - values[some], 0.0), tops
                places[some], bounds[some] = near[same, best], tops + MISSED * (tops - lowest)
            np.maximum.at(highest, times, values)
            going = going[bounds[going] >= highest[times[going]]]
        return places, values, gains

    def _inside(self, points: np.ndarray) -> np.ndarray:
        """(...,): whether points (..., sides) lie in their part, a triangle or a tetrahedron on tetrahedra."""
        return points.sum(axis=-1) <= (1 + 1e-12 if self._simplex else np.inf)


class KnownPlaces(Extreme):
    """An extreme that is searched for once, and is then read at the same places of the cells.

    Beside a solution the change of the place changes an extreme to the second order alone (envelope theorem).
    """

    _places: Sequence[Place] = ()

    def __call__(self, fields: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        self._places = self._places or self._search(fields, weights)[2]
        values = np.empty(len(weights))
        for k, (cell, point) in enumerate(self._places):
            values[k] = weights[k] @ (fields[:, self._space.dofs[:, cell]] @ self._space.at(point[:, None])[0])
        return values, np.zeros(len(weights))
