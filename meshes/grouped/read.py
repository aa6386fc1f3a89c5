"""From a mesh file to a mesh with groups.

Own readers take Gmsh's format 4.1, Nastran and Abaqus; meshio reads all other formats. Physical groups and element sets
keep their names; a group without one, such as a Nastran property, is called by its number.

Gmsh's format 4.1, in text or binary (https://gmsh.info/doc/texinfo/gmsh.html, "MSH file format"), has its own reader
because meshio refuses files with some entities in a physical group and others in none.
"""

from __future__ import annotations

import contextlib
import io
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from meshes.grouped.decks import read_abaqus, read_nastran
from meshes.grouped.model import Block, GroupedMesh, MeshData, MeshFileError, dimension, node_rows
from scenes.errors import SceneError, check_regular, printable, quoted
from scenes.model import ROUNDING

KINDS = {
    "tetra": (4, 4), "tetra10": (4, 10), "hexahedron": (8, 8), "hexahedron20": (8, 20), "hexahedron27": (8, 27),
}  # fmt: skip
"""meshio's names of the cells that are solved on: their corners and nodes."""
_TEXT_FORMATS = {**dict.fromkeys((".bdf", ".nas", ".fem", ".dat"), read_nastran), ".inp": read_abaqus}
# The nodes of a cell in the order of its mirror image, by the number of corners; cells of first order have the first.
_INVERSION = {4: np.r_[0, 2, 1, 3, 6, 5, 4, 7, 9, 8], 8: np.r_[4:8, 0:4, 12:16, 8:12, 16:24, 25, 24, 26]}
# Tags of cells that meshio reads from files of Gmsh, Medit, Netgen and others; the first are of physical groups.
_TAGS = ("gmsh:physical", "gmsh:geometrical", "medit:ref", "netgen:index", "CellEntityIds", "su2:tag", "mat_id")


def read_gmsh(data: bytes) -> MeshData:
    """Read a mesh in Gmsh's format 4.1. Raises MeshFileError."""
    from meshio._common import num_nodes_per_cell
    from meshio.gmsh.common import _gmsh_to_meshio_order, _gmsh_to_meshio_type

    if b"$PartitionedEntities" in data:
        raise MeshFileError("it is partitioned: save it whole, without partitions")
    header = _section(data, b"MeshFormat").split(maxsplit=3)

    def numbers(section: bytes) -> _Numbers:
        return _Numbers(_section(data, section), header[1] == b"1", int(header[2]))

    text = _section(data, b"PhysicalNames").decode("utf-8", "replace") if b"$PhysicalNames" in data else ""
    names = {(int(dim), int(tag)): name for dim, tag, name in re.findall(r'(\d+)\s+(\d+)\s+"(.*)"', text)}
    physical = _read_physical(numbers(b"Entities")) if b"$Entities" in data else {}
    ids, points = _read_nodes(numbers(b"Nodes"))
    section, blocks, tags = numbers(b"Elements"), list[Block](), list[int]()
    for _ in range(section.take("size", 4)[0]):
        dim, tag, number = (int(n) for n in section.take("int", 3))
        count = section.take_one("size")
        if number not in _gmsh_to_meshio_type:
            raise MeshFileError(f"it has cells of Gmsh's type {number}: mesh with cells of first or second order")
        kind = _gmsh_to_meshio_type[number]
        width = 1 + num_nodes_per_cell[kind]
        rows = section.take("size", count * width).reshape(count, width)
        nodes = _gmsh_to_meshio_order(kind, node_rows(ids, rows[:, 1:]))
        blocks.append((kind, nodes, tuple(names.get((dim, n), str(n)) for n in physical.get((dim, tag), []))))
        tags.append(tag)
    return _tagged(points, blocks, tags, names)


