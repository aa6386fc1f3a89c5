"""Interface of the meshes that `fem3d.adaptivity.adapt.adapt` refines, its answer, and refinement for a whole field.

Errors of probes converge twice as fast as the error of the field, so a grid made for probes may leave a field that
oscillates beside a steep decay. The error of the field is estimated by the difference of the two highest degrees at
points of every cell, relative to the largest rise.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Protocol

import numpy as np

from fem3d.adaptivity import nested
from fem3d.adaptivity.estimator import Spread, total
from fem3d.adaptivity.goal_errors import Level, Record
from fem3d.adaptivity.nested import Problems, Solution
from fem3d.adaptivity.trace_errors import Response
from fem3d.problems.current import Conductor
from fem3d.problems.heat import HeatProblem
from fem3d.results.outputs import Study
from fem3d.solution.transient import Base
from meshes import edgewise, grading
from meshes.grading import RATIO
from meshes.grid import Grid
from scenes.errors import NumericsError
from scenes.result import Step

# Largest ratio of the error to the difference of the two degrees: the worst of 1,200 steady scenes has 1.85, below the
# coldest boundary (`validate stress`, "field away from the probes").
CAUTION = 2.0
# Intervals with at least this fraction of the largest difference are refined: one more layer at a re-entrant edge
# reduces it by this factor.
CAUSES = RATIO ** (2 / 3)
POINTS = 6  # points along each axis of a cell at which two fields are compared
MOST_LEVELS = 6  # levels for the field, after those that the probes need
MOST_GROWTH, FREELY, MOST = 2.0, 3_000, 30_000


class Indicators(NamedTuple):
    """Error indicators that steer the refinement of a mesh.

    Attributes
    ----------
    goals: of each goal, relative to its scale.
    worst: the largest relative error.
    record: estimates of the level, for the correction of later levels.
    """

    goals: Sequence[Spread]
    worst: float
    record: Record | None = None


class Mesh(Protocol):
    """A mesh of a scene with its error estimator: `Bricks`, or the tetrahedra and hexahedra of `CellMesh`."""

    @property
    def whole(self) -> bool:
        """Whether the mesh is of the whole scene, not of its symmetric part."""

    def begin(self) -> Mesh:
        """Return the mesh to begin with, which may be a coarser one."""

    def problems(self) -> Problems:
        """Return the problems in nested spaces."""

    def examine(self, study: Study, given: Problems, fine: Solution) -> Level | None:
        """Bound the errors of a fine solution; None where a lower space has no steady state although the fine one
        has."""

    def respond(
        self, study: Study, given: Problems, bases: Sequence[Base], shift: float, steady: Level | None, generations: int
    ) -> Response:
        """Return the response of the first of ``bases``, in the highest space, with its errors; lower spaces follow.

        ``steady`` is the level of its steady state, if solved; ``generations`` of Krylov fields are the first trial.
        """

    def refine(self, indicators: Indicators, target: float) -> Mesh | None:
        """Return the mesh refined where indicators are large, aiming at the relative error ``target``.

        None where the mesh cannot be refined further. Raises NumericsError where no refinement reaches the target.
        """

    def refine_all(self) -> Mesh | None:
        """Return the mesh a little finer everywhere, or None where that is impossible."""

    def refine_for_field(self, level: Level) -> Mesh | None:
        """Return the mesh refined where the steady field has the largest errors; None where that is impossible."""

    def with_scene(self, scene: Any) -> Mesh:
        """Return the same cells with another scene, whose parts are in the same places."""

    def statistics(self, heat: HeatProblem) -> dict[str, Any]:
        """Return cells, degrees and volume for a result."""

    def steps(self, levels: int | None) -> tuple[Step, ...]:
        """Return the lines of the plan; after a run with the number of its refinements."""

    def warnings(self, study: Study, relative: dict[str, float]) -> list[str]:
        """Return warnings of the mesh and of ``relative`` errors above the accuracy."""


@dataclass(frozen=True, eq=False)
class Answer:
    """The last level.

    Attributes
    ----------
    mesh, heat, conductor: the mesh and the problems in its highest space.
    steady, errors: the steady solution and the errors of its quantities, by name, in their units.
    response: the response over time.
    levels: how many meshes were solved.
    field: error of the steady field over its largest rise; infinite where unknown.
    """

    mesh: Mesh
    heat: HeatProblem
    conductor: Conductor | None
    steady: Solution | None
    errors: dict[str, float]
    response: Response | None
    levels: int
    field: float = np.inf

    @property
    def fine(self) -> Solution:
        """The steady solution, which must exist."""
        assert self.steady is not None
        return self.steady

    def relative(self, study: Study) -> dict[str, float]:
        """Return all errors over their scales."""
        if self.response is not None:
            errors, scales = self.response.errors, self.response.scales
        else:
            errors, scales = self.errors, study.steady_scales(self.fine.out)
        return {name: error / scales[name] for name, error in errors.items()}


def less_accurate(study: Study, relative: dict[str, float], reason: str) -> list[str]:
    """Return the warning that ``relative`` errors exceed the accuracy: ``reason`` names the mesh and the remedy."""
    over = {name: e for name, e in relative.items() if e > study.accuracy}
    if not over:
        return []
    worst = max(over, key=lambda name: over[name])
    shown = f"{over[worst]:.1g}" if over[worst] > 2 * study.accuracy else f"{over[worst]:.3g}"
    if float(shown) <= study.accuracy:
        shown = f"just over {shown}"
    names = f"{len(over)} of {len(relative)} probes are" if len(over) > 1 else f'probe "{worst}" is'
    return [
        f"{names} less accurate than the {study.accuracy:g} asked for, {worst} with an estimated {shown}, on {reason}"
    ]


def most(size: int) -> float:
    """Return how many nodes a level for the field may have, for the ``size`` that the probes need."""
    return max(min(MOST_GROWTH * size, MOST), FREELY)


def improved(study: Study, answer: Answer, level: Level, progress: Callable[[str], None]) -> Answer:
    """Refine a few more levels for the field, at a few times the cost of the probes; return also the field's error."""
    assert study.field is not None
    best = replace(answer, field=estimate(level))
    mesh: Mesh | None = answer.mesh
    most_nodes = most(best.heat.size)
    for number in range(best.levels + 1, best.levels + 1 + MOST_LEVELS):
        mesh = mesh.refine_for_field(level) if mesh is not None and best.field > study.field else None
        if mesh is None:
            break
        try:
            problems = mesh.problems()
            if problems.heat.size > most_nodes:
                break
            fine = nested.solution(study, problems, near=best.fine.state)
            finer = mesh.examine(study, problems, fine)
        except NumericsError:
            break
        if finer is None:
            break
        level = finer
        progress(f"level {number}, for the field: {problems.heat.size} unknowns")
        if level.worst <= study.accuracy and (error := estimate(level)) < best.field:
            best = Answer(mesh, problems.heat, problems.conductor, level.fine, level.errors, None, number, error)
    return best


