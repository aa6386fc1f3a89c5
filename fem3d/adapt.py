"""Refining until every quantity is known well enough, level by level (`fem3d.level`)."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass

import numpy as np

from fem3d import estimate, field_error, reach, start, transient
from fem3d.domain import boxes
from fem3d.errors import NumericsError, RunawayError
from fem3d.estimate import Spread
from fem3d.level import Level, Solution, examined, problems, solution
from fem3d.study import Study
from fem3d.time_response import ROW_SHARE, Response, respond
from fem3d.transient import Base
from meshes import diffusion, grading
from meshes.grading import Features
from meshes.grid import Grid

# Times the change of the runaway voltage from grid to grid by which a voltage must exceed it: what all further changes
# add up to if each is at most three quarters of the one before.
SURELY = 3.0
MOST_LEVELS = 40
# Of what is enough, at which a refinement aims: what it takes away is foreseen to a factor of two or so, and one more
# level costs more than some cells too many (`validate stress --scenes 160`: seconds of the slowest).
AIM = 0.5

Progress = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class Answer:
    """What the last level gives: its solution, the steady errors by name, the response over time, and the error of the
    steady field over its largest rise (infinite where the study doesn't ask for it)."""

    fine: Solution
    errors: dict[str, float]
    response: Response | None
    levels: int
    field: float = np.inf


def solve(study: Study, with_transient: bool, progress: Progress = lambda _: None) -> Answer:
    """Levels until every estimated error is within the study's accuracy.

    Raises RunawayError where no steady state exists, NumericsError where the accuracy can't be reached.
    """
    accuracy, scene = study.accuracy, study.part.scene
    marks = grading.features(scene)
    grid = reach.first_grid(scene, accuracy, marks)
    # No trace is known better than where it ends, and its rows take their share.
    enough = accuracy * (1 - ROW_SHARE) if with_transient else accuracy
    edges, limit = reach.Edges(enough, accuracy, marks), None
    for number in range(1, MOST_LEVELS):
        given = problems(boxes(scene, grid), accuracy)
        reach.check_size(given, accuracy, marks)
        edges.check_power(given)
        try:
            fine = solution(study, given)
        except RunawayError as runaway:
            # The voltage of the fold is a number of this grid; it stands once another one agrees with it.
            known_to = np.inf if limit is None else abs(runaway.limit - limit)
            if abs(study.voltage) - runaway.limit > SURELY * known_to:
                raise
            limit, grid = runaway.limit, grading.raised(grid)
            continue
        progress(f"level {number}: {fine.state.heat.size} unknowns")
        here = examined(study, given, fine, marks)
        if here is None:
            grid = _finer(grid, grading.raised(grid), marks, accuracy)
            continue
        if here.worst <= enough:
            if not with_transient:
                off = np.inf if study.field is None else field_error.of(here)
                if study.field is None or off <= study.field:
                    return Answer(fine, here.errors, None, number, off)
                return _for_the_field(study, Answer(fine, here.errors, None, number, off), here, marks, progress)
            progress("transient")
            response = _response(study, here, marks)
            if response.accepted:
                return Answer(fine, here.errors, response, number)
            goals, worst = [*response.goals, *here.goals.values()], response.worst
            del response
        else:
            goals, worst = list(here.goals.values()), here.worst
        edges.check(grid, goals)
        grid = _refined(grid, goals, worst, enough, accuracy, marks)
        # The next level's matrices take the place of these.
        del given, fine, here
    raise NumericsError(f"an accuracy of {accuracy:g} isn't reached in this scene")


def _response(study: Study, here: Level, marks: Features) -> Response:
    """The response of a level whose steady state is known."""
    bases = [Base.of_steady(solved.state) for solved in (here.fine, here.low)]
    g = transient.shift(transient.time_constant(here.fine.state), study.earliest)
    relative = {n: e / here.scales[n] for n, e in here.errors.items()}
    return respond(study, here.problems, bases, g, marks, here.fine.out, relative)


def _for_the_field(study: Study, best: Answer, here: Level, marks: Features, progress: Progress) -> Answer:
    """A few more levels where the probes need none, for a field that can be looked at, if that costs no more than a few
    times what they did; the answer says how far off it is."""
    assert study.field is not None
    most = field_error.most(best.fine.state.heat.size)
    for number in range(best.levels + 1, best.levels + 1 + field_error.MOST_LEVELS):
        given = problems(boxes(study.part.scene, field_error.refined(here)), study.accuracy)
        if given.heat.size > most:
            break
        try:
            fine = solution(study, given)
            found = examined(study, given, fine, marks)
        except NumericsError:
            break
        if found is None:
            break
        here = found
        progress(f"level {number}, for the field: {fine.state.heat.size} unknowns")
        if here.worst <= study.accuracy and (off := field_error.of(here)) < best.field:
            best = Answer(fine, here.errors, None, number, off)
        if best.field <= study.field:
            break
    return best


@dataclass(frozen=True, eq=False)
class Course:
    """What the last level of a transient without a steady state gives: its base and the response over time."""

    base: Base
    response: Response
    levels: int


def solve_course(study: Study, progress: Progress = lambda _: None) -> Course:
    """Levels until every estimated error of the transient is within the study's accuracy; NumericsError where that
    can't be reached."""
    accuracy, scene = study.accuracy, study.part.scene
    marks = grading.features(scene)
    grid = diffusion.graded(reach.first_grid(scene, accuracy, marks), scene, study.earliest)
    slowest, generations, enough = study.end, 0, accuracy * (1 - ROW_SHARE)
    edges = reach.Edges(enough, accuracy, marks)
    for number in range(1, MOST_LEVELS):
        given = problems(boxes(scene, grid), accuracy)
        reach.check_size(given, accuracy, marks)
        edges.check_power(given)
        g = transient.shift(slowest, study.earliest)
        bases = start.nested(given, g, study.end, accuracy)
        progress(f"level {number}: {given.heat.size} unknowns")
        response = respond(study, given, bases, g, marks, None, {}, generations)
        if response.accepted:
            return Course(bases[0], response, number)
        slowest, generations = min(study.end, response.slowest), response.generations
        edges.check(grid, response.goals)
        grid = _refined(grid, response.goals, response.worst, enough, accuracy, marks)
        del given, bases, response
    raise NumericsError(f"an accuracy of {accuracy:g} isn't reached in this scene")


def _refined(
    grid: Grid, goals: Collection[Spread], worst: float, enough: float, accuracy: float, marks: Features
) -> Grid:
    """The grid refined for what goals miss on its intervals, or for as much more as the worst error says, until that is
    expected to be ``enough``; NumericsError where no grid reaches that."""
    missing = estimate.worst(goals)
    known = max(estimate.total(missing), 1e-300)
    finer = grading.refined(grid, [m * max(worst / known, 1.0) for m in missing], AIM * enough, marks)
    return _finer(grid, finer, marks, accuracy)


def _finer(grid: Grid, finer: Grid, marks: Features, accuracy: float) -> Grid:
    if finer.same(grid):
        raise NumericsError(f"an accuracy of {accuracy:g} isn't reached in this scene" + reach.because(marks))
    return finer
