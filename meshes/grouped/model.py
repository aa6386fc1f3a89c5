"""The content of a mesh file, the mesh with groups that is built of it, and its refinement.

A mesh is refined on the cells' own curved shape: all cells into eight, or chosen tetrahedra by scikit-fem's bisection
of longest edges, which goes on in the neighbours until no node hangs. scikit-fem cuts the cells as if their edges were
straight; the nodes then go where the maps of the old cells take them.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from skfem import MeshHex, MeshTet

INSIDE = 1e-6  # reference coordinates; coordinates in files have six or more digits


class MeshFileError(ValueError):
    """A mesh file that cannot be read; the message names the cause and the cure."""


Block = tuple[str, np.ndarray, tuple[str, ...]]
"""Cells of one kind in the same groups: meshio's name of the kind, nodes (cells, nodes) in meshio's order, groups."""


@dataclass
class MeshData:
    """Nodes and cells of a mesh file.

    Attributes
    ----------
    points : (n, 3) coordinates of the nodes, in the file's unit
    blocks : the cells
    others : description of each name in the file that is no group of cells
    """

    points: np.ndarray
    blocks: list[Block]
    others: dict[str, str] = field(default_factory=dict)


def dimension(kind: str) -> int:
    """Return the dimension of a kind of cell."""
    if kind.startswith(("triangle", "quad", "polygon")):
        return 2
    return 0 if kind == "vertex" else 1 if kind.startswith("line") else 3


def node_rows(ids: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Return the row of each wanted node among the nodes of a file, by their numbers in the file."""
    order = np.argsort(ids, kind="stable")
    at = order[np.minimum(np.searchsorted(ids, wanted, sorter=order), len(ids) - 1)]
    missing = ids[at] != wanted
    if missing.any():
        raise MeshFileError(f"a cell has node {wanted[missing][0]}, which is not in the file: write the nodes too")
    return at


@dataclass(frozen=True, eq=False)
class GroupedMesh:
    """A mesh and its groups of cells and facets.

    Attributes
    ----------
    mesh : scikit-fem's MeshTet, MeshTet2, MeshHex or MeshHex2, in m
    volumes : numbers of the cells, for each volume group
    surfaces : ascending numbers of the facets, and the row in ``f2t`` of the cell that each facet points out of, for
        each surface group
    file_type, file_cells : kind of the file's cells by meshio's name, and their number
    others : description of each name in the file that is neither a volume nor a surface group
    """

    mesh: Any
    volumes: dict[str, np.ndarray]
    surfaces: dict[str, tuple[np.ndarray, np.ndarray]]
    file_type: str = ""
    file_cells: int = 0
    others: dict[str, str] = field(default_factory=dict)

    @property
    def count(self) -> int:
        """Number of cells."""
        return int(self.mesh.t.shape[1])

    @property
    def simplex(self) -> bool:
        """Whether the cells are tetrahedra."""
        return len(self.mesh.t) == 4


def locate(mesh: Any, point: np.ndarray, inside: np.ndarray | None = None) -> tuple[int, np.ndarray] | None:
    """Find the cell of scikit-fem's mesh, among chosen cells (cells,), and the reference coordinates (3,) of a point.

    Return None outside. The map of each cell near the point is inverted by Newton's method.
    """
    nodes, simplex = mesh.doflocs[:, mesh.dofs.element_dofs], len(mesh.t) == 4
    low, high = nodes.min(axis=1), nodes.max(axis=1)
    size = (high - low).max(axis=0)
    # A curved cell may bulge beyond its nodes by less than this.
    room = (1e-6 if mesh.doflocs.shape[1] == mesh.nvertices else 0.25) * size
    near = ((point[:, None] >= low - room) & (point[:, None] <= high + room)).all(axis=0)
    cells = np.flatnonzero(near if inside is None else near & inside)
    if not len(cells):
        return None
    mapping = mesh.mapping()
    x = np.full((3, len(cells), 1), 0.25 if simplex else 0.5)
    for _ in range(30):  # Newton's method doubles the digits in each
        slopes = np.moveaxis(mapping.DF(x, tind=cells)[..., 0], -1, 0)
        away = (point[:, None] - mapping.F(x, tind=cells)[..., 0]).T
        step = np.linalg.solve(slopes, away[..., None])[..., 0].T
        # Where the point is in another cell the iteration ends at the bounds.
        before, x = x, np.clip(x + step[..., None], -0.5, 1.5)
        if np.abs(x - before).max() < 1e-13:
            break
    at = x[..., 0]
    outside = np.maximum(-at, at - 1).max(axis=0)
    if simplex:
        outside = np.maximum(outside, at.sum(axis=0) - 1)
    off = np.linalg.norm(mapping.F(x, tind=cells)[..., 0] - point[:, None], axis=0)
    outside = np.where(off < 1e-6 * size[cells], outside, np.inf)
    best = int(outside.argmin())
    return (int(cells[best]), at[:, best]) if outside[best] <= INSIDE else None


