"""The largest or smallest value of a function along a line through bricks, where it is a polynomial in each of them.

A lattice finds the top, and the parabola through its best point and the two beside it tells how much higher it is; the
parabola of twice the spacing tells how well that is known.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.polynomial import legendre

from fem3d.domain import Patch
from fem3d.extreme import Place
from fem3d.integrals import Space

PER_DEGREE = 8  # points of the lattice in a cell, for each degree


class LineExtreme:
    """What `fem3d.extreme.Extreme` is, over lines along an axis alone."""

    def __init__(self, space: Space, patches: Sequence[Patch], sign: float) -> None:
        self._space, self._sign, self._patches = space, sign, [p for p in patches if len(p[0])]
        p = int(getattr(space, "p", 2))
        self._at = np.linspace(0.0, 1.0, PER_DEGREE * p + 1)
        nodes = (1 - np.cos(np.pi * np.arange(p + 1) / p)) / 2
        self._nodes = nodes
        self._fine = legendre.legvander(2 * self._at - 1, p) @ np.linalg.inv(legendre.legvander(2 * nodes - 1, p))

    def __call__(self, fields: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(times,) twice: of the sums of functions (r, functions) with weights (times, r), and how well it is known."""
        found, left = np.full(len(weights), -np.inf), np.zeros(len(weights))
        for cells, corner, sides in self._patches:
            values = np.tensordot(weights, self._sign * self._sampled(fields, cells, corner, sides), (-1, 0))
            for lattice in np.moveaxis(values, 1, 0):
                best = lattice.argmax(axis=1)
                top = lattice[np.arange(len(weights)), best]
                gains = [_beside(lattice, best, step)[0] for step in (1, 2)]
                value, doubt = top + gains[0], np.abs(gains[0] - gains[1])
                better = value > found
                found, left = np.where(better, value, found), np.where(better, doubt, left)
        return self._sign * found, left

    def where(self, function: np.ndarray) -> Place:
        """Where that of a function (functions,) is."""
        tops = []
        for cells, corner, sides in self._patches:
            values = self._sign * self._sampled(function[None], cells, corner, sides)[0]
            cell, point = np.unravel_index(int(values.argmax()), values.shape)
            beside = _beside(values[cell, None], np.array([point]), 1)[1][0] * self._at[1]
            tops.append((float(values.max()), Place(int(cells[cell]), corner + (self._at[point] + beside) * sides[0])))
        return max(tops, key=lambda top: top[0])[1]

    def rows(self) -> np.ndarray:
        """(points, functions): what reads a function at the points of the lattice."""
        found = []
        for cells, corner, sides in self._patches:
            at = self._space.at(corner[:, None] + sides[0][:, None] * self._at)
            for dofs in self._space.dofs[:, cells].T:
                found.append(np.zeros((len(at), self._space.size)))
                found[-1][:, dofs] = at
        return np.concatenate(found)

    def _sampled(self, fields: np.ndarray, cells: np.ndarray, corner: np.ndarray, sides: np.ndarray) -> np.ndarray:
        """(r, cells, points): functions on the lattice of every cell."""
        points = corner[:, None] + sides[0][:, None] * self._nodes
        at_nodes = np.einsum("pn,rnc->rcp", self._space.at(points), fields[:, self._space.dofs[:, cells]])
        return at_nodes @ self._fine.T


def _beside(lattice: np.ndarray, best: np.ndarray, step: int) -> tuple[np.ndarray, np.ndarray]:
    """(times,) twice: by how much the parabola through the best point (times,) and those a step beside it rises above
    it, and how far from it, in spacings; at an end nothing."""
    times, last = np.arange(len(lattice)), lattice.shape[1] - 1
    inside = (best >= step) & (best <= last - step)
    middle = np.clip(best, step, last - step)
    low, top, high = (lattice[times, middle + d] for d in (-step, 0, step))
    bend = 2 * top - low - high
    aside = np.where(inside & (bend > 0), (high - low) / (2 * np.where(bend > 0, bend, 1.0)), 0.0)
    return aside * (high - low) / 4, step * aside
