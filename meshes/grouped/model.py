"""The value type of a mesh with groups."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components


@dataclass(frozen=True, eq=False)
class GroupedMesh:
    """``mesh`` is scikit-fem's (MeshTet, MeshTet2, MeshHex or MeshHex2), in m; ``volumes`` are the cells of each volume
    group, ``surfaces`` the facets of each surface group, and of each which of its two cells in `f2t` it points out of.

    ``file_type`` is meshio's name of the file's cells, ``points`` (n, 3) and ``cells`` (m, nodes) are they, in order
    of nodes; ``others``: the names of groups that are neither, and of surface groups with facets that are of no cell,
    with what they are.
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
        """How many cells."""
        return int(self.mesh.t.shape[1])

    @property
    def simplex(self) -> bool:
        """Whether the cells are tetrahedra."""
        return len(self.mesh.t) == 4

    def exposed(self, facets: np.ndarray) -> np.ndarray:
        """(n,): which facets are on the surface."""
        return self.mesh.f2t[1, facets] < 0

    def beside(self, facets: np.ndarray) -> np.ndarray:
        """(k,): the cells at either side of some facets."""
        cells = np.unique(self.mesh.f2t[:, facets])
        return cells[cells >= 0]

    def borders(self, facets: np.ndarray, inside: np.ndarray) -> np.ndarray:
        """Those of some facets that a chosen cell (cells,) is at."""
        cells = self.mesh.f2t[:, facets]
        return facets[((cells >= 0) & inside[cells]).any(axis=0)]

    def parts(self, inside: np.ndarray, cuts: np.ndarray | None = None) -> np.ndarray:
        """(cells,): a number from 1 on for each set of chosen cells (cells,) that facets join, but for those of
        ``cuts``; 0 elsewhere."""
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
        """(3, cells) twice: the least and the largest coordinates of each cell's nodes."""
        nodes = self.mesh.doflocs[:, self.mesh.dofs.element_dofs]
        return nodes.min(axis=1), nodes.max(axis=1)
