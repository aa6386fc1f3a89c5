"""Hexahedra of the whole structure, from a grid of the part that is solved: each brick in pieces, and all mirrored."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from meshes.grid import VOID, Grid
from meshes.symmetry import Symmetry

CORNERS = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))
"""The corners of a hexahedron in VTK's order."""

Image = Callable[[np.ndarray, int, str], np.ndarray]
"""What a mirror across an axis, "even" or "odd", makes of a quantity."""


def _same(values: np.ndarray, axis: int, parity: str) -> np.ndarray:
    return values


def with_none(cells: np.ndarray, none: float | bool) -> np.ndarray:
    """What is known of cells (nx, ny, nz, ...), with ``none`` for those of one interval more along each axis: that of
    empty pieces, where fields jump."""
    return np.pad(cells, [(0, 1)] * 3 + [(0, 0)] * (cells.ndim - 3), constant_values=none)


class Whole:
    """Hexahedra ``hexes`` (m, nodes) on ``points`` (n, 3) in m; ``material`` (m,) is the number of each one's material
    in ``material_names``, ``box`` (m,) of its box. The points of mirror planes are shared."""

    def __init__(
        self,
        grid: Grid,
        symmetry: Symmetry,
        axes: Sequence[np.ndarray],
        intervals: Sequence[np.ndarray],
        nodes: Sequence[tuple[int, ...]],
    ) -> None:
        """Per axis of the part the coordinates (m) of all nodes, and the interval that each piece is of (`with_none`);
        ``nodes`` are those of a hexahedron, as steps along the axes from its lowest."""
        self._planes = symmetry.planes
        owner = self._mirrored(with_none(grid.owner, VOID)[np.ix_(*intervals)], 0, _same)
        self._solid = owner != VOID
        self.box = owner[self._solid]
        whole = list(axes)
        for axis, middle, _ in self._planes:
            whole[axis] = np.concatenate([whole[axis], 2 * middle - whole[axis][-2::-1]])
        shape = tuple(len(at) for at in whole)
        first = np.argwhere(self._solid) * ((np.array(shape) - 1) // owner.shape)
        numbers = np.stack([np.ravel_multi_index(tuple((first + step).T), shape) for step in nodes], axis=1)
        self._used, local = np.unique(numbers, return_inverse=True)
        self.hexes = local.reshape(numbers.shape)
        at = np.unravel_index(self._used, shape)
        self.points = np.stack([c[i] for c, i in zip(whole, at, strict=True)], axis=1)
        self.material_names = list(dict.fromkeys(b.material.name for b in grid.boxes))
        self.material = np.array([self.material_names.index(b.material.name) for b in grid.boxes])[self.box]

    def at_points(self, values: np.ndarray, image: Image = _same) -> np.ndarray:
        """(..., n): values (..., x, y, z) at the nodes of the part."""
        nodal = self._mirrored(values, 1, image)
        return nodal.reshape(*nodal.shape[:-3], -1)[..., self._used]

    def in_hexes(self, values: np.ndarray, image: Image = _same) -> np.ndarray:
        """(m,): values (x, y, z) of the pieces of the part."""
        return self._mirrored(values, 0, image)[self._solid]

    def _mirrored(self, values: np.ndarray, shared: int, image: Image) -> np.ndarray:
        """Values (..., x, y, z) of the whole, without as many layers of an image as it shares with what is mirrored."""
        for axis, _, parity in self._planes:
            other = np.take(values, np.arange(values.shape[axis - 3] - shared)[::-1], axis=axis - 3)
            values = np.concatenate([values, image(other, axis, parity)], axis=axis - 3)
        return values
