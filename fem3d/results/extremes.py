"""Search for the largest or smallest value of a field over parts of cells, at some times.

In every cell that can reach the extreme a lattice selects the halves, quarters or eighths of cells that may hold it.
Lattices of half the size around each best point then converge. The gain of the last lattice estimates the remainder:
the error near an extreme is quadratic in the spacing, so that all further lattices together would gain a third of the
last gain.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.polynomial.legendre import legvander

from fem3d.spaces.domain import Patch
from fem3d.spaces.integrals import AT_ONCE, Space

FINE, TURNS = 5, 6  # points along each side of a finer lattice, and how many there are: to 1/128 of a side
# The top of a cell may lie above its best lattice point by this part of the function's span on the lattice. For
# 3,600 random functions of degrees 2 to 6 it is 0.04 where coefficients halve per degree, as in solutions, else 0.16.
MISSED = 0.1


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
    """The largest value (``sign`` 1) or the smallest one (-1) over some parts of cells.

    Attributes
    ----------
    kept : the place at each time, which later readings share; empty before the first, None to search at each reading
    """

    kept: Sequence[Place] | None = None

    def __init__(self, space: Space, patches: Sequence[Patch], sign: float) -> None:
        self.space, self.sign = space, sign
        self.patches = [patch for patch in patches if len(patch.cells)]

    def once(self) -> Extreme:
        """Return an extreme that is searched for once, and is then read at the same places of the cells.

        Beside a solution the change of the place changes an extreme to the second order alone (envelope theorem).
        """
        extreme = copy(self)
        extreme.kept = ()
        return extreme

    def where(self, function: np.ndarray) -> Place:
        """Return the place of the extreme of a function (functions,)."""
        return LatticeSearch([self]).run(function[None], np.ones((1, 1)))[2][0][0]


def read_extremes(every: Sequence[Extreme], fields: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(extremes, times) twice: extremes of the sums of functions (r, functions) with weights (times, r), and the
    estimated remainder of the search for each; all extremes in one space are searched for at once."""
    values, doubts = np.zeros((2, len(every), len(weights)))
    for i, extreme in enumerate(every):
        for k, (cell, point) in enumerate(extreme.kept or ()):
            at = extreme.space.dofs[:, cell], extreme.space.at(point[:, None])[0]
            values[i, k] = weights[k] @ (fields[:, at[0]] @ at[1])
    if new := [i for i, extreme in enumerate(every) if not extreme.kept]:
        sought = [every[i] for i in new]
        values[new], doubts[new], places = LatticeSearch(sought).run(fields, weights)
        for extreme, found in zip(sought, places, strict=True):
            extreme.kept = found if extreme.kept is not None else None
    return values, doubts