def _tagged(points: np.ndarray, blocks: list[Block], tags: list[int], names: dict[tuple[int, int], str]) -> MeshData:
    """Call volumes and surfaces in no group by the ``tags`` of their elementary entities, 0 for none; ``names`` are of
    physical groups, by dimension and number."""
    taken, tagged = {(dimension(kind), name) for kind, _, own in blocks for name in own}, list[Block]()
    for (kind, nodes, own), tag in zip(blocks, tags, strict=True):
        alone = dimension(kind), str(tag)
        free = not own and tag and alone[0] >= 2 and alone not in taken
        tagged.append((kind, nodes, (str(tag),) if free else own))
    present = {name for _, name in taken}
    lost = "a physical group without cells (Mesh.SaveAll in format 2.2 drops groups: save without it, or in 4.1)"
    return MeshData(points, tagged, {name: lost for name in names.values() if name not in present})


def _section(data: bytes, name: bytes) -> bytes:
    begin, end = data.find(b"$" + name), data.find(b"$End" + name)
    if begin < 0 or end < 0:
        raise MeshFileError(f"its section ${name.decode()} is missing or ends early: save it again")
    return data[data.index(b"\n", begin) + 1 : end]


class _Numbers:
    """The numbers of a section, taken one after the other from text or binary data."""

    def __init__(self, section: bytes, binary: bool, size: int) -> None:
        self.binary, self.place = binary, 0
        self.data = np.frombuffer(section, np.uint8) if binary else np.array(section.split(), float)
        self.types = {"int": np.dtype("<i4"), "size": np.dtype(f"<u{size}"), "real": np.dtype("<f8")}

    def take(self, kind: str, count: int) -> np.ndarray:
        """Return the next ``count`` numbers of a kind."""
        end = self.place + count * (self.types[kind].itemsize if self.binary else 1)
        if end > len(self.data):
            raise MeshFileError("it ends early: save it again")
        piece, self.place = self.data[self.place : end], end
        return (piece.view(self.types[kind]) if self.binary else piece).astype(float if kind == "real" else np.int64)

    def take_one(self, kind: str) -> int:
        """Return the next number."""
        return int(self.take(kind, 1)[0])


def _read_physical(numbers: _Numbers) -> dict[tuple[int, int], list[int]]:
    """Return the physical groups of each entity, by its dimension and elementary tag."""
    groups = {}
    for dim, count in enumerate(numbers.take("size", 4)):
        for _ in range(count):
            tag = numbers.take_one("int")
            numbers.take("real", 6 if dim else 3)
            # A negative number is a group with the orientation reversed.
            groups[dim, tag] = [abs(int(group)) for group in numbers.take("int", numbers.take_one("size"))]
            if dim:
                numbers.take("int", numbers.take_one("size"))
    return groups


def _read_nodes(numbers: _Numbers) -> tuple[np.ndarray, np.ndarray]:
    ids, points = [np.empty(0, int)], [np.empty((0, 3))]
    for _ in range(numbers.take("size", 4)[0]):
        dim, _, parametric = numbers.take("int", 3)
        count = numbers.take_one("size")
        ids.append(numbers.take("size", count))
        width = 3 + dim * parametric
        points.append(numbers.take("real", count * width).reshape(count, width)[:, :3])
    return np.concatenate(ids), np.concatenate(points)


def read(path: Path, unit: float) -> GroupedMesh:
    """Read a mesh file in units of ``unit`` (m).

    Raises SceneError where it cannot be read, has no volume cells, cells of several kinds or of one that is not solved
    on, or flat or partly inverted cells. Inverted cells are turned round.
    """
    data = _load(path)
    name = _kind(data, path)
    points = data.points * unit
    volumes = [block for block in data.blocks if block[0] == name]
    cells = np.concatenate([nodes for _, nodes, _ in volumes])
    # Gmsh's older format has a cell once for every group that it is in.
    first, same = np.unique(np.sort(cells, axis=1), axis=0, return_index=True, return_inverse=True)[1:]
    cells = cells[first]
    inverted = (_determinants(_made(points, cells, name)) < 0).all(axis=1)
    cells[inverted] = cells[inverted][:, _INVERSION[KINDS[name][0]][: cells.shape[1]]]
    mesh = _made(points, cells, name)
    _refuse_degenerate(mesh, path)
    if KINDS[name][0] == 4:
        # With the vertices of each cell in ascending order an edge has one direction in all its cells.
        mesh = replace(mesh, t=np.sort(mesh.t, axis=0))
    groups = {group: np.unique(same.ravel()[rows]) for group, rows in _members(volumes).items()}
    surfaces, others = _surfaces(mesh, data, np.unique(cells[:, : KINDS[name][0]]))
    return GroupedMesh(mesh, groups, surfaces, name, len(cells), others)


