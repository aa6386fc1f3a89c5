"""From a mesh file to a mesh with groups, through meshio.

Gmsh's physical groups and the element sets of other formats keep their names; a group without one, such as a Nastran
property, is called by its number.
"""

from __future__ import annotations

import contextlib
import io
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from meshes.grouped.model import GroupedMesh
from meshes.grouped.refine import ordered
from scenes.errors import SceneError, printable, quoted
from scenes.files import check_regular

KINDS = {
    "tetra": (4, 4), "tetra10": (4, 10), "hexahedron": (8, 8), "hexahedron20": (8, 20), "hexahedron27": (8, 27),
}  # fmt: skip
"""meshio's names of the cells that are solved on: their corners and nodes."""

_FORMATS = {".msh": "gmsh", ".bdf": "nastran", ".nas": "nastran", ".fem": "nastran", ".dat": "nastran"}
# a mesh is flat where its least extent is below this fraction of the largest, which nine digits can't tell from zero
FLAT = 1e-9
_NUMBERED = ("gmsh:physical", "nastran:ref", "medit:ref")
_IGNORED = ("gmsh:", "cell_tags")


def read(path: Path, unit: float) -> GroupedMesh:
    """The mesh of a file in units of ``unit`` (m). Raises SceneError where it can't be read, has no volume cells, cells
    of several kinds or of one that is not solved on, or cells that are inverted."""
    file_mesh = _load(path)
    name = _kind(file_mesh, path)
    numbers, cells = _joined(file_mesh, name)
    # Gmsh's older format has a cell once for every group that it is in.
    first, same = np.unique(np.sort(cells, axis=1), axis=0, return_index=True, return_inverse=True)[1:]
    cells, points = cells[first], np.asarray(file_mesh.points, float) * unit
    _refuse_broken(points, cells, path)
    mesh = made(points, cells, name)
    _refuse_inverted(mesh, path)
    mesh = ordered(mesh) if KINDS[name][0] == 4 else mesh
    of_cell = np.full(int(numbers.max()) + 1, -1)
    of_cell[numbers] = same.ravel()
    used, renumbered = np.unique(cells, return_inverse=True)
    grouped = GroupedMesh(mesh, {}, {}, name, points[used], renumbered.reshape(cells.shape))
    return _with_groups(grouped, file_mesh, of_cell, np.unique(cells[:, : KINDS[name][0]]))


def own_order(name: str) -> np.ndarray:
    """(nodes,): where scikit-fem has each node of a cell of meshio's."""
    from skfem.io.meshio import HEX_MAPPING

    corners, nodes = KINDS[name]
    return np.arange(nodes) if corners == 4 else np.array(HEX_MAPPING[:nodes])


def made(points: np.ndarray, cells: np.ndarray, name: str) -> Any:
    """scikit-fem's mesh of cells (m, nodes) in meshio's order; its vertices are the corners, sorted. Hexahedra of 20
    nodes get the 7 more that give them the same shape among those of 27."""
    from skfem import ElementHex2, ElementHexS2, MeshHex, MeshHex2, MeshTet, MeshTet2

    corners, nodes = KINDS[name]
    ordered = cells[:, np.argsort(own_order(name))]
    used, t = np.unique(ordered[:, :corners], return_inverse=True)
    linear, curved = (MeshTet, MeshTet2) if corners == 4 else (MeshHex, MeshHex2)
    mesh = linear(points[used].T, t.reshape(-1, corners).T)
    if nodes == corners:
        return mesh
    at = points[ordered]
    if nodes == 20:
        serendipity = np.array([ElementHexS2().lbasis(ElementHex2().doflocs.T, i)[0] for i in range(20)])
        at = np.einsum("nk,cnd->ckd", serendipity, at)
    mesh = curved.from_mesh(mesh)
    places = mesh.doflocs.copy()
    places[:, mesh.dofs.element_dofs] = at.T
    return replace(mesh, doflocs=places)


