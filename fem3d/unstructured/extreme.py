"""The largest or smallest value of a field over a group: that at its nodes, made better in the cells around it."""

from __future__ import annotations

from functools import cache
from itertools import product

import numpy as np

from fem3d.unstructured.space import Space
from meshes.grouped import shapes
from meshes.grouped.model import Faces

FINE = 8  # intervals along an edge: what lies between the samples is below 2 % of how far a cell's field bulges
AT_ONCE = 4_000_000  # numbers that a block of times may take


class Extreme:
    """The largest value (``sign`` 1) or the smallest one (-1) over some cells or faces."""

    def __init__(self, space: Space, sign: float, cells: np.ndarray, faces: Faces | None) -> None:
        self._sign = sign
        if faces is None:
            self._dofs, self._which = space.dofs[cells], np.zeros(len(cells), int)
            places = _lattice(space.kind)[None]
        else:
            self._dofs, self._which = space.dofs[faces[:, 0]], faces[:, 1]
            places = _on_faces(space.kind)
        self._at = np.array([shapes.values(space.kind, space.degree, x) for x in places])
        on = np.abs(self._at[self._which]).max(axis=1) > 1e-12  # nodes that matter there: on a face, those of the face
        self._dofs = np.where(on, self._dofs, -1)
        self.nodes = np.unique(self._dofs[on])

    def __call__(self, fields: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """(times,): of the sums of fields (r, nodes) with weights (times, r)."""
        found = np.empty(len(weights))
        size, own = max(1, AT_ONCE // len(self.nodes)), self._sign * fields[:, self.nodes]
        for start in range(0, len(weights), size):
            block = weights[start : start + size] @ own
            winners = block.argmax(axis=1)
            found[start : start + size] = block.max(axis=1)
            for winner in np.unique(winners):
                when = start + np.flatnonzero(winners == winner)
                around = self._around(fields, self.nodes[winner])
                found[when] = np.maximum(found[when], (self._sign * (weights[when] @ around)).max(axis=1))
        return self._sign * found

    def _around(self, fields: np.ndarray, node: int) -> np.ndarray:
        """(r, samples): the fields in the cells or faces at a node."""
        near = np.flatnonzero((self._dofs == node).any(axis=1))
        values = fields[:, self._dofs[near]] * (self._dofs[near] >= 0)
        return np.einsum("epn,ren->rep", self._at[self._which[near]], values).reshape(len(fields), -1)


@cache
def _lattice(kind: str) -> np.ndarray:
    """(places, 3): evenly spaced in a reference cell."""
    found = np.array(list(product(range(FINE + 1), repeat=3)))
    return (found[found.sum(axis=1) <= FINE] if kind == shapes.TETRA else found) / FINE


@cache
def _on_faces(kind: str) -> np.ndarray:
    """(faces, places, 3): on each face of a reference cell."""
    flat = np.array(list(product(range(FINE + 1), repeat=2))) / FINE
    flat = flat[flat.sum(axis=1) <= 1] if kind == shapes.TETRA else flat
    corners = shapes.nodes(kind, 1)[shapes.FACETS[kind]]
    sides = np.stack([corners[:, 1] - corners[:, 0], corners[:, -1] - corners[:, 0]], axis=1)
    return corners[:, :1] + np.einsum("ps,fsd->fpd", flat, sides)
