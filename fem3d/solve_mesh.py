"""The 3D model of a scene on a mesh file: degrees 1 and 2, a refined mesh where that is cheap, the result, the plan.

The mesh is the user's, so its levels are few, and errors come from their differences: the difference of two levels
bounds the error of the finer one where errors at least halve from one to the other. From degree 1 to 2 they do, even at
edges; on halved cells just so where a field has a singularity of order one half.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from fem3d import currents, level, probe_quantities, solve_scene, start, time_response, transient
from fem3d.groups import groups
from fem3d.heat import HeatProblem
from fem3d.level import Problems, Solution
from fem3d.mesh_fields import MeshFields
from fem3d.probes import reading
from fem3d.study import Study
from fem3d.time_response import Marched
from meshes import symmetry
from meshes.grouped.check import check, remarks
from meshes.grouped.place import Placed
from meshes.grouped.read import read
from meshes.grouped.refine import refine
from scenes import physics
from scenes.model import MeshScene
from scenes.plan import Step
from scenes.result import Estimate, Result, Traces

LARGEST_REFINED = 60_000  # unknowns of a refined mesh; above, the mesh is taken as it is
BETWEEN_DEGREES, BETWEEN_MESHES = 1.0, 1.25  # the error of a level over its difference from the one before, at most
OF_GRADIENT = 3.0  # times that where a flow is an integral of the gradient, which converges more slowly than all else
OVER_TIME = 1.5  # times that in a transient
LEAST = 0.2  # of the fields' own difference: a difference of values may vanish by chance
ROUNDING = 1e-9


def solve(scene: MeshScene, progress: Callable[[str], None] | None = None) -> Result:
    """The probes of a scene on its mesh, steady or over time, every number with its estimated error.

    Names and units as of `fem3d.solve_scene.solve`. The mesh is the user's: where the errors exceed the accuracy of the
    scene, a warning says so. Raises SceneError where mesh and scene do not fit, RunawayError where no steady
    state exists, NumericsError where the numerics fail.
    """
    if not scene.steady and not physics.heat(scene):
        return currents.over_time(scene, lambda alone: solve(alone, progress), plan(scene))
    say = progress or (lambda _: None)
    placed = place(scene)
    study = probe_quantities.study(scene, symmetry.uncut(scene, [m.name for m in placed.materials]))  # type: ignore[arg-type]
    found = _steady(placed, study, say) if scene.steady else _transient(placed, study, say)
    found.details["warnings"] += remarks(placed.mesh)
    return found


def place(scene: MeshScene) -> Placed:
    return check(scene, read(scene.path, scene.unit))


@dataclass(frozen=True, eq=False)
class Space:
    """One of the spaces that a scene is solved in: the problems of a mesh, and which of them."""

    problems: Problems
    degree: int
    refined: bool

    @property
    def heat(self) -> HeatProblem:
        """The heat problem."""
        return self.problems.heats[self.degree - 1]

    @property
    def words(self) -> str:
        """What it is, for a person."""
        return f"degree {self.degree}{' on a mesh refined once' if self.refined else ''}"

    def caution(self, study: Study) -> dict[str, float]:
        """By what the difference of each quantity to the space before is multiplied."""
        known = BETWEEN_MESHES if self.refined else BETWEEN_DEGREES
        probes = self.problems.domain.probes

        def gradient(name: str) -> bool:
            probe = probes[name]
            if probe.quantity not in ("heat_flow", "current"):
                return False
            how = reading(self.heat, probe)
            return how.gradient or (probe.quantity == "current" and not how.boundaries)

        return {n: known * (OF_GRADIENT if gradient(p) else 1.0) for n, p in study.goals.items()}


def spaces(placed: Placed) -> Iterator[Space]:
    """Those that are worth their time, from coarse to fine."""
    given = level.problems(groups(placed), placed.scene.accuracy)
    yield Space(given, 1, False)
    yield Space(given, 2, False)
    if _refines(placed):
        yield Space(level.problems(groups(Placed(placed.scene, refine(placed.mesh))), placed.scene.accuracy), 2, True)


def _refines(placed: Placed) -> bool:
    # A refined mesh has eight times the cells, and close to eight times the nodes.
    return 8 * placed.mesh.mesh.nvertices * (7 if placed.mesh.simplex else 8) <= LARGEST_REFINED


Judged = tuple[dict[str, float], dict[str, float]]
"""The errors of quantities, and what they are relative to."""


class Found(NamedTuple):
    """What the last space gives, with the errors of each quantity and what they are relative to."""

    space: Space
    answer: Any
    errors: dict[str, float]
    scales: dict[str, float]
    levels: int


def _refined(
    placed: Placed,
    say: Callable[[str], None],
    accuracy: float,
    solved: Callable[[Space, Any], Any],
    compared: Callable[[Space, Any, Space, Any], Judged],
) -> Found:
    """As many spaces as the accuracy takes and the mesh allows: ``solved`` answers one, knowing the answer before, and
    ``compared`` gives the errors, with their scales, of two in a row."""
    before: Found | None = None
    for number, space in enumerate(spaces(placed), 1):
        say(f"{space.words}: {space.heat.free} unknowns")
        answer = solved(space, before and before.answer)
        errors, scales = compared(space, answer, before.space, before.answer) if before else ({}, {})
        before = Found(space, answer, errors, scales, number)
        if errors and max(e / scales[n] for n, e in errors.items()) <= accuracy:
            break
    assert before is not None
    return before


def _apart(vertices: int, pairs: list[tuple[np.ndarray, np.ndarray]]) -> float:
    """The largest relative difference of some fields (..., functions), as root of the mean square over the corners of
    the file's cells, which all spaces have first."""
    found = 0.0
    for a, b in ((x[..., :vertices], y[..., :vertices]) for x, y in pairs):
        size = float(np.sqrt((a**2).mean()))
        if size:
            found = max(found, float(np.sqrt(((a - b) ** 2).mean())) / size)
    return found


