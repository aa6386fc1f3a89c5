"""Contacts in the second path: nodes that are doubled where a temperature or a potential jumps."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree
from skfem import Basis, FacetBasis, MeshHex

from validate.verify.newton import Contact, On

Pair = frozenset[int]
"""The numbers of two boxes."""


def split(mesh: MeshHex, owner: np.ndarray, contacts: Collection[Pair]) -> MeshHex:
    """The mesh with a point of its own on each side of every face between two boxes that have a contact; ``owner``
    (cells,) is the box of each cell. Cells keep a point in common where others join them around it, as at the edge of
    a crack.

    Raises ValueError where a face keeps all its points, so that nothing could jump across it.
    """
    first, second = mesh.f2t
    inner = np.flatnonzero(second >= 0)
    apart = _apart(mesh, owner, contacts, inner)
    whole = inner[~apart]
    corners = np.arange(mesh.t.size).reshape(mesh.t.shape)
    joined = [_corner(mesh, corners, cells, mesh.facets[:, whole]) for cells in (first[whole], second[whole])]
    graph = coo_matrix((np.ones(joined[0].size), (joined[0].ravel(), joined[1].ravel())), shape=(mesh.t.size,) * 2)
    number = connected_components(graph, directed=False)[1].reshape(mesh.t.shape)
    points = np.empty((3, int(number.max()) + 1))
    points[:, number] = mesh.p[:, mesh.t]
    doubled = MeshHex(points, number)
    remaining = np.flatnonzero(doubled.f2t[1] >= 0)
    if _apart(doubled, owner, contacts, remaining).any():
        raise ValueError("a contact is one face wide and open on no side: its nodes cannot be doubled")
    return doubled


def _apart(mesh: MeshHex, owner: np.ndarray, contacts: Collection[Pair], facets: np.ndarray) -> np.ndarray:
    """(facets,): which of some facets lie in a contact."""
    pairs = np.sort(owner[mesh.f2t[:, facets]], axis=0)
    return np.any([(pairs == np.sort(list(pair))[:, None]).all(axis=0) for pair in contacts] or [pairs[0] < 0], axis=0)


def _corner(mesh: MeshHex, corners: np.ndarray, cells: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(4, facets): the number of the corner that each point (4, facets) is in some cells."""
    at = (mesh.t[:, cells][None] == points[:, None]).argmax(axis=1)
    return corners[at, cells]


def contact(
    basis: Basis, owner: np.ndarray, pair: Pair, order: int, thermal: float, electrical: float | None
) -> Contact:
    """The contact of two boxes on a mesh that was split there. Raises ValueError where they don't touch."""
    mesh, outer = basis.mesh, basis.mesh.boundary_facets()
    sides = [outer[owner[mesh.f2t[0, outer]] == number] for number in sorted(pair)]
    # Facets of the two sides lie on each other, and so do their nodes.
    middles = [mesh.p[:, mesh.facets[:, side]].mean(axis=1) for side in sides]
    first, second = _same(middles[0], middles[1], mesh)
    if not len(first):
        raise ValueError("two boxes with a contact don't touch")
    one, other = (basis.get_dofs(facets=side[at]).flatten() for side, at in zip(sides, (first, second), strict=True))
    here_nodes, there_nodes = _same(basis.doflocs[:, one], basis.doflocs[:, other], mesh)
    a, b = one[here_nodes], other[there_nodes]
    double = a != b
    a, b, ones = a[double], b[double], np.ones(int(double.sum()))
    less, plus = (
        csr_matrix((np.r_[ones, sign * ones], (np.r_[a, a], np.r_[a, b])), shape=(basis.N,) * 2) for sign in (-1, 1)
    )
    face = FacetBasis(mesh, basis.elem, facets=sides[0][first], intorder=order)
    return Contact(On(face), less, plus, thermal, electrical)


def _same(a: np.ndarray, b: np.ndarray, mesh: MeshHex) -> tuple[np.ndarray, np.ndarray]:
    """The numbers of the points a (3, points) and b that are in the same place."""
    distances, nearest = cKDTree(b.T).query(a.T)
    near = np.flatnonzero(distances < 1e-9 * np.ptp(mesh.p))
    return near, nearest[near]
