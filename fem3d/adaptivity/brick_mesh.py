"""Grids of bricks, refined in degrees and layers by their error indicators."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

from fem3d.adaptivity import goal_errors, mesh, nested, reach, trace_errors
from fem3d.adaptivity.estimator import Estimator, total, worst_of
from fem3d.adaptivity.goal_errors import Level
from fem3d.adaptivity.mesh import Indicators, less_accurate
from fem3d.adaptivity.nested import Problems, Solution
from fem3d.adaptivity.reach import not_reached
from fem3d.adaptivity.trace_errors import Response
from fem3d.problems.heat import HeatProblem
from fem3d.results.outputs import Study
from fem3d.solution.transient import Base
from fem3d.spaces.domain import boxes
from fem3d.spaces.size import foreseen
from meshes import edgewise, grading
from meshes import grid as grids
from meshes.grading import Features
from meshes.grid import Grid
from scenes.model import Scene
from scenes.result import Step

# A refinement aims at this fraction of the allowed error: the predicted reduction is right only within a factor of two,
# and one more level costs more than some cells too many (`validate stress --scenes 160`: seconds of the slowest).
AIM = 0.5
# Degree of a rough grid; a first grid with at least MANY unknowns is preceded by a rough grid. With fewer unknowns the
# rough grid takes longer than it saves (random scenes, also on blocks).
ROUGH, MANY = 2, 6_000
LARGE = 30_000  # unknowns of a grid beyond which tetrahedra are looked at (`fem3d.adaptivity.choice`)


@dataclass(frozen=True, eq=False)
class Bricks:
    """A grid of bricks for a relative ``accuracy``, refined where the contributions of the last two degrees are large.

    ``marks`` are the features of the scene with its singular edges. A grid of rough degrees selects the edges that need
    the degrees of its ``aim``. If memory has no room for a finer grid, the accuracy is refused or, with
    ``as_far_as_it_goes``, the grid is taken as it is."""

    scene: Scene
    grid: Grid
    accuracy: float
    marks: Features
    aim: Grid | None = None
    as_far_as_it_goes: bool = False

    @staticmethod
    def of(study: Study, over_time: bool = False) -> Bricks:
        """Return the first grid; ``over_time`` adds layers at faces whose temperature jumps."""
        scene, accuracy = study.part.scene, study.accuracy
        reach.check_planes(scene)
        marks = grading.features(scene, study.earliest if over_time else None)
        return Bricks(scene, reach.first_grid(scene, accuracy, marks), accuracy, marks)

    @cached_property
    def _estimator(self) -> Estimator:
        return Estimator.of_grid(self.grid, self.marks)

    def begin(self) -> Bricks:
        if foreseen(self.scene, self.grid).unknowns < MANY:
            return self
        reach.check_size(self.scene, self.grid, self.accuracy, self.marks)
        return replace(self, grid=edgewise.of_degree(self.grid, ROUGH), aim=grading.raised(self.grid))

    def problems(self) -> Problems:
        reach.check_size(self.scene, self.grid, self.accuracy, self.marks)
        given = nested.problems(boxes(self.scene, self.grid), self.accuracy)
        if self.aim is None and any(p.quantity == "current" for p in self.scene.probes):
            # The power of the cold conductor is available before any other solution.
            power = self._estimator.indicators(given.electric_parts)
            reach.check_edges(self.grid, self.marks, [power], self.accuracy)
        return given

    def examine(self, study: Study, given: Problems, fine: Solution) -> Level | None:
        return goal_errors.examined(study, given, fine, self._estimator)

    def respond(
        self, study: Study, given: Problems, bases: Sequence[Base], shift: float, steady: Level | None, generations: int
    ) -> Response:
        return trace_errors.respond(study, given, bases, shift, self._estimator, steady, generations)

    def refine(self, indicators: Indicators, target: float) -> Bricks | None:
        missing = worst_of(indicators.goals)
        missing = [m * max(indicators.worst / max(total(missing), 1e-300), 1.0) for m in missing]
        if self.aim is not None:
            # The last degree's contribution, FALLS times its error, is foreseen to a factor of two.
            share = edgewise.share_of(missing, AIM * target / (2 * edgewise.FALLS))
            finer = replace(self, grid=edgewise.finer(self.grid, missing, share, self.aim), aim=None)
        else:
            reach.check_edges(self.grid, self.marks, indicators.goals, target)
            refined = edgewise.refined if self.grid.edges else grading.refined
            finer = replace(self, grid=refined(self.grid, missing, AIM * target, self.marks))
            if finer.grid.same(self.grid):
                raise not_reached(self.accuracy, reach.because(self.marks))
        if self.as_far_as_it_goes and not reach.fits(self.scene, foreseen(self.scene, finer.grid)):
            return None
        return finer

    def refine_all(self) -> Bricks | None:
        if self.aim is not None:
            return replace(self, grid=self.aim, aim=None)
        finer = grading.raised(self.grid)
        return None if finer.same(self.grid) else replace(self, grid=finer)

    def refine_for_field(self, level: Level) -> Bricks:
        return replace(self, grid=mesh.refined(level, self.aim))

    def with_scene(self, scene: Scene) -> Bricks:
        return replace(self, scene=scene)

    whole = False
    levels = None

    def steps(self, levels: int | None) -> tuple[Step, ...]:
        """Return a line of the plan if the scene demands the grid, or if the grid is large."""
        size = foreseen(self.scene, self.grid)
        if not self.scene.mesh and size.unknowns <= LARGE:
            return ()
        why = "run.mesh asks for it" if self.scene.mesh else "tetrahedra are foreseen to take more"
        return (Step("mesh", "done", f"a grid of bricks of {size.unknowns:,} unknowns to start with; {why}"),)

    def statistics(self, heat: HeatProblem) -> dict[str, Any]:
        return grids.statistics(self.grid)

    def warnings(self, study: Study, relative: dict[str, float]) -> list[str]:
        return less_accurate(study, relative, f"as many bricks as the memory has room for; {reach.ADVICE}")