def _steady(placed: Placed, study: Study, say: Callable[[str], None]) -> Result:
    def compared(space: Space, fine: Solution, coarser: Space, low: Solution) -> Judged:
        scales, caution = study.steady_scales(fine.out), space.caution(study)
        pairs = [(space.heat.field(fine.state.rise), coarser.heat.field(low.state.rise))]
        if fine.state.conductor is not None:
            pairs.append((fine.state.hot_potential, low.state.hot_potential))
        least = LEAST * _apart(placed.mesh.mesh.nvertices, pairs) + ROUNDING + fine.state.unsettled
        apart = time_response.distance(fine.quantities, low.quantities)
        return {n: caution[n] * d + least * scales[n] for n, d in apart.items()}, scales

    def solved(space: Space, before: Solution | None) -> Solution:
        return level.solution(study, space.problems, space.degree - 1)

    found = _refined(placed, say, study.accuracy, solved, compared)
    fine: Solution = found.answer
    details = _details(placed, found, found.errors, study) | solve_scene.of_steady(fine.out)
    details["fields"] = MeshFields(placed, found.space.heat, fine.state, None)
    details |= {"study": study, "solution": fine}
    return Result("fem3d", {n: Estimate(float(v), found.errors[n]) for n, v in fine.quantities.items()}, None, details)


