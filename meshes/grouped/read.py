"""From a mesh file to a mesh with groups.

Own readers take Gmsh's format 4.1, Nastran and Abaqus; meshio reads all other formats. Physical groups and element sets
keep their names; a group without one, such as a Nastran property, is called by its number.
"""

from __future__ import annotations

import contextlib
import io
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from meshes.grouped.abaqus import read_abaqus
from meshes.grouped.data import MeshData, MeshFileError, Piece, add_gmsh_groups, collect, dimension
from meshes.grouped.gmsh import is_gmsh_41, read_gmsh
from meshes.grouped.model import GroupedMesh
from meshes.grouped.nastran import read_nastran
from meshes.grouped.refine import ordered
from scenes.errors import SceneError, printable, quoted
from scenes.files import check_regular
from scenes.model import ROUNDING

KINDS = {
    "tetra": (4, 4), "tetra10": (4, 10), "hexahedron": (8, 8), "hexahedron20": (8, 20), "hexahedron27": (8, 27),
}  # fmt: skip
"""meshio's names of the cells that are solved on: their corners and nodes."""

_TEXT_FORMATS = {**dict.fromkeys((".bdf", ".nas", ".fem", ".dat"), read_nastran), ".inp": read_abaqus}


def read(path: Path, unit: float) -> GroupedMesh:
    """Read a mesh file in units of ``unit`` (m).

    Raises SceneError where it cannot be read, has no volume cells, cells of several kinds or of one that is not solved
    on, or flat or curved and inverted cells. Straight inverted cells are turned round.
    """
    data = _load(path)
    name = _kind(data, path)
    points = data.points * unit
    starts = np.cumsum([0, *(len(rows) for _, rows in data.blocks)])
    chosen = [i for i, (kind, _) in enumerate(data.blocks) if kind == name]
    numbers = np.concatenate([starts[i] + np.arange(len(data.blocks[i][1])) for i in chosen])
    cells = np.concatenate([data.blocks[i][1] for i in chosen])
    # Gmsh's older format has a cell once for every group that it is in.
    first, same = np.unique(np.sort(cells, axis=1), axis=0, return_index=True, return_inverse=True)[1:]
    cells = cells[first]
    _refuse_broken(points, cells, path)
    mesh = made(points, cells, name)
    if name in _INVERSION:
        inverted = np.asarray((_determinants(mesh) < 0).all(axis=1))[:, None]
        cells = np.where(inverted, cells[:, _INVERSION[name]], cells)
        mesh = made(points, cells, name)
    _refuse_inverted(mesh, path)
    mesh = ordered(mesh) if KINDS[name][0] == 4 else mesh
    of_cell = np.full(starts[-1], -1)
    of_cell[numbers] = same.ravel()
    used, renumbered = np.unique(cells, return_inverse=True)
    grouped = GroupedMesh(mesh, {}, {}, name, points[used], renumbered.reshape(cells.shape), dict(data.others))
    _add_groups(grouped, data, of_cell, np.unique(cells[:, : KINDS[name][0]]))
    return grouped


def own_order(name: str) -> np.ndarray:
    """(nodes,): where scikit-fem has each node of a cell of meshio's."""
    from skfem.io.meshio import HEX_MAPPING

    corners, nodes = KINDS[name]
    return np.arange(nodes) if corners == 4 else np.array(HEX_MAPPING[:nodes])


def made(points: np.ndarray, cells: np.ndarray, name: str) -> Any:
    """scikit-fem's mesh of cells (m, nodes) in meshio's order; its vertices are the corners, sorted. Hexahedra of 20
    nodes get 7 more, which give the same shape with 27 nodes."""
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


def _load(path: Path) -> MeshData:
    if path.exists():
        check_regular(path, f"mesh.file: {quoted(path)}")
    if not path.is_file():
        what = "is a directory" if path.is_dir() else "is no file"
        raise SceneError(f"mesh.file: {quoted(path)} {what}: give the path of a mesh, relative to the scene file")
    text_format = _TEXT_FORMATS.get(path.suffix.lower())
    why = "it is damaged, or of another format: " + (
        "save it in Gmsh's format 4.1" if path.suffix.lower() == ".msh" else
        "give a Gmsh (.msh), Nastran (.bdf, .nas) or Abaqus (.inp) mesh"
    )  # fmt: skip
    try:
        data = path.read_bytes()
        if text_format:
            return text_format(data.decode("utf-8-sig", "replace"))
        return read_gmsh(data) if is_gmsh_41(data) else _read_by_meshio(path)
    except MeshFileError as error:
        why = printable(str(error), 400)
    except ModuleNotFoundError as error:
        why = f"{path.suffix} files take the Python package {error.name}: install it, or give a Gmsh (.msh) mesh"
    except (Exception, SystemExit):  # meshio ends the program over some files
        pass
    raise SceneError(f"mesh.file: {quoted(path)} cannot be read: {why}")