def estimate(level: Level) -> float:
    """Return the largest error of the fine steady field over its largest rise."""
    gaps, field = sampled(level)
    largest = float(max(field.max(), 0.0) - min(field.min(), 0.0)) or 1.0
    return CAUTION * float(gaps.max()) / largest


def refined(level: Level, aim: Grid | None = None) -> Grid:
    """Return the grid refined on the intervals with most of the field's error.

    Towards singular planes they are cut, elsewhere they gain a degree, or are halved at the highest; edges of a rough
    grid gain a degree, at most to its ``aim``.
    """
    space, (gaps, _) = level.problems.bricks, sampled(level)
    grid, marks = space.grid, grading.features(level.problems.domain.scene)
    cells = np.zeros(grid.owner.shape)
    cells[tuple(space.ijk)] = gaps.max(axis=1)
    if grid.edges:
        missing = edgewise.of_cells(np.where(cells >= CAUSES * gaps.max(), 1.0, 0.0))
        if aim is not None:
            return edgewise.finer(grid, missing, 0.5, aim)
        return edgewise.refined(grid, missing, 0.5 * total(missing), marks)
    worst = [cells.max(axis=tuple({0, 1, 2} - {d})) for d in range(3)]
    missing = [np.where(each >= CAUSES * gaps.max(), 1.0, 0.0) for each in worst]
    # Half the target makes twice the share: one step everywhere.
    return grading.refined(grid, missing, 0.5 * total(missing), marks)


def sampled(level: Level) -> tuple[np.ndarray, np.ndarray]:
    """Return (cells, points) the difference of the two highest degrees, and likewise the fine field."""
    given, space = level.problems, level.problems.domain.space
    # Inside of cells, so that each point is of one cell alone.
    inner = 0.5 - 0.499 * np.cos(np.pi * (np.arange(POINTS) + 0.5) / POINTS)
    X = np.array(np.meshgrid(inner, inner, inner)).reshape(3, -1)
    X = X[:, X.sum(axis=0) <= 1] if len(space.mesh.t) == 4 else X
    fields = given.heat.field(np.array([level.fine.state.rise, given.lifted(level.low.state.rise, -2)]))
    fine, low = fields[:, space.dofs.T] @ space.at(X).T
    return np.abs(fine - low), fine
