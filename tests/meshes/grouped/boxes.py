"""Scenes of boxes turned into mesh files with groups, and into the scenes that use them.

Every box, boundary and probe with an extent becomes a group of its name, so that a scene can be solved both ways.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import meshio
import numpy as np

from meshes.grouped import shapes
from meshes.grouped.model import GroupedMesh
from meshes.grouped.refine import quadratic
from scenes.free import from_dict
from scenes.model import Scene

# The six paths along edges from one corner of a brick to the opposite one; the same in all, they fit at faces.
KUHN = [(0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6)]
BLOCKS = {
    "tetra": ("tetra", "triangle"), "tetra10": ("tetra", "triangle6"), "hexahedron": ("hexahedron", "quad"),
    "hexahedron20": ("hexahedron", "quad8"), "hexahedron27": ("hexahedron", "quad9"),
}  # fmt: skip
Map = Callable[[np.ndarray], np.ndarray]


def grouped(scene: Scene, cell: str, pieces: int, bend: Map | None = None) -> GroupedMesh:
    """The boxes as cells of a kind, with so many pieces between neighbouring planes; ``bend`` moves the nodes."""
    flat = [*scene.boxes, *scene.boundaries, *scene.probes]
    axes = []
    for d in range(3):
        planes = np.unique(np.round([c[d] for item in flat for c in (item.lower, item.upper)], 15))
        low, high = min(b.lower[d] for b in scene.boxes), max(b.upper[d] for b in scene.boxes)
        planes = planes[(planes >= low) & (planes <= high)]
        steps = [np.linspace(a, b, pieces + 1)[:-1] for a, b in pairwise(planes)]
        axes.append(np.concatenate([*steps, planes[-1:]]))
    counts = [len(a) - 1 for a in axes]
    i = np.stack(np.meshgrid(*(np.arange(n) for n in counts), indexing="ij"), axis=-1).reshape(-1, 1, 3)
    corners = i + shapes.nodes("hexahedron", 1).astype(int)
    cells = np.ravel_multi_index(tuple(np.moveaxis(corners, -1, 0)), tuple(n + 1 for n in counts))
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    owner = np.full(len(cells), -1)
    for number, box in enumerate(scene.boxes):
        owner[_within(points[cells].mean(axis=1), box)] = number
    cells, owner = cells[owner >= 0], owner[owner >= 0]
    kind = BLOCKS[cell][0]
    if kind == "tetra":
        cells = cells[:, np.array(KUHN)].reshape(-1, 4)
        owner = np.repeat(owner, len(KUHN))
    middles = points[cells].mean(axis=1)
    faces = cells[:, shapes.FACETS[kind]]
    at = points[faces].mean(axis=2)
    volumes = {box.name: np.flatnonzero(owner == k) for k, box in enumerate(scene.boxes)}
    surfaces = {}
    for item in (*scene.boundaries, *scene.probes):
        extents = sum(u > v for u, v in zip(item.upper, item.lower, strict=True))
        if extents == 3:
            volumes[item.name] = np.flatnonzero(_within(middles, item))
        elif extents == 2:
            pairs = np.argwhere(_within(at, item))
            faces_seen = np.sort(faces[pairs[:, 0], pairs[:, 1]], axis=1)
            surfaces[item.name] = pairs[np.unique(faces_seen, axis=0, return_index=True)[1]]
    mesh = GroupedMesh(points, cells, kind, 1, volumes, surfaces, {}, cell)
    mesh = mesh if cell in ("tetra", "hexahedron") else quadratic(mesh)
    if bend is not None:
        mesh.points[:] = bend(mesh.points)
    return mesh


def as_meshio(mesh: GroupedMesh, unit: float = 1.0, named: bool = True) -> meshio.Mesh:
    """A mesh as meshio has it, a cell once for every group that it is in, as Gmsh writes it."""
    count = {"tetra": 4, "tetra10": 10, "hexahedron": 8, "hexahedron20": 20, "hexahedron27": 27}[mesh.file_type]
    used, local = np.unique(mesh.cells[:, :count], return_inverse=True)
    cells = local.reshape(len(mesh.cells), count)
    blocks, tags, names = [], [], {}
    for tag, (name, own) in enumerate(mesh.volumes.items(), 1):
        blocks.append((mesh.file_type, cells[own]))
        tags.append(np.full(len(own), tag))
        names[name] = np.array([tag, 3])
    for tag, (name, faces) in enumerate(mesh.surfaces.items(), len(names) + 1):
        rows = [cells[cell][_on_face(mesh.kind, mesh.order, face, count)] for cell, face in faces]
        blocks.append((BLOCKS[mesh.file_type][1], np.array(rows)))
        tags.append(np.full(len(faces), tag))
        names[name] = np.array([tag, 2])
    data = {"gmsh:physical": tags, "gmsh:geometrical": tags} if named else {"nastran:ref": tags}
    return meshio.Mesh(mesh.points[used] / unit, blocks, cell_data=data, field_data=names if named else {})


def write(mesh: GroupedMesh, path: Path, unit: float = 1.0) -> None:
    """A Gmsh or, by the suffix, a Nastran file."""
    if path.suffix == ".msh":
        as_meshio(mesh, unit).write(path, file_format="gmsh22", binary=False)
    else:
        as_meshio(mesh, unit, named=False).write(path, file_format="nastran")


def document(boxes: dict[str, Any], file: str, unit: float = 1.0) -> dict[str, Any]:
    """The scene on the mesh of a scene of boxes."""
    found = {key: boxes[key] for key in ("scene", "run") if key in boxes}
    found["mesh"] = {"file": file, "unit": unit}
    scene = from_dict(boxes)
    assert isinstance(scene, Scene)
    found["material"] = [
        {**m, "groups": [b.name for b in scene.boxes if b.material.name == m["name"]]} for m in boxes["material"]
    ]
    found["source"] = [
        {"group": box.name, "heat_source": given["heat_source"]}
        for box, given in zip(scene.boxes, boxes["box"], strict=True)
        if "heat_source" in given
    ]
    for table in ("boundary", "probe"):
        found[table] = []
        for item in boxes.get(table, []):
            own = {key: value for key, value in item.items() if key not in ("lower", "upper")}
            found[table].append(own if "at" in item else own | {"group": item["name"]})
    return found


def _within(at: np.ndarray, item: Any) -> np.ndarray:
    small = 1e-9 * np.abs(at).max()
    found: np.ndarray = ((at > np.array(item.lower) - small) & (at < np.array(item.upper) + small)).all(axis=-1)
    return found


def _on_face(kind: str, order: int, face: int, count: int) -> list[int]:
    """The nodes of a face: corners, then the middles between them, then its own."""
    own, corners = shapes.nodes(kind, order)[:count], shapes.nodes(kind, 1)[shapes.FACETS[kind][face]]
    wanted = [*corners]
    if order == 2:
        wanted += [(a + b) / 2 for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True)]
        wanted += [corners.mean(axis=0)] if count == 27 else []
    return [int(np.abs(own - w).max(axis=1).argmin()) for w in wanted]
