"""One run of a free scene: solved in 3D, and the folder that keeps it.

Nothing here imports numpy before the renderer's process has been started, which takes the longest to get ready.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from compare.clock import Clock
from compare.solve import scope
from compare.solve.outcome import SolveOutcome
from compare.solve.scope import SolveRequest
from scenes import physics
from scenes.model import AnyScene
from validate.report.figures.render import Renderer
from validate.report.folder import Folder

if TYPE_CHECKING:
    from scenes.result import Result


def run(
    scene: AnyScene, request: SolveRequest, out: Path, progress: Callable[[str], None] | None = None
) -> SolveOutcome:  # fmt: skip
    """Solve a scene and write the results folder.

    The folder is there, whole, when this returns, and as it was before when this raises. Raises SceneError for a folder
    that can't be used and a run that would report nothing (before anything is solved), and fem3d.errors.NumericsError.
    """
    say = progress or (lambda _: None)
    scene = scope.reported(scene, request)
    clock = Clock()
    with Folder(out) as folder:
        renderer = Renderer()
        if "field" not in scope.skipped_figures(scene, request):
            renderer.start()
        try:
            with clock.stage("imports"):
                solve = scope.solver(scene)
            say("solving in 3D")
            with clock.stage("fem3d"):
                result: Result = solve(scene, say)
            say("writing the results")
            plan = scope.assemble(scene, request, tuple(result.details["plan"]))
            with clock.stage("checks"):
                outcome = _looked_at(SolveOutcome(scene, request, plan, result))
            outcome = _write(outcome, folder.partial, renderer, clock)
        finally:
            renderer.close()
    return replace(outcome, folder=folder.target, replaced=folder.replaced, timing=clock.all())


def _looked_at(outcome: SolveOutcome) -> SolveOutcome:
    """With the warnings, also of what gets too hot, and the time whose field is drawn."""
    from compare import hottest

    scene, result, shown = outcome.scene, outcome.result, None
    warnings = tuple(result.details.get("warnings", ()))
    if physics.heat(scene):
        fields, times, materials = result.details["fields"], hottest.moments(result.traces), physics.materials(scene)
        if any(material.valid_to is not None for material in materials):
            warnings += tuple(hottest.warnings(materials, hottest.by_material(fields, times)))
        if result.traces is not None and "field" not in scope.skipped_figures(scene, outcome.request):
            shown = hottest.farthest(fields, times, scene.initial_temperature)
    return replace(outcome, warnings=warnings, shown=shown)


def answer(scene: AnyScene, progress: Callable[[str], None] | None = None) -> SolveOutcome:
    """The same without any file: solved. Raises NumericsError."""
    clock = Clock()
    # What fields are asked for to have: a scene without probes reports every part's mean temperature.
    scene = scope.reported(scene, SolveRequest(fields=True))
    with clock.stage("fem3d"):
        result: Result = scope.solver(scene)(scene, progress or (lambda _: None))
    request = SolveRequest(figures=False)
    plan = scope.assemble(scene, request, tuple(result.details["plan"]))
    return _looked_at(SolveOutcome(scene, request, plan, result, timing=clock.all()))


def _write(outcome: SolveOutcome, folder: Path, renderer: Renderer, clock: Clock) -> SolveOutcome:
    """Writes the files; the outcome comes back with their names and the plan as carried out."""
    scene, request, result = outcome.scene, outcome.request, outcome.result
    names: list[str] = []
    skipped = scope.skipped_figures(scene, request)
    if "field" not in skipped:
        from validate.report.solve.field_figure import send

        send(outcome, renderer)
    with clock.stage("files"):
        if not scope.traces_reason(scene):
            from validate.report.solve.traces import write_traces

            names.append(write_traces(folder / "traces.csv", result))
        if not scope.fields_reason(scene, request):
            from validate.report.solve.field_files import write_fields

            names += write_fields(folder, scene, result)
    if len(skipped) < 2:
        with clock.stage("figures"):
            from validate.report.solve.figures import draw

            files, notes = draw(outcome, [n for n in ("traces", "field") if n not in skipped], folder, renderer)
        names += files
        if notes:
            plan = scope.assemble(scene, request, tuple(result.details["plan"]), notes)
            outcome = replace(outcome, plan=plan)
    outcome = replace(outcome, files=(*names, "report.html", "summary.json"), timing=clock.all())
    from validate.report.solve.summary import document
    from validate.report.summary import write_document

    found = document(outcome)
    with clock.stage("files"):
        _write_report(outcome, folder, found, "field" not in skipped)
        write_document(folder / "summary.json", found)
    return outcome


def _write_report(outcome: SolveOutcome, folder: Path, found: dict[str, Any], turned: bool) -> None:
    """The page; ``turned`` says that it has the field to turn."""
    from validate.report.html.field import Field
    from validate.report.html.page import write_report
    from validate.report.solve.table import headline
    from validate.report.table import Style

    field = None
    if turned:
        from validate.report.figures.render import exaggeration
        from validate.report.solve.field_figure import temperatures, when

        fields, kelvins = outcome.result.details["fields"], temperatures(outcome)
        coldest = float(kelvins.min())
        factor = exaggeration(fields.points)
        field = Field(fields.points, fields.hexes, kelvins - coldest, factor, f"{when(outcome)}, above {coldest:.6g} K")
    said = " ".join(headline(outcome, Style()).split())
    write_report(folder / "report.html", outcome.scene.name, said, found, field)