def _members(blocks: list[Block]) -> dict[str, np.ndarray]:
    """Return the cells of each group, counted through all blocks."""
    groups, start = dict[str, list[np.ndarray]](), 0
    for _, nodes, names in blocks:
        for name in names:
            groups.setdefault(name, []).append(np.arange(start, start + len(nodes)))
        start += len(nodes)
    return {name: np.concatenate(parts) for name, parts in groups.items()}


@np.errstate(all="ignore")
def _made(points: np.ndarray, cells: np.ndarray, name: str) -> Any:
    """Make scikit-fem's mesh of cells (m, nodes) in meshio's order; its vertices are the corners, sorted. Hexahedra of
    20 nodes get 7 more, which give the same shape with 27 nodes."""
    from skfem import ElementHex2, ElementHexS2, MeshHex, MeshHex2, MeshTet, MeshTet2
    from skfem.io.meshio import HEX_MAPPING

    corners, nodes = KINDS[name]
    own = cells if corners == 4 else cells[:, np.argsort(HEX_MAPPING[:nodes])]
    used, t = np.unique(own[:, :corners], return_inverse=True)
    linear, curved = (MeshTet, MeshTet2) if corners == 4 else (MeshHex, MeshHex2)
    mesh = linear(*map(np.ascontiguousarray, (points[used].T, t.reshape(-1, corners).T)))
    if nodes == corners:
        return mesh
    at = points[own]
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
        raise SceneError(f"mesh.file: {quoted(path)} is no file: give the path of a mesh, relative to the scene file")
    why = "it is damaged or of another format: give a Gmsh 4.1 (.msh), Nastran (.bdf), Abaqus (.inp) or VTK (.vtu) mesh"
    try:
        data = path.read_bytes()
        if text_format := _TEXT_FORMATS.get(path.suffix.lower()):
            return text_format(data.decode("utf-8-sig", "replace"))
        return read_gmsh(data) if re.search(rb"\$MeshFormat\s+4\.1\s", data) else _read_by_meshio(path, data)
    except MeshFileError as error:
        why = printable(str(error), 400)
    except ModuleNotFoundError as error:
        why = f"{path.suffix} files take the Python package {error.name}: install it, or give a Gmsh (.msh) mesh"
    except (Exception, SystemExit):  # meshio ends the program over some files
        pass
    raise SceneError(f"mesh.file: {quoted(path)} cannot be read: {why}")


def _read_by_meshio(path: Path, data: bytes) -> MeshData:
    import meshio

    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()) as said:
        found = meshio.read(path, file_format="gmsh" if b"$MeshFormat" in data else None)
    if re.search(r"cells\s+that\s+meshio\s+cannot\s+handle", said.getvalue()):
        raise MeshFileError("it has cells such as VTK's voxels, which are not read: give tetrahedra or hexahedra")
    sets = {name: of for name, of in found.cell_sets.items() if not name.startswith(("gmsh:", "cell_tags"))}
    names = {(int(dim), int(tag)): name for name, (tag, dim) in found.field_data.items()}
    blocks, elementary, families = list[Block](), list[int](), getattr(found, "cell_tags", {})  # of MED
    for i, block in enumerate(found.cells):
        every = np.arange(len(block.data))
        inside = [np.isin(every, [] if of[i] is None else of[i]) for of in sets.values()]
        tags = [found.cell_data[key][i] if key in found.cell_data else 0 * every for key in (*_TAGS, "cell_tags")]
        alike, which = np.unique(np.column_stack([*tags, *inside]).astype(int), axis=0, return_inverse=True)
        for k, (physical, *row) in enumerate(alike.tolist()):
            own = [name for name, member in zip(sets, row[len(_TAGS) :], strict=True) if member]
            own += [names.get((dimension(block.type), physical), str(physical))] if physical else []
            own += families.get(row[len(_TAGS) - 1], [])
            nodes = node_rows(np.arange(len(found.points)), np.asarray(block.data, int)[which.ravel() == k])
            blocks.append((block.type, nodes, tuple(own)))
            elementary.append(max(row[: len(_TAGS) - 1]))
    return _tagged(np.asarray(found.points, float), blocks, elementary, names)


