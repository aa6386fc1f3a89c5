"""A level of the search for an accuracy: solutions on a mesh and on lesser ones, and the errors that they tell.

A level is four solutions on the same cells: the fine one, whose numbers are reported; a coarse one, of degrees lower
by one in x and y; a low one, of degrees lower by two, and a tall one that differs from it by degrees higher by one in
z. Degrees converge so fast that the difference of fine and coarse bounds the error in x and y with room to spare: over
sinks of all kinds that error came out between a tenth and a half of it. The difference of tall and low is the error in
z itself. Where a difference happens to vanish, the dual-weighted estimate of the fine solution alone takes over.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fem3d import bubbles, indicators, outputs, reach, steady
from fem3d.conductor import Conductor
from fem3d.errors import NumericsError
from fem3d.indicators import Indicators
from fem3d.operators import HeatProblem, assemble
from fem3d.outputs import Outputs
from fem3d.steady import SteadyState
from fem3d.study import Quantities, Study
from meshes.bricks import BrickMesh
from meshes.grading import Features

IN_PLANE = 1.0  # the error in x and y over the difference of fine and coarse, at most
IN_DEPTH = 1.5  # the error in z over the difference of tall and low, at most
SHARPEN = 0.3  # of the difference in x and y: if that in z is larger, it is measured at the higher degrees
NEGLIGIBLE = 0.2  # part of the accuracy below which an error in z isn't worth refining
OF_LARGEST = 1.0  # every temperature may be off by the largest difference of any, in K or relative to its scale
OF_ESTIMATE = 1.0  # the error over its dual-weighted estimate, at most
CLEARLY = 2.0  # times the accuracy: estimates above it need no second solution to refine


@dataclass(frozen=True, eq=False)
class Solution:
    """The steady state on one mesh, what is read off it, and its quantities."""

    state: SteadyState
    out: Outputs
    quantities: Quantities


@dataclass(frozen=True, eq=False)
class Level:
    """What is known of the solution on a mesh: where the goals' errors come from, the quantities' scales, whether the
    error in z matters, the coarse, low and tall solutions and the steady errors by name; without the last two where the
    goals alone call for a finer mesh, or where a lesser mesh has no steady state."""

    goals: dict[str, Indicators]
    scales: dict[str, float]
    deep: bool
    lesser: tuple[Solution, Solution, Solution] | None
    errors: dict[str, float]

    def accepted(self, accuracy: float) -> bool:
        """Whether every error is known, and below an accuracy."""
        worst = max((e / self.scales[q] for q, e in self.errors.items()), default=0.0)
        return self.lesser is not None and worst <= accuracy


def examined(study: Study, mesh: BrickMesh, fine: Solution, features: Features) -> Level:
    """The level of a fine solution. Raises NumericsError where singular edges put the accuracy out of reach."""
    accuracy, scales = study.accuracy, study.steady_scales(fine.out)
    goals = goals_at(study, fine, [], features)
    reach.check_edges(mesh, goals, scales, features, accuracy)
    estimate = {name: goals[name].remaining for name in goals}
    clear = max((e / scales[q] for q, e in estimate.items()), default=0.0) > CLEARLY * accuracy
    lesser = None if clear else _lesser(study, mesh, fine)
    if lesser is None:
        return Level(goals, scales, True, None, {})
    coarse, low, tall = lesser
    depth = {q: IN_DEPTH * abs(float(tall.quantities[q] - low.quantities[q])) for q in low.quantities}
    deep = max((depth[q] / scales[q] for q in depth), default=0.0) > NEGLIGIBLE * accuracy
    if not deep:
        estimate = {name: goals[name].but_depth for name in goals}
    errors = steady_errors(study, fine, coarse.quantities, depth, estimate, scales)
    return Level(goals, scales, deep, lesser, errors)


def solution(study: Study, mesh: BrickMesh, reported: bool = False, follow: bool | None = None) -> Solution:
    """The steady state on a mesh, with care for the heat balance where it will be reported; ``follow`` as of
    `steady.coupled`."""
    state = steady.solve(assemble(study.part.scene, mesh, reported), study.voltage, study.accuracy, follow)
    out = outputs.of_steady(state, study.part)
    return Solution(state, out, study.steady(out))


def lesser_meshes(mesh: BrickMesh) -> tuple[BrickMesh, BrickMesh, BrickMesh]:
    """The coarse, the low and the tall mesh to a fine one; the low one is the coarse one where degrees are low."""
    coarse = mesh.with_degrees(-1, -1, 0)
    low = mesh.with_degrees(-2, -2, 0, least=2)
    if all((a.degrees == b.degrees).all() for a, b in zip(low.axes, coarse.axes, strict=True)):
        low = coarse
    return coarse, low, low.with_degrees(0, 0, 1)


def _lesser(study: Study, mesh: BrickMesh, fine: Solution) -> tuple[Solution, Solution, Solution] | None:
    """The coarse, the low and the tall solution; None where any has no steady state although the fine one has."""
    coarse_mesh, low_mesh, tall_mesh = lesser_meshes(mesh)
    # Low degrees follow a current's pattern badly: only where the fine solution does is there an error in that.
    follow = fine.state.follows_pattern
    try:
        coarse = solution(study, coarse_mesh, follow=follow)
        low = coarse if low_mesh is coarse_mesh else solution(study, low_mesh, follow=follow)
        tall = solution(study, tall_mesh, follow=follow)
        if low is not coarse and _apart(study, tall, low) > SHARPEN * _apart(study, fine, coarse):
            low, tall = coarse, solution(study, mesh.with_degrees(-1, -1, 1), follow=follow)
        return coarse, low, tall
    except NumericsError:
        return None


def _apart(study: Study, a: Solution, b: Solution) -> float:
    """The largest difference of their rises (of all quantities where there are none), relative to the scales."""
    scales = study.steady_scales(b.out)
    apart = (abs(float(a.quantities[q] - b.quantities[q])) / scales[q] for q in (study.rises or scales))
    return max(apart, default=0.0)


def steady_errors(
    study: Study,
    solved: Solution,
    coarse: Quantities,
    depth: dict[str, float],
    estimate: dict[str, float],
    scales: dict[str, float],
) -> dict[str, float]:
    """Estimated error of each quantity of the fine solution, in its unit.

    ``depth`` are errors in z, ``estimate`` the dual-weighted ones of the goals, in the quantities' units.
    """
    fine = solved.quantities
    difference = {name: abs(float(fine[name] - coarse[name])) for name in fine}
    unit = {name: 1.0 if study.alike else scales[name] for name in study.rises}
    largest = max((difference[name] / unit[name] for name in study.rises), default=0.0)
    caution = {name: study.caution.get(name, 1.0) for name in fine}
    errors = {name: IN_PLANE * caution[name] * d for name, d in difference.items()}
    for name, found in estimate.items():
        errors[name] = max(errors[name], OF_ESTIMATE * found)
    for name in study.rises:
        errors[name] = max(errors[name], OF_LARGEST * largest * unit[name])
    for name, goal in study.ratios.items():
        share = OF_ESTIMATE * estimate[goal] / abs(float(fine[goal]))
        errors[name] = max(errors[name], share * abs(float(fine[name])))
    for name, probe in study.goals.items():
        errors[name] += float(solved.out.get(f"doubt:{probe}", 0.0))
    # What the iteration left, and rounding in the solves; nothing is known better than that.
    left = solved.state.unsettled + 1e-10
    return {name: e + caution[name] * depth[name] + left * scales[name] for name, e in errors.items()}


def goals_at(study: Study, fine: Solution, snapshots: list[np.ndarray], features: Features) -> dict[str, Indicators]:
    """`goals_of` a steady solution and of some rises on the way there, with what the next degrees would add where a
    probe reads (`fem3d.bubbles`)."""
    state = fine.state
    potentials = [] if state.potential is None else [state.potential]
    scales = study.steady_scales(fine.out)
    goals = goals_of(study, state.heat, state.conductor, potentials, [state.rise, *snapshots], scales, features)
    instant = bubbles.Instant.steady(state)
    for name, where in bubbles.at_goals(study, state.heat, state.conductor, [instant]).items():
        add(goals[name], where)
    return goals


def add(goal: Indicators, where: list[tuple[int, int, float]]) -> None:
    """Add to a goal's indicators what was found by (axis, interval, K), in place."""
    for d, i, kelvin in where:
        goal.missing[d][i] += kelvin


def goals_of(
    study: Study,
    heat: HeatProblem,
    conductor: Conductor | None,
    potentials: list[np.ndarray],
    rises: list[np.ndarray],
    scales: dict[str, float],
    features: Features,
) -> dict[str, Indicators]:
    """Where the errors of the study's goals come from, the last of the rises being the one that extremes are read at;
    ``scales`` are how large what the current causes in a quantity may be."""
    by_name = {p.name: p for p in study.part.scene.probes}
    rows = {q: outputs.goal(heat, by_name[probe], rises[-1]) for q, probe in study.goals.items()}
    return indicators.of_goals(heat, conductor, potentials, rises, rows, scales, features)
