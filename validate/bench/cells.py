"""The graded cells that every full-order entry gets: those this toolkit starts with for an accuracy, cut further.

They are graded towards the singular edges with its knowledge of the exponents, which a user of another program would
have to work out or find by trial; all entries share them so that a comparison is of solvers, not of patience.
"""

from __future__ import annotations

import numpy as np

from meshes import grading
from meshes.axis import Axis
from meshes.bricks import BrickMesh
from scenes.model import Scene


def graded(
    scene: Scene, accuracy: float, cuts: int, degree: int, across: int = 1, depth: int | None = None
) -> BrickMesh:
    """The first mesh for an accuracy, each interval in x and y in ``cuts`` equal pieces and in z in ``across``, with
    one degree everywhere, or another one (``depth``) in z."""
    axes = []
    for d, axis in enumerate(grading.first_mesh(scene, accuracy).axes):
        n = across if d == 2 else cuts
        at = np.arange(n * (len(axis.breaks) - 1) + 1) / n
        breaks = np.interp(at, np.arange(len(axis.breaks)), axis.breaks)
        p = depth if d == 2 and depth is not None else degree
        axes.append(Axis(breaks, np.full(len(breaks) - 1, p)))
    x, y, z = axes
    return BrickMesh((x, y, z), scene.boxes)


def anew(mesh: BrickMesh) -> BrickMesh:
    """The same mesh without anything that has been worked out on it, as a solver first gets it."""
    x, y, z = (Axis(axis.breaks, axis.degrees) for axis in mesh.axes)
    return BrickMesh((x, y, z), mesh.boxes)