def _load(path: Path) -> Any:
    import meshio

    if path.exists():
        check_regular(path, f"mesh.file: {quoted(path)}")
    if not path.is_file():
        what = "is a directory" if path.is_dir() else "is no file"
        raise SceneError(f"mesh.file: {quoted(path)} {what}: give the path of a mesh, relative to the scene file")
    said = io.StringIO()
    try:
        # meshio prints what it dislikes, and ends the program over a file that it cannot read.
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            return meshio.read(path, file_format=_FORMATS.get(path.suffix.lower()))
    except (Exception, SystemExit) as error:
        why = " ".join((said.getvalue() or str(error)).split()) or type(error).__name__
        raise SceneError(
            f"mesh.file: {quoted(path)} cannot be read ({printable(why, 120)}): give a Gmsh (.msh) or Nastran (.bdf, "
            ".nas) mesh, or another that meshio reads"
        ) from None


def _kind(file_mesh: Any, path: Path) -> str:
    names = list(dict.fromkeys(block.type for block in file_mesh.cells if block.dim == 3 and len(block.data)))
    if not names:
        has = " and ".join(dict.fromkeys(block.type for block in file_mesh.cells)) or "no cells"
        raise SceneError(
            f"mesh.file: {quoted(path)} has no volume cells, but {has}: mesh the volumes too, and save them with their "
            "physical groups"
        )
    if len(names) > 1 or names[0] not in KINDS:
        shown = " and ".join(names)
        mixed = "mixes" if len(names) > 1 else "is made of"
        raise SceneError(f"mesh.file: {quoted(path)} {mixed} {shown} cells: give a mesh of {' or '.join(KINDS)} alone")
    return names[0]


def _joined(file_mesh: Any, name: str) -> tuple[np.ndarray, np.ndarray]:
    """The numbers that the cells of a kind have among all of the file, and their nodes."""
    starts = np.cumsum([0, *(len(block.data) for block in file_mesh.cells)])
    blocks = [
        (start, np.asarray(b.data, int)) for b, start in zip(file_mesh.cells, starts, strict=False) if b.type == name
    ]
    return np.concatenate([start + np.arange(len(cells)) for start, cells in blocks]), np.concatenate(
        [c for _, c in blocks]
    )


def _refuse_broken(points: np.ndarray, cells: np.ndarray, path: Path) -> None:
    """Refuses what is no mesh at all: coordinates that are no numbers, cells that have a node twice, and nodes that lie
    in one plane."""
    shown = f"mesh.file: {quoted(path)}"
    used = np.unique(cells)
    unknown = used[~np.isfinite(points[used]).all(axis=1)]
    if len(unknown):
        raise SceneError(
            f"{shown} has {len(unknown)} nodes whose coordinates are no finite numbers, the first is the file's node "
            f"{unknown[0] + 1} in order: mesh again"
        )
    ordered = np.sort(cells, axis=1)
    twice = np.flatnonzero((ordered[:, 1:] == ordered[:, :-1]).any(axis=1))
    if len(twice):
        near = ", ".join(f"{float(c):.4g} m" for c in points[cells[twice[0]]].mean(axis=0))
        raise SceneError(
            f"{shown} has {len(twice)} cells of {len(cells)} with a node twice, the first at [{near}]: mesh again"
        )
    # The least of the extents along the axes in which the nodes extend most.
    extents = np.linalg.svd(points[used] - points[used].mean(axis=0), compute_uv=False)
    if not extents[-1] > FLAT * extents[0]:
        raise SceneError(f"{shown} is flat, its nodes lie in one plane: give a mesh of volumes")


def _refuse_inverted(mesh: Any, path: Path) -> None:
    reference = mesh.elem().doflocs.T
    places = np.concatenate([reference, reference.mean(axis=1, keepdims=True)], axis=1)
    # scikit-fem's reference hexahedron has its corners the other way round.
    jacobians = np.moveaxis(mesh.mapping().DF(places), (0, 1), (-2, -1))
    determinants = (1 if len(mesh.t) == 4 else -1) * np.linalg.det(jacobians)
    size = np.abs(determinants).max(axis=1)
    wrong = np.flatnonzero(determinants.min(axis=1) <= 1e-9 * np.where(size > 0, size, 1.0))
    if len(wrong):
        at = mesh.doflocs[:, mesh.t[:, wrong[0]]].mean(axis=1)
        near = ", ".join(f"{float(c):.4g} m" for c in at)
        raise SceneError(
            f"mesh.file: {quoted(path)} has {len(wrong)} inverted or flat cells of {mesh.t.shape[1]}, the first at "
            f"[{near}]: mesh again, with more or less curved cells there"
        )


