"""Adaptive refinement: solve, estimate the errors, mark and refine, on any `fem3d.adaptivity.mesh.Mesh`.

A level is one mesh with its solutions in the nested spaces and the errors of its goals. Its answer is accepted, or the
mesh is refined by its error indicators. A mesh is refined everywhere if states go beyond a resistivity law, if it is
too coarse for a law, or if only a lower space has no solution. If the heating runs away, it is refined for a state just
below the limit, to confirm the runaway. Any other failure in the highest space ends the run.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from fem3d.adaptivity import nested, responses
from fem3d.adaptivity.brick_mesh import Bricks
from fem3d.adaptivity.goal_errors import Level
from fem3d.adaptivity.mesh import Answer, Indicators, Mesh, estimate_field_error, not_reached
from fem3d.adaptivity.nested import Problems
from fem3d.adaptivity.trace_errors import ROW_SHARE, BoundedResponse, bound_response
from fem3d.results.outputs import Study
from fem3d.solution import transient
from fem3d.solution.newton import CoarseMeshError
from fem3d.solution.steady import ON_PATH
from fem3d.solution.transient import Base
from scenes.errors import BeyondLawError, NumericsError, RunawayError, RunawayInTimeError

# The error of a limit over its change from the mesh before: the sum of all further changes if each is at most 3/4 of
# its predecessor. A larger voltage runs away on any mesh.
SURELY = 3.0
# Fraction of a limit: a mesh is refined for the state at this drive before the limit is believed.
BELOW = 0.95
MOST_LEVELS = 40  # each aims at half the error (`mesh.AIM`): 2^-40 is 1e-12, below rounding
Progress = Callable[[str], None]


def adapt(
    study: Study,
    with_transient: bool,
    progress: Progress = lambda _: None,
    mesh: Mesh | None = None,
    with_steady: bool = True,
) -> Answer:
    """Solve on finer and finer meshes until the estimated error of each quantity is within ``study.accuracy``.

    On each mesh:

    1. Solve the coupled steady state in nested spaces of degrees p and p - 1 (`nested.solve_space`).
    2. Estimate the errors of all quantities by dual-weighted residuals (`goal_errors.bound_errors`).
    3. If a transient is wanted and the steady errors are small enough, solve it and estimate the errors of its traces.
    4. Accept the mesh if all errors are within the accuracy. Otherwise refine the cells with the largest shares.

    An error is relative to the scale of its quantity in `Study`. A scene whose conditions vary in time has no steady
    state: it takes ``with_steady=False``. The first ``mesh`` is by default a grid of bricks. Errors exceed the accuracy
    only where memory or the most unknowns end the refinement, or where traces would need too many rows.

    Raises RunawayError if no steady state is found at the whole drive, RunawayInTimeError if the transient runs away,
    BeyondLawError if states leave the range of a resistivity law, TooLargeError if the default grid exceeds the memory,
    and otherwise NumericsError, for example after `MOST_LEVELS` meshes.
    """
    search = Refinement(study, with_steady, with_transient, progress)
    mesh = (mesh or Bricks.of(study, over_time=not with_steady)).begin()
    for number in range(1, MOST_LEVELS + 1):
        finer: Mesh | None
        try:
            answer, level = search.solve(mesh, number)
        except RunawayError as runaway:
            finer = search.refine_for_runaway(mesh, runaway)
            if finer is None:
                raise
        except (BeyondLawError, CoarseMeshError) as failure:
            finer = mesh.refine_all()
            if finer is None:
                raise failure if isinstance(failure, BeyondLawError) else not_reached(study.accuracy) from None
        else:
            response = answer.response
            if response.accepted if response else max(answer.relative.values(), default=0.0) <= search.tolerance:
                if study.field_accuracy is None or level is None or with_transient:
                    return answer
                return replace(answer, field_error=estimate_field_error(level))
            finer = mesh.refine(indicators(level, response), search.tolerance)
            if finer is None:
                return answer
            # The next level's matrices take the place of these.
            del answer, level, response
        mesh = finer
    raise not_reached(study.accuracy)


def indicators(level: Level | None, response: BoundedResponse | None = None) -> Indicators:
    """Return the indicators to refine by, of a steady level, of a response, or of both."""
    goals = [*(response.goals if response else ()), *(level.goals.values() if level else ())]
    relative = response.relative if response else level.relative if level else {}
    return Indicators(goals, max(relative.values()), level.record if level else None)


@dataclass
class Refinement:
    """The request, and the state carried from one level to the next.

    Attributes
    ----------
    limit, change : largest drive with a steady state on the last mesh, and its change from the mesh before
    ran_away : whether a transient ran away on an earlier mesh
    """

    study: Study
    with_steady: bool
    with_transient: bool
    progress: Progress
    limit: float | None = None
    change: float = np.inf
    ran_away: bool = False

    @property
    def tolerance(self) -> float:
        """The largest relative error of an accepted level; the rows of traces take their share of the accuracy."""
        return self.study.accuracy * (1 - ROW_SHARE) if self.with_transient else self.study.accuracy

    def solve(self, mesh: Mesh, number: int) -> tuple[Answer, Level | None]:
        """Solve and examine the steady state on a mesh, and its response if the steady level is accurate enough."""
        problems, level, response = mesh.problems(), None, None
        fine = nested.solve_space(self.study, problems) if self.with_steady else None
        self.progress(f"level {number}: {problems.heat.size} unknowns")
        if fine is not None:
            level = mesh.examine(self.study, problems, fine)
        if self.with_transient and (level is None or level.worst <= self.tolerance):
            response = self._respond(mesh, problems, level)
        steady, errors = (level.fine, level.errors) if level else (None, {})
        relative = response.relative if response else level.relative if level else {}
        return Answer(mesh, problems.heat, problems.conductor, steady, errors, relative, response, number), level

    def _respond(self, mesh: Mesh, problems: Problems, level: Level | None) -> BoundedResponse:
        """Solve the transient in Krylov fields, about the steady state if there is one."""
        study = self.study
        shift = transient.shift(min(study.end, transient.slowest(problems.heats[0])), study.earliest)
        if level is not None:
            self.progress("transient")
            bases = [Base.of_steady(solution.state, study.accuracy) for solution in (level.fine, level.low)]
        else:
            bases = [Base.bare(problems.heats[k], problems.conductors[k]) for k in (-1, -2)]
            if not bases[0].nonlinear:  # hot states are searched in the lower space alone
                lower = problems.heats[-2], problems.conductors[-2]
                low, hot = responses.search_hot_states(*lower, shift, study.earliest, study.end, study.accuracy)
                bases = [responses.make_base(problems.heat, problems.conductor, hot), low]
        return bound_response(study, problems, bases, shift, mesh.estimator, level, mesh.last)

    def refine_for_runaway(self, mesh: Mesh, runaway: RunawayError) -> Mesh | None:
        """Refine the mesh for the state just below the limit. None if the limit is accurate and the drive exceeds it by
        more than its error, `SURELY` times its change from the mesh before and the error by quadratures."""
        if isinstance(runaway, RunawayInTimeError):
            return self._refine_for_runaway_in_time(mesh)
        before, self.change = self.change, np.inf if self.limit is None else abs(runaway.limit - self.limit)
        self.limit, change, by_quadrature = runaway.limit, self.change, runaway.error
        # Where paths turn back and forth beyond the same limit on three meshes, a finer one shows no more.
        if by_quadrature == np.inf and max(change, before) <= ON_PATH * runaway.limit:
            return None
        error = SURELY * change + by_quadrature
        if np.isfinite(change):
            runaway.error = max(SURELY * change, ON_PATH * runaway.limit) + by_quadrature
        confirmed = runaway.whole - runaway.limit > error
        if confirmed and not runaway.largest:
            return None  # states beyond the limit exist, but are too hot
        # A choice: a limit whose last two changes are within 2 %, which its message states, needs no such state.
        if confirmed and SURELY * max(change, before) + by_quadrature <= 0.02 * runaway.limit:
            runaway.error = SURELY * max(change, before) + by_quadrature
            return None
        below = min(max(BELOW, 1 - error / max(runaway.limit, 1e-300)), 1 - ON_PATH)
        fraction = below * runaway.limit / runaway.whole
        problems = mesh.problems().driven(fraction, not runaway.unit)
        if fraction <= 0:
            return mesh.refine_all()
        try:
            level = mesh.examine(self.study, problems, nested.solve_space(self.study, problems))
        except NumericsError:
            return mesh.refine_all()
        # The rise below a pole or a fold of the drive is off by the limit's error over its distance.
        allowed = self.study.accuracy / (1 - below)
        if confirmed and level.worst <= allowed and change <= self.study.accuracy * runaway.limit:
            return None
        # A level may pass already and its limit change: its error is to fall by half at least.
        return mesh.refine(indicators(level), min(allowed, level.worst) / 2)

    def _refine_for_runaway_in_time(self, mesh: Mesh) -> Mesh | None:
        """Refine until the steady state is resolved that constant inputs lead to, or confirmed not to exist."""
        problems = mesh.problems()
        try:
            level = mesh.examine(self.study, problems, nested.solve_space(self.study, problems))
        except RunawayError as steady:
            return self.refine_for_runaway(mesh, steady)
        except NumericsError:
            level = None  # inputs vary, or heat does not leave
        if level is not None and level.worst > self.tolerance:
            return mesh.refine(indicators(level), self.tolerance)
        before, self.ran_away = self.ran_away, True
        return None if before else mesh.refine_all()
