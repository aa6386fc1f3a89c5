"""The 3D model of a scene on a mesh file: degrees 1 and 2, a refined mesh where that is cheap, the result, the plan.

The mesh is the user's, so its levels are few, and errors come from their differences: the difference of two levels
bounds the error of the finer one where errors at least halve from one to the other. From degree 1 to 2 they do, even at
edges; on halved cells just so where a field has a singularity of order one half.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from fem3d import currents, level, probe_quantities, solve_scene, start, time_response, transient
from fem3d.groups import groups
from fem3d.heat import HeatProblem
from fem3d.level import Problems, Solution
from fem3d.mesh_fields import MeshFields
from fem3d.plan import of_free
from fem3d.probes import reading
from fem3d.study import Study
from fem3d.time_response import Marched, Response
from meshes import symmetry
from meshes.grouped.check import check, remarks
from meshes.grouped.place import Placed
from meshes.grouped.read import read
from meshes.grouped.refine import refine
from scenes import physics
from scenes.model import MeshScene
from scenes.plan import Step, noted, step
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
    placed = _placed(scene)
    study = probe_quantities.study(scene, symmetry.uncut(scene, [m.name for m in placed.materials]))  # type: ignore[arg-type]
    found = _steady(placed, study, say) if scene.steady else _transient(placed, study, say)
    found.details["warnings"] += remarks(placed.mesh)
    return found


def _placed(scene: MeshScene) -> Placed:
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
        probes = {p.name: p for p in self.problems.domain.scene.probes}

        def gradient(name: str) -> bool:
            probe = probes[name]
            if probe.quantity not in ("heat_flow", "current"):
                return False
            how = reading(self.heat, probe)
            return how.gradient or (probe.quantity == "current" and not how.boundaries)

        return {n: known * (OF_GRADIENT if gradient(p) else 1.0) for n, p in study.goals.items()}


def _spaces(placed: Placed) -> Iterator[Space]:
    """Those that are worth their time, from coarse to fine."""
    given = level.problems(groups(placed), placed.scene.accuracy)
    yield Space(given, 1, False)
    yield Space(given, 2, False)
    if _refines(placed):
        yield Space(level.problems(groups(Placed(placed.scene, refine(placed.mesh))), placed.scene.accuracy), 2, True)


def _refines(placed: Placed) -> bool:
    # A refined mesh has eight times the cells, and close to eight times the nodes.
    return 8 * placed.mesh.mesh.nvertices * (7 if placed.mesh.simplex else 8) <= LARGEST_REFINED


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
    before: tuple[Space, Solution] | None = None
    errors: dict[str, float] = {}
    scales: dict[str, float] = {}
    count = 0
    for space in _spaces(placed):
        if errors and max(e / scales[n] for n, e in errors.items()) <= study.accuracy:
            break
        say(f"{space.words}: {space.heat.free} unknowns")
        fine, count = level.solution(study, space.problems, space.degree - 1), count + 1
        if before is not None:
            scales, low = study.steady_scales(fine.out), before[1]
            pairs = [(_field(space, fine), _field(before[0], low))]
            if fine.state.conductor is not None:
                pairs.append((fine.state.hot_potential, low.state.hot_potential))
            least = LEAST * _apart(placed.mesh.mesh.nvertices, pairs) + ROUNDING + fine.state.unsettled
            caution = space.caution(study)
            errors = {
                n: caution[n] * abs(float(v - low.quantities[n])) + least * scales[n]
                for n, v in fine.quantities.items()
            }
        before = space, fine
    assert before is not None, "there are two spaces at least"
    space, fine = before
    found = {n: Estimate(float(v), errors[n]) for n, v in fine.quantities.items()}
    details = _details(placed, space, {n: e / scales[n] for n, e in errors.items()}, study, count)
    imbalance = solve_scene.imbalance(fine.out)
    details |= {"steps": 0, "energy_imbalance": imbalance, "transient_imbalance": None}
    details["fields"] = MeshFields(placed, space.heat, fine.state, None)
    return Result("fem3d", found, None, details)


def _field(space: Space, solution: Solution) -> np.ndarray:
    return space.heat.field(solution.state.rise)


def _transient(placed: Placed, study: Study, say: Callable[[str], None]) -> Result:
    """The transient in as many spaces as the accuracy takes and the mesh allows."""
    slowest, count = study.end, 0
    errors: dict[str, float] = {}
    before: tuple[Space, Marched] | None = None
    for space in _spaces(placed):
        say(f"{space.words}: {space.heat.free} unknowns")
        shift, count = transient.shift(slowest, study.earliest), count + 1
        own = space.problems.conductors[space.degree - 1]
        base = start.of(space.heat, own, shift, study.end, study.accuracy)
        fine = time_response.marched(study, base, shift, None)
        slowest = min(study.end, float(1 / max(fine.answer.trajectory.rates.min(), 1e-300)))
        last, before = before, (space, fine)
        if last is None:
            continue
        errors = _errors(study, space, fine, *last)
        worst = max((e / fine.scales[n] for n, e in errors.items()), default=0.0)
        if worst <= (1 - time_response.ROW_SHARE) * study.accuracy:
            break
    assert before is not None, "there are two spaces at least"
    space, fine = before
    found: Response = time_response.with_rows(study, fine.answer, fine.reduced, errors, fine.scales, fine.generations)
    relative = {n: e / fine.scales[n] for n, e in found.errors.items()}
    details = _details(placed, space, relative, study, count)
    details |= {
        "steps": len(fine.answer.trajectory.steps),
        "energy_imbalance": found.imbalance,
        "transient_imbalance": found.imbalance,
        "accurate_from_s": study.earliest,
        "jumps": len(space.heat.jumps(study.end)),
        "fields": MeshFields(placed, space.heat, None, fine.answer),
    }
    return Result("fem3d", {}, Traces(found.times, found.traces, found.errors), details)


def _errors(study: Study, space: Space, fine: Marched, coarser: Space, low: Marched) -> dict[str, float]:
    times = np.array([0.1, 1.0]) * study.end
    fields = [own.heat.field(answer.answer.rises(times)) for own, answer in ((space, fine), (coarser, low))]
    vertices = int(coarser.problems.domain.space.mesh.nvertices)
    least = LEAST * _apart(vertices, list(zip(*fields, strict=True)))
    caution = space.caution(study)
    return {
        n: OVER_TIME * caution[n] * d + least * fine.scales[n] + fine.lost[n]
        + float(np.max(fine.out.get(f"doubt:{n}", 0.0)))
        for n, d in time_response.distance(fine.there, low.there).items()
    }  # fmt: skip


def _details(placed: Placed, space: Space, relative: dict[str, float], study: Study, levels: int) -> dict[str, Any]:
    conductor, mesh = space.problems.conductors[space.degree - 1], placed.mesh
    functions = space.problems.domain.space
    electric = 0 if conductor is None else len(conductor.free)
    return {
        "unknowns": space.heat.free if physics.heat(placed.scene) else electric,
        "electric_unknowns": electric,
        "levels": levels,
        "symmetry": "whole",
        "warnings": _warnings(relative, study, space),
        "mesh": {
            "cells": mesh.count,
            "cell_type": mesh.file_type,
            "nodes": space.heat.size,
            "refined": space.refined,
            "lowest_degree": space.degree,
            "highest_degree": space.degree,
            "volume_m3": float(functions.basis(np.arange(functions.mesh.t.shape[1])).dx.sum()),
            "volume_groups": sorted(mesh.volumes),
            "surface_groups": sorted(mesh.surfaces),
        },
        "plan": noted(_plan(placed), _found(placed, space)),
    }


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
    return _plan(_placed(scene))


def _plan(placed: Placed) -> tuple[Step, ...]:
    scene, mesh = placed.scene, placed.mesh
    many = "" if _refines(placed) else "the mesh has too many cells; errors between degrees 1 and 2"
    electric = physics.electric(scene) and any(b.kind == "voltage" for b in scene.boundaries)
    lines = of_free(
        scene,
        "one factorization per level: conductivities don't depend on temperature",
        "in the cells that conduct",
        "" if electric else "there is no electrode",
        f"errors estimated, and compared with {scene.accuracy:g}",
        "projected on Krylov fields",
    )
    return (
        Step("mesh", "done", f"{mesh.count} {mesh.file_type} cells of {scene.file}, as they are"),
        step("refinement", "every cell into eight, once, where degrees 1 and 2 differ by more", many),
        *lines,
    )


def _found(placed: Placed, space: Space) -> list[Step]:
    """What the plan could not know."""
    agree = "degrees 1 and 2 agree within the accuracy on the mesh as it is"
    return [Step("refinement", "skipped", agree)] if _refines(placed) and not space.refined else []
