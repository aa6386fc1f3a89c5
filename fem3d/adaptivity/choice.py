"""Choice of the mesh for a scene of boxes: a grid of bricks, whose planes cross the whole scene, or tetrahedra
(`meshes.columns`), which are refined locally.

Bricks gain degrees and layers where tetrahedra are halved: if parts align, bricks need far fewer unknowns for an
accuracy. Planes that align with no others make a grid grow with the square of their number, tetrahedra in proportion.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fem3d.adaptivity import reach
from fem3d.adaptivity.cell_mesh import CellMesh
from fem3d.adaptivity.mesh import LARGE, Bricks, Mesh
from fem3d.results.outputs import Study
from fem3d.spaces.size import Size, foreseen
from meshes.columns import Columns
from meshes.grid import graph
from scenes.free.grid import crowding
from scenes.model import Scene


def choose(study: Study, whole: Study, over_time: bool = False) -> tuple[Study, Mesh]:
    """Return the mesh to begin with and its study: of the symmetric part on bricks, of the ``whole`` on tetrahedra.

    Raises TooLargeError where both take too much memory.
    """
    scene, size = study.part.scene, reach.least(study.part.scene)
    if scene.mesh == "bricks":
        return study, Bricks.of(study, over_time)
    if not scene.mesh and _suits(scene, size):
        # A response over time has its rows on a grid that is fine enough alone.
        first = replace(Bricks.of(study, over_time), as_far_as_it_goes=not over_time)
        if _suits(scene, foreseen(scene, first.grid)):
            return study, first
    why = "run.mesh asks for them"
    if scene.mesh != "tetrahedra":
        crowded, every = crowding(graph(whole.part.scene).planes), float(f"{size.unknowns:.2g}")
        why = f"a grid of bricks would take {every:,.0f} unknowns and {size.memory / 1e9:.2g} GB or more, as {crowded}"
    return whole, CellMesh(Columns.of(whole.part.scene), scene.accuracy, why).fitting()


def _suits(scene: Scene, grid: Size) -> bool:
    """Return whether a first grid takes fewer unknowns than tetrahedra of the same accuracy, and fits the memory."""
    # With 10 pads beside a meander the unknowns of tetrahedra grow 7.8 times per decade of the accuracy.
    most = LARGE * 7.0 ** max(np.log10(1e-2 / scene.accuracy), 0.0)
    return grid.unknowns <= most and reach.fits(scene, grid)
