"""A mesh with groups, and the search for the cell at a point."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components


@dataclass(frozen=True, eq=False)
class GroupedMesh:
    """A mesh and its groups of cells and facets.

    Attributes
    ----------
    mesh : scikit-fem's MeshTet, MeshTet2, MeshHex or MeshHex2, in m
    volumes : numbers of the cells, for each volume group
    surfaces : numbers of the facets, and the row in ``f2t`` of the cell that each facet points out of, for each
        surface group
    file_type : kind of the file's cells by meshio's name
    points, cells : (n, 3) nodes of the file (m), and (m, nodes) its volume cells in meshio's order
    others : description of each name in the file that is neither a volume nor a surface group
    """

    mesh: Any
    volumes: dict[str, np.ndarray]
    surfaces: dict[str, tuple[np.ndarray, np.ndarray]]
    file_type: str = ""
    points: np.ndarray = field(default_factory=lambda: np.empty((0, 3)))
    cells: np.ndarray = field(default_factory=lambda: np.empty((0, 0), int))
    others: dict[str, str] = field(default_factory=dict)

    @property
    def count(self) -> int:
        """Number of cells."""
        return int(self.mesh.t.shape[1])

    @property
    def simplex(self) -> bool:
        """Whether the cells are tetrahedra."""
        return len(self.mesh.t) == 4

    def unjoined_corners(self) -> int:
        """Return how many corners lie where another one is."""
        points = self.mesh.doflocs[:, : self.mesh.nvertices].T
        size = float(np.ptp(points, axis=0).max())
        rounded = np.rint((points - points.min(axis=0)) / (1e-9 * size)).astype(np.int64)
        return len(points) - len(np.unique(rounded, axis=0))

    def parts(self, inside: np.ndarray, cuts: np.ndarray | None = None) -> np.ndarray:
        """Return (cells,) a number from 1 on for each part of the chosen cells that facets join; 0 elsewhere.

        Facets in ``cuts`` join nothing.
        """
        joins = np.setdiff1d(np.arange(self.mesh.f2t.shape[1]), [] if cuts is None else cuts).astype(int)
        a, b = self.mesh.f2t[:, joins]
        both = (b >= 0) & inside[a] & inside[b]
        graph = coo_array((np.ones(both.sum(), bool), (a[both], b[both])), shape=(self.count, self.count))
        labels = connected_components(graph, directed=False)[1]
        numbers = np.zeros(self.count, int)
        numbers[inside] = 1 + np.unique(labels[inside], return_inverse=True)[1]
        return numbers

    @cached_property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest coordinates (3, cells) of each cell's nodes."""
        nodes = self.mesh.doflocs[:, self.mesh.dofs.element_dofs]
        return nodes.min(axis=1), nodes.max(axis=1)


INSIDE = 1e-6  # reference coordinates; coordinates in files have six or more digits
STEPS = 30  # iterations at most; Newton's method doubles the digits in each


def locate(mesh: GroupedMesh, point: np.ndarray, inside: np.ndarray | None = None) -> tuple[int, np.ndarray] | None:
    """Find the cell, among chosen ones (cells,), and the reference coordinates (3,) of a point (m).

    Return None outside. The map of each cell near the point is inverted by Newton's method.
    """
    low, high = mesh.bounds
    size = (high - low).max(axis=0)
    # A curved cell may bulge beyond its nodes by less than this.
    room = (1e-6 if mesh.mesh.doflocs.shape[1] == mesh.mesh.nvertices else 0.25) * size
    near = ((point[:, None] >= low - room) & (point[:, None] <= high + room)).all(axis=0)
    cells = np.flatnonzero(near if inside is None else near & inside)
    if not len(cells):
        return None
    mapping = mesh.mesh.mapping()
    x = np.full((3, len(cells), 1), 0.25 if mesh.simplex else 0.5)
    for _ in range(STEPS):
        slopes = np.moveaxis(mapping.DF(x, tind=cells)[..., 0], -1, 0)
        away = (point[:, None] - mapping.F(x, tind=cells)[..., 0]).T
        step = np.linalg.solve(slopes, away[..., None])[..., 0].T
        # Where the point is in another cell the iteration ends at the bounds.
        before, x = x, np.clip(x + step[..., None], -0.5, 1.5)
        if np.abs(x - before).max() < 1e-13:
            break
    at = x[..., 0]
    outside = np.maximum(-at, at - 1).max(axis=0)
    if mesh.simplex:
        outside = np.maximum(outside, at.sum(axis=0) - 1)
    off = np.linalg.norm(mapping.F(x, tind=cells)[..., 0] - point[:, None], axis=0)
    outside = np.where(off < 1e-6 * size[cells], outside, np.inf)
    best = int(outside.argmin())
    return (int(cells[best]), at[:, best]) if outside[best] <= INSIDE else None
