"""Estimate the error of a whole steady field, and refine the mesh for it.

Errors of probes converge twice as fast as the error of the field, so a grid made for probes may leave a field that
oscillates beside a steep decay. The error of the field is estimated by the difference of the two highest degrees at
points of every cell, relative to the largest rise.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from fem3d.adaptivity import nested
from fem3d.adaptivity.estimator import total
from fem3d.adaptivity.goal_errors import Level
from fem3d.adaptivity.mesh import Answer, Mesh
from fem3d.results.study import Study
from meshes import edgewise, grading
from meshes.grading import RATIO
from meshes.grid import Grid
from scenes.errors import NumericsError

# Largest ratio of the error to the difference of the two degrees: the worst of 1,200 steady scenes has 1.85, below the
# coldest boundary (`validate stress`, "field away from the probes").
CAUTION = 2.0
# Intervals with at least this fraction of the largest difference are refined: one more layer at a re-entrant edge
# reduces it by this factor.
CAUSES = RATIO ** (2 / 3)
POINTS = 6  # points along each axis of a cell at which two fields are compared
MOST_LEVELS = 6  # levels for the field, after those that the probes need
MOST_GROWTH, FREELY, MOST = 2.0, 3_000, 30_000


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
