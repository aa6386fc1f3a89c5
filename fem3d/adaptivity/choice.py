"""What a scene of boxes is solved on: a grid of bricks, whose planes cross the whole scene, or tetrahedra
(`meshes.columns`), which end where they are needed.

Bricks gain degrees and layers where tetrahedra are halved: where parts align they take far fewer unknowns for an
accuracy. Planes that align with nothing make a grid grow with the square of their number, tetrahedra in proportion.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fem3d.adaptivity import loop, reach
from fem3d.adaptivity.brick_mesh import LARGE, Bricks
from fem3d.adaptivity.mesh import Answer, Mesh
from fem3d.adaptivity.tetrahedra import Tetrahedra
from fem3d.results.study import Study
from fem3d.spaces.box_cells import BoxCells, box_cells
from fem3d.spaces.size import Size, foreseen
from meshes import connected
from meshes.columns import Columns
from scenes.errors import NumericsError, TooLargeError
from scenes.free.crowding import crowding
from scenes.model import Scene
from scenes.plan import Step

# Times the unknowns of the first tetrahedra that those have which reach an accuracy of 1e-2, and what the next decade
# takes: a meander of platinum on a membrane takes 2.5 times with 10 to 50 pads beside it, random plates 2.3, stacks
# with vias more; with 10 pads 1e-3 takes 7.8 times as many as 1e-2.
TO_PERCENT, PER_DECADE = 4.0, 7.0


@dataclass(frozen=True, eq=False)
class OnBoxes:
    """A scene of boxes on tetrahedra that its parts are made of."""

    columns: Columns
    why: str

    advice = reach.ADVICE

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

    def finer(self, shorter: np.ndarray, sharp: np.ndarray) -> OnBoxes:
        """On columns that are finer there, above all beside what is sharp."""
        return replace(self, columns=self.columns.refined(shorter, sharp))

    def of(self, scene: Any) -> OnBoxes:
        """Another scene on the mesh."""
        return replace(self, columns=replace(self.columns, scene=scene))

    def remarks(self) -> list[str]:
        """Nothing."""
        return []

    def statistics(self) -> dict[str, Any]:
        """Of which kind the cells are."""
        return {"cell_type": "tetra"}

    def steps(self, levels: int | None) -> tuple[Step, ...]:
        """The lines of the plan."""
        cells = self.cells.t.shape[1]
        done = "" if levels is None else f"; finer where readings missed most, {levels} times, to {cells} cells"
        return (Step("mesh", "done", f"tetrahedra of degree 3, of the whole scene: {self.why}{done}"),)


def of(study: Study, whole: Study, over_time: bool = False) -> tuple[Study, Mesh]:
    """What a scene is solved on and the study of it: of its part on bricks, of the ``whole`` on tetrahedra. Raises
    TooLargeError where it takes too much memory on either."""
    scene, bricks = study.part.scene, None
    if scene.mesh == "bricks":
        return study, Bricks.of(study, over_time)
    grid, free = reach.least(scene), not scene.mesh
    if free and _suits(grid, LARGE):
        bricks = _bricks(study, over_time)
        grid = foreseen(scene, bricks.grid)
        if _suits(grid, LARGE):
            return study, bricks
    laid = on_tetrahedra(whole.part.scene, grid)
    enough = factor(scene.accuracy) * laid.size.unknowns
    if free and _suits(grid, enough):
        bricks = bricks or _bricks(study, over_time)
        if _suits(foreseen(scene, bricks.grid), enough):
            return study, bricks
    if not reach.fits(laid.size):
        raise too_large(whole.part.scene, laid.size)
    return whole, laid


def solve(
    study: Study, mesh: Mesh, whole: Callable[[], Study], with_transient: bool, progress: Callable[[str], None]
) -> tuple[Study, Answer]:
    """The answer on a mesh that `of` has chosen, and the study of it. Where the memory has no room for all bricks that
    an accuracy takes, the scene is solved on tetrahedra too, and the answer of the smaller error is taken. Raises as
    `loop.solve` does."""
    known, left = None, np.inf
    try:
        known = loop.solve(study, with_transient, progress, mesh, not with_transient)
        left = 0.0 if with_transient else max(known.relative(study).values(), default=0.0)
    except TooLargeError:
        if not _may_change(mesh):
            raise
    if known is not None and (left <= study.accuracy or not _may_change(mesh)):
        return study, known
    every, last = whole(), mesh if known is None else known.mesh
    assert isinstance(last, Bricks)
    laid = replace(on_tetrahedra(every.part.scene, foreseen(last.scene, last.grid)), below=left)
    try:
        if not reach.fits(laid.size):
            raise too_large(every.part.scene, laid.size)
        progress("begun anew on tetrahedra: bricks would be too many")
        answer = loop.solve(every, with_transient, progress, laid, not with_transient)
    except NumericsError:
        if known is None:
            raise
        return study, known
    if known is not None and left <= max(answer.relative(every).values(), default=0.0):
        return study, known
    return every, answer


def _may_change(mesh: Mesh) -> bool:
    """Whether tetrahedra may take the place of bricks that become too many."""
    return isinstance(mesh, Bricks) and not mesh.scene.mesh


def _bricks(study: Study, over_time: bool) -> Bricks:
    """Those to start with. A response over time has its rows on a grid that is fine enough alone."""
    return replace(Bricks.of(study, over_time), as_far_as_it_goes=not over_time)


def _suits(grid: Size, most: float) -> bool:
    """Whether a grid has no more than so many unknowns, and fits the memory."""
    return grid.unknowns <= most and reach.fits(grid)


def too_large(scene: Scene, size: Size) -> TooLargeError:
    """What is raised where the first tetrahedra take too much memory."""
    return TooLargeError(
        f"the scene takes {_shown(size)} on tetrahedra, and {reach.MOST_MEMORY / 1e9:g} GB are the most; "
        f"{crowding(scene, connected.coarsest(scene).breaks)}: let more coincide, or leave out what does not matter"
    )


def _shown(size: Size) -> str:
    return f"{float(f'{size.unknowns:.2g}'):,.0f} unknowns and {size.memory / 1e9:.2g} GB"


def factor(accuracy: float) -> float:
    """Times the unknowns of the first tetrahedra that an accuracy is foreseen to take."""
    return float(TO_PERCENT * PER_DECADE ** max(np.log10(1e-2 / accuracy), 0.0))


def on_tetrahedra(scene: Scene, grid: Size) -> Tetrahedra:
    """The first tetrahedra of a scene that a ``grid`` of that size is not taken for."""
    why = "run.mesh asks for them"
    if scene.mesh != "tetrahedra":
        crowded = crowding(scene, connected.coarsest(scene).breaks)
        why = f"a grid of bricks would take {_shown(grid)} or more, as {crowded}"
    return Tetrahedra(OnBoxes(Columns.of(scene), why), scene.accuracy)
