"""A run with its folder: solved, compared, and kept; the way of every kind of run.

Nothing here imports numpy before the renderer's process has been started, which takes the longest to get ready.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from compare.outcome import Clock, Outcome
from compare.pipeline import answer
from scenes.plan import Request, Step, noted
from validate.report import names, of
from validate.report.figures.render import Field, Renderer
from validate.report.folder import Folder

if TYPE_CHECKING:
    import numpy as np

    from compare.against import Data


def run(
    scene: Any,
    request: Request,
    out: Path | None = None,
    progress: Callable[[str], None] | None = None,
    data: Data | None = None,
    then: Callable[[Outcome[Any]], Outcome[Any]] | None = None,
) -> Outcome[Any]:
    """Solve a scene as asked, compare, and write the results folder (``out``, or one named after the scene);
    ``then`` adds to what was found before it is written.

    The folder is there, whole, when this returns, and as it was before when this raises. Raises SceneError for a folder
    that can't be used (before anything is solved), and what `compare.pipeline.answer` raises.
    """
    say, clock, kind = progress or (lambda _: None), Clock(), of(scene)
    with Folder(out or names.of(scene, request)) as folder, Renderer(kind.draws_field(scene, request)) as renderer:
        outcome = answer(scene, request, say, data, clock)
        outcome = outcome if then is None else then(outcome)
        say("writing the results")
        outcome = write(outcome, folder.partial, renderer, clock)
    return replace(outcome, folder=folder.target, replaced=folder.replaced, timing=clock.all())


def write(outcome: Outcome[Any], folder: Path, renderer: Renderer, clock: Clock) -> Outcome[Any]:
    """Writes the files; the outcome comes back with their names and the plan as carried out."""
    kind, names = of(outcome.scene), []
    planned = {line.step for line in outcome.plan if line.state == "done"}
    field = kind.field(outcome) if kind.draws_field(outcome.scene, outcome.request) else None
    if field is not None:
        renderer.send(field)
    with clock.stage("files"):
        columns = kind.columns(outcome)
        if columns:
            names.append(write_columns(folder / "traces.csv", columns))
        for name, more in getattr(kind, "more_columns", lambda _: {})(outcome).items():
            names.append(write_columns(folder / name, more))
        if "field files" in planned:
            from validate.report.fields import write_fields

            names += write_fields(folder, outcome.solved, outcome.scene.accuracy, *kind.stored(outcome))
    if outcome.request.figures and (field is not None or planned & kind.FIGURES.keys()):
        with clock.stage("figures"):
            files, notes = _draw(outcome, planned, folder, field, renderer)
        names += files
        outcome = replace(outcome, plan=noted(outcome.plan, notes))
    outcome = replace(outcome, files=(*names, "report.html", "summary.json"), timing=clock.all())
    from validate.report.html.page import write_report
    from validate.report.summary import document

    found = document(outcome)
    with clock.stage("files"):
        write_report(folder / "report.html", outcome, found, field)
        (folder / "summary.json").write_text(json.dumps(found, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    return outcome


def _draw(
    outcome: Outcome[Any], planned: set[str], folder: Path, field: Field | None, renderer: Renderer
) -> tuple[list[str], list[Step]]:
    """Draws the figures as .png and .svg; returns the files' names, and the plan's lines that turned out otherwise."""
    from validate.report.figures.drawing import save, style

    kind = of(outcome.scene)
    files: list[str] = []
    notes: list[Step] = []
    with style():
        for name, draw in kind.FIGURES.items():
            if name in planned:
                module, _, function = draw.rpartition(".")
                figure = getattr(import_module(f"validate.report.{module}"), function)(outcome)
                files += save(figure, folder, name.replace(" ", "_"))
        if field is not None:
            # Last, because the picture comes from a process of its own.
            figure, note = kind.field_figure(outcome, field, renderer.image())
            files = [*([] if figure is None else save(figure, folder, kind.FIELD_FIGURE.replace(" ", "_"))), *files]
            notes += [] if note is None else [note]
    return files, notes


def write_columns(path: Path, columns: dict[str, np.ndarray]) -> str:
    """Writes columns of equal length under their names, to full precision; returns the file's name."""
    rows = zip(*(column.tolist() for column in columns.values()), strict=True)
    lines = [",".join(columns), *(",".join(map(repr, row)) for row in rows)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path.name
