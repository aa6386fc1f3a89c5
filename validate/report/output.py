"""The files of one run: traces.csv, figures, fields and, last, summary.json."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from compare import scope
from compare.words import sink_text
from validate.report.figures.render import Renderer
from validate.report.folder import Folder
from validate.report.summary import document, write_document

if TYPE_CHECKING:
    from compare.clock import Clock
    from compare.outcome import Outcome
    from scenes.plan import Request


def prepare(request: Request) -> Renderer:
    """A renderer for figure 4, started now where that figure is drawn, so that it is ready when the solution is."""
    renderer = Renderer()
    if "figure4" not in scope.skipped_figures(request):
        renderer.start()
    return renderer


def write(outcome: Outcome, folder: Folder, renderer: Renderer, clock: Clock) -> Outcome:
    """Writes the files into ``folder.partial``; the outcome comes back with their names and the plan as carried out."""
    request, names = outcome.request, []
    skipped = scope.skipped_figures(request)
    drawn = [name for name in scope.FIGURES if name not in skipped]
    if "figure4" in drawn and outcome.fem3d is not None:
        renderer.send(outcome.fem3d.details["fields"], outcome.sink.room_temperature)
    with clock.stage("files"):
        if request.transient:
            from validate.report.traces import write_traces

            names.append(write_traces(folder.partial / "traces.csv", outcome.fem3d, outcome.reduced1d))
        if not scope.fields_reason(request) and outcome.fem3d is not None:
            from compare.painted import of_result
            from validate.report.fields import stored_times, write_fields

            sink, one = outcome.sink, outcome.reduced1d
            times = stored_times(sink.end_time, request.field_times)
            names += write_fields(
                folder.partial, outcome.fem3d, times if request.transient else times[:0], sink.room_temperature,
                sink.accuracy, None if one is None else of_result(sink, one),
            )  # fmt: skip
    if drawn:
        with clock.stage("figures"):
            from validate.report.figures.figures import draw

            files, notes = draw(outcome, drawn, folder.partial, renderer)
        names += files
        plan = tuple(replace(step, reason=notes.get(step.step, step.reason)) for step in outcome.plan)
        outcome = replace(outcome, plan=plan)
    outcome = replace(outcome, files=(*names, "report.html", "summary.json"), timing=clock.all())
    found = document(outcome)
    with clock.stage("files"):
        _write_report(outcome, folder, found, drawn)
        write_document(folder.partial / "summary.json", found)
    return outcome


def _write_report(outcome: Outcome, folder: Folder, found: dict[str, Any], drawn: list[str]) -> None:
    """The page; its scene that can be turned comes with the figures."""
    from compare.checks import contradicts
    from validate.report.html.field import of_result
    from validate.report.html.page import write_report
    from validate.report.table import Style, headline

    sink = outcome.sink
    field = None
    if "figure4" in drawn and outcome.fem3d is not None:
        field = of_result(outcome.fem3d.details["fields"], sink.room_temperature)
    contrary = [check for check in outcome.checks if contradicts(check, sink, False)]
    said = " ".join(headline(outcome, contrary, Style()).split())
    write_report(folder.partial / "report.html", sink_text(sink), said, found, field)