class LatticeSearch:
    """The search for some extremes in one space. Extremes over parts of cells that are alike share their lattices."""

    def __init__(self, extremes: Sequence[Extreme]) -> None:
        self._extremes, self._space = extremes, extremes[0].space
        self._nodes = (1 - np.cos(np.linspace(0, np.pi, self._space.p + 2))) / 2

    def run(self, fields: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray, list[list[Place]]]:
        """The values and the remainders (extremes, times), and the places of each extreme, as of `read_extremes`."""
        extremes, count = self._extremes, len(self._extremes)
        values, doubts = np.full((count, len(weights)), -np.inf), np.zeros((count, len(weights)))
        places = [[Place(-1, np.zeros(3))] * len(weights) for _ in extremes]
        signs = np.array([extreme.sign for extreme in extremes])
        alike: dict[tuple[bytes, bytes, int], list[tuple[int, Patch]]] = {}
        seen, most = 0, max(1, AT_ONCE // (len(fields) * len(self._space.dofs)))
        for i, patch in ((i, patch) for i, extreme in enumerate(extremes) for patch in extreme.patches):
            alike.setdefault((patch.corner.tobytes(), patch.sides.tobytes(), seen // most), []).append((i, patch))
            seen += len(patch.cells)
        for group in alike.values():
            cells, (_, corner, sides) = np.concatenate([patch.cells for _, patch in group]), group[0][1]
            owner = np.repeat([i for i, _ in group], [len(patch.cells) for _, patch in group])
            points = np.array(list(product(self._nodes, repeat=len(sides))))
            shapes = self._space.at((corner + points @ sides).T)
            local = signs[owner] * fields[:, self._space.dofs[:, cells]]
            step = max(1, AT_ONCE // local[0].size)
            for start in range(0, len(weights), step):
                functions = np.tensordot(weights[start : start + step], local, (1, 0))
                pair, cell, on_lattice = self._reaching(functions, owner, cells[0], points, shapes)
                pair, cell, at, tops, gains = self._climb(pair, cell, on_lattice, len(sides))
                for n in np.argsort(tops, kind="stable").tolist():
                    time, i = start + int(pair[n]) // count, int(pair[n]) % count
                    if tops[n] > values[i, time]:
                        values[i, time], doubts[i, time] = tops[n], gains[n]
                        places[i][time] = Place(int(cells[cell[n]]), corner + at[n] @ sides)
        return signs[:, None] * values, doubts, places

    def _reaching(
        self, functions: np.ndarray, owner: np.ndarray, cell: int, points: np.ndarray, shapes: np.ndarray
    ) -> tuple[np.ndarray, ...]:
        """Pairs and cells (n,) whose functions (times, functions of a cell, cells) may reach the extreme of their
        ``owner`` (cells,), and their values (n, points) at a lattice with these ``shapes`` (points, functions of a
        cell). All cells are like one ``cell``. A pair of a time and an extreme is time * extremes + extreme.

        A function is at most its largest coefficient of a vertex plus the sum of its other coefficients times the
        largest sizes of their shapes, and above its own lattice by `MISSED` of its span; the extreme is at least the
        largest value on the lattice.
        """
        inside, count = self._inside(points), len(self._extremes)
        sizes, vertices = np.abs(shapes[inside]).max(axis=0), self._space.unit[self._space.dofs[:, cell]] == 1.0
        highest = functions[:, vertices & (sizes > 0)].max(axis=1)
        bounds = highest + np.tensordot(np.abs(functions[:, ~vertices]), sizes[~vertices], (1, 0))
        at_corners = shapes[inside & np.isin(points, (0, 1)).all(axis=1)]
        attained = np.full((len(functions), count), -np.inf)
        np.maximum.at(attained.T, owner, np.tensordot(functions, at_corners, (1, 1)).max(axis=2).T)
        times, cells = np.nonzero(bounds >= attained[:, owner])
        on_lattice, pair = functions[times, :, cells] @ shapes.T, times * count + owner[cells]
        top, least = on_lattice[:, inside].max(axis=1), on_lattice[:, inside].min(axis=1)
        np.maximum.at(attained.reshape(-1), pair, top)
        reach = top + MISSED * (top - least) >= attained.ravel()[pair]
        return pair[reach], cells[reach], on_lattice[reach]

    def _climb(self, pair: np.ndarray, cell: np.ndarray, on_lattice: np.ndarray, count: int) -> tuple[np.ndarray, ...]:
        """Pairs and cells (n,) of the parts of cells that were searched to the end, their best points (n, sides), the
        values there and the gains of the last lattice.

        Parts are halves of a line, quarters of a side, eighths of a cell. Those that cannot reach the top of their
        pair are left out of finer lattices. The functions of some pairs and cells, polynomials along each of the
        ``count`` sides, have the values ``on_lattice`` (m, points) at a lattice of nodes.
        """
        degree = len(self._nodes) - 1
        to_legendre = np.linalg.inv(legvander(2 * self._nodes - 1, degree))
        parts = np.array([at for at in product((0.25, 0.75), repeat=count) if self._inside(np.array(at) - 0.25)])
        whose, places = np.repeat(np.arange(len(on_lattice)), len(parts)), np.tile(parts, (len(on_lattice), 1))
        tops, gains, bounds = np.full((3, len(whose)), -np.inf)
        highest = np.full(pair.max() + 1, -np.inf)
        going, along = np.arange(len(whose)), self._space.p // 2 + 2
        for turn in range(TURNS + 1):
            around = 0.25 * 0.5**turn * np.linspace(-1, 1, along)
            at = np.array(list(np.ndindex(*[along] * count)), int)
            for some in np.array_split(going, 1 + len(going) * max(on_lattice[0].size, at.size) // AT_ONCE):
                near, values = np.clip(places[some][..., None] + around, 0.0, 1.0), on_lattice[whose[some]]
                for table in (legvander(2 * near - 1, degree) @ to_legendre).swapaxes(0, 1):
                    values = values.reshape(len(some), degree + 1, -1).swapaxes(1, 2) @ table.swapaxes(1, 2)
                values, points = values.reshape(len(some), -1), near[:, np.arange(count), at]
                inside, every = self._inside(points), np.arange(len(some))
                best = np.where(inside, values, -np.inf).argmax(axis=1)
                top, places[some] = values[every, best], points[every, best]
                gains[some], tops[some] = np.maximum(top - tops[some], 0.0), top
                bounds[some] = top + MISSED * (top - np.where(inside, values, np.inf).min(axis=1))
            np.maximum.at(highest, pair[whose], tops)
            going, along = going[bounds[going] >= highest[pair[whose[going]]]], FINE
        return pair[whose[going]], cell[whose[going]], places[going], tops[going], gains[going]

    def _inside(self, points: np.ndarray) -> np.ndarray:
        """(...,): whether points (..., sides) lie in their part, a triangle or a tetrahedron on tetrahedra."""
        return points.sum(axis=-1) <= (1 + 1e-12 if len(self._space.mesh.t) == 4 else np.inf)