def _transient(placed: Placed, study: Study, say: Callable[[str], None]) -> Result:
    times = np.array([0.1, 1.0]) * study.end

    def solved(space: Space, before: Marched | None) -> Marched:
        slowest = study.end if before is None else 1 / max(before.answer.trajectory.rates.min(), 1e-300)
        shift = transient.shift(min(study.end, slowest), study.earliest)
        own = space.problems.conductors[space.degree - 1]
        return time_response.marched(study, start.of(space.heat, own, shift, study.end, study.accuracy), shift, None)

    def compared(space: Space, fine: Marched, coarser: Space, low: Marched) -> Judged:
        pairs = zip(*(s.heat.field(m.answer.rises(times)) for s, m in ((space, fine), (coarser, low))), strict=True)
        least, caution = LEAST * _apart(placed.mesh.mesh.nvertices, list(pairs)), space.caution(study)
        errors = {}
        for n, apart in time_response.distance(fine.there, low.there).items():
            doubt = float(np.max(fine.out.get(f"doubt:{n}", 0.0)))
            errors[n] = OVER_TIME * caution[n] * apart + least * fine.scales[n] + fine.lost[n] + doubt
        return errors, fine.scales

    found = _refined(placed, say, (1 - time_response.ROW_SHARE) * study.accuracy, solved, compared)
    fine: Marched = found.answer
    made = time_response.with_rows(study, fine.answer, fine.reduced, found.errors, found.scales, fine.generations)
    details = _details(placed, found, made.errors, study) | solve_scene.over_time(study, made)
    details["fields"] = MeshFields(placed, found.space.heat, None, fine.answer)
    details["transient"] = fine.answer
    return Result("fem3d", {}, Traces(made.times, made.traces, made.errors), details)


def _details(placed: Placed, found: Found, errors: dict[str, float], study: Study) -> dict[str, Any]:
    space, mesh = found.space, placed.mesh
    whole = space.problems.domain.space
    own = solve_scene.described(study, space.heat, space.problems.conductors[space.degree - 1], found.levels)
    return own | {
        "scales": found.scales,
        "symmetry": "whole",
        "warnings": _warnings({n: e / found.scales[n] for n, e in errors.items()}, study, space),
        "mesh": {
            "cells": mesh.count, "cell_type": mesh.file_type, "nodes": space.heat.size, "refined": space.refined,
            "lowest_degree": space.degree, "highest_degree": space.degree,
            "volume_m3": float(whole.on(np.arange(whole.mesh.t.shape[1])).weights.sum()),
            "volume_groups": sorted(mesh.volumes), "surface_groups": sorted(mesh.surfaces),
        },
        "plan": _plan(placed, space),
    }  # fmt: skip


def _warnings(relative: dict[str, float], study: Study, space: Space) -> list[str]:
    over = {name: e for name, e in relative.items() if e > study.accuracy}
    if not over:
        return []
    worst = max(over, key=lambda name: over[name])
    shown = f"{over[worst]:.1g}" if over[worst] > 2 * study.accuracy else f"{over[worst]:.3g}"
    if float(shown) <= study.accuracy:
        shown = f"just over {shown}"
    names = f"{len(over)} of {len(relative)} probes are" if len(over) > 1 else f'probe "{worst}" is'
    return [
        f"{names} less accurate than the {study.accuracy:g} asked for, {worst} with an estimated {shown}, on "
        f"this mesh with elements of {space.words}; give a finer mesh, above all at edges, corners and the rims of "
        "electrodes and fixed temperatures"
    ]


def plan(scene: MeshScene) -> tuple[Step, ...]:
    """What `solve` will do, before it does it; reads the mesh."""
    return _plan(place(scene), None)


def _plan(placed: Placed, space: Space | None) -> tuple[Step, ...]:
    """The lines; with a space, as it turned out."""
    scene, mesh = placed.scene, placed.mesh
    steps = [Step("mesh", "done", f"{mesh.count} {mesh.file_type} cells of {scene.file}, as they are")]
    if not _refines(placed):
        steps.append(Step("refinement", "skipped", "the mesh has too many cells; errors between degrees 1 and 2"))
    elif space is not None and not space.refined:
        steps.append(Step("refinement", "skipped", "degrees 1 and 2 agree within the accuracy on the mesh as it is"))
    else:
        steps.append(Step("refinement", "done", "every cell into eight, once, where degrees 1 and 2 differ by more"))
    if physics.electric(scene) and any(b.kind == "voltage" for b in scene.boundaries):
        electric = Step("electric problem", "done", "in the cells that conduct")
    else:
        electric = Step("electric problem", "skipped", "there is no electrode")
    reached = f"errors estimated, and compared with {scene.accuracy:g}"
    return *steps, solve_scene.heat_step(scene), electric, *solve_scene.states(scene, reached)
