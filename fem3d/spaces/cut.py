"""Cells that are cut into boxes where a law bends inside, as fields on the whole cells.

A law has a bend along an isotherm. Boxes that it crosses are cut further, and others are not. What a law is at the
points of all boxes of a cell becomes a field at the points of Gauss of the cell itself, n along an axis: that whose
integrals by these, times any product of polynomials of degree below n of each coordinate, are those over the boxes. So
forms see no boxes. They miss what a bend has of higher degrees, which only products of the highest functions of a cell
see: of the temperature these are as small as what the mesh leaves of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre

from fem3d.spaces.element import gauss, line

FEW = 5  # points of a box along each axis, and those more: for what bends inside, more boxes help and points hardly do
# Of the largest change of a field over a box: one along another axis that is less bends an isotherm so little that
# what the axis's own points miss is less than what the boxes do.
ALIKE = 0.25
BEYOND = 2.0  # times what a straight line changes by between the outermost points of a box and its ends
LEAST = 0.5  # of the smallest value in a cell: below that no field that stands for a positive one may swing at a point


class Boxes(NamedTuple):
    """Of each of n boxes the number of its cell, and on the reference cell where it begins and its ``sides`` (3, n)."""

    cells: np.ndarray
    lower: np.ndarray
    sides: np.ndarray

    @staticmethod
    def whole(cells: np.ndarray) -> Boxes:
        """Cells as one box each."""
        return Boxes(cells, np.zeros((3, len(cells))), np.ones((3, len(cells))))

    def of(self, which: np.ndarray) -> Boxes:
        """Some of them."""
        return Boxes(self.cells[which], self.lower[:, which], self.sides[:, which])

    def cut(self, changes: np.ndarray) -> Boxes:
        """Each cut, for a field that changes by ``changes`` (3, n) over it along the axes: in four along the one along
        which it changes most, in two along each of several where it changes about as much."""
        along = (changes > ALIKE * changes.max(axis=0)) & (changes > 0)
        parts = np.where(along, np.where(along.sum(axis=0) > 1, 2, 4), 1)
        counts = parts.prod(axis=0)
        box = np.repeat(np.arange(len(counts)), counts)
        number = np.arange(len(box)) - np.repeat(np.cumsum(counts) - counts, counts)
        within = []
        for n in parts[:, box]:
            within.append(number % n)
            number = number // n
        sides = (self.sides / parts)[:, box]
        return Boxes(self.cells[box], self.lower[:, box] + within * sides, sides)


def joined(boxes: Sequence[Boxes]) -> Boxes:
    """All of some boxes."""
    return Boxes(*(np.concatenate(parts, axis=-1) for parts in zip(*boxes, strict=True)))


@dataclass(frozen=True, eq=False)
class Cut:
    """The boxes of some cells. ``places`` (cut cells,): which of the cells are cut, ``owner`` (boxes,): of which each
    box is one, by its place among them, those of a cell together; ``dofs`` (boxes, functions): the functions there.
    ``tables``: along each axis the values and slopes (2, boxes, functions of the coordinate, points) of what the
    functions are products of, as their ``modes`` (3, functions) say; ``means``: along each axis what is told of the
    points of each box to those of its cell (boxes, points of the cell, points); a box goes on ``outside`` times the
    span of its points beyond them."""

    boxes: Boxes
    places: np.ndarray
    owner: np.ndarray
    dofs: np.ndarray
    modes: np.ndarray
    tables: list[np.ndarray]
    means: list[np.ndarray]
    outside: float

    @staticmethod
    def of(
        cells: np.ndarray, boxes: Boxes, dofs: np.ndarray, modes: np.ndarray, points: tuple[int, int, int], more: int
    ) -> Cut | None:
        """Of those ``boxes`` that are of some cells with ``dofs`` (functions, cells), whose quadrature has so many
        ``points`` along the axes, ``more`` of them than is their due; None without any."""
        order = np.argsort(cells)
        place = np.minimum(np.searchsorted(cells, boxes.cells, sorter=order), len(cells) - 1)
        mine = np.flatnonzero(cells[order[place]] == boxes.cells) if len(cells) else np.empty(0, int)
        if not len(mine):
            return None
        owner = order[place[mine]]
        together = np.argsort(owner, kind="stable")
        boxes, owner = boxes.of(mine[together]), owner[together]
        tables, means, outside = [], [], []
        for start, side, k, n in zip(boxes.lower, boxes.sides, modes, points, strict=True):
            x, w = gauss(min(n - more, FEW) + more)
            at = start[:, None] + side[:, None] * x
            tables.append(np.array(line(int(k.max(initial=1)), at)).swapaxes(1, 2))
            # In Legendre's polynomials of size one in the mean square, whose products Gauss's rule sums exactly.
            scale = np.sqrt(2 * np.arange(n) + 1)
            there, in_cell = (legendre.legvander(2 * y - 1, n - 1) * scale for y in (at, gauss(n)[0]))
            means.append(np.einsum("gk,bpk->bgp", in_cell, there) * w * side[:, None, None])
            outside.append(x[0] / (x[-1] - x[0]))
        return Cut(boxes, np.unique(owner), owner, dofs[:, owner].T, modes, tables, means, max(outside))

    def value(self, u: np.ndarray, along: int | None = None) -> np.ndarray:
        """(boxes, points): a function u (functions,) of the space; or, ``along`` an axis, by how much it would change
        over the whole cell at its slope there."""
        x, y, z = (table[int(d == along)] for d, table in enumerate(self.tables))
        n, whole = len(x), np.zeros((len(x), x.shape[1], y.shape[1], z.shape[1]))
        whole[(slice(None), *self.modes)] = u[self.dofs]
        in_z = whole.reshape(n, -1, z.shape[1]) @ z
        in_yz = y.swapaxes(1, 2)[:, None] @ in_z.reshape(n, x.shape[1], y.shape[1], -1)
        return np.asarray(x.swapaxes(1, 2) @ in_yz.reshape(n, x.shape[1], -1)).reshape(n, -1)

    def extremes(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(boxes,) twice: about the least and the largest value of a function in each."""
        values = self.value(u)
        low, high = values.min(axis=1), values.max(axis=1)
        beyond = BEYOND * self.outside * (high - low)
        return low - beyond, high + beyond

    def changes(self, u: np.ndarray) -> np.ndarray:
        """(3, boxes): how far a function spans each box along the axes, in the mean square."""
        slopes = np.array([self.value(u, d) for d in range(3)])
        return np.sqrt((slopes**2).mean(axis=-1)) * self.boxes.sides

    def within(self, field: np.ndarray) -> np.ndarray:
        """(..., cut cells, points of a cell): the field on the cells that a field (..., boxes, points) becomes."""
        x, y, z = self.means
        first, n = field.shape[:-2], len(x)
        in_x = x @ field.reshape(*first, n, x.shape[2], -1)
        in_xy = y[:, None] @ in_x.reshape(*first, n, x.shape[1], y.shape[2], -1)
        every = in_xy.reshape(*first, n, -1, z.shape[2]) @ z.swapaxes(1, 2)
        starts = np.searchsorted(self.owner, self.places)
        summed = np.add.reduceat(every.reshape(*first, n, -1), starts, axis=-2)
        least = np.minimum.reduceat(field.min(axis=-1), starts, axis=-1)[..., None]
        return np.where(least > 0, np.maximum(summed, LEAST * least), summed)