def refine(given: GroupedMesh, times: np.ndarray) -> GroupedMesh:
    """Return the mesh with each tetrahedron halved so many ``times`` (cells,), or each hexahedron cut into eight.

    Neighbours are halved until no node hangs. The corners of the old cells keep their numbers.
    """
    mesh = given.mesh
    flat = (MeshTet if given.simplex else MeshHex)(mesh.doflocs[:, : mesh.nvertices], mesh.t)
    # scikit-fem has all cells at the first corners of hexahedra, then all at the second corners, and so on.
    fine, parents = _bisected(flat, times) if given.simplex else (flat.refined(), np.tile(np.arange(given.count), 8))
    finer = fine
    if type(mesh) is not type(flat):
        curved = type(mesh).from_mesh(fine)
        nodes = curved.dofs.element_dofs
        if given.simplex:
            at = flat.mapping().invF(np.swapaxes(curved.doflocs[:, nodes], 1, 2), tind=parents)
        else:
            at = (mesh.refdom.p[:, :, None] + np.asarray(mesh.elem().doflocs).T[:, None]) / 2
            at = np.repeat(at, given.count, axis=1)
        places = curved.doflocs.copy()
        places[:, nodes] = np.swapaxes(mesh.mapping().F(at, tind=parents), 1, 2)
        finer = replace(curved, doflocs=places)
    within = _within(flat, fine, parents)
    surfaces = {}
    for name, (facets, side) in given.surfaces.items():
        fine_facets = np.flatnonzero(np.isin(within, facets))
        at = np.searchsorted(facets, within[fine_facets])
        out_of = mesh.f2t[side[at], facets[at]]
        surfaces[name] = fine_facets, (parents[finer.f2t[0, fine_facets]] != out_of).astype(int)
    volumes = {name: np.flatnonzero(np.isin(parents, cells)) for name, cells in given.volumes.items()}
    return replace(given, mesh=finer, volumes=volumes, surfaces=surfaces)


def _bisected(mesh: Any, times: np.ndarray) -> tuple[Any, np.ndarray]:
    """Halve straight tetrahedra so many ``times`` (cells,); return the mesh and (new cells,) their parents."""
    # scikit-fem compares lengths to 1e-10 of its unit, and warns when it copies arrays.
    size, logger = float(np.ptp(mesh.p, axis=1).max()), logging.getLogger("skfem")
    before, parents = logger.level, np.arange(mesh.t.shape[1])
    logger.setLevel(logging.ERROR)
    try:
        finer = MeshTet(mesh.p / size, mesh.t)
        while times.any():
            whole, within = _Followed(finer.p, finer.t), np.arange(finer.t.shape[1])
            finer = whole.refined(np.flatnonzero(times).astype(np.int32))
            for halved in whole.rounds:
                within = np.concatenate([within, within[halved]])
            parents, times = parents[within], np.maximum(times - 1, 0)[within]
        return MeshTet(np.ascontiguousarray(finer.p * size), np.sort(finer.t, axis=0)), parents
    finally:
        logger.setLevel(before)


class _Followed(MeshTet):
    """A mesh that records the cells halved in each round; one half keeps the number of the cell."""

    rounds: Any = ()

    def _adaptive_sort_mesh(self, p: np.ndarray, t: np.ndarray, marked: np.ndarray) -> np.ndarray:
        self.rounds = [*self.rounds, marked.copy()]
        cells: np.ndarray = super()._adaptive_sort_mesh(p, t, marked)
        return cells


def _within(flat: Any, fine: Any, parents: np.ndarray) -> np.ndarray:
    """(facets of the fine mesh,): the old facet around each, -1 inside of old cells."""
    cell, reference = parents[fine.f2t[0]], flat.refdom
    middles = fine.p[:, fine.facets].mean(axis=1)
    at = flat.mapping().invF(middles[:, :, None], tind=cell)[..., 0]
    facets = np.full(len(cell), -1)
    for number, corners in enumerate(reference.facets):
        first, second, last = reference.p[:, [corners[0], corners[1], corners[-1]]].T
        on = np.abs(np.cross(second - first, last - first) @ (at - first[:, None])) < INSIDE
        facets[on] = flat.t2f[number, cell[on]]
    return facets
