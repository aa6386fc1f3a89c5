"""The content of a mesh file, the mesh with groups that is built of it, and its refinement.

A mesh is refined on the cells' own curved shape: all cells into eight, or chosen tetrahedra by scikit-fem's bisection
of longest edges, which goes on in the neighbours until no node hangs. scikit-fem cuts the cells as if their edges were
straight; the nodes then go where the maps of the old cells take them.
"""

from __future__ import annotations

import logging
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from skfem import MeshHex, MeshTet

Piece = tuple[str, int, np.ndarray]
"""Name and dimension of a group, and some of its cells."""
Element = tuple[str, list[int], list[str]]
"""A cell of a file: its kind by meshio's name, the numbers of its nodes in meshio's order, and its groups."""
INSIDE = 1e-6  # reference coordinates; coordinates in files have six or more digits
STEPS = 30  # iterations at most; Newton's method doubles the digits in each
# A place is on a facet where its distance in the coordinates of the reference cell is less; parts of a cell are larger.
ON_FACET = 1e-7


class MeshFileError(ValueError):
    """A mesh file that cannot be read; the message names the cause and the cure."""


@dataclass
class MeshData:
    """Nodes, cells and groups of a mesh file.

    Attributes
    ----------
    points : (n, 3) coordinates of the nodes, in the file's unit
    blocks : kind of cell by meshio's name, and nodes (cells, nodes) in meshio's order, for each block of cells
    groups : numbers of the cells, counted through all blocks, for each name and dimension of a group
    others : description of each name in the file that is no group of cells
    """

    points: np.ndarray
    blocks: list[tuple[str, np.ndarray]]
    groups: dict[tuple[str, int], np.ndarray]
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


def assemble(nodes: dict[int, np.ndarray], elements: list[Element]) -> MeshData:
    """Make the mesh of nodes, by their numbers in the file, and of elements."""
    mesh, pieces, start = MeshData(np.array(list(nodes.values()), float), [], {}), list[Piece](), 0
    ids, by_kind = np.array(list(nodes)), dict[str, list[Element]]()
    for element in elements:
        by_kind.setdefault(element[0], []).append(element)
    for kind, block in by_kind.items():
        mesh.blocks.append((kind, node_rows(ids, np.array([corners for _, corners, _ in block]))))
        members = dict[str, list[int]]()
        for i, (_, _, names) in enumerate(block, start):
            for name in names:
                members.setdefault(name, []).append(i)
        pieces += [(name, dimension(kind), np.array(cells)) for name, cells in members.items()]
        start += len(block)
    mesh.groups = collect(pieces)
    return mesh


def collect(pieces: Iterable[Piece]) -> dict[tuple[str, int], np.ndarray]:
    """Join the pieces of each group."""
    groups: dict[tuple[str, int], list[np.ndarray]] = {}
    for name, dim, cells in pieces:
        if len(cells):
            groups.setdefault((name, dim), []).append(cells)
    return {key: np.unique(np.concatenate(parts)) for key, parts in groups.items()}


def add_gmsh_groups(
    mesh: MeshData, names: dict[tuple[int, int], str], physical: list[Piece], elementary: list[Piece]
) -> None:
    """Add Gmsh's physical groups and, for cells in none, its elementary entities by their tags.

    ``names`` are the names of physical groups, by dimension and tag.
    """
    mesh.groups |= collect((names.get((dim, int(tag)), tag), dim, cells) for tag, dim, cells in physical)
    grouped = np.concatenate([np.empty(0, int), *(cells for _, _, cells in physical)])
    alone = collect((tag, dim, np.setdiff1d(cells, grouped)) for tag, dim, cells in elementary if dim >= 2)
    mesh.groups = alone | mesh.groups
    lost = (
        "a physical group without cells (Mesh.SaveAll in format 2.2 drops physical groups: save without it, or in 4.1)"
    )
    present = {name for name, _ in mesh.groups}
    mesh.others |= {name: lost for name in names.values() if name not in present}


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