def _read_by_meshio(path: Path) -> MeshData:
    import meshio

    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        found = meshio.read(path, file_format="gmsh" if path.suffix.lower() == ".msh" else None)
    mesh = MeshData(np.asarray(found.points, float), [(b.type, np.asarray(b.data, int)) for b in found.cells], {})
    starts = np.cumsum([0, *(len(rows) for _, rows in mesh.blocks)])
    sets: list[Piece] = [
        (name, dimension(mesh.blocks[i][0]), starts[i] + np.asarray(cells, int))
        for name, blocks in found.cell_sets.items() if not name.startswith(("gmsh:", "cell_tags"))
        for i, cells in enumerate(blocks) if cells is not None
    ]  # fmt: skip
    names = {(int(dim), int(tag)): name for name, (tag, dim) in found.field_data.items()}

    def tagged(key: str) -> list[Piece]:
        return [
            (str(tag), dimension(kind), start + np.flatnonzero(tags == tag))
            for (kind, _), tags, start in zip(mesh.blocks, found.cell_data.get(key, ()), starts, strict=False)
            for tag in np.unique(tags) if tag
        ]  # fmt: skip

    mesh.groups = collect(sets + tagged("medit:ref"))
    add_gmsh_groups(mesh, names, tagged("gmsh:physical"), tagged("gmsh:geometrical"))
    return mesh


def _kind(data: MeshData, path: Path) -> str:
    kinds = list(dict.fromkeys(kind for kind, rows in data.blocks if len(rows)))
    names = [kind for kind in kinds if dimension(kind) == 3]
    if not names:
        raise SceneError(
            f"mesh.file: {quoted(path)} has no volume cells, but {' and '.join(kinds) or 'no cells'}: mesh the volumes "
            "too, and save them with their physical groups"
        )
    if len(names) > 1 or names[0] not in KINDS:
        shown = " and ".join(names)
        mixed = "mixes" if len(names) > 1 else "is made of"
        raise SceneError(f"mesh.file: {quoted(path)} {mixed} {shown} cells: give a mesh of {' or '.join(KINDS)} alone")
    return names[0]


def _refuse_broken(points: np.ndarray, cells: np.ndarray, path: Path) -> None:
    """Refuse coordinates that are no numbers, cells that have a node twice, and nodes that all lie in one plane."""
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
    if not extents[-1] > ROUNDING * extents[0]:
        raise SceneError(f"{shown} is flat, its nodes lie in one plane: give a mesh of volumes")


# The nodes of a straight cell in the order of its mirror image.
_INVERSION = {"tetra": [0, 2, 1, 3], "hexahedron": [4, 5, 6, 7, 0, 1, 2, 3]}


def _determinants(mesh: Any) -> np.ndarray:
    """Return (cells, points) the determinants of the maps of cells at their nodes and middles, positive in order."""
    reference = mesh.elem().doflocs.T
    places = np.concatenate([reference, reference.mean(axis=1, keepdims=True)], axis=1)
    jacobians = np.moveaxis(mesh.mapping().DF(places), (0, 1), (-2, -1))
    # scikit-fem's reference hexahedron has its corners the other way round.
    return np.asarray((1 if len(mesh.t) == 4 else -1) * np.linalg.det(jacobians))


def _refuse_inverted(mesh: Any, path: Path) -> None:
    determinants = _determinants(mesh)
    size = np.abs(determinants).max(axis=1)
    wrong = np.flatnonzero(determinants.min(axis=1) <= 1e-9 * np.where(size > 0, size, 1.0))
    if len(wrong):
        at = mesh.doflocs[:, mesh.t[:, wrong[0]]].mean(axis=1)
        near = ", ".join(f"{float(c):.4g} m" for c in at)
        curved = mesh.doflocs.shape[1] > mesh.nvertices
        raise SceneError(
            f"mesh.file: {quoted(path)} has {len(wrong)} inverted or flat cells of {mesh.t.shape[1]}, the first at "
            f"[{near}]: mesh again" + (", with more or less curved cells there" if curved else "")
        )


def _add_groups(grouped: GroupedMesh, data: MeshData, of_cell: np.ndarray, vertices: np.ndarray) -> None:
    """Add the groups of a file; ``vertices`` are the file's numbers of the mesh's vertices."""
    corners, start = len(grouped.mesh.facets), 0
    facet, side = np.full((2, len(of_cell)), -1)
    for kind, nodes in data.blocks:
        if len(nodes) and _CORNERS.get(kind[:4]) == corners:
            rows, block = nodes[:, :corners], slice(start, start + len(nodes))
            facet[block], side[block] = _facets(grouped.mesh, np.searchsorted(vertices, rows), np.isin(rows, vertices))
        start += len(nodes)
    for (name, dim), cells in data.groups.items():
        if dim == 3:
            grouped.volumes[name] = np.unique(of_cell[cells])
        elif dim == 2 and (facet[cells] >= 0).all():
            facets, first = np.unique(facet[cells], return_index=True)
            grouped.surfaces[name] = facets, side[cells][first]
        elif dim == 2:
            grouped.others.setdefault(name, "a surface with faces that are no faces of the volume cells")
        else:
            grouped.others.setdefault(name, "a group of lines" if dim == 1 else "a group of points")


_CORNERS = {"tria": 3, "quad": 4}


def _facets(mesh: Any, corners: np.ndarray, known: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(n,) twice: the facets with some corners (n, 3 or 4), -1 where there is none, and the row of the cell out of
    which they point in the order of their corners."""
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
