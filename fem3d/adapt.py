"""Refining until every quantity is known well enough, level by level (`fem3d.level`)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fem3d import field_error, reach, start
from fem3d.errors import NumericsError, RunawayError
from fem3d.indicators import Indicators
from fem3d.level import Solution, add, examined, goals_at, goals_of, lesser_meshes, solution
from fem3d.operators import assemble
from fem3d.study import Study
from fem3d.time_response import Response, respond
from fem3d.transient import Base, shift, time_constant
from meshes import diffusion, grading
from meshes.bricks import BrickMesh
from meshes.grading import Features

SURELY = 3.0  # times the change of the runaway voltage from mesh to mesh by which a voltage must exceed it
MARKED = 0.9  # part of the estimated error whose intervals are refined
MOST_LEVELS = 40
FAR = 30.0  # times the accuracy: errors above it are refined for in double steps


@dataclass(frozen=True, eq=False)
class Answer:
    """What the last level gives: its solutions, the steady errors by name, the response over time, and the error
    of the steady field over its largest rise (infinite where the study doesn't ask for it)."""

    fine: Solution
    errors: dict[str, float]
    response: Response | None
    levels: int
    field: float = np.inf


def solve(study: Study, transient: bool, progress: Callable[[str], None] = lambda _: None) -> Answer:
    """Levels until every estimated error is within the study's accuracy.

    Raises RunawayError where no steady state exists, NumericsError where the accuracy can't be reached.
    """
    accuracy = study.accuracy
    features = grading.features(study.part.scene)
    mesh = reach.first_mesh(study.part.scene, accuracy, features)
    previous_limit = None
    for level in range(1, MOST_LEVELS):
        reach.check_size(mesh, accuracy, features)
        try:
            fine = solution(study, mesh, reported=True)
        except RunawayError as runaway:
            # The voltage of the fold is a number of this mesh; it stands once another mesh agrees with it.
            known_to = np.inf if previous_limit is None else abs(runaway.limit - previous_limit)
            if abs(study.voltage) - runaway.limit > SURELY * known_to or reach.entries(mesh) > reach.MOST_ENTRIES / 8:
                raise
            previous_limit = runaway.limit
            mesh = mesh.with_degrees(1, 1, 1)
            continue
        progress(f"level {level}: {fine.state.heat.size} unknowns")
        here = examined(study, mesh, fine, features)
        goals, deep = here.goals, here.deep
        if here.accepted(accuracy):
            assert here.lesser is not None
            coarse, low, tall = here.lesser
            if not transient:
                states = (s.state for s in (fine, *here.lesser))
                return Answer(
                    fine, here.errors, None, level, np.inf if study.field is None else field_error.of(*states)
                )
            progress("transient")
            # What hardly depends on the degree in z when steady doesn't depend on it more on the way there.
            in_z = (Base.of_steady(low.state), Base.of_steady(tall.state)) if deep else None
            bases = Base.of_steady(fine.state), Base.of_steady(coarse.state)
            g = shift(time_constant(fine.state), study.earliest)
            response = respond(study, *bases, in_z, g, fine.out)
            if response.accepted:
                return Answer(fine, here.errors, response, level)
            goals = goals_at(study, fine, response.snapshots, features)
            deep = response.deep
        finer = refined(mesh, weighted(goals, here.scales), features, deep)
        reach.check_finer(finer, mesh, features, accuracy)
        mesh = finer
    raise NumericsError(f"an accuracy of {accuracy:g} isn't reached in this scene")


@dataclass(frozen=True, eq=False)
class Course:
    """What the last level of a transient without a steady state gives: its base and the response over time."""

    base: Base
    response: Response
    levels: int


def solve_course(study: Study, progress: Callable[[str], None] = lambda _: None) -> Course:
    """Levels until every estimated error of the transient is within the study's accuracy; NumericsError where that
    can't be reached."""
    accuracy, scene = study.accuracy, study.part.scene
    features = grading.features(scene)
    mesh = diffusion.graded(reach.first_mesh(scene, accuracy, features), scene, study.earliest)
    slowest, generations = study.end, 0
    for level in range(1, MOST_LEVELS):
        reach.check_size(mesh, accuracy, features)
        g = shift(slowest, study.earliest)

        def base_on(mesh: BrickMesh, reported: bool = False, g: float = g) -> Base:
            return start.base(assemble(scene, mesh, reported), g, study.end, accuracy)

        coarse, low, tall = lesser_meshes(mesh)
        fine, coarse_base = base_on(mesh, reported=True), base_on(coarse)
        progress(f"level {level}: {fine.heat.size} unknowns")
        in_z = coarse_base if low is coarse else base_on(low), base_on(tall)
        response = respond(study, fine, coarse_base, in_z, g, None, generations)
        if response.accepted:
            return Course(fine, response, level)
        slowest, generations = min(study.end, response.slowest), response.generations
        rises = response.snapshots
        goals = goals_of(study, fine.heat, fine.conductor, fine.potentials, rises, response.scales, features)
        for name, where in response.local.items():
            add(goals[name], where)
        excess = max(e / response.scales[q] for q, e in response.errors.items()) / accuracy
        finer = refined(mesh, weighted(goals, response.scales), features, response.deep, excess, response.across)
        reach.check_finer(finer, mesh, features, accuracy)
        mesh = finer
    raise NumericsError(f"an accuracy of {accuracy:g} isn't reached in this scene")


def weighted(goals: dict[str, Indicators], scales: dict[str, float]) -> list[np.ndarray]:
    """Per axis, the errors of the intervals in all goals, each relative to its scale."""
    return [np.sum([g.missing[d] / scales[q] for q, g in goals.items()], axis=0) for d in range(3)]


def refined(
    mesh: BrickMesh,
    missing: list[np.ndarray],
    features: Features,
    deep: bool,
    excess: float = 1.0,
    across: bool = True,
) -> BrickMesh:
    """The mesh with those intervals refined that cause most of the error, which is ``excess`` times the accuracy; along
    z only where ``deep``, along x and y only where ``across``."""
    if not deep:
        missing[2][~grading.singular_intervals(mesh.axes[2], features.exponents[2])] = 0.0
    elif not across:
        missing[0][:] = missing[1][:] = 0.0
    ordered = np.sort(np.concatenate(missing))[::-1]
    total = np.cumsum(ordered)
    cut = ordered[min(int(np.searchsorted(total, MARKED * total[-1])), len(ordered) - 1)]
    return grading.refine(mesh, [m >= max(cut, 1e-300) for m in missing], features, 2 if excess > FAR else 1)
