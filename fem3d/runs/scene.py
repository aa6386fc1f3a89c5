"""Solve a free scene in 3D, of boxes or on a mesh file, steady or over time; describe the plan and the result.

`until` follows a transient until shortly before a thermal runaway.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from fem3d.adaptivity import nested
from fem3d.adaptivity.adapt import adapt
from fem3d.adaptivity.mesh import Answer, Mesh
from fem3d.adaptivity.responses import BEFORE, waits
from fem3d.adaptivity.trace_errors import ROW_SHARE
from fem3d.results import outputs
from fem3d.results.fields import Fields
from fem3d.results.outputs import Study
from fem3d.runs import currents, probe_quantities
from fem3d.solution.exponential import runaway_sentence
from meshes import grid, symmetry
from meshes.symmetry import Symmetry
from scenes import physics
from scenes.errors import NumericsError, RunawayInTimeError, listed
from scenes.free import structure
from scenes.free.graph import CellGraph
from scenes.model import AnyScene, MeshScene, Point, Scene
from scenes.result import Estimate, Result, Step, Traces
from scenes.units import TIME


def solve(scene: AnyScene, progress: Callable[[str], None] | None = None, whole: bool = False) -> Result:
    """Solve the probes of a scene in 3D, steady or over time, each with its error bound; ``whole`` ignores symmetry.

    Steady keys and trace names are the probes' names; temperatures in K, potentials in V, flows in W, currents in A.
    If errors on a mesh file exceed the accuracy of the scene, a warning is added. Raises SceneError where mesh and
    scene do not fit, scenes.errors.RunawayError where no steady state exists, NumericsError where the numerics fail.
    """
    physics.refuse_following(scene, not scene.steady)
    if not scene.steady and not physics.heat(scene):
        return currents.over_time(scene, lambda alone: solve(alone, progress), plan(scene))
    study, mesh = start(scene, whole)
    answer = adapt(study, not scene.steady, progress or (lambda _: None), mesh, scene.steady)
    details = described(study, answer) | {"plan": plan(scene, answer.mesh), "answer": answer}
    # An answer above the requested error has no error estimate away from the probes.
    if study.field_accuracy is not None and answer.field_error < np.inf:
        details["field_error"] = off = answer.field_error
        if off > study.field_accuracy:
            details["warnings"].append(
                f"the field away from the probes may be off by {off:.0%} of its largest rise where it is worst; "
                "the probes are as accurate as asked for; a smaller accuracy refines the field too"
            )
    if isinstance(scene, Scene):
        details["warnings"] += structure.remarks(scene)
    details["warnings"] += answer.mesh.warnings(study, answer.relative)
    if (response := answer.response) is not None:
        details |= {"scales": response.scales, "transient": response.transient}
        waiting = waits(answer.heat, study.earliest, study.end)
        traces = Traces(response.times, response.traces, response.errors, study.earliest, waiting, response.early)
        return Result("fem3d", {}, traces, details)
    details |= {"scales": study.steady_scales(answer.fine.out), "study": study, "solution": answer.fine}
    steady = {n: Estimate(float(v), answer.errors[n]) for n, v in answer.fine.quantities.items()}
    return Result("fem3d", steady, None, details)


def on_first_mesh(scene: AnyScene) -> dict[str, Estimate]:
    """Solve the steady probes of a scene on its first mesh alone, each with its estimated error.

    Raises NumericsError where the mesh has no solution.
    """
    study, mesh = start(scene)
    problems = mesh.problems()
    level = mesh.examine(study, problems, nested.solve_space(study, problems))
    return {name: Estimate(float(value), level.errors[name]) for name, value in level.fine.quantities.items()}


def start(scene: AnyScene, whole: bool = False) -> tuple[Study, Mesh]:
    """Return the study of the solved part of a scene, and the first mesh."""
    from fem3d.adaptivity.cell_mesh import choose, mesh_of

    study = probe_quantities.study(scene, part_of(scene, whole))
    if isinstance(scene, MeshScene):
        return study, mesh_of(probe_quantities.to_solve(scene))
    every = probe_quantities.study(scene, part_of(scene, True))
    return choose(study, every, over_time=not scene.steady)


def part_of(scene: AnyScene, whole: bool) -> Symmetry:
    """Return the solved part of a scene with its probes; a scene on a mesh file is solved whole."""
    scene = probe_quantities.to_solve(scene)
    if isinstance(scene, MeshScene):
        return symmetry.uncut(scene, [b.material.name for b in scene.bodies])
    inside = clipped(scene)
    return symmetry.uncut(inside, [b.name for b in inside.boxes]) if whole else symmetry.reduce(inside)


def clipped(scene: Scene) -> Scene:
    """Return the scene with conditions and probes cut to the extent of its boxes."""
    low = [min(b.lower[d] for b in scene.boxes) for d in range(3)]
    high = [max(b.upper[d] for b in scene.boxes) for d in range(3)]

    def inside(point: Point) -> Point:
        x, y, z = (min(max(c, low[d]), high[d]) for d, c in enumerate(point))
        return x, y, z

    boundaries = tuple(replace(b, lower=inside(b.lower), upper=inside(b.upper)) for b in scene.boundaries)
    probes = tuple(replace(p, lower=inside(p.lower), upper=inside(p.upper)) for p in scene.probes)
    return replace(scene, boundaries=boundaries, probes=probes)


def described(study: Study, answer: Answer) -> dict[str, Any]:
    """Return the details of a result about its last level."""
    heat, conductor, mesh, response = answer.heat, answer.conductor, answer.mesh, answer.response
    state = None if answer.steady is None else answer.steady.state
    transient = None if response is None else response.transient
    electric = 0 if conductor is None else len(conductor.free)
    over_time = None if response is None else response.imbalance
    rises = [] if state is None else [state.rise]
    if transient is not None:
        rises += list(transient.rises(np.linspace(0.0, transient.end, 9)))
    warnings = list(physics.frozen(study.part.scene))
    if response is not None and response.between > ROW_SHARE * study.accuracy:
        warnings.append(
            f"the {len(response.times)} rows of the traces are as many as are made: straight lines between them are "
            f"off by up to {response.between:.1e}, more than {ROW_SHARE:g} of the accuracy of {study.accuracy:g}; "
            "errors have it"
        )
    followed = physics.may_follow(heat.domain.scene, over_time=transient is not None)
    return {
        "unknowns": heat.free if physics.heat(heat.domain.scene) else electric, "electric_unknowns": electric,
        "levels": answer.levels, "symmetry": study.part.part, "planes": study.part.planes,
        "warnings": warnings + outputs.warn_of_tables(heat, np.array(rises), followed),
        "fields": Fields(heat, study.part, state, transient), "mesh": mesh.statistics(heat),
        "steps": 0 if transient is None else len(transient.steps),
        "energy_imbalance": over_time if answer.steady is None else outputs.heat_imbalance(answer.steady.out)[1],
        "transient_imbalance": over_time,
    }  # fmt: skip


def plan(scene: AnyScene, mesh: Mesh | None = None) -> tuple[Step, ...]:
    """Return the plan of `solve` beforehand; with the last ``mesh`` the plan as carried out."""
    on, before = mesh or start(scene)[1], tuple[Step, ...]()
    if isinstance(scene, MeshScene):
        domain: Any = on.domain
        graph: CellGraph = domain.placed
        reached = f"errors estimated, and compared with {scene.accuracy:g}"
    else:
        part = part_of(scene, False)
        line, graph = part.step, grid.graph(part.scene)
        if part.planes and on.whole:
            line = Step("symmetry", "skipped", "tetrahedra are of the whole scene")
        before = *(Step(what, "done", text) for what, text in structure.described(scene)), line
        reached = f"refined until every estimated error is below {scene.accuracy:g}"
        reached += ", or memory ends it" * on.whole
    steps = *before, *on.plan(mesh.levels if mesh else None), heat_step(scene, not scene.steady), electric_step(graph)
    if scene.steady:
        only = "only the steady state was asked for"
        return *steps, Step("steady state", "done", reached), Step("transient", "skipped", only)
    if not physics.heat(scene):
        return *steps, *currents.plan(scene)
    how = f"to {scene.end_time:g} s, {transient_method(scene)}, errors held against {scene.accuracy:g}"
    only = "only the transient was asked for"
    return *steps, Step("steady state", "skipped", only), Step("transient", "done", how)


def transient_method(scene: AnyScene) -> str:
    """Return how a transient is solved."""
    all_unknowns = "with all unknowns, by a Runge-Kutta method of order 4"
    return all_unknowns if physics.nonlinear(scene, True) else "projected on a few Krylov fields"


def heat_step(scene: AnyScene, over_time: bool) -> Step:
    """Return the line of the heat problem."""
    if not physics.heat(scene):
        return Step("heat", "skipped", "nothing thermal is asked for: the currents at the initial temperature")
    if why := physics.nonlinear(scene, over_time):
        return Step("heat", "done", f"by Newton's method: {why}")
    return Step("heat", "done", "one factorization per mesh: the conductivity doesn't depend on temperature")


def electric_step(graph: CellGraph) -> Step:
    """Return the line of the electric problem."""
    if not graph.live.any():
        return Step("electric problem", "skipped", "no part touches electrodes of two voltages")
    warm = physics.heat(graph.scene) and any(m.warms for m in physics.materials(graph.scene))
    follows = ", whose resistance follows the temperature" * warm
    dead = graph.names(graph.solid & ~graph.live)
    without = f"; no current flows in {listed(dead)}" if dead else ""
    return Step("electric problem", "done", f"in {listed(graph.names(graph.live))}{follows}{without}")


def until(
    scene: AnyScene, runaway: RunawayInTimeError, progress: Callable[[str], None] | None = None
) -> tuple[AnyScene, Result, str]:
    """Return the scene up to shortly before its runaway, its result (`fem3d.runs.scene.solve`), and a sentence with the
    time of the runaway and the end of the result. Raises the ``runaway`` itself if no such result can be solved."""
    time, said = runaway.time, runaway_sentence(runaway.time, scene.accuracy)
    for _ in range(4):  # each run may move the end: a finer mesh may run away earlier
        end = float(f"{BEFORE * time:.2e}")
        kept = replace(scene, end_time=end, output_times=(*(t for t in scene.output_times if t < end), end))
        try:
            return kept, solve(kept, progress), f"{said}; it is solved up to {TIME.show(end)}"
        except RunawayInTimeError as earlier:
            time = min(earlier.time, end)
        except NumericsError:
            break
    raise runaway
