"""A brick mesh as points and hexahedra, and through meshio to files and back."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from meshes.axis import Axis
from meshes.bricks import BrickMesh, bricks_of
from scenes.model import Box, Material

CORNERS = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))


def hexahedra(mesh: BrickMesh) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Points (n, 3), linear hexahedra (m, 8) between neighbouring nodes, their boxes (m,), grid numbers (n,) of the
    points. A cell of degree p is p^3 of them."""
    hexes, boxes = [], []
    for block in mesh.blocks:
        numbers = mesh.numbers(block)
        nx, ny, nz = (n - 1 for n in numbers.shape)
        corners = [numbers[i : i + nx, j : j + ny, k : k + nz].ravel() for i, j, k in CORNERS]
        hexes.append(np.stack(corners, axis=1))
        boxes.append(np.full(nx * ny * nz, block.box))
    joined = np.concatenate(hexes)
    nodes, local = np.unique(joined, return_inverse=True)
    points = mesh.coordinates()[:, nodes].T
    return points, local.reshape(joined.shape), np.concatenate(boxes), nodes


def write(mesh: BrickMesh, path: str | Path, point_data: Mapping[str, np.ndarray] | None = None) -> None:
    """Write a mesh with any of meshio's formats; ``point_data`` are values per grid node. The cell data "material"
    numbers the materials in order of appearance."""
    import meshio

    points, hexes, boxes, nodes = hexahedra(mesh)
    names = list(dict.fromkeys(b.material.name for b in mesh.boxes))
    of_box = np.array([names.index(b.material.name) for b in mesh.boxes])
    data = {name: np.asarray(values)[nodes] for name, values in (point_data or {}).items()}
    found = meshio.Mesh(points, [("hexahedron", hexes)], point_data=data, cell_data={"material": [of_box[boxes]]})
    # Two formats end in .msh, and meshio would take Ansys's, which holds no data.
    found.write(path, file_format="gmsh" if Path(path).suffix == ".msh" else None)


def read(path: str | Path, materials: list[Material], degree: int = 2) -> BrickMesh:
    """A brick mesh from a file of axis-parallel hexahedra with the cell data "material".

    The data may be missing where there is one material only. Every coordinate becomes a breakpoint. Raises ValueError
    where the file has other cells, none, no data, or cells that aren't bricks of one grid.
    """
    import meshio

    found: Any = meshio.read(path)
    hexes = np.concatenate([c.data for c in found.cells if c.type == "hexahedron"] or [np.empty((0, 8), int)])
    if not len(hexes) or any(c.type != "hexahedron" for c in found.cells):
        raise ValueError(f"{path}: a brick mesh has hexahedra only")
    if "material" not in found.cell_data and len(materials) > 1:
        raise ValueError(f"{path}: its cells have no data named material")
    material = np.concatenate(found.cell_data.get("material", [np.zeros(len(hexes))])).astype(int)
    corners = found.points[hexes]
    lower, upper = corners.min(axis=1), corners.max(axis=1)
    breaks = []
    for d in range(3):
        values = np.unique(np.concatenate([lower[:, d], upper[:, d]]))
        small = 1e-9 * (values[-1] - values[0])
        breaks.append(values[np.concatenate([[True], np.diff(values) > small])])
    first = [np.abs(breaks[d][:, None] - lower[:, d]).argmin(axis=0) for d in range(3)]
    last = [np.abs(breaks[d][:, None] - upper[:, d]).argmin(axis=0) for d in range(3)]
    volume = np.prod(upper - lower, axis=1)
    edges = [corners[:, b] - corners[:, a] for a, b in ((0, 1), (0, 3), (0, 4))]
    spanned = np.abs(np.linalg.det(np.stack(edges, axis=1)))
    gaps = any((b - a != 1).any() for a, b in zip(first, last, strict=True))
    if gaps or (np.abs(spanned - volume) > 1e-6 * volume).any():
        raise ValueError(f"{path}: its hexahedra aren't the bricks of one grid")
    owner = np.full(tuple(len(b) - 1 for b in breaks), -1)
    owner[first[0], first[1], first[2]] = material
    boxes = []
    for number, block in enumerate(bricks_of(owner)):
        (x0, x1), (y0, y1), (z0, z1) = block.spans
        low = (float(breaks[0][x0]), float(breaks[1][y0]), float(breaks[2][z0]))
        high = (float(breaks[0][x1]), float(breaks[1][y1]), float(breaks[2][z1]))
        boxes.append(Box(f"box-{number}", materials[block.box], low, high))
    x, y, z = (Axis(b, np.full(len(b) - 1, degree)) for b in breaks)
    return BrickMesh((x, y, z), tuple(boxes))
