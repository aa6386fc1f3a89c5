"""The largest or smallest value of a function over parts of cells, found on the polynomials themselves.

A lattice in every cell tells which cells may hold it; in these finer lattices around the best point close in on it.
Along a line the parabola through the best point of a fine lattice and the two beside it tells how much higher the top
is, and the parabola of twice the spacing how well that is known.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import product
from typing import NamedTuple

import numpy as np

from fem3d.spaces.domain import Patch
from fem3d.spaces.integrals import Space

# Each next lattice has this fraction of the extent of the one before: two spacings around the best point, as tops lie
# askew.
CLOSER = 0.5
FINE = 5  # points of such a lattice along each side
TURNS = 6  # lattices after the first: the best point is then known to within 1/128 of a side
# A cell's top may lie above its best lattice point by this fraction of what the function spans on the lattice.
MISSED = 0.1
# A second top is looked for at least this fraction of a side away from the first, which the finer lattices do not
# see.
APART = 0.4
CANDIDATES = 24  # cells that are looked at more closely, at most: as many as may share a vertex
PER_DEGREE = 8  # lattice points along a line in a cell, for each degree
AT_ONCE = 4_000_000  # numbers in a block of times, at most, which bounds the memory


class Place(NamedTuple):
    """Where an extreme is: the cell and the reference point (3,)."""

    cell: int
    point: np.ndarray

    def row(self, space: Space) -> np.ndarray:
        """(functions,): what reads a function there."""
        row = np.zeros(space.size)
        row[space.dofs[:, self.cell]] = space.at(self.point[:, None])[0]
        return row


class Extreme:
    """The largest value (``sign`` 1) or the smallest one (-1) over some parts of cells. Points of a part are told by
    how far along its sides they lie, from 0 to 1."""

    def __init__(self, space: Space, patches: Sequence[Patch], sign: float) -> None:
        self._space, self._sign = space, sign
        self._simplex = "Tet" in type(space.mesh).__name__
        self._patches = [p for p in patches if len(p[0])]
        # As many points along each side as make a polynomial known there.
        counts = {1: PER_DEGREE * space.p + 1}
        self._lattices = [self._lattice(n, counts.get(n, space.p + 2)) for n in (len(p[2]) for p in self._patches)]

    def __call__(self, fields: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(times,) twice: of the sums of functions (r, functions) with weights (times, r), and what the search may have
        left of each."""
        extremes, doubts = np.full(len(weights), -np.inf), np.zeros(len(weights))
        for (cells, corner, sides), points in zip(self._patches, self._lattices, strict=True):
            at, dofs = self._space.at((corner + points @ sides).T), self._space.dofs[:, cells]
            step = max(1, AT_ONCE // max(at.shape[0] * dofs.shape[1], 1))
            samples = self._sign * np.tensordot(fields[:, dofs], at, (1, 1))
            for start in range(0, len(weights), step):
                values = np.tensordot(weights[start : start + step], samples, (-1, 0))
                if len(sides) == 1:
                    now = start + np.arange(len(values))
                    tops = [(now, *_on_line(lattice)) for lattice in np.moveaxis(values, 1, 0)]
                else:
                    tops = self._tops(values, points, start, weights, self._sign * fields[:, dofs], corner, sides)
                for when, value, doubt in tops:
                    better = value > extremes[when]
                    extremes[when], doubts[when] = (
                        np.where(better, value, extremes[when]),
                        np.where(better, doubt, doubts[when]),
                    )
        return self._sign * extremes, doubts

    def _tops(
        self,
        values: np.ndarray,
        points: np.ndarray,
        start: int,
        weights: np.ndarray,
        fields: np.ndarray,
        corner: np.ndarray,
        sides: np.ndarray,
    ) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
        """The times from a ``start`` on, the value and its doubt of each cell and point of a lattice that may hold the
        extreme then; of ``fields`` (r, own, cells)."""
        tried = [(cell, point, start + when) for cell, point, when in self._candidates(values, points)]
        functions = [weights[when] @ fields[:, :, cell] for cell, _, when in tried]
        group = np.repeat([point for _, point, _ in tried], [len(when) for *_, when in tried])
        _, tops, doubts = self._close(np.concatenate(functions), points, group, corner, sides)
        ends = np.cumsum([len(when) for *_, when in tried])[:-1]
        return list(zip((when for *_, when in tried), np.split(tops, ends), np.split(doubts, ends), strict=True))

    @staticmethod
    def _candidates(values: np.ndarray, points: np.ndarray) -> Iterator[tuple[int, int, np.ndarray]]:
        """Cells with a point of a lattice (times, cells, points), and the times at which the extreme may be near it.

        Of each cell that is its best point, and the best of those away from that. The lattice may miss `MISSED` of
        what the function spans on a cell of its top: the highest point of all is beaten where a point is no further
        below it.
        """
        highest = values.max(axis=(1, 2))
        missed = MISSED * np.ptp(values, axis=2)
        best = values.argmax(axis=2)
        ranked = np.argsort(-values.max(axis=2), axis=1)[:, :CANDIDATES]
        for cell in np.unique(ranked).tolist():
            in_reach = values[:, cell].max(axis=1) + missed[:, cell] >= highest
            times = np.flatnonzero((ranked == cell).any(axis=1) & in_reach)
            for first in np.unique(best[times, cell]).tolist():
                same = times[best[times, cell] == first]
                away = np.flatnonzero((np.abs(points - points[first]) > APART).any(axis=1))
                second = away[values[same, cell][:, away].argmax(axis=1)] if len(away) else np.empty(0, int)
                for tried in (np.full(len(same), first), second):
                    at = same[: len(tried)]
                    possible = values[at, cell, tried] + missed[at, cell] >= highest[at]
                    for point in np.unique(tried[possible]).tolist():
                        yield cell, point, at[possible & (tried == point)]

    def where(self, function: np.ndarray) -> Place:
        """Where that of a function (functions,) is."""
        best: tuple[float, Place] | None = None
        for (cells, corner, sides), points in zip(self._patches, self._lattices, strict=True):
            values = self._sign * (self._space.at((corner + points @ sides).T) @ function[self._space.dofs[:, cells]])
            point, cell = np.unravel_index(int(values.argmax()), values.shape)
            local = self._sign * function[None, self._space.dofs[:, cells[cell]]]
            (at,), (value,), _ = self._close(local, points, np.array([point]), corner, sides)
            if best is None or value > best[0]:
                best = float(value), Place(int(cells[cell]), corner + at @ sides)
        assert best is not None
        return best[1]

    def _close(
        self, functions: np.ndarray, points: np.ndarray, best: np.ndarray, corner: np.ndarray, sides: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(n, sides) and (n,) twice: where functions (n, own), of any cell each, are largest near the ``best`` (n,) of
        some points, their values, and what the search may have left of each."""
        # Those whose best points are the same are closed in on together.
        which, group = np.unique(best, return_inverse=True)
        middles, around = points[which], self._lattice(len(sides), FINE, inside=False) * 2 - 1
        value = (functions * self._space.at((corner + middles @ sides).T)[group]).sum(axis=1)
        doubt, best = np.zeros(len(functions)), np.empty(len(functions), int)
        step = max(1, AT_ONCE // (len(around) * functions.shape[1]))
        for turn in range(1, TURNS + 1):
            near = np.clip(middles[:, None] + CLOSER**turn * around, 0.0, 1.0)
            alike = np.split(np.argsort(group, kind="stable"), np.cumsum(np.bincount(group))[:-1])
            for start in range(0, len(near), step):
                some = near[start : start + step]
                tables = self._space.at((corner + some @ sides).reshape(-1, 3).T).reshape(*some.shape[:2], -1)
                for places, table, members in zip(some, tables, alike[start : start + step], strict=True):
                    values = functions[members] @ table.T
                    values[:, self._outside(places)] = -np.inf
                    best[members] = values.argmax(axis=1)
                    doubt[members] = np.maximum(values.max(axis=1) - value[members], 0.0)
                    value[members] += doubt[members]
            pairs, group = np.unique(group * len(around) + best, return_inverse=True)
            middles = near[pairs // len(around), pairs % len(around)]
        return middles[group], value, doubt

    def _lattice(self, n: int, count: int, inside: bool = True) -> np.ndarray:
        """(points, n): a lattice along n sides, as far as it lies inside."""
        steps = np.array(list(product(np.linspace(0, 1, count), repeat=n)))
        return steps[~self._outside(steps)] if inside else steps

    def _outside(self, points: np.ndarray) -> np.ndarray:
        """(points,): which lie outside of their part."""
        outside: np.ndarray = self._simplex & (points.sum(axis=1) > 1 + 1e-12)
        return outside


def _on_line(lattice: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(times,) twice: the top of functions that are known on a lattice (times, points), and how well it is known."""
    times, last, best = np.arange(len(lattice)), lattice.shape[1] - 1, lattice.argmax(axis=1)
    highest, tops = lattice[times, best], []
    for step in (1, 2):
        middle = np.clip(best, step, last - step)
        low, top, high = (lattice[times, middle + d] for d in (-step, 0, step))
        bend = 2 * top - low - high
        aside = np.where(bend > 0, (high - low) / (2 * np.where(bend > 0, bend, 1.0)), 0.0)
        # Not beyond the ends of the line, of which the best point may be one.
        inside = np.abs(middle + step * aside - last / 2) <= last / 2
        tops.append(np.where(inside, np.maximum(top + aside * (high - low) / 4, highest), highest))
    return tops[0], np.abs(tops[0] - tops[1])
