"""A run of a free scene: solved in 3D, and looked at for what gets too hot."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from importlib import import_module
from typing import TYPE_CHECKING, Any

from compare.outcome import Clock, Outcome
from compare.plan import free_fields_reason, of_free, skipped_free_figures
from scenes import physics
from scenes.errors import SceneError
from scenes.model import AnyScene, GroupProbe, MeshScene, Probe
from scenes.plan import Request, Step

if TYPE_CHECKING:
    from pathlib import Path

    from scenes.plan import Export
    from scenes.result import Result


def reported(scene: AnyScene, request: Request) -> AnyScene:
    """The scene with something to report: where it has no probes and field files are asked for, every box's mean
    temperature (on a mesh that of every material's groups), which then also says how accurate the fields are. Raises
    SceneError for a run that reports nothing."""
    if scene.probes:
        return scene
    if free_fields_reason(scene, request):
        raise SceneError("the scene has no [[probe]], so there is nothing to report: add one, or give --fields")
    if isinstance(scene, MeshScene):
        groups = dict.fromkeys(group for body in scene.bodies for group in body.groups)
        return replace(scene, probes=tuple(GroupProbe(f"mean {name}", group=name) for name in groups))
    return replace(scene, probes=tuple(Probe(f"mean {b.name}", b.lower, b.upper) for b in scene.boxes))


def plan(scene: AnyScene, request: Request, data: None = None) -> tuple[Step, ...]:
    """What `solve` will do, before it does it."""
    return of_free(scene, request, solver(scene).plan(scene, **_whole(scene, request)))


def _whole(scene: AnyScene, request: Request) -> dict[str, bool]:
    """What says that a scene of boxes is solved whole, where a number of one side changes that side alone."""
    asked = request.sensitivities or request.uncertain is not None
    return {"whole": True} if asked and not isinstance(scene, MeshScene) else {}


def solver(scene: AnyScene) -> Any:
    """The module that plans and solves a scene: boxes have bricks, and a mesh is taken as it is."""
    return import_module("fem3d.solve_mesh" if isinstance(scene, MeshScene) else "fem3d.solve_scene")


def solve(
    scene: AnyScene, request: Request, say: Callable[[str], None], clock: Clock, data: None = None
) -> Outcome[AnyScene]:  # fmt: skip
    """The probes, the warnings, also of what gets too hot, and the time whose field is drawn. Raises NumericsError."""
    from compare import hottest

    if request.export is not None:
        from fem3d.compact.find import check
        from scenes.compact import files

        check(scene)
        files.check(request.export.folder)
    with clock.stage("imports"):
        model = solver(scene)
    say("solving in 3D")
    with clock.stage("fem3d"):
        result: Result = model.solve(scene, say, **_whole(scene, request))
    shown, warnings = None, tuple(result.details.get("warnings", ()))
    with clock.stage("checks"):
        if physics.heat(scene):
            fields, times = result.details["fields"], hottest.moments(result.traces)
            warnings += tuple(hottest.past(physics.materials(scene), fields, times))
            if result.traces is not None and "field" not in skipped_free_figures(scene, request):
                shown = hottest.farthest(fields, times, scene.initial_temperature)
    steps = of_free(scene, request, tuple(result.details["plan"]))
    model = None
    if request.export is not None:
        with clock.stage("export"):
            model = exported(scene, request.export, say)
    outcome = Outcome(scene, request, steps, result, warnings=warnings, shown=shown, exported=model)
    if not request.sensitivities and request.uncertain is None:
        return outcome
    say("sensitivities")
    with clock.stage("sensitivities"):
        return _with_sensitivities(outcome)


def _with_sensitivities(outcome: Outcome[AnyScene]) -> Outcome[AnyScene]:
    """With how the probes follow the numbers of the scene, and what uncertain ones make of them."""
    from compare.inputs import sensitivities
    from compare.inputs.propagation import propagated

    uncertain = outcome.request.uncertain
    found = sensitivities.of_free(outcome.scene, outcome.solved)
    outcome = replace(outcome, warnings=(*outcome.warnings, *found.remarks()))
    if outcome.request.sensitivities:
        outcome = replace(outcome, sensitivities=found)
    return (
        outcome if uncertain is None else replace(outcome, propagated=propagated(uncertain, found, found.values, None))
    )


def exported(scene: AnyScene, export: Export, say: Callable[[str], None]) -> tuple[str, Path]:
    """The compact model's own words, and the folder that it is written to."""
    from fem3d.compact.find import compact
    from scenes.compact import files, fmu
    from scenes.compact.words import validity

    document = compact(scene, export.states, export.accuracy or scene.accuracy, say)
    without = "" if fmu.available() else f"; {fmu.MISSING}"
    return f"a compact model ({validity(document)}{without})", files.write(document, export.folder)