def _kind(data: MeshData, path: Path) -> str:
    kinds = list(dict.fromkeys(kind for kind, rows, _ in data.blocks if len(rows)))
    names = [kind for kind in kinds if dimension(kind) == 3]
    if not names:
        raise SceneError(
            f"mesh.file: {quoted(path)} has no volume cells, only {' and '.join(kinds) or 'points'}: mesh the volumes "
            "too, and save them with their physical groups"
        )
    if len(names) > 1 or names[0] not in KINDS:
        raise SceneError(
            f"mesh.file: {quoted(path)} is made of {' and '.join(names)} cells: give one of {' or '.join(KINDS)} alone"
        )
    return names[0]


@np.errstate(all="ignore")  # of cells that are refused
def _determinants(mesh: Any) -> np.ndarray:
    """Return (cells, points) the determinants of the maps of cells at their nodes and middles, positive in order."""
    reference = mesh.elem().doflocs.T
    places = np.concatenate([reference, reference.mean(axis=1, keepdims=True)], axis=1)
    jacobians = np.moveaxis(mesh.mapping().DF(places), (0, 1), (-2, -1))
    # scikit-fem's reference hexahedron has its corners the other way round.
    return np.asarray((1 if len(mesh.t) == 4 else -1) * np.linalg.det(jacobians))


def _refuse_degenerate(mesh: Any, path: Path) -> None:
    """Refuse cells that are inverted or flat, as with a node twice, or that have coordinates that are no numbers."""
    determinants = _determinants(mesh)
    wrong = np.flatnonzero(~(determinants.min(axis=1) > ROUNDING * np.abs(determinants).max(axis=1)))
    if len(wrong):
        near = ", ".join(f"{float(c):.4g} m" for c in mesh.doflocs[:, mesh.t[:, wrong[0]]].mean(axis=1))
        raise SceneError(
            f"mesh.file: {quoted(path)} has {len(wrong)} inverted or flat cells of {mesh.t.shape[1]} (or with a node "
            f"twice, or without finite coordinates), the first at [{near}]: mesh again"
        )


def _surfaces(
    mesh: Any, data: MeshData, vertices: np.ndarray
) -> tuple[dict[str, tuple[np.ndarray, np.ndarray]], dict[str, str]]:
    """Return the surface groups, and a description of all other names; ``vertices`` are the file's numbers of the
    mesh's vertices."""
    surfaces, others, count = dict[str, tuple[np.ndarray, np.ndarray]](), dict(data.others), len(mesh.facets)
    numbers = {tuple(f): n for n, f in enumerate(np.sort(vertices[mesh.facets], axis=0).T.tolist())}
    flat = [block for block in data.blocks if dimension(block[0]) == 2]
    # Faces with another number of corners are faces of no cell.
    form = "triangle" if count == 3 else "quad"
    rows = [n[:, :count] if kind.startswith(form) else np.full((len(n), count), -1) for kind, n, _ in flat]
    corners = np.concatenate([np.empty((0, count), int), *rows])
    facets = np.array([numbers.get(tuple(row), -1) for row in np.sort(corners, axis=1).tolist()], int)
    # A face points out of the first cell beside it, in the order of its corners, or out of the second one.
    p = np.moveaxis(data.points[corners], -1, 0)
    normal = np.cross(p[..., 1] - p[..., 0], p[..., -1] - p[..., 0], axis=0)
    first, second = mesh.f2t[:, facets]
    inwards = (normal * (p.mean(axis=-1) - data.points[vertices[mesh.t[:, first]]].mean(axis=0).T)).sum(axis=0) < 0
    side = np.where(inwards & (second >= 0), 1, 0)
    for name, members in _members(flat).items():
        if (facets[members] >= 0).all():
            own, at = np.unique(facets[members], return_index=True)
            surfaces[name] = own, side[members][at]
        else:
            others[name] = "a surface with faces that are no faces of the volume cells"
    return surfaces, others
