"""Scenes of boxes turned into mesh files with groups, and into the scenes that use them.

Every box, boundary and probe with an extent becomes a group of its name, so that a scene can be solved both ways.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import meshio
import numpy as np

from meshes.grouped.read import KINDS
from scenes.free import from_dict
from scenes.model import Scene

# The six paths along edges from one corner of a brick to the opposite one; the same in all, they fit at faces.
KUHN = [(0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6)]
BLOCKS = {
    "tetra": ("tetra", "triangle"), "tetra10": ("tetra", "triangle6"), "hexahedron": ("hexahedron", "quad"),
    "hexahedron20": ("hexahedron", "quad8"), "hexahedron27": ("hexahedron", "quad9"),
}  # fmt: skip
CORNERS = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)])
FACETS = {
    "tetra": np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)]),
    "hexahedron": np.array([(0, 4, 7, 3), (1, 2, 6, 5), (0, 1, 5, 4), (3, 7, 6, 2), (0, 3, 2, 1), (4, 5, 6, 7)]),
}  # fmt: skip
TETRA_EDGES = [[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]]
HEXAHEDRON_EDGES = [[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6], [6, 7], [7, 4], [0, 4], [1, 5], [2, 6], [3, 7]]
Map = Callable[[np.ndarray], np.ndarray]


def grouped(scene: Scene, cell: str, pieces: int, bend: Map | None = None) -> "Built":
    """The boxes as cells of a kind, with so many pieces between neighbouring planes; ``bend`` moves the nodes."""
    flat: list[Any] = [*scene.boxes, *scene.boundaries, *scene.probes]
    axes = []
    for d in range(3):
        planes = np.unique(np.round([c[d] for item in flat for c in (item.lower, item.upper)], 15))
        low, high = min(b.lower[d] for b in scene.boxes), max(b.upper[d] for b in scene.boxes)
        planes = planes[(planes >= low) & (planes <= high)]
        steps = [np.linspace(a, b, pieces + 1)[:-1] for a, b in pairwise(planes)]
        axes.append(np.concatenate([*steps, planes[-1:]]))
    counts = [len(a) - 1 for a in axes]
    i = np.stack(np.meshgrid(*(np.arange(n) for n in counts), indexing="ij"), axis=-1).reshape(-1, 1, 3)
    corners = i + CORNERS
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
    faces = cells[:, FACETS[kind]]
    at = points[faces].mean(axis=2)
    volumes = {box.name: np.flatnonzero(owner == k) for k, box in enumerate(scene.boxes)}
    surfaces = {}
    for item in flat[len(scene.boxes) :]:
        extents = sum(u > v for u, v in zip(item.upper, item.lower, strict=True))
        if extents == 3:
            volumes[item.name] = np.flatnonzero(_within(middles, item))
        elif extents == 2:
            rows = faces[_within(at, item)]
            surfaces[item.name] = rows[np.unique(np.sort(rows, axis=1), axis=0, return_index=True)[1]]
    points, cells = _completed(points, cells, cell)
    if bend is not None:
        points = bend(points)
    return Built(points, cells, cell, volumes, surfaces)


@dataclass
class Built:
    """``cells`` (m, nodes) in VTK's order, and the corners of the faces of each surface group."""

    points: np.ndarray
    cells: np.ndarray
    file_type: str
    volumes: dict[str, np.ndarray]
    surfaces: dict[str, np.ndarray]


def _completed(points: np.ndarray, cells: np.ndarray, cell: str) -> tuple[np.ndarray, np.ndarray]:
    """With the nodes of second order, if the kind has any."""
    if cell in ("tetra", "hexahedron"):
        return points, cells
    groups = _between(cell)
    middles = np.array([points[cells[:, g]].mean(axis=1) for g in groups])
    keys = np.rint(middles.reshape(-1, 3) / (1e-9 * np.ptp(points))).astype(np.int64)
    first, number = np.unique(keys, axis=0, return_index=True, return_inverse=True)[1:]
    more = len(points) + number.reshape(len(groups), -1).T
    return np.concatenate([points, middles.reshape(-1, 3)[first]]), np.concatenate([cells, more], axis=1)


def _between(cell: str) -> list[list[int]]:
    """The corners in whose middle each further node of a kind lies: of edges, faces and the cell."""
    if cell == "tetra10":
        return TETRA_EDGES
    return HEXAHEDRON_EDGES + ([*FACETS["hexahedron"].tolist(), list(range(8))] if cell == "hexahedron27" else [])


def as_meshio(mesh: Built, unit: float = 1.0, named: bool = True) -> meshio.Mesh:
    """A mesh as meshio has it, a cell once for every group that it is in, as Gmsh writes it."""
    cells = mesh.cells
    blocks, tags, names = [], [], {}
    for tag, (name, own) in enumerate(mesh.volumes.items(), 1):
        blocks.append((mesh.file_type, cells[own]))
        tags.append(np.full(len(own), tag))
        names[name] = np.array([tag, 3])
    for tag, (name, faces) in enumerate(mesh.surfaces.items(), len(names) + 1):
        blocks.append((BLOCKS[mesh.file_type][1], _faces(mesh, faces)))
        tags.append(np.full(len(faces), tag))
        names[name] = np.array([tag, 2])
    data = {"gmsh:physical": tags, "gmsh:geometrical": tags} if named else {"nastran:ref": tags}
    return meshio.Mesh(mesh.points / unit, blocks, cell_data=data, field_data=names if named else {})


def write(mesh: Built, path: Path, unit: float = 1.0) -> None:
    """A Gmsh or, by the suffix, a Nastran file."""
    if path.suffix == ".msh":
        as_meshio(mesh, unit).write(path, file_format="gmsh22", binary=False)
    else:
        as_meshio(mesh, unit, named=False).write(path, file_format="nastran")


def document(boxes: dict[str, Any], file: str, unit: float = 1.0) -> dict[str, Any]:
    """The scene on the mesh of a scene of boxes."""
    found: dict[str, Any] = {key: boxes[key] for key in ("scene", "run") if key in boxes}
    found["mesh"] = {"file": file, "unit": unit}
    scene = from_dict(boxes)
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
            own = {"side" if key == "box" else key: v for key, v in item.items() if key not in ("lower", "upper")}
            found[table].append(own if "at" in item else own | {"group": item["name"]})
    return found | ({"contact": boxes["contact"]} if "contact" in boxes else {})


def _within(at: np.ndarray, item: Any) -> np.ndarray:
    small = 1e-9 * np.abs(at).max()
    return ((at > np.array(item.lower) - small) & (at < np.array(item.upper) + small)).all(axis=-1)


def _faces(mesh: Built, rows: np.ndarray) -> np.ndarray:
    """The nodes of faces: corners, then the middles between them, then their own."""
    kind, count = BLOCKS[mesh.file_type][1], KINDS[mesh.file_type][0]
    if kind in ("triangle", "quad"):
        return rows
    middles = {
        frozenset(nodes[group].tolist()): node
        for nodes in mesh.cells
        for group, node in zip(_between(mesh.file_type), nodes[count:].tolist(), strict=True)
    }
    sides = [[middles[frozenset(side)] for side in zip(row, [*row[1:], row[0]], strict=True)] for row in rows.tolist()]
    own = [[middles[frozenset(row)]] if kind == "quad9" else [] for row in rows.tolist()]
    return np.array([[*row, *side, *last] for row, side, last in zip(rows.tolist(), sides, own, strict=True)])
