"""What a run of a free scene writes and draws, and why it leaves out the rest: the one place that decides it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from scenes import physics
from scenes.errors import SceneError
from scenes.model import AnyScene, GroupProbe, MeshScene, Probe
from scenes.plan import Step

if TYPE_CHECKING:
    from scenes.result import Result

UNITS = {"temperature": "K", "potential": "V", "heat_flow": "W", "current": "A"}
"""The unit of each quantity that a probe may ask for."""


@dataclass(frozen=True)
class SolveRequest:
    """What the user asked of a run, and the command line that did, if it was one."""

    figures: bool = True
    fields: bool = False
    command: str = ""


def reported(scene: AnyScene, request: SolveRequest) -> AnyScene:
    """The scene with something to report: where it has no probes and field files are asked for, every box's mean
    temperature (on a mesh that of every material's groups), which then also says how accurate the fields are. Raises
    SceneError for a run that reports nothing."""
    if scene.probes:
        return scene
    if fields_reason(scene, request):
        raise SceneError("the scene has no [[probe]], so there is nothing to report: add one, or give --fields")
    if isinstance(scene, MeshScene):
        groups = dict.fromkeys(group for body in scene.bodies for group in body.groups)
        return replace(scene, probes=tuple(GroupProbe(f"mean {name}", group=name) for name in groups))
    return replace(scene, probes=tuple(Probe(f"mean {b.name}", b.lower, b.upper) for b in scene.boxes))


def traces_reason(scene: AnyScene) -> str:
    """Why there are no traces; empty where there are."""
    return "only the steady state was asked for (run.steady)" if scene.steady else ""


def fields_reason(scene: AnyScene, request: SolveRequest) -> str:
    """Why no field files are written; empty where they are."""
    if not request.fields:
        return "not asked for (--fields)"
    return "" if physics.heat(scene) else "no temperature is solved for"


def skipped_figures(scene: AnyScene, request: SolveRequest) -> dict[str, str]:
    """The figures that a run does not draw, each with the reason."""
    if not request.figures:
        return dict.fromkeys(("field", "traces"), "no figures were asked for")
    skipped = {}
    if not physics.heat(scene):
        skipped["field"] = "no temperature is solved for"
    if traces_reason(scene):
        skipped["traces"] = traces_reason(scene)
    return skipped


def assemble(
    scene: AnyScene, request: SolveRequest, solver_steps: tuple[Step, ...], notes: Mapping[str, str] | None = None
) -> tuple[Step, ...]:
    """The whole plan around the solver's lines; ``notes`` says of a figure why it could not be drawn."""
    when = "steady" if scene.steady else "hottest moment's"
    drawn = {"field": f"the {when} temperature field, rendered off screen", "traces": "every probe against time"}
    why = {
        **{f"figure {name}": reason for name, reason in (skipped_figures(scene, request) | dict(notes or {})).items()},
        "traces.csv": traces_reason(scene),
        "field files": fields_reason(scene, request),
    }
    does = {
        **{f"figure {name}": what for name, what in drawn.items()},
        "traces.csv": "a column for each probe",
        "field files": "fem3d.pvd with its .vtu files, and fem3d.vtkhdf where VTK can",
    }
    lines = (Step(name, "skipped" if why.get(name) else "done", why.get(name) or what) for name, what in does.items())
    return (*solver_steps, *lines)


def solver(scene: AnyScene) -> Callable[..., Result]:
    """What solves a scene and tells how far it is: boxes have bricks, and a mesh is taken as it is."""
    if isinstance(scene, MeshScene):
        from fem3d.solve_mesh import solve as solve_on_mesh

        return solve_on_mesh
    from fem3d.solve_scene import solve

    return solve


def plan(scene: AnyScene, request: SolveRequest) -> tuple[Step, ...]:
    """What `compare.solve.run.run` will do, before it does it."""
    if isinstance(scene, MeshScene):
        from fem3d.solve_mesh import plan as plan_on_mesh

        return assemble(scene, request, plan_on_mesh(scene))
    from fem3d.solve_scene import plan

    return assemble(scene, request, plan(scene))
