"""A run with its results folder: solved, reported, and written in one step.

Nothing here imports numpy before the renderer's process has been started, which takes the longest to get ready.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

from compare.analyses import chosen
from compare.kinds import kind_of
from compare.options import Options
from compare.outcome import Outcome, Progress
from compare.pipeline import solve
from scenes.result import noted, step
from validate.folder import MODEL, RUN, Folder, replaced
from validate.report import pictures
from validate.report.figures.render import Renderer

if TYPE_CHECKING:
    import numpy as np


def run(
    scene: Any, options: Options, out: Path, progress: Progress | None = None,
    tell: Callable[[Outcome[Any]], None] = lambda _: None,
) -> Outcome[Any]:  # fmt: skip
    """Solve a scene and write the results folder; ``tell`` is called before pictures are drawn and files written.

    On return the folder is complete, and so is the folder of an exported model; after an exception both are as before.
    Raises SceneError for a folder that cannot be used (before anything is solved), and the errors of
    `compare.pipeline.solve`.
    """
    progress = progress or Progress()
    model = nullcontext() if options.export is None else Folder(options.export.folder, MODEL)
    with Folder(out, RUN) as folder, model as exports, Renderer(draws_field(scene, options)) as renderer:
        outcome = solve(scene, options, progress)
        tell(outcome)
        progress("writing the results")
        write(outcome, folder.partial, renderer, progress)
        if exports is not None:
            from statespace import export as files

            with progress.stage("files"):
                files.write(outcome.analyses["export"], exports.partial)
    outcome.folder, outcome.replaced, outcome.timing = folder.target, replaced(folder), progress.timing()
    return outcome


def draws_field(scene: Any, options: Options) -> bool:
    """Whether the 3D field is rendered."""
    return pictures.FIELDS[scene.kind] in kind_of(scene).drawn(scene, options)


def write(outcome: Outcome[Any], folder: Path, renderer: Renderer, progress: Progress) -> None:
    """Write the files, and note their names and failures in the outcome."""
    kind, written = kind_of(outcome.scene), list[str]()
    field = pictures.field(outcome) if draws_field(outcome.scene, outcome.options) else None
    if field is not None:
        renderer.send(field)
    with progress.stage("files"):
        tables = {"traces.csv": kind.report.columns(outcome), "sensitivities.csv": {}}
        if outcome.options.sensitivities:
            tables["sensitivities.csv"] = {n: c for each in outcome.slopes.values() for n, c in each.table.items()}
        for name, columns in tables.items():
            if columns:
                _write_columns(folder / name, columns)
                written.append(name)
        if any(line.step == "field files" and line.state == "done" for line in outcome.plan):
            from validate.report.fields import write_fields

            written += write_fields(folder, outcome.solved, *pictures.stored(outcome))
    if outcome.options.figures:
        from validate.report.figures.drawing import field_figure, save, style

        with progress.stage("figures"), style():
            drawn = []
            for name in kind.drawn(outcome.scene, outcome.options):
                if figure := pictures.draw(name, outcome):
                    drawn += save(figure, folder, name)
            for each in chosen(outcome.options):
                found = outcome.analyses.get(each.name)
                if each.figure_name and found is not None:
                    figure = pictures.draw(each.figure_name, outcome) or each.figure(found, outcome)
                    drawn += [] if figure is None else save(figure, folder, each.figure_name)
            if field is not None:
                # Last, because the picture comes from a process of its own.
                image, name = renderer.image(), pictures.FIELDS[outcome.scene.kind]
                if image is None:
                    note = step(name, field.instead, "" if field.instead else "no OpenGL to render with")
                    outcome.plan = noted(outcome.plan, [note])
                if image is not None or field.instead:
                    written += save(field_figure(field, image), folder, name)
            written += drawn
    outcome.files, outcome.timing = (*written, "report.html", "summary.json"), progress.timing()
    from validate.report.page import write_report
    from validate.report.summary import document, write_document

    summary = document(outcome)
    with progress.stage("files"):
        write_report(folder / "report.html", outcome, summary)
        write_document(folder / "summary.json", summary)


def _write_columns(path: Path, columns: dict[str, np.ndarray]) -> None:
    """Write columns of equal length under their names, to full precision."""
    rows = zip(*(column.tolist() for column in columns.values()), strict=True)
    lines = [",".join(columns), *(",".join(map(repr, row)) for row in rows)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
