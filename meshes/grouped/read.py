"""From a mesh file to a mesh with groups, through meshio.

Gmsh's physical groups and the element sets of other formats keep their names; a group without one, such as a Nastran
property, is called by its number.
"""

from __future__ import annotations

import contextlib
import io
from pathlib import Path
from typing import Any

import numpy as np

from meshes.grouped import shapes
from meshes.grouped.model import GroupedMesh
from scenes.errors import SceneError, printable, quoted

KINDS = {
    "tetra": (shapes.TETRA, 1), "tetra10": (shapes.TETRA, 2), "hexahedron": (shapes.HEXAHEDRON, 1),
    "hexahedron20": (shapes.HEXAHEDRON, 2), "hexahedron27": (shapes.HEXAHEDRON, 2),
}  # fmt: skip
"""meshio's names of the cells that are solved on: kind and order."""

_FORMATS = {".msh": "gmsh", ".bdf": "nastran", ".nas": "nastran", ".fem": "nastran", ".dat": "nastran"}
_NUMBERED = ("gmsh:physical", "nastran:ref", "medit:ref")
_IGNORED = ("gmsh:", "cell_tags")


def read(path: Path, unit: float) -> GroupedMesh:
    """The mesh of a file in units of ``unit`` (m). Raises SceneError where it can't be read, has no volume cells, cells
    of several kinds or of one that is not solved on, or cells that are inverted."""
    found = _load(path)
    kind, order, name = _kind(found, path)
    numbers, cells = _joined(found, [name])
    # Gmsh's older format has a cell once for every group that it is in.
    first, same = np.unique(np.sort(cells, axis=1), axis=0, return_index=True, return_inverse=True)[1:]
    cells, points = cells[first], np.asarray(found.points, float) * unit
    if name == "hexahedron20":
        points, cells = _completed(points, cells)
    mesh = GroupedMesh(points, cells, kind, order, {}, {}, {}, name)
    _refuse_inverted(mesh, path)
    of_cell = np.full(max((n.max(initial=-1) for n in numbers.values()), default=-1) + 1, -1)
    of_cell[numbers[name]] = same.ravel()
    return _with_groups(mesh, found, of_cell)


def _load(path: Path) -> Any:
    import meshio

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


def _kind(found: Any, path: Path) -> tuple[str, int, str]:
    names = list(dict.fromkeys(block.type for block in found.cells if block.dim == 3 and len(block.data)))
    if not names:
        has = " and ".join(dict.fromkeys(block.type for block in found.cells)) or "no cells"
        raise SceneError(
            f"mesh.file: {quoted(path)} has no volume cells, but {has}: mesh the volumes too, and save them with their "
            "physical groups"
        )
    if len(names) > 1 or names[0] not in KINDS:
        shown = " and ".join(names)
        mixed = "mixes" if len(names) > 1 else "is made of"
        raise SceneError(f"mesh.file: {quoted(path)} {mixed} {shown} cells: give a mesh of {' or '.join(KINDS)} alone")
    kind, order = KINDS[names[0]]
    return kind, order, names[0]


def _joined(found: Any, names: list[str]) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """The numbers that the cells of each name have among all of the file, and the nodes of all of them."""
    numbers: dict[str, list[np.ndarray]] = {name: [] for name in names}
    cells, start = [], 0
    for block in found.cells:
        if block.type in names:
            numbers[block.type].append(start + np.arange(len(block.data)))
            cells.append(np.asarray(block.data, int))
        start += len(block.data)
    return {name: np.concatenate(own) for name, own in numbers.items()}, np.concatenate(cells)


