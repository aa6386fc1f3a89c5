"""Whether a scene fits its mesh: every refusal by name, and remarks on what may not be meant."""

from __future__ import annotations

import numpy as np

from meshes.grouped import check_groups, check_parts
from meshes.grouped.model import GroupedMesh
from meshes.grouped.place import Placed
from scenes.model import MeshScene


def check(scene: MeshScene, mesh: GroupedMesh) -> Placed:
    """The scene on the mesh.

    Raises SceneError for groups that are not there or of the wrong kind; cells without a material, or with two;
    conditions that act on nothing or contradict each other; probes of what is not there; floating parts, and what
    nothing drives.
    """
    check_groups.named(scene, mesh)
    placed = Placed(scene, mesh)
    check_groups.materials(placed)
    check_groups.boundaries(placed)
    check_groups.probes(placed)
    check_parts.check(placed)
    return placed


def remarks(mesh: GroupedMesh) -> list[str]:
    """What is no fault of the scene, but may not be meant."""
    points = mesh.mesh.doflocs[:, : mesh.mesh.nvertices].T
    size = float(np.ptp(points, axis=0).max())
    rounded = np.rint((points - points.min(axis=0)) / (1e-9 * size)).astype(np.int64)
    twice = len(points) - len(np.unique(rounded, axis=0))
    if not twice:
        return []
    return [
        f"{twice} corners of the mesh lie where another one is without being joined to it, so that neither heat nor "
        "current passes there; if the parts should touch, make the mesh conforming (in Gmsh: BooleanFragments, or "
        "Coherence)"
    ]
