"""Refining until every quantity is known well enough, level by level, on any `fem3d.adaptivity.mesh.Mesh`.

A level is solved and judged; the verdict is to accept its answer, to refine the mesh for what its readings miss, to
raise it a little everywhere, or to ask another mesh whether heating really runs away.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from fem3d.adaptivity import field_error, nested, reach, transient_base
from fem3d.adaptivity.brick_mesh import Bricks
from fem3d.adaptivity.estimator import Spread
from fem3d.adaptivity.goal_errors import Level
from fem3d.adaptivity.mesh import Answer, Indicators, Mesh
from fem3d.adaptivity.nested import Problems
from fem3d.adaptivity.reach import not_reached
from fem3d.adaptivity.trace_errors import ROW_SHARE, LowerSpaceError, Response
from fem3d.results.study import Study
from fem3d.solution import transient
from fem3d.solution.steady import SteadyState
from fem3d.solution.transient import Base
from scenes.errors import BeyondLawError, NumericsError, RunawayError, RunawayInTimeError

# A voltage above that of the fold runs away on any mesh if it lies further above it than this many times the change of
# the fold's voltage from the mesh before: what all further changes add up to, each at most 2/3 of the one before.
SURELY = 3.0
# Of a limit: the drives whose states a mesh is refined for before the limit is believed, the second if the first has
# none. A limit that changes by less than `NAMED` is not off by a quarter: a drive that is so `FAR` above needs no more.
BELOW, NAMED, FAR = (0.99, 0.95), 1e-3, 1.25
MOST_LEVELS = 40
Progress = Callable[[str], None]


class Verdict(NamedTuple):
    """What is to be done after a level: "accept" its ``answer``; "refine" the mesh for what its ``goals`` miss, which
    ``falls`` with the degree (`estimate.falling`), or for as much more as the ``worst`` of the ``relative`` errors
    says; "raise" it, as a lower space has no steady state although the fine one has, or as its states go ``beyond`` the
    law of a resistivity; or see whether another mesh confirms the ``runaway``."""

    action: Literal["accept", "refine", "raise", "runaway"]
    answer: Answer | None = None
    level: Level | None = None
    goals: Sequence[Spread] = ()
    falls: Spread | None = None
    relative: Mapping[str, float] = {}
    runaway: RunawayError | None = None
    beyond: BeyondLawError | None = None

    @property
    def indicators(self) -> Indicators:
        """The indicators to refine by."""
        worst = max(self.relative.values(), default=np.inf)
        return Indicators(self.goals, self.falls, worst, self.level.record if self.level else None)


def adapt(
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
    search, falling = Search(study, with_steady, with_transient, progress), reach.Falling(study.accuracy)
    mesh = mesh or Bricks.of(study, over_time=not with_steady)
    mesh = mesh.begin()
    for number in range(1, MOST_LEVELS):
        verdict = search.judge(mesh, number)
        if verdict.action == "accept":
            assert verdict.answer is not None
            if study.field is None or verdict.level is None or with_transient:
                return verdict.answer
            return field_error.improved(study, verdict.answer, verdict.level, progress)
        finer: Mesh | None
        if verdict.action == "refine":
            assert verdict.answer is not None
            falling.check(verdict.answer.heat.size, verdict.relative)
            finer = mesh.refine(verdict.indicators, search.enough)
        elif verdict.runaway is not None:
            finer = search.refine_for_runaway(mesh, verdict.runaway)
        else:
            finer = mesh.refine_all()
        if finer is None:
            if failure := verdict.runaway or verdict.beyond:
                raise failure
            if verdict.answer is None:
                break
            return verdict.answer
        mesh = finer
        # The next level's matrices take the place of these.
        del verdict
    raise not_reached(study.accuracy)


@dataclass
class Search:
    """What one level hands to the next: the limit of the last mesh's runaway, whether a transient ran away, and the
    slowest time constant (s) and the generations of fields of a transient without steady state; the
    steady state ``near`` that of the next mesh."""

    study: Study
    with_steady: bool
    with_transient: bool
    progress: Progress
    fold: float | None = None
    ran_away: bool = False
    slowest: float = np.inf
    generations: int = 0
    near: SteadyState | None = None

    @property
    def enough(self) -> float:
        """The relative error that a level may have: no trace is known better than where it ends, and its rows take
        their share."""
        return self.study.accuracy * (1 - ROW_SHARE) if self.with_transient else self.study.accuracy

    def judge(self, mesh: Mesh, number: int) -> Verdict:
        """The verdict on a mesh, from its steady level, and from its response where that level is good enough."""
        problems = mesh.problems()
        fine = level = response = None
        try:
            if self.with_steady:
                fine = nested.solution(self.study, problems, near=self.near)
                # Of a linear problem nobody asks for it, and it holds the factors of its mesh.
                self.near = fine.state if problems.follows else None
                level = mesh.examine(self.study, problems, fine)
            self.progress(f"level {number}: {problems.heat.size} unknowns")
            if self.with_steady and level is None:
                return Verdict("raise")
            if self.with_transient and (level is None or level.worst <= self.enough):
                response = self._respond(mesh, problems, level)
        except RunawayError as runaway:
            return Verdict("runaway", runaway=runaway)
        except BeyondLawError as beyond:
            return Verdict("raise", beyond=beyond)
        except LowerSpaceError:
            return Verdict("raise")
        errors = level.errors if level else {}
        told = level.fine if level else fine
        answer = Answer(mesh, problems.heat, problems.conductor, told, errors, response, number)
        relative = response.relative if response else level.relative if level else {}
        if response.accepted if response else max(relative.values(), default=0.0) <= self.enough:
            return Verdict("accept", answer, level)
        goals = [*(response.goals if response else ()), *(level.goals.values() if level else ())]
        falls = response.falls if response else level.falls if level else None
        return Verdict("refine", answer, level, goals=goals, falls=falls, relative=relative)

    def _respond(self, mesh: Mesh, problems: Problems, level: Level | None) -> Response:
        """The response on a mesh, in fields about its steady state; where that isn't asked for, about what the slowest
        time constant of the mesh before tells."""
        study = self.study
        if level is not None:
            self.progress("transient")
            shift = transient.shift(transient.time_constant(level.fine.state), study.earliest)
            bases = [Base.of_steady(solution.state) for solution in (level.fine, level.low)]
            return mesh.respond(study, problems, bases, shift, level, self.generations)
        shift = transient.shift(min(study.end, self.slowest), study.earliest)
        bare = [Base.bare(*pair) for pair in zip(problems.heats, problems.conductors, strict=True)][::-1]
        linear = not bare[0].follows
        bases = transient_base.nested(problems, shift, study.end, study.accuracy) if linear else bare
        response = mesh.respond(study, problems, bases, shift, None, self.generations)
        self.slowest, self.generations = response.slowest, response.generations
        return response

    def refine_for_runaway(self, mesh: Mesh, runaway: RunawayError) -> Mesh | None:
        """Refine the mesh to confirm a runaway; None where it is the scene's own, with a limit that is accurate."""
        if isinstance(runaway, RunawayInTimeError):
            before, self.ran_away = self.ran_away, True
            return None if before else mesh.refine_all()
        change = np.inf if self.fold is None else abs(runaway.limit - self.fold)
        self.fold = runaway.limit
        # Where heat alone drives a scene the limit is a fraction of it.
        drive = abs(self.study.voltage) or 1.0
        confirmed = drive - runaway.limit > SURELY * change
        if confirmed and not runaway.largest:
            return None  # states beyond the limit exist, but are too hot
        if confirmed and drive > FAR * runaway.limit and change <= NAMED * runaway.limit:
            return None
        levels = (self._level_below(mesh, fraction * runaway.limit / drive) for fraction in BELOW)
        level = next((level for level in levels if level is not None), None)
        if level is not None and level.worst > self.enough:
            indicators = Indicators([*level.goals.values()], level.falls, level.worst, level.record)
            return mesh.refine(indicators, self.enough)
        return None if confirmed and level is not None else mesh.refine_all()

    def _level_below(self, mesh: Mesh, fraction: float) -> Level | None:
        """Solve at a ``fraction`` of the drive; None where a space has no steady state."""
        given = mesh.problems().driven(fraction)
        try:
            return mesh.examine(self.study, given, nested.solution(self.study, given)) if fraction > 0 else None
        except NumericsError:
            return None
