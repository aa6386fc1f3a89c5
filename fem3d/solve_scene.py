"""The 3D model of a free scene: any boxes, conditions and probes, steady or over time; the plan and the result."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from fem3d import adapt, currents, outputs, probe_quantities
from fem3d.conductor import Conductor
from fem3d.fields import Fields, grid_of
from fem3d.heat import HeatProblem
from fem3d.study import Study
from fem3d.time_response import Response
from meshes import connected, symmetry
from meshes.grid import statistics
from meshes.symmetry import Symmetry
from scenes import physics
from scenes.model import AnyScene, Point, Scene
from scenes.plan import Step
from scenes.result import Estimate, Result, Traces


def solve(scene: Scene, progress: Callable[[str], None] | None = None, whole: bool = False) -> Result:
    """The probes of a scene in 3D, steady or over time, every number with its estimated error; ``whole`` leaves no part
    out that is a mirror image of another.

    Steady keys and trace names are the probes' names; temperatures in K, potentials in V, flows in W, currents in A.
    Raises fem3d.errors.RunawayError where no steady state exists, NumericsError where the numerics fail.
    """
    if not scene.steady and not physics.heat(scene):
        return currents.over_time(scene, lambda alone: solve(alone, progress), plan(scene))
    say = progress or (lambda _: None)
    study = probe_quantities.study(scene, part_of(scene, whole))
    return _steady(study, scene, say) if scene.steady else _transient(study, scene, say)


def part_of(scene: Scene, whole: bool) -> Symmetry:
    """The part of a scene that is solved."""
    inside = clipped(scene)
    return symmetry.uncut(inside, [b.name for b in inside.boxes]) if whole else symmetry.reduce(inside)


def clipped(scene: Scene) -> Scene:
    """The scene with conditions and probes cut to the extent of its boxes."""
    low = [min(b.lower[d] for b in scene.boxes) for d in range(3)]
    high = [max(b.upper[d] for b in scene.boxes) for d in range(3)]

    def inside(point: Point) -> Point:
        x, y, z = (min(max(c, low[d]), high[d]) for d, c in enumerate(point))
        return x, y, z

    boundaries = tuple(replace(b, lower=inside(b.lower), upper=inside(b.upper)) for b in scene.boundaries)
    probes = tuple(replace(p, lower=inside(p.lower), upper=inside(p.upper)) for p in scene.probes)
    return replace(scene, boundaries=boundaries, probes=probes)


def _steady(study: Study, scene: Scene, say: Callable[[str], None]) -> Result:
    answer = adapt.solve(study, False, say)
    off, state = answer.field, answer.fine.state
    found = {name: Estimate(float(v), answer.errors[name]) for name, v in answer.fine.quantities.items()}
    details = described(study, state.heat, state.conductor, answer.levels) | of_steady(answer.fine.out) | {
        "mesh": statistics(grid_of(state.heat)),
        "plan": plan(scene, not study.part.planes),
        "study": study,
        "solution": answer.fine,
        "fields": Fields(state.heat, state, study.part, None),
        "field_error": off,
        "scales": study.steady_scales(answer.fine.out),
    }  # fmt: skip
    if off > probe_quantities.FIELD:
        details["warnings"].append(
            f"the field away from the probes may be off by {off:.0%} of its largest rise where it is worst; the probes "
            "are as accurate as asked for; a smaller accuracy refines the field too"
        )
    return Result("fem3d", found, None, details)


def _transient(study: Study, scene: Scene, say: Callable[[str], None]) -> Result:
    course = adapt.solve_course(study, say)
    response, heat = course.response, course.base.heat
    details = described(study, heat, course.base.conductor, course.levels) | over_time(study, response) | {
        "scales": response.scales,
        "mesh": statistics(grid_of(heat)),
        "plan": plan(scene, not study.part.planes),
        "transient": response.transient,
        "fields": Fields(heat, None, study.part, response.transient),
    }  # fmt: skip
    return Result("fem3d", {}, Traces(response.times, response.traces, response.errors), details)


def described(study: Study, heat: HeatProblem, conductor: Conductor | None, levels: int) -> dict[str, Any]:
    """What a result says of its last level."""
    electric = 0 if conductor is None else len(conductor.free)
    return {
        "unknowns": heat.free if physics.heat(heat.domain.scene) else electric, "electric_unknowns": electric,
        "levels": levels, "symmetry": study.part.part, "warnings": [],
    }  # fmt: skip


def of_steady(out: outputs.Outputs) -> dict[str, Any]:
    """What a result says of a steady state."""
    return {"steps": 0, "energy_imbalance": imbalance(out), "transient_imbalance": None}


def over_time(study: Study, response: Response) -> dict[str, Any]:
    """What a result says of a transient."""
    return {
        "steps": len(response.transient.trajectory.steps), "energy_imbalance": response.imbalance,
        "transient_imbalance": response.imbalance, "accurate_from_s": study.earliest,
        "jumps": len(response.transient.base.heat.jumps(study.end)),
    }  # fmt: skip


def imbalance(out: outputs.Outputs) -> float:
    """|what enters| over what passes: heat by the boundaries' flows, sources and currents, or, where nothing thermal is
    asked for, power by what the electrodes supply; of a steady state."""
    flows = [float(v) for name, v in out.items() if name.startswith("flow:")]
    power, generated = float(out["power"]), float(out["generated"])
    if not flows:
        return abs(power - float(out["dissipated"])) / power if power else 0.0
    passing = (sum(abs(f) for f in flows) + power + abs(generated)) / 2
    return abs(sum(flows) + power + generated) / passing if passing else 0.0


def plan(scene: Scene, whole: bool = False) -> tuple[Step, ...]:
    """What `solve` will do, before it does it."""
    part = symmetry.reduce(clipped(scene))
    warm = any(b.material.resistivity and b.material.temperature_coefficient for b in part.scene.boxes)
    if connected.live(part.scene).any():
        follows = ", whose resistance follows the temperature" if warm and physics.heat(scene) else ""
        electric = Step("electric problem", "done", f"in the parts that touch electrodes of two voltages{follows}")
    else:
        electric = Step("electric problem", "skipped", "no part touches electrodes of two voltages")
    reached = f"refined until every estimated error is below {scene.accuracy:g}"
    line = part.step
    if whole and part.planes:
        line = Step("symmetry", "skipped", "the whole is solved, for a number of one side changes that side alone")
    return line, heat_step(scene), electric, *states(scene, reached)


def heat_step(scene: AnyScene) -> Step:
    """The line of the heat problem."""
    if physics.heat(scene):
        return Step("heat", "done", "one factorization per mesh: the conductivity doesn't depend on temperature")
    return Step("heat", "skipped", "nothing thermal is asked for: the currents at the initial temperature")


def states(scene: AnyScene, reached: str) -> tuple[Step, Step]:
    """The lines of the steady state, with what is ``reached`` there, and of the transient."""
    if scene.steady:
        only = "only the steady state was asked for"
        return Step("steady state", "done", reached), Step("transient", "skipped", only)
    if not physics.heat(scene):
        return currents.plan(scene)
    how = f"to {scene.end_time:g} s, projected on Krylov fields, errors held against {scene.accuracy:g}"
    only = "only the transient was asked for"
    return Step("steady state", "skipped", only), Step("transient", "done", how)
