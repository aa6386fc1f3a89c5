"""The 3D model of a scene on a mesh file: its levels, the result with its errors, the plan."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from fem3d import currents, steady
from fem3d.steady import SteadyState
from fem3d.study import Study
from fem3d.unstructured import course, errors, goals, outputs
from fem3d.unstructured.fields import MeshFields
from fem3d.unstructured.level import Level, finest
from meshes.grouped.check import check, remarks
from meshes.grouped.place import Placed
from meshes.grouped.read import read
from scenes.free import asks
from scenes.meshed.model import MeshScene
from scenes.plan import Step
from scenes.result import Estimate, Result, Traces


def solve(scene: MeshScene, progress: Callable[[str], None] | None = None) -> Result:
    """The probes of a scene on its mesh, steady or over time, every number with its estimated error.

    Names and units as of `fem3d.solve_scene.solve`. The mesh is the user's: where the errors exceed the accuracy of the
    scene, a warning says so. Raises SceneError where mesh and scene do not fit, RunawayError where no steady
    state exists, NumericsError where the numerics fail.
    """
    if not scene.steady and not asks.heat(scene):
        return currents.over_time(scene, lambda alone: solve(alone, progress), plan(scene))
    say = progress or (lambda _: None)
    placed = _placed(scene)
    study = goals.study(placed)
    found = _steady(placed, study, say) if scene.steady else _transient(placed, study, say)
    found.details["warnings"] += remarks(placed.mesh)
    return found


def _placed(scene: MeshScene) -> Placed:
    return check(scene, read(scene.path, scene.unit))


def _steady(placed: Placed, study: Study, say: Callable[[str], None]) -> Result:
    thermal, accuracy = asks.heat(placed.scene), study.accuracy
    solved: list[tuple[Level, SteadyState, dict[str, Any]]] = []
    found: dict[str, Estimate] = {}
    excess = np.inf
    for level in finest(placed):
        if excess <= 1.0:
            break
        say(f"{level.words}: {level.heat.free} unknowns")
        span = 0.0 if level.conductor is None else level.conductor.span
        state = steady.coupled(level.heat, level.conductor, thermal, span, accuracy)
        out = outputs.of_steady(state)
        if solved:
            before = solved[-1]
            pairs = [(state.rise, before[1].rise)]
            if state.conductor is not None:
                pairs.append((state.hot_potential, before[1].hot_potential))
            least = errors.LEAST * errors.apart(level, before[0], pairs) + errors.ROUNDING + state.unsettled
            values, scales = study.steady(out), study.steady_scales(out)
            moved = {n: abs(float(v - study.steady(before[2])[n])) for n, v in values.items()}
            caution = {n: errors.factor(level) * study.caution.get(n, 1.0) for n in values}
            error = {n: caution[n] * m + least * scales[n] for n, m in moved.items()}
            found = {n: Estimate(float(v), error[n]) for n, v in values.items()}
            excess = max((e / scales[n] / accuracy for n, e in error.items()), default=0.0)
        solved.append((level, state, out))
    level, state, out = solved[-1]
    fields = MeshFields(level, state, None)
    worst = {n: e.error / study.steady_scales(out)[n] for n, e in found.items()}
    details = _details(level, worst, study, len(solved), fields)
    details |= {"steps": 0, "energy_imbalance": outputs.imbalance(out), "transient_imbalance": None}
    return Result("fem3d", found, None, details)


def _transient(placed: Placed, study: Study, say: Callable[[str], None]) -> Result:
    found = course.solve(placed, study, say)
    level = found.level
    fields = MeshFields(level, None, found.response.transient)
    details = _details(level, found.relative, study, found.levels, fields)
    details |= {
        "steps": len(found.response.transient.trajectory.steps),
        "energy_imbalance": found.imbalance,
        "transient_imbalance": found.imbalance,
        "accurate_from_s": study.earliest,
        "jumps": len(level.heat.jumps(study.end)),
    }
    return Result("fem3d", {}, Traces(found.times, found.traces, found.errors), details)


def _details(
    level: Level, relative: dict[str, float], study: Study, levels: int, fields: MeshFields
) -> dict[str, Any]:  # fmt: skip
    given, conductor = level.given, level.conductor
    electric = 0 if conductor is None else len(conductor.free)
    return {
        "unknowns": level.heat.free if asks.heat(given.scene) else electric,
        "electric_unknowns": electric,
        "levels": levels,
        "symmetry": "whole",
        "warnings": _warnings(relative, study, level),
        "mesh": _statistics(level),
        "plan": _plan(given, level),
        "fields": fields,
    }


def _warnings(relative: dict[str, float], study: Study, level: Level) -> list[str]:
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
        f"this mesh with elements of {level.words}; give a finer mesh, above all at edges, corners and the rims of "
        "electrodes and fixed temperatures"
    ]


def _statistics(level: Level) -> dict[str, Any]:
    mesh, space = level.given.mesh, level.heat.space
    return {
        "cells": len(mesh.cells),
        "cell_type": mesh.file_type,
        "nodes": space.size,
        "refined": level.refined,
        "lowest_degree": level.degree,
        "highest_degree": level.degree,
        "volume_m3": float(space.weights.sum()),
        "volume_groups": sorted(mesh.volumes),
        "surface_groups": sorted(mesh.surfaces),
    }


def plan(scene: MeshScene) -> tuple[Step, ...]:
    """What `solve` will do, before it does it; reads the mesh."""
    return _plan(_placed(scene), None)


def _plan(placed: Placed, level: Level | None) -> tuple[Step, ...]:
    """The lines; with a level, as it turned out."""
    scene, mesh, levels = placed.scene, placed.mesh, finest(placed)
    steps = [Step("mesh", "done", f"{len(mesh.cells)} {mesh.file_type} cells of {scene.file}, as they are")]
    refines = levels[-1].refined
    if not refines:
        steps.append(Step("refinement", "skipped", "the mesh has too many cells; errors between degrees 1 and 2"))
    elif level is not None and not level.refined:
        steps.append(Step("refinement", "skipped", "degrees 1 and 2 agree within the accuracy on the mesh as it is"))
    else:
        steps.append(Step("refinement", "done", "every cell into eight, once, where degrees 1 and 2 differ by more"))
    if asks.heat(scene):
        steps.append(Step("heat", "done", "one factorization per level: conductivities don't depend on temperature"))
    else:
        steps.append(Step("heat", "skipped", "nothing thermal is asked for: the currents at the initial temperature"))
    if asks.electric(scene) and any(b.kind == "voltage" for b in scene.boundaries):
        steps.append(Step("electric problem", "done", "in the cells that conduct"))
    else:
        steps.append(Step("electric problem", "skipped", "there is no electrode"))
    if scene.steady:
        steps.append(Step("steady state", "done", f"errors estimated, and compared with {scene.accuracy:g}"))
        steps.append(Step("transient", "skipped", "only the steady state was asked for"))
    elif asks.heat(scene):
        steps.append(Step("steady state", "skipped", "only the transient was asked for"))
        steps.append(Step("transient", "done", f"to {scene.end_time:g} s, projected on Krylov fields"))
    else:
        steps += currents.plan(scene)
    return tuple(steps)
