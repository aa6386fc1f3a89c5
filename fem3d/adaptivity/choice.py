"""What a scene of boxes is solved on: a grid of bricks, whose planes cross the whole scene, or tetrahedra
(`meshes.columns`), which end where they are needed.

Bricks gain degrees and layers where tetrahedra are halved: where parts align they take far fewer unknowns for an
accuracy. Planes that align with nothing make a grid grow with the square of their number, tetrahedra in proportion.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fem3d.adaptivity import reach
from fem3d.adaptivity.brick_mesh import LARGE, Bricks
from fem3d.adaptivity.mesh import Mesh
from fem3d.adaptivity.tetrahedra import Tetrahedra
from fem3d.results.study import Study
from fem3d.spaces.box_cells import BoxCells, box_cells
from fem3d.spaces.size import Size, foreseen
from meshes import connected
from meshes.columns import Columns
from scenes.free.crowding import crowding
from scenes.model import Scene
from scenes.plan import Step

# Times the unknowns of the first tetrahedra that those have which reach an accuracy of 1e-2, and what each further
# decade takes: the edges of a solution are resolved by unknowns in proportion to the inverse of the error.
TO_PERCENT, PER_DECADE = 3.0, 4.0


@dataclass(frozen=True, eq=False)
class OnBoxes:
    """A scene of boxes on tetrahedra that its parts are made of."""

    columns: Columns
    why: str

    given = False
    most, becomes = 2, 4.0

    @property
    def scene(self) -> Scene:
        """The scene."""
        return self.columns.scene

    @property
    def cells(self) -> Any:
        """scikit-fem's mesh."""
        return self.columns.mesh

    def domain(self) -> BoxCells:
        """What the boxes are made of."""
        return box_cells(self.scene, self.cells)

    def finer(self, times: np.ndarray) -> OnBoxes:
        """On columns that are finer there."""
        return replace(self, columns=self.columns.refined(times))

    def of(self, scene: Any) -> OnBoxes:
        """Another scene on the mesh."""
        return replace(self, columns=replace(self.columns, scene=scene))

    def because(self, size: Size) -> str:
        """What makes the mesh so large."""
        taken = f"{float(f'{size.unknowns:.2g}'):,.0f} unknowns and {size.memory / 1e9:.3g} GB"
        return f" by tetrahedra of {taken}; {crowding(self.scene, connected.coarsest(self.scene).breaks)}"

    def remarks(self) -> list[str]:
        """Nothing."""
        return []

    def statistics(self) -> dict[str, Any]:
        """Of which kind the cells are."""
        return {"cell_type": "tetra"}

    def steps(self, levels: int | None) -> tuple[Step, ...]:
        """The lines of the plan."""
        done = (
            "" if levels is None else f"; finer where readings missed most, {levels} times, to {self.cells.t.shape[1]}"
        )
        return (Step("mesh", "done", f"tetrahedra of degree 3, of the whole scene: {self.why}{done}"),)


def of(study: Study, whole: Study, over_time: bool = False) -> tuple[Study, Mesh]:
    """What a scene is solved on and the study of it: of its part on bricks, of the ``whole`` on tetrahedra. Raises
    NumericsError where it takes too much memory on either."""
    scene, bricks = study.part.scene, None
    if scene.mesh == "bricks":
        return study, Bricks.of(study, over_time)
    grid, free = reach.least(scene), not scene.mesh
    if free and grid.unknowns <= LARGE:
        bricks = Bricks.of(study, over_time)
        grid = foreseen(scene, bricks.grid)
        if grid.unknowns <= LARGE:
            return study, bricks
    laid = on_tetrahedra(whole.part.scene, grid)
    enough = factor(scene.accuracy) * laid.size.unknowns
    if free and grid.unknowns <= enough:
        bricks = bricks or Bricks.of(study, over_time)
        if foreseen(scene, bricks.grid).unknowns <= enough:
            return study, bricks
    if laid.size.memory > reach.MOST_MEMORY:
        raise reach.not_reached(scene.accuracy, laid.laid.because(laid.size))
    return whole, laid


def factor(accuracy: float) -> float:
    """Times the unknowns of the first tetrahedra that an accuracy is foreseen to take."""
    return float(TO_PERCENT * PER_DECADE ** max(np.log10(1e-2 / accuracy), 0.0))


def on_tetrahedra(scene: Scene, grid: Size) -> Tetrahedra:
    """The first tetrahedra of a scene that a ``grid`` of that size is not taken for."""
    why = "run.mesh asks for them"
    if scene.mesh != "tetrahedra":
        shown = f"{float(f'{grid.unknowns:.2g}'):,.0f} unknowns and {grid.memory / 1e9:.2g} GB or more"
        why = f"a grid of bricks would take {shown}, as {crowding(scene, connected.coarsest(scene).breaks)}"
    return Tetrahedra(OnBoxes(Columns.of(scene), why), scene.accuracy)