def _completed(points: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Hexahedra of 20 nodes with the 7 more that give them the same shape among those of 27."""
    facets = GroupedMesh(points, cells, shapes.HEXAHEDRON, 2, {}, {}).facets
    inner = np.einsum("kn,cnd->ckd", shapes.serendipity(), points[cells])
    start, count = len(points), int(facets.max()) + 1
    more = np.concatenate([start + facets, (start + count + np.arange(len(cells)))[:, None]], axis=1)
    joined = np.concatenate([points, np.empty((count + len(cells), 3))])
    joined[more] = inner
    return joined, np.concatenate([cells, more], axis=1)


def _refuse_inverted(mesh: GroupedMesh, path: Path) -> None:
    places = np.concatenate([shapes.nodes(mesh.kind, mesh.order), shapes.nodes(mesh.kind, 1).mean(axis=0)[None]])
    found = shapes.jacobians(mesh.kind, mesh.order, mesh.points[mesh.cells], places)
    size = np.abs(found).max(axis=1)
    wrong = np.flatnonzero(found.min(axis=1) <= 1e-9 * np.where(size > 0, size, 1.0))
    if len(wrong):
        at = mesh.points[mesh.corners[wrong[0]]].mean(axis=0)
        near = ", ".join(f"{float(c):.4g} m" for c in at)
        raise SceneError(
            f"mesh.file: {quoted(path)} has {len(wrong)} inverted or flat cells of {len(mesh.cells)}, the first at "
            f"[{near}]: mesh again, with more or less curved cells there"
        )


def _groups(found: Any) -> dict[tuple[str, int], np.ndarray]:
    """The cells of each group, numbered through the file, by the group's name and dimension."""
    starts = np.cumsum([0, *(len(block.data) for block in found.cells)])
    collected: dict[tuple[str, int], list[np.ndarray]] = {}

    def add(name: str, block: int, cells: np.ndarray) -> None:
        if len(cells):
            collected.setdefault((name, found.cells[block].dim), []).append(starts[block] + np.asarray(cells, int))

    for name, sets in (found.cell_sets or {}).items():
        if not name.startswith(_IGNORED):
            for block, cells in enumerate(sets):
                if cells is not None:
                    add(name, block, cells)
    named = {(int(tag), int(dim)): name for name, (tag, dim) in (found.field_data or {}).items()}
    for key in _NUMBERED:
        for block, tags in enumerate(found.cell_data.get(key, [])):
            if len(tags) != len(found.cells[block].data):
                continue
            for tag in np.unique(tags):
                name = named.get((int(tag), found.cells[block].dim), str(tag))
                if tag != 0 or name != "0":
                    add(name, block, np.flatnonzero(tags == tag))
    return {key: np.unique(np.concatenate(own)) for key, own in collected.items()}


def _with_groups(mesh: GroupedMesh, found: Any, of_cell: np.ndarray) -> GroupedMesh:
    corners = 3 if mesh.kind == shapes.TETRA else 4
    faces = _Faces(mesh)
    starts = np.cumsum([0, *(len(block.data) for block in found.cells)])
    for (name, dim), cells in _groups(found).items():
        if dim == 3:
            mesh.volumes[name] = np.unique(of_cell[cells])
        elif dim == 2:
            rows = []
            for block, start in zip(found.cells, starts, strict=False):
                own = cells[(cells >= start) & (cells < start + len(block.data))] - start
                if len(own):
                    rows.append(np.asarray(block.data, int)[own][:, :corners])
            made = faces.of(np.concatenate(rows)) if all(r.shape[1] == corners for r in rows) else None
            if made is None:
                mesh.others.setdefault(name, "a surface with faces that are no faces of the volume cells")
            else:
                mesh.surfaces[name] = made
        else:
            mesh.others.setdefault(name, "a group of lines" if dim == 1 else "a group of points")
    return mesh


class _Faces:
    """Finds the faces of a mesh by their corners."""

    def __init__(self, mesh: GroupedMesh) -> None:
        local = mesh.corners[:, shapes.FACETS[mesh.kind]]
        self._corners = local.reshape(-1, local.shape[-1])
        self._width = local.shape[1]
        self._by_key: dict[bytes, list[int]] = {}
        for number, key in enumerate(np.sort(self._corners, axis=1)):
            self._by_key.setdefault(key.tobytes(), []).append(number)

    def of(self, wanted: np.ndarray) -> np.ndarray | None:
        """(n, 2): the faces with some corners (n, 3 or 4), each of the cell that it points out of as its corners are
        given; ``None`` where there is none with them."""
        found: dict[bytes, int] = {}
        for corners, key in zip(wanted, np.sort(wanted, axis=1), strict=True):
            there = self._by_key.get(key.tobytes())
            if there is None:
                return None
            found[key.tobytes()] = next((n for n in there if _same_way(self._corners[n], corners)), there[0])
        return np.stack(np.divmod(np.array(list(found.values())), self._width), axis=1)


def _same_way(a: np.ndarray, b: np.ndarray) -> bool:
    """Whether two rings of the same corners run the same way."""
    turned = np.roll(b, -int(np.flatnonzero(b == a[0])[0]))
    return bool((turned == a).all())
