"""Move the mesh of a scene with the faces of another scene that has the same parts.

Each axis is mapped by itself: a plane of faces goes where its faces go, and coordinates between two planes move in
proportion. Bricks stay bricks, and cells, functions and unknowns stay the same.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from fem3d.spaces.domain import Domain, box_cells, boxes, groups
from meshes.grouped.place import Placed
from meshes.symmetry import Symmetry
from scenes.errors import SceneError
from scenes.model import AnyScene, MeshScene, Scene

SAME = 1e-9
"""Faces that are nearer to each other than this fraction of a scene's extent lie in one plane."""
TOGETHER = 1e-6
"""Faces in one plane move together where their displacements differ by less than this fraction of the largest one."""


def move(domain: Any, part: Symmetry, other: Symmetry) -> Domain:
    """Return the domain of another scene on the cells of a scene's domain, moved.

    Parameters
    ----------
    domain : the domain of ``part``
    part, other : the parts of both scenes that are solved

    Raises
    ------
    SceneError
        if no such motion exists: faces in one plane move apart or past others, or a part or a symmetry is lost
    """
    alike = [p[::2] for p in part.planes] == [p[::2] for p in other.planes]
    if not alike or _names(part.scene) != _names(other.scene):
        raise SceneError("the scene loses a mirror plane or a part when it changes")
    scene: Any = other.scene
    if isinstance(scene, MeshScene):
        return groups(Placed(scene, domain.placed.mesh), domain.space.p)
    maps = [_planes(part.scene, scene, axis) for axis in range(3)]
    if domain.space.by_cells:
        mesh = domain.space.mesh
        points = np.array([np.interp(x, *each) for x, each in zip(mesh.p, maps, strict=True)])
        return box_cells(scene, replace(mesh, doflocs=points), domain.space.p)
    grid = domain.space.grid
    breaks = tuple(np.interp(x, *each) for x, each in zip(grid.breaks, maps, strict=True))
    return boxes(scene, replace(grid, breaks=breaks, boxes=scene.boxes))


def _planes(scene: Any, other: Any, axis: int) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates (m) of the planes across an axis, ascending, in a scene and in another one."""
    pairs = np.array(sorted(_faces(scene, other, axis)))
    extent, largest = np.ptp(pairs[:, 0]), np.abs(pairs[:, 1] - pairs[:, 0]).max()
    at, to = [pairs[0, 0]], [pairs[0, 1]]
    for before, after in pairs[1:]:
        if before - at[-1] > SAME * extent:
            at.append(before)
            to.append(after)
        elif abs((after - before) - (to[-1] - at[-1])) > TOGETHER * largest + SAME * SAME * extent:
            raise SceneError(f"faces at {'xyz'[axis]} = {before:.6g} m lie in one plane and move apart")
    if (np.diff(to) <= 0).any():
        raise SceneError(f"faces across {'xyz'[axis]} move past each other")
    return np.array(at), np.array(to)


def _faces(scene: Scene, other: Scene, axis: int) -> Iterator[tuple[float, float]]:
    """Coordinates along an axis of all faces inside the extent of a scene's boxes, and the same in another scene."""
    extent = [c for box in scene.boxes for c in (box.lower[axis], box.upper[axis])]
    low, high = min(extent), max(extent)
    small = SAME * (high - low)
    extended = [(p, q) for p, q in zip(scene.probes, other.probes, strict=True) if p.lower != p.upper]
    items: list[tuple[Any, Any]] = [
        *zip(scene.boxes, other.boxes, strict=True),
        *zip(scene.boundaries, other.boundaries, strict=True),
        *extended,
    ]  # fmt: skip
    for a, b in items:
        for p, q in ((a.lower[axis], b.lower[axis]), (a.upper[axis], b.upper[axis])):
            if low - small <= p <= high + small:
                yield p, q


def _names(scene: AnyScene) -> list[str]:
    parts: tuple[Any, ...] = getattr(scene, "boxes", ())
    return [item.name for items in (parts, scene.boundaries, scene.probes) for item in items]