def _groups(file_mesh: Any) -> dict[tuple[str, int], np.ndarray]:
    """The cells of each group, numbered through the file, by the group's name and dimension."""
    starts = np.cumsum([0, *(len(block.data) for block in file_mesh.cells)])
    collected: dict[tuple[str, int], list[np.ndarray]] = {}

    def add(name: str, block: int, cells: np.ndarray) -> None:
        if len(cells):
            collected.setdefault((name, file_mesh.cells[block].dim), []).append(starts[block] + np.asarray(cells, int))

    for name, sets in (file_mesh.cell_sets or {}).items():
        if not name.startswith(_IGNORED):
            for block, cells in enumerate(sets):
                if cells is not None:
                    add(name, block, cells)
    named = {(int(tag), int(dim)): name for name, (tag, dim) in (file_mesh.field_data or {}).items()}
    for key in _NUMBERED:
        for block, tags in enumerate(file_mesh.cell_data.get(key, [])):
            if len(tags) != len(file_mesh.cells[block].data):
                continue
            for tag in np.unique(tags):
                name = named.get((int(tag), file_mesh.cells[block].dim), str(tag))
                if tag != 0 or name != "0":
                    add(name, block, np.flatnonzero(tags == tag))
    return {key: np.unique(np.concatenate(pieces)) for key, pieces in collected.items()}


def _with_groups(grouped: GroupedMesh, file_mesh: Any, of_cell: np.ndarray, vertices: np.ndarray) -> GroupedMesh:
    """With the groups of a file; ``vertices`` are the file's numbers of the mesh's vertices."""
    corners, start = len(grouped.mesh.facets), 0
    facet, side = np.full((2, sum(len(block.data) for block in file_mesh.cells)), -1)
    for block in file_mesh.cells:
        if block.dim == 2 and len(block.data) and _CORNERS.get(block.type[:4]) == corners:
            rows = np.asarray(block.data, int)[:, :corners]
            block_rows = slice(start, start + len(rows))
            facet[block_rows], side[block_rows] = _facets(
                grouped.mesh, np.searchsorted(vertices, rows), np.isin(rows, vertices)
            )
        start += len(block.data)
    for (name, dim), cells in _groups(file_mesh).items():
        if dim == 3:
            grouped.volumes[name] = np.unique(of_cell[cells])
        elif dim == 2 and (facet[cells] >= 0).all():
            facets, first = np.unique(facet[cells], return_index=True)
            grouped.surfaces[name] = facets, side[cells][first]
        elif dim == 2:
            grouped.others.setdefault(name, "a surface with faces that are no faces of the volume cells")
        else:
            grouped.others.setdefault(name, "a group of lines" if dim == 1 else "a group of points")
    return grouped


_CORNERS = {"tria": 3, "quad": 4}


def _facets(mesh: Any, corners: np.ndarray, known: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(n,) twice: the facets with some corners (n, 3 or 4), -1 where there is none, and from which of their two cells
    they point outwards as their corners are given."""
    wanted = np.where(known, corners, -1)
    both = np.concatenate([np.sort(mesh.facets, axis=0).T, np.sort(wanted, axis=1)])
    number = np.unique(both, axis=0, return_inverse=True)[1].ravel()
    count = mesh.facets.shape[1]
    at = np.full(number.max() + 1, -1)
    at[number[:count]] = np.arange(count)
    facets = at[number[count:]]
    p = mesh.doflocs[:, np.where(facets[:, None] >= 0, corners, 0)]  # (3, n, corners)
    normal = np.cross(p[..., 1] - p[..., 0], p[..., -1] - p[..., 0], axis=0)
    first = mesh.doflocs[:, mesh.t[:, mesh.f2t[0, facets]]].mean(axis=1)
    inwards = (normal * (p.mean(axis=-1) - first)).sum(axis=0) < 0
    return facets, np.where(inwards & (mesh.f2t[1, facets] >= 0), 1, 0)
