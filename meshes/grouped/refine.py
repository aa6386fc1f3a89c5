"""Uniform refinement of a mesh with groups: each cell into eight, on the cell's own curved shape.

The nodes of the new cells lie on a lattice in their old cell. A lattice point is known by its weights at the old
corners, which neighbours agree on, so that cells stay joined exactly as they were, whatever lies at the same place.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from meshes.grouped import shapes
from meshes.grouped.model import Faces, GroupedMesh

_AT_CORNERS = ((0, 4, 6, 7), (4, 1, 5, 8), (6, 5, 2, 9), (7, 8, 9, 3))
_OCTAHEDRA = (
    ((4, 9, 5, 6), (4, 9, 6, 7), (4, 9, 7, 8), (4, 9, 8, 5)),
    ((5, 7, 4, 6), (5, 7, 6, 9), (5, 7, 9, 8), (5, 7, 8, 4)),
    ((6, 8, 4, 5), (6, 8, 5, 9), (6, 8, 9, 7), (6, 8, 7, 4)),
)
"""Four tetrahedra at the corners of one leave an octahedron, which one of its three diagonals cuts into four."""


def refine(mesh: GroupedMesh) -> GroupedMesh:
    """The mesh with eight cells in place of each: those of cell i are 8 i to 8 i + 7."""
    places, children = _lattice(mesh.kind, mesh.order)
    points, local = _numbered(mesh, places)
    cut = _shortest(mesh)
    cells = local[np.arange(len(local))[:, None, None], children[cut]].reshape(-1, children.shape[-1])
    volumes = {name: (8 * own[:, None] + np.arange(8)).ravel() for name, own in mesh.volumes.items()}
    surfaces = {name: _faces(mesh.kind, faces, cut) for name, faces in mesh.surfaces.items()}
    return replace(mesh, points=points, cells=cells, volumes=volumes, surfaces=surfaces)


def quadratic(mesh: GroupedMesh) -> GroupedMesh:
    """The same mesh with cells of second order: with a node in the middle of every edge, and of hexahedra of every face
    and cell too."""
    if mesh.order == 2:
        return mesh
    points, cells = _numbered(mesh, shapes.nodes(mesh.kind, 2))
    return replace(mesh, points=points, cells=cells, order=2)


def _numbered(mesh: GroupedMesh, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) of a lattice with reference coordinates (places, 3) in all cells, and their numbers (m, places)."""
    weights = np.rint(64 * shapes.values(mesh.kind, 1, places)).astype(np.int64)
    corners = mesh.corners.astype(np.int64)
    # A corner and its weight in one number; corners without weight are no part of the key.
    keys = np.where(weights > 0, corners[:, None, :] * 65 + weights, -1)
    keys = np.sort(keys, axis=-1).reshape(-1, corners.shape[1])
    first, local = np.unique(keys, axis=0, return_index=True, return_inverse=True)[1:]
    at = shapes.values(mesh.kind, mesh.order, places)
    cell, place = np.divmod(first, len(places))
    points = np.einsum("pn,pnd->pd", at[place], mesh.points[mesh.cells[cell]])
    return points, local.reshape(len(corners), len(places))


def _shortest(mesh: GroupedMesh) -> np.ndarray:
    """(m,): which diagonal of the octahedron in each tetrahedron is the shortest; 0 for hexahedra."""
    if mesh.kind == shapes.HEXAHEDRON:
        return np.zeros(len(mesh.cells), int)
    middles = shapes.values(mesh.kind, 1, shapes.nodes(mesh.kind, 2)) @ mesh.points[mesh.corners]
    lengths = [np.linalg.norm(middles[:, own[0][0]] - middles[:, own[0][1]], axis=1) for own in _OCTAHEDRA]
    return np.argmin(lengths, axis=0)


def _faces(kind: str, faces: Faces, cut: np.ndarray) -> Faces:
    """The four faces of new cells on each old one."""
    own = _children_on_faces(kind)[cut[faces[:, 0]], faces[:, 1]]
    own[..., 0] += 8 * faces[:, :1]
    return own.reshape(-1, 2)


@cache
def _lattice(kind: str, order: int) -> tuple[np.ndarray, np.ndarray]:
    """The lattice points (points, 3) in a cell and which are the nodes of each child (cuts, 8, nodes)."""
    own = shapes.nodes(kind, order)
    corners = _child_corners(kind)
    there = np.einsum("nv,kcvd->kcnd", shapes.values(kind, 1, own), corners)
    steps = np.rint(4 * there).astype(int).reshape(-1, 3)
    places, local = np.unique(steps, axis=0, return_inverse=True)
    return places / 4, local.reshape(there.shape[:-1])


@cache
def _child_corners(kind: str) -> np.ndarray:
    """(cuts, 8, corners, 3): where the corners of the children are, with the children the right way round."""
    if kind == shapes.HEXAHEDRON:
        cube = shapes.nodes(kind, 1)
        return np.array([[(cube + corner) / 2 for corner in cube]])
    found = shapes.nodes(kind, 2)[np.array([_AT_CORNERS + own for own in _OCTAHEDRA])]
    inverted = np.linalg.det(found[:, :, 1:] - found[:, :, :1]) < 0
    found[inverted] = found[inverted][:, [0, 1, 3, 2]]
    return found


@cache
def _children_on_faces(kind: str) -> np.ndarray:
    """(cuts, faces, 4, 2): the children, and their faces, that make up each face of a cell."""
    facets, corners = shapes.FACETS[kind], shapes.nodes(kind, 1)
    found: list[list[list[tuple[int, int]]]] = []
    for children in _child_corners(kind):
        found.append([])
        for face in facets:
            a, b, c = corners[face[:3]]
            on = np.abs((children - a) @ np.cross(b - a, c - a)) < 1e-9
            found[-1].append([(i, k) for i in range(8) for k, own in enumerate(facets) if on[i, own].all()])
    return np.array(found)


@cache
def inherited(kind: str, order: int) -> tuple[np.ndarray, np.ndarray]:
    """(nodes,) twice: for each node of a cell a child that has it, and which of the child's nodes it is."""
    own = shapes.nodes(kind, order)
    # The nodes of a cell are nodes of the children at its corners, however the rest is cut.
    corners = _child_corners(kind)[0]
    there = np.einsum("nv,cvd->cnd", shapes.values(kind, 1, shapes.nodes(kind, 2)), corners)
    distance = np.abs(there[None] - own[:, None, None]).max(axis=-1).reshape(len(own), -1)
    child, node = np.divmod(distance.argmin(axis=1), there.shape[1])
    return child, node
