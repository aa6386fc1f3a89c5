"""How well a whole steady field is known, where nothing is read off it, and a grid that suits it better.

Probes' errors converge twice as fast as the field's, and a grid that suits them may leave a field that swings beside a
steep decay. The field's error is judged by what the space of degrees lower by one differs by from the fine one,
relative to the largest rise, at points of every cell.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from fem3d.adaptivity import nested
from fem3d.adaptivity.estimator import total
from fem3d.adaptivity.goal_errors import Level
from fem3d.adaptivity.mesh import Answer
from fem3d.results.study import Study
from meshes import edgewise, grading
from meshes.grading import RATIO
from meshes.grid import Grid
from scenes.errors import NumericsError

# The error over the difference of the two degrees, at most, once it is small: `validate stress` divides by it in its
# row "field away from the probes". Of some 1,200 steady scenes one falls 1.85 times the difference below what is cold.
CAUTION = 2.0
# Intervals with at least this fraction of the largest difference are refined: what one layer more leaves of it at a
# re-entrant edge.
CAUSES = RATIO ** (2 / 3)
POINTS = 6  # points of an interval, along each axis, at which two fields are compared
MOST_LEVELS = 6  # levels for the field, after those that the probes need
MOST_GROWTH, FREELY, MOST = 2.0, 3_000, 30_000


def most(size: int) -> float:
    """How many nodes a level for the field may have: some times those that the probes need (``size``), more of few."""
    return max(min(MOST_GROWTH * size, MOST), FREELY)


def improved(study: Study, answer: Answer, level: Level, progress: Callable[[str], None]) -> Answer:
    """A few more levels where the probes need none, for a field that can be looked at, if that costs no more than a few
    times what they did; the answer says how far off it is."""
    assert study.field is not None
    best = replace(answer, field=answer.mesh.field_error(level))
    most_nodes = most(best.heat.size)
    for number in range(best.levels + 1, best.levels + 1 + MOST_LEVELS):
        mesh = best.mesh.refined_for_field(level) if best.field > study.field else None
        if mesh is None:
            break
        try:
            problems = mesh.problems()
            if problems.heat.size > most_nodes:
                break
            fine = nested.solution(study, problems, near=best.fine.state)
            finer = mesh.examined(study, problems, fine)
        except NumericsError:
            break
        if finer is None:
            break
        level = finer
        progress(f"level {number}, for the field: {problems.heat.size} unknowns")
        if level.worst <= study.accuracy and (error := mesh.field_error(level)) < best.field:
            best = Answer(mesh, problems.heat, problems.conductor, level.fine, level.errors, None, number, error)
    return best


def of(level: Level) -> float:
    """The error of the fine steady field on bricks where it is worst, over its largest rise."""
    return relative(*_sampled(level))


def relative(gaps: np.ndarray, field: np.ndarray) -> float:
    """The error of a field over its largest rise, from samples of it and of how far the degree below is apart."""
    largest = float(max(field.max(), 0.0) - min(field.min(), 0.0)) or 1.0
    return CAUTION * float(gaps.max()) / largest


def refined(level: Level, aim: Grid | None = None) -> Grid:
    """The grid with the intervals refined that cause most of its field's error: towards singular planes they are cut,
    elsewhere they gain a degree, and are halved at the highest; of a rough grid edges gain one, up to those of its
    ``aim``."""
    grid, (gaps, _) = level.problems.bricks.grid, _sampled(level)
    marks = grading.features(level.problems.domain.scene)
    cells = gaps.reshape([n for length in gaps.shape for n in (length // POINTS, POINTS)]).max(axis=(1, 3, 5))
    if grid.edges:
        missing = edgewise.of_cells(np.where(cells >= CAUSES * gaps.max(), 1.0, 0.0))
        if aim is not None:
            return edgewise.finer(grid, missing, 0.5, aim)
        return edgewise.refined(grid, missing, 0.5 * total(missing), marks)
    worst = [cells.max(axis=tuple({0, 1, 2} - {d})) for d in range(3)]
    missing = [np.where(each >= CAUSES * gaps.max(), 1.0, 0.0) for each in worst]
    # Twice its share: one step, wherever.
    return grading.refined(grid, missing, 0.5 * total(missing), marks)


def _sampled(level: Level) -> tuple[np.ndarray, np.ndarray]:
    """(x, y, z) twice: how far the two degrees are apart at points of the solid, zero outside, and the fine field."""
    given, space = level.problems, level.problems.bricks
    # Inside of cells, so that each point is of one cell alone.
    inner = (np.arange(POINTS) + 0.5) / POINTS
    inner = 0.5 - 0.499 * np.cos(np.pi * inner)
    at = [(b[:-1, None] + np.diff(b)[:, None] * inner).ravel() for b in space.grid.breaks]
    fields = given.heat.field(np.array([level.fine.state.rise, given.lifted(level.low.state.rise, 1)]))
    fine, low = space.sample(fields, *at)
    solid = space.grid.solid.repeat(POINTS, 0).repeat(POINTS, 1).repeat(POINTS, 2)
    return np.where(solid, np.abs(fine - low), 0.0), np.where(solid, fine, 0.0)
