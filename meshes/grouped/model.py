"""The value type of a mesh with groups."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from meshes.grouped import shapes

Faces = np.ndarray
"""(n, 2): faces as pairs of a cell and the number of the face in it, by which the face points out of the cell."""


@dataclass(frozen=True, eq=False)
class GroupedMesh:
    """``points`` (n, 3) in m; ``cells`` (m, nodes of a cell), in VTK's order, of one ``kind`` and ``order``.

    ``volumes``: the cells of each volume group. ``surfaces``: the faces of each surface group. ``others``: the
    names of groups that are neither, and of surface groups with faces that are of no cell, with what they are.
    ``file_type`` is meshio's name of the cells; its first nodes are the file's, as many as the type has.
    """

    points: np.ndarray
    cells: np.ndarray
    kind: str
    order: int
    volumes: dict[str, np.ndarray]
    surfaces: dict[str, Faces]
    others: dict[str, str] = field(default_factory=dict)
    file_type: str = ""

    @property
    def corners(self) -> np.ndarray:
        """(m, 4 or 8): the cells' corners."""
        return self.cells[:, : 4 if self.kind == shapes.TETRA else 8]

    @cached_property
    def facets(self) -> np.ndarray:
        """(m, faces of a cell): a number for each face, the same in the two cells that share it."""
        local = self.corners[:, shapes.FACETS[self.kind]]
        keys = np.sort(local.reshape(-1, local.shape[-1]), axis=1)
        found = np.unique(keys, axis=0, return_inverse=True)[1]
        return found.reshape(local.shape[:2])

    @cached_property
    def shared(self) -> np.ndarray:
        """(m, faces of a cell): whether there is a cell beyond a face."""
        return (np.bincount(self.facets.ravel()) > 1)[self.facets]

    def number(self, faces: Faces) -> np.ndarray:
        """(n,): the numbers of faces."""
        found: np.ndarray = self.facets[faces[:, 0], faces[:, 1]]
        return found

    def exposed(self, faces: Faces) -> np.ndarray:
        """(n,): which faces are on the surface."""
        found: np.ndarray = ~self.shared[faces[:, 0], faces[:, 1]]
        return found

    def both_sides(self, faces: Faces) -> np.ndarray:
        """(k,): the cells at either side of some faces."""
        wanted = np.isin(self.facets, self.number(faces))
        return np.flatnonzero(wanted.any(axis=1))

    def parts(self, inside: np.ndarray) -> np.ndarray:
        """(m,): a number from 1 on for each set of chosen cells (m,) that faces join, 0 elsewhere."""
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import connected_components

        count, width = self.facets.shape
        cells = np.repeat(np.arange(count), width)
        chosen = np.repeat(inside, width)
        number = self.facets.ravel()
        joint = coo_array(
            (np.ones(chosen.sum(), bool), (cells[chosen], count + number[chosen])),
            shape=(count + number.max() + 1,) * 2,
        )
        labels = connected_components(joint, directed=False)[1][:count]
        found = np.zeros(count, int)
        found[inside] = 1 + np.unique(labels[inside], return_inverse=True)[1]
        return found
