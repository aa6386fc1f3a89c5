"""The mesh of a scene, moved with the faces of another scene that has the same parts.

Each axis is mapped by itself: a plane of faces goes where its faces go, and coordinates between two planes move in
proportion. Bricks stay bricks, and cells, functions and unknowns stay the same.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from fem3d.spaces.bricks import BrickSpace
from fem3d.spaces.domain import Domain, box_domain, group_domain
from meshes.grouped.check import Placed
from meshes.symmetry import Symmetry
from scenes.errors import SceneError
from scenes.model import ROUNDING, AnyScene, MeshScene, Scene

TOGETHER = 1e-6
"""Faces in one plane move together where their displacements differ by less than this fraction of the largest one."""


def move(domain: Any, part: Symmetry, other: Symmetry) -> Domain:
    """Return the domain of ``other``, the solved part of another scene, on the moved cells of the ``domain`` of a part.

    Raises SceneError if no such motion exists: faces in one plane move apart or past others, or a part or a symmetry is
    lost.
    """
    if not same_planes(part, other) or _names(part.scene) != _names(other.scene):
        raise SceneError("the scene loses a mirror plane or a part when it changes")
    scene: Any = other.scene
    if isinstance(scene, MeshScene):
        return group_domain(Placed(scene, domain.placed.mesh), domain.space.p)
    maps = [_displacements(part.scene, scene, axis) for axis in range(3)]
    if not isinstance(domain.space, BrickSpace):
        mesh = domain.space.mesh
        points = np.array([x + np.interp(x, *each) for x, each in zip(mesh.p, maps, strict=True)])
        return box_domain(scene, replace(mesh, doflocs=points), domain.space.p)
    grid = domain.space.grid
    breaks = tuple(x + np.interp(x, *each) for x, each in zip(grid.breaks, maps, strict=True))
    return box_domain(scene, replace(grid, breaks=breaks, boxes=scene.boxes))


def same_planes(part: Symmetry, other: Symmetry) -> bool:
    """Whether two scenes have mirror planes across the same axes and of the same parity."""
    return [plane[::2] for plane in part.planes] == [plane[::2] for plane in other.planes]


def _displacements(scene: Any, other: Any, axis: int) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates (m) of the planes across an axis in a scene, ascending, and their displacements (m) to another."""
    pairs = np.array(sorted(_faces(scene, other, axis)))
    extent, displacements = np.ptp(pairs[:, 0]), pairs[:, 1] - pairs[:, 0]
    planes = np.flatnonzero(np.diff(pairs[:, 0], prepend=-np.inf) > ROUNDING * extent)
    parting = np.maximum.reduceat(displacements, planes) - np.minimum.reduceat(displacements, planes)
    allowed = TOGETHER * np.abs(displacements).max() + 4 * np.spacing(np.abs(pairs).max())
    if (parting > allowed).any():
        at = pairs[planes[parting.argmax()], 0]
        raise SceneError(f"faces at {'xyz'[axis]} = {at:.6g} m lie in one plane and move apart")
    if (np.diff(pairs[planes, 1]) <= 0).any():
        raise SceneError(f"faces across {'xyz'[axis]} move past each other")
    return pairs[planes, 0], displacements[planes]


def _faces(scene: Scene, other: Scene, axis: int) -> Iterator[tuple[float, float]]:
    """Coordinates along an axis of all faces inside the extent of a scene's boxes, and the same in another scene."""
    extent = [c for box in scene.boxes for c in (box.lower[axis], box.upper[axis])]
    low, high = min(extent), max(extent)
    small = ROUNDING * (high - low)
    extended = [(p, q) for p, q in zip(scene.probes, other.probes, strict=True) if p.lower != p.upper]
    items: list[tuple[Any, Any]] = [*zip(scene.boxes, other.boxes, strict=True), *extended]
    items += zip(scene.boundaries, other.boundaries, strict=True)
    for a, b in items:
        for p, q in ((a.lower[axis], b.lower[axis]), (a.upper[axis], b.upper[axis])):
            if low - small <= p <= high + small:
                yield p, q


def _names(scene: AnyScene) -> list[str]:
    return [item.name for items in (getattr(scene, "boxes", ()), scene.boundaries, scene.probes) for item in items]
