"""A brick mesh as a file of tetrahedra in Medit's format, in micrometres: each brick in six, after Kuhn, along the same
diagonal everywhere, so that neighbours fit."""

from __future__ import annotations

from itertools import permutations
from pathlib import Path

import numpy as np

from meshes.bricks import VOID, BrickMesh

MICRO = 1e6
SUBSTRATE, END = 2, 3


def write(mesh: BrickMesh, path: Path) -> None:
    """The file, the boxes' numbers from 1 its regions, with triangles on the oxide's underside and the beam's end."""
    shape = tuple(len(axis.breaks) for axis in mesh.axes)
    cells = np.argwhere(mesh.owner != VOID)
    paths = np.array([_path(order) for order in permutations(range(3))])
    grid = (cells[:, None, None] + paths).reshape(-1, 4, 3)
    used, local = np.unique(np.ravel_multi_index(tuple(np.moveaxis(grid, -1, 0)), shape), return_inverse=True)
    local = local.reshape(-1, 4)
    at = np.array([axis.breaks[i] * MICRO for axis, i in zip(mesh.axes, np.unravel_index(used, shape), strict=True)]).T
    regions = np.repeat(mesh.owner[tuple(cells.T)] + 1, 6)
    edges = at[local[:, 1:]] - at[local[:, :1]]
    flipped = np.linalg.det(edges) < 0
    local[flipped] = local[flipped][:, [0, 2, 1, 3]]
    triangles = _triangles(at, local, regions)
    with path.open("w", encoding="utf-8") as file:
        file.write(f"MeshVersionFormatted 2\nDimension 3\nVertices\n{len(at)}\n")
        np.savetxt(file, np.column_stack([at, np.zeros(len(at))]), fmt="%.17g %.17g %.17g %d")
        file.write(f"Tetrahedra\n{len(local)}\n")
        np.savetxt(file, np.column_stack([local + 1, regions]), fmt="%d")
        file.write(f"Triangles\n{len(triangles)}\n")
        np.savetxt(file, triangles, fmt="%d")
        file.write("End\n")


def _path(order: tuple[int, ...]) -> np.ndarray:
    """(4, 3): from one corner of a brick to the opposite one along its edges."""
    found = np.zeros((4, 3), dtype=int)
    for step, axis in enumerate(order):
        found[step + 1 :, axis] = 1
    return found


def _triangles(at: np.ndarray, local: np.ndarray, regions: np.ndarray) -> np.ndarray:
    """(triangles, 4): three corners from 1 and the label."""
    y, z = at[:, 1], at[:, 2]
    bottom = _sides(local, np.abs(z - z.min()) < 1e-9)
    end = _sides(local[regions == 1], np.abs(y) < 1e-9)
    labels = np.repeat([SUBSTRATE, END], [len(bottom), len(end)])
    return np.column_stack([np.concatenate([bottom, end]) + 1, labels])


def _sides(local: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    """(sides, 3): the sides of tetrahedra whose corners are all among the chosen vertices."""
    sides = local[:, [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]]].reshape(-1, 3)
    found: np.ndarray = np.unique(np.sort(sides[chosen[sides].all(axis=1)], axis=1), axis=0)
    return found
