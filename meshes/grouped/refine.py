"""Refinement of a mesh with groups, on the cells' own curved shape: of all cells into eight, or of chosen tetrahedra by
scikit-fem's bisection of longest edges, which goes on in the neighbours until no node hangs.

scikit-fem cuts the cells as if their edges were straight; the nodes then go where the maps of the old cells take them.
"""

from __future__ import annotations

import logging
from dataclasses import replace
from typing import Any

import numpy as np
from skfem import MeshHex, MeshTet

from meshes.grouped.model import GroupedMesh

# A place is on a facet where its distance in the coordinates of the reference cell is less; parts of a cell are larger.
ON_FACET = 1e-7


def refine(given: GroupedMesh, times: np.ndarray | None = None) -> GroupedMesh:
    """Return the mesh with each cell cut into eight, or with each tetrahedron halved so many ``times`` (cells,).

    Neighbours are halved until no node hangs. The corners of the old cells keep their numbers.
    """
    mesh = given.mesh
    flat, fine, parents = _cut(mesh, given.simplex, times)
    if type(mesh) is not type(flat):
        curved = type(mesh).from_mesh(fine)
        nodes = curved.dofs.element_dofs
        if given.simplex:
            at = flat.mapping().invF(np.swapaxes(curved.doflocs[:, nodes], 1, 2), tind=parents)
        else:
            # Its k-th eighth is at the k-th corner of a hexahedron.
            at = (mesh.refdom.p[:, :, None] + np.asarray(mesh.elem().doflocs).T[:, None]) / 2
            at = np.repeat(at, given.count, axis=1)
        places = curved.doflocs.copy()
        places[:, nodes] = np.swapaxes(mesh.mapping().F(at, tind=parents), 1, 2)
        finer = replace(curved, doflocs=places)
    else:
        finer = fine
    within = _within(flat, fine, parents)
    surfaces = {}
    for name, (facets, side) in given.surfaces.items():
        order = np.argsort(facets)
        fine_facets = np.flatnonzero(np.isin(within, facets))
        at = order[np.searchsorted(facets[order], within[fine_facets])]
        turned = parents[finer.f2t[0, fine_facets]] != mesh.f2t[0, facets[at]]
        surfaces[name] = fine_facets, np.where(turned, 1 - side[at], side[at])
    volumes = {name: np.flatnonzero(np.isin(parents, cells)) for name, cells in given.volumes.items()}
    return replace(given, mesh=finer, volumes=volumes, surfaces=surfaces)


def ordered(mesh: Any) -> Any:
    """A mesh of tetrahedra with the vertices of each cell in ascending order, so that an edge has one direction in all
    its cells; the numbers of vertices, edges and facets stay."""
    return replace(mesh, t=np.sort(mesh.t, axis=0))


def bisected(mesh: Any, times: np.ndarray) -> tuple[Any, np.ndarray]:
    """Return a mesh of straight tetrahedra with each halved so many ``times`` (cells,), and (new cells,) their parents.

    Neighbours are halved until no node hangs.
    """
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

    def _adaptive_sort_mesh(self, p: np.ndarray, t: np.ndarray, marked: np.ndarray) -> np.ndarray:
        self.rounds = [*self.rounds, marked.copy()]
        cells: np.ndarray = super()._adaptive_sort_mesh(p, t, marked)
        return cells

    rounds: Any = ()


def _cut(mesh: Any, simplex: bool, times: np.ndarray | None) -> tuple[Any, Any, np.ndarray]:
    """A mesh as if straight, that one refined, and the cell that each is a part of."""
    flat = (MeshTet if simplex else MeshHex)(mesh.doflocs[:, : mesh.nvertices], mesh.t)
    if times is not None:
        return flat, *bisected(flat, times)
    # The number of each cell travels as the binary digits that it has.
    count = flat.t.shape[1]
    digits, numbers = range(int(count).bit_length()), np.arange(count)
    cut = replace(flat, _subdomains={str(k): np.flatnonzero(numbers >> k & 1) for k in digits}).refined()
    parents = np.zeros(8 * count, int)
    for k in digits:
        parents[cut.subdomains[str(k)]] += 1 << k
    fine = replace(cut, _subdomains=None)
    return flat, ordered(fine) if simplex else fine, parents


def _within(flat: Any, fine: Any, parents: np.ndarray) -> np.ndarray:
    """(facets of the fine mesh,): the old facet around each, -1 inside of old cells."""
    size, reference = float(np.ptp(flat.p, axis=1).max()), flat.refdom
    cell = parents[fine.f2t[0]]
    middles = fine.p[:, fine.facets].mean(axis=1) / size
    at = flat.scaled(1 / size).mapping().invF(middles[:, :, None], tind=cell)[..., 0]
    facets = np.full(len(cell), -1)
    for number, corners in enumerate(reference.facets):
        first, second, last = reference.p[:, [corners[0], corners[1], corners[-1]]].T
        on = np.abs(np.cross(second - first, last - first) @ (at - first[:, None])) < ON_FACET
        facets[on] = flat.t2f[number, cell[on]]
    return facets
