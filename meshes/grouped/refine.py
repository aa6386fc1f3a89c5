"""Uniform refinement of a mesh with groups: each cell into eight, on the cell's own curved shape.

scikit-fem cuts the cells as if their edges were straight; the nodes then go where the maps of the old cells take them.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from scipy.sparse import csr_array
from skfem import MeshHex, MeshTet

from meshes.grouped.model import GroupedMesh


def refine(given: GroupedMesh) -> GroupedMesh:
    """The mesh with eight cells in place of each; the old cells' corners keep their numbers."""
    mesh, linear = given.mesh, MeshTet if given.simplex else MeshHex
    flat = linear(mesh.doflocs[:, : mesh.nvertices], mesh.t)
    # The number of each cell travels as the binary digits that it has.
    digits = range(int(given.count).bit_length())
    numbers = np.arange(given.count)
    cut = replace(flat, _subdomains={str(k): np.flatnonzero(numbers >> k & 1) for k in digits}).refined()
    parents = np.zeros(8 * given.count, int)
    for k in digits:
        parents[cut.subdomains[str(k)]] += 1 << k
    fine = replace(cut, _subdomains=None)
    if type(mesh) is not linear:
        fine = type(mesh).from_mesh(fine)
        nodes = fine.dofs.element_dofs
        if given.simplex:
            at = flat.mapping().invF(np.swapaxes(fine.doflocs[:, nodes], 1, 2), tind=parents)
        else:
            # Its k-th eighth is at the k-th corner of a hexahedron.
            at = (mesh.refdom.p[:, :, None] + np.asarray(mesh.elem().doflocs).T[:, None]) / 2
            at = np.repeat(at, given.count, axis=1)
        places = fine.doflocs.copy()
        places[:, nodes] = np.swapaxes(mesh.mapping().F(at, tind=parents), 1, 2)
        fine = replace(fine, doflocs=places)
    within = _within(flat, fine)
    surfaces = {}
    for name, (facets, side) in given.surfaces.items():
        order = np.argsort(facets)
        own = np.flatnonzero(np.isin(within, facets))
        at = order[np.searchsorted(facets[order], within[own])]
        turned = parents[fine.f2t[0, own]] != mesh.f2t[0, facets[at]]
        surfaces[name] = own, np.where(turned, 1 - side[at], side[at])
    volumes = {name: np.flatnonzero(np.isin(parents, cells)) for name, cells in given.volumes.items()}
    return replace(given, mesh=fine, volumes=volumes, surfaces=surfaces, parents=parents)


def _within(flat: Any, fine: Any) -> np.ndarray:
    """(facets of the fine mesh,): the old facet that each lies in, -1 for those inside of old cells.

    The new vertices are the old ones, the middles of edges and, of hexahedra, of facets and cells, in this order.
    """
    count, each = flat.nvertices, flat.facets.shape[1]
    on = [flat.facets, count + flat.f2e]
    if len(flat.facets) == 4:
        on.append(count + flat.nedges + np.arange(each)[None])
    old, new = np.concatenate(on), fine.facets

    def incidence(rows: np.ndarray) -> csr_array:
        ones, columns = np.ones(rows.size, np.int8), np.repeat(np.arange(rows.shape[1]), len(rows))
        return csr_array((ones, (columns, rows.T.ravel())), shape=(rows.shape[1], int(fine.t.max()) + 1))

    shared = (incidence(new) @ incidence(old).T).tocoo()
    whole = shared.data == len(new)
    found = np.full(new.shape[1], -1)
    found[shared.row[whole]] = shared.col[whole]
    return found
