"""A run with its folder: solved, compared, and kept; the way of every kind of run.

Nothing here imports numpy before the renderer's process has been started, which takes the longest to get ready.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scenes.plan import Request, noted, step
from statespace import export
from validate.folder import Folder
from validate.report import of
from validate.report.figures.render import Renderer
from validate.report.folder import MODEL, RUN, folder_of, replaced
from validate.run import kinds
from validate.run.outcome import Clock, Outcome
from validate.run.pipeline import answer

if TYPE_CHECKING:
    import numpy as np
    from matplotlib.figure import Figure

    from compare.against import Data


def run(
    scene: Any,
    request: Request,
    out: Path | None = None,
    progress: Callable[[str], None] | None = None,
    data: Data | None = None,
    then: Callable[[Outcome[Any]], Outcome[Any]] | None = None,
    tell: Callable[[Outcome[Any]], None] = lambda _: None,
) -> Outcome[Any]:
    """Solve a scene as asked, compare, and write the results folder (``out``, or one named after the scene);
    ``then`` adds to what was found, and ``tell`` is called with all of it, before pictures are drawn and files written.

    The folder is there, whole, when this returns, and so is that of a model which was to be exported; both are as they
    were before when this raises. Raises SceneError for a folder that can't be used (before anything is solved), and
    what `validate.run.pipeline.answer` raises.
    """
    say, clock, drawn = progress or (lambda _: None), Clock(), draws_field(scene, request)
    model = nullcontext() if request.export is None else Folder(request.export.folder, MODEL)
    with Folder(out or folder_of(scene, request), RUN) as folder, model as exports, Renderer(drawn) as renderer:
        outcome = answer(scene, request, say, data, clock)
        outcome = outcome if then is None else then(outcome)
        tell(outcome)
        say("writing the results")
        outcome = write(outcome, folder.partial, renderer, clock)
        if exports is not None and outcome.exported is not None:
            with clock.stage("files"):
                export.write(outcome.exported.document, exports.partial)
    return replace(outcome, folder=folder.target, replaced=replaced(folder), timing=clock.all())


def write(outcome: Outcome[Any], folder: Path, renderer: Renderer, clock: Clock) -> Outcome[Any]:
    """Writes the files; the outcome comes back with their names and the plan as carried out."""
    kind, written = of(outcome.scene), list[str]()
    planned = {line.step for line in outcome.plan if line.state == "done"}
    field = kind.field(outcome) if draws_field(outcome.scene, outcome.request) else None
    if field is not None:
        renderer.send(field)
    with clock.stage("files"):
        course = outcome.sensitivities and outcome.sensitivities.course
        tables = {"traces.csv": kind.columns(outcome), "sensitivities.csv": course.columns() if course else {}}
        for name, columns in tables.items():
            if columns:
                _write_columns(folder / name, columns)
                written.append(name)
        if "field files" in planned:
            from validate.report.fields import write_fields

            written += write_fields(folder, outcome.solved, outcome.scene.accuracy, *kind.stored(outcome))
    if outcome.request.figures and (field is not None or planned & kind.FIGURES.keys()):
        from validate.report.figures.drawing import field_figure, save, style

        drawn: list[str] = []
        with clock.stage("figures"), style():
            for name, place in kind.FIGURES.items():
                if name in planned:
                    drawn += save(_drawn(place, outcome), folder, name.replace(" ", "_"))
            if field is not None:
                # Last, because the picture comes from a process of its own.
                image, name = renderer.image(), kind.FIELD_FIGURE
                if image is None:
                    note = step(name, field.instead, "" if field.instead else "no OpenGL to render with")
                    outcome = replace(outcome, plan=noted(outcome.plan, [note]))
                if image is not None or field.instead:
                    written += save(field_figure(field, image), folder, name.replace(" ", "_"))
        written += drawn
    outcome = replace(outcome, files=(*written, "report.html", "summary.json"), timing=clock.all())
    from validate.report.html.page import write_report
    from validate.report.summary import document, write_document

    summary = document(outcome)
    with clock.stage("files"):
        write_report(folder / "report.html", outcome, summary, field)
        write_document(folder / "summary.json", summary)
    return outcome


def _drawn(place: str, outcome: Outcome[Any]) -> Figure:
    module, _, function = place.partition(".")
    return getattr(import_module(f"validate.report.figures.{module}"), function)(outcome)


def draws_field(scene: Any, request: Request) -> bool:
    name = of(scene).FIELD_FIGURE.removeprefix("figure ")
    return bool(name) and name not in kinds.of(scene).skipped_figures(scene, request)


def _write_columns(path: Path, columns: dict[str, np.ndarray]) -> None:
    """Writes columns of equal length under their names, to full precision."""
    rows = zip(*(column.tolist() for column in columns.values()), strict=True)
    lines = [",".join(columns), *(",".join(map(repr, row)) for row in rows)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
