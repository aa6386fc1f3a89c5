"""Refining until every quantity is known well enough, level by level (`fem3d.adaptivity.goal_errors`), on any
`Mesh`."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np

from fem3d.adaptivity import field_error, nested, transient_base
from fem3d.adaptivity.brick_mesh import Bricks
from fem3d.adaptivity.estimate import Spread
from fem3d.adaptivity.goal_errors import Level
from fem3d.adaptivity.nested import Problems, Solution
from fem3d.adaptivity.reach import not_reached
from fem3d.adaptivity.trace_errors import ROW_SHARE, Response
from fem3d.problems.current import Conductor
from fem3d.problems.heat import HeatProblem
from fem3d.results.fields.fields import RunFields
from fem3d.results.study import Study
from fem3d.solution import transient
from fem3d.solution.steady import SteadyState
from fem3d.solution.transient import Base, Transient
from meshes.symmetry import Symmetry
from scenes.errors import NumericsError, RunawayError, RunawayInTimeError

# Times the change of the runaway voltage from mesh to mesh by which a voltage must exceed it: what all further changes
# add up to if each is at most three quarters of the one before.
SURELY = 3.0
MOST_LEVELS = 40
Progress = Callable[[str], None]


class Mesh(Protocol):
    """What a scene is solved on, as the search for an accuracy sees it: a grid of bricks (`Bricks`) or a mesh file
    (`fem3d.adaptivity.mesh_file.FileMesh`). They differ in where errors come from and in how they are refined."""

    def problems(self) -> Problems:
        """The problems on it, in nested spaces."""

    def examined(self, study: Study, given: Problems, fine: Solution) -> Level | None:
        """The level of a fine solution; None where a lower space has no steady state although the fine one has."""

    def responded(
        self, study: Study, given: Problems, bases: Sequence[Base], shift: float, steady: Level | None, generations: int
    ) -> Response:
        """The response of the first of ``bases``, those of the spaces from the highest on, with its errors; ``steady``
        is the level of its steady state, where that is known, ``generations`` of fields where to start."""

    def refined(self, goals: Collection[Spread], falls: Spread, worst: float, enough: float) -> Mesh | None:
        """Refined for what goals miss, each degree taking away less than the one before by the factors ``falls``
        (`estimate.falling`), or for as much more as the ``worst`` error says, until that is expected to be ``enough``;
        None where it is to be taken as it is. NumericsError where no refinement reaches that."""

    def raised(self) -> Mesh | None:
        """A little finer everywhere, or None."""

    def fields(
        self, heat: HeatProblem, part: Symmetry, state: SteadyState | None, transient: Transient | None
    ) -> RunFields:
        """The fields of a run on it."""

    def statistics(self, heat: HeatProblem) -> dict[str, Any]:
        """What a result says of it."""

    def warnings(self, study: Study, relative: dict[str, float]) -> list[str]:
        """What is to be said of it, and of the ``relative`` errors that it leaves."""


@dataclass(frozen=True, eq=False)
class Answer:
    """What the last level gives: its mesh and problem, the steady solution and its errors by name, the response over
    time, and the error of the steady field over its largest rise (infinite where the study doesn't ask for it)."""

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
        """The steady solution that is there."""
        assert self.steady is not None
        return self.steady


def solve(
    study: Study,
    with_transient: bool,
    progress: Progress = lambda _: None,
    mesh: Mesh | None = None,
    with_steady: bool = True,
) -> Answer:
    """Levels, of bricks if no ``mesh`` is given, until every estimated error is within the study's accuracy or the mesh
    is to be taken as it is; of the steady state, of the transient, or of both.

    Raises RunawayError where no steady state exists, RunawayInTimeError where a transient runs away, NumericsError
    where the accuracy can't be reached.
    """
    accuracy, here_on = study.accuracy, mesh or Bricks.of(study, over_time=not with_steady)
    # No trace is known better than where it ends, and its rows take their share.
    enough = accuracy * (1 - ROW_SHARE) if with_transient else accuracy
    limit, ran_away, slowest, generations = None, False, study.end, 0
    for number in range(1, MOST_LEVELS):
        given = here_on.problems()
        fine = here = response = None
        try:
            if with_steady:
                fine = nested.solution(study, given)
                here = here_on.examined(study, given, fine)
        except RunawayError as runaway:
            # The voltage of the fold is a number of this mesh; it stands once another one agrees with it.
            known_to = np.inf if limit is None else abs(runaway.limit - limit)
            finer = None if abs(study.voltage) - runaway.limit > SURELY * known_to else here_on.raised()
            if finer is None:
                raise
            limit, here_on = runaway.limit, finer
            continue
        progress(f"level {number}: {given.heat.size} unknowns")
        if with_steady and here is None:
            finer = here_on.raised()
            if finer is None:
                break
            here_on = finer
            continue
        if with_transient and (here is None or here.worst <= enough):
            if here is None:
                g = transient.shift(slowest, study.earliest)
                bases = transient_base.nested(given, g, study.end, accuracy)
            else:
                progress("transient")
                g = transient.shift(transient.time_constant(here.fine.state), study.earliest)
                bases = [Base.of_steady(solved.state) for solved in (here.fine, here.low)]
            try:
                response = here_on.responded(study, given, bases, g, here, generations)
            except RunawayInTimeError:
                # As a fold, it stands once another mesh agrees.
                finer = None if ran_away else here_on.raised()
                if finer is None:
                    raise
                ran_away, here_on = True, finer
                continue
            if here is None:
                slowest, generations = min(study.end, response.slowest), response.generations
            del bases
        found = Answer(here_on, given.heat, given.conductor, fine, here.errors if here else {}, response, number)
        if response.accepted if response else here is not None and here.worst <= enough:
            return found if with_transient or here is None else _for_the_field(study, found, here, progress)
        goals = [*(response.goals if response else ()), *(here.goals.values() if here else ())]
        worst = response.worst if response else here.worst if here else np.inf
        falls = response.falls if response else here.falls if here else []
        finer = here_on.refined(goals, falls, worst, enough)
        if finer is None:
            return found
        # The next level's matrices take the place of these.
        del given, fine, here, response, found
        here_on = finer
    raise not_reached(accuracy)


def _for_the_field(study: Study, best: Answer, here: Level, progress: Progress) -> Answer:
    """A few more levels where the probes need none, for a field that can be looked at, if that costs no more than a few
    times what they did; the answer says how far off it is."""
    if study.field is None:
        return best
    best = replace(best, field=field_error.of(here))
    most = field_error.most(best.heat.size)
    for number in range(best.levels + 1, best.levels + 1 + field_error.MOST_LEVELS):
        if best.field <= study.field:
            break
        mesh = replace(best.mesh, grid=field_error.refined(here))  # type: ignore[type-var]
        try:
            given = mesh.problems()
            if given.heat.size > most:
                break
            fine = nested.solution(study, given)
            found = mesh.examined(study, given, fine)
        except NumericsError:
            break
        if found is None:
            break
        here = found
        progress(f"level {number}, for the field: {fine.state.heat.size} unknowns")
        if here.worst <= study.accuracy and (off := field_error.of(here)) < best.field:
            best = Answer(mesh, given.heat, given.conductor, fine, here.errors, None, number, off)
    return best
