"""A run with its results folder: solved, reported, drawn, and written in one step.

Nothing here imports numpy before the renderer's process has been started, which takes the longest to get ready.
"""

from __future__ import annotations

import csv
from collections.abc import Callable, Mapping
from contextlib import nullcontext
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from compare.options import Options
from compare.outcome import Outcome, Progress
from scenes import physics
from scenes.formats import sink_text
from scenes.result import Step, noted, step
from scenes.units import TIME
from validate.folder import MODEL, RUN, Folder
from validate.report.figures import FIGURES, outputs
from validate.report.figures.render import Field, Renderer

if TYPE_CHECKING:
    import numpy as np
    from matplotlib.figure import Figure


def plan(scene: Any, options: Options) -> tuple[Step, ...]:
    """Return the steps of a run before it is solved. Raises SceneError."""
    from compare import pipeline

    return (*pipeline.plan(scene, options), *outputs(scene, options))


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
        from compare.pipeline import solve

        outcome = solve(scene, options, progress)
        outcome.plan = (*outcome.plan, *outputs(outcome.scene, outcome.options))
        tell(outcome)
        progress("writing the results")
        write(outcome, folder.partial, renderer, progress)
        if exports is not None:
            from statespace import export as files

            with progress.stage("files"):
                files.write(outcome.analyses["export"], exports.partial)
    outcome.folder, outcome.timing = folder.target, progress.timing()
    outcome.replaced = folder.replaced.get("command") or ""
    return outcome


def draws_field(scene: Any, options: Options) -> bool:
    """Whether the 3D field is rendered."""
    heated = scene.kind == "sink" or (scene.kind == "free" and physics.heat(scene))
    return heated and options.figures and options.only != "1d"


def write(outcome: Outcome[Any], folder: Path, renderer: Renderer, progress: Progress) -> None:
    """Write the files, and note their names and failures in the outcome."""
    import numpy as np

    from compare.kinds import kind_of

    written = list[str]()
    done = [line.step for line in outcome.plan if line.state == "done"]
    field = field_of(outcome) if draws_field(outcome.scene, outcome.options) else None
    if field is not None:
        renderer.send(field)
    with progress.stage("files"):
        tables = {"traces.csv": kind_of(outcome.scene).columns(outcome), "sensitivities.csv": {}}
        if outcome.options.sensitivities:
            followed = {name: found for name, found in outcome.slopes.items() if name != "single" and found.traces}
            for model, slopes in followed.items():
                times = next(iter(followed.values())).times
                tables["sensitivities.csv"] |= {"time_s": times} | {
                    f"{model}_{name}_by_{key}": np.interp(times, slopes.times, slope)
                    for key, by_name in slopes.traces.items() for name, slope in by_name.items()
                }  # fmt: skip
        for name, columns in tables.items():
            if columns:
                with (folder / name).open("w", encoding="utf-8", newline="") as file:
                    write_columns(file, columns)
                written.append(name)
        if "field files" in done:
            from validate.report.fields import write_fields

            written += write_fields(folder, outcome.solved, *stored(outcome))
    if outcome.options.figures:
        from validate.report.figures.drawing import field_figure, save, style

        with progress.stage("figures"), style():
            drawn = []
            for name in done:
                if figure := draw(name, outcome):
                    drawn += save(figure, folder, name)
            if field is not None:
                # Last, because the picture comes from a process of its own.
                image, name = renderer.image(), "figure4" if outcome.scene.kind == "sink" else "figure_field"
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


def write_columns(file: TextIO, columns: Mapping[str, np.ndarray], missing: str = "nan") -> None:
    """Write columns of equal length under their names, to full precision, and a text for NaN."""
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(columns)
    for row in zip(*(column.tolist() for column in columns.values()), strict=True):
        writer.writerow(missing if cell != cell else cell for cell in row)


def draw(name: str, outcome: Outcome[Any]) -> Figure | None:
    """Draw a figure by its file name; return None for another name, or a picture of a field."""
    if name not in FIGURES or not FIGURES[name].function:
        return None
    module, _, function = FIGURES[name].function.partition(".")
    figure: Figure | None = getattr(import_module(f"validate.report.figures.{module}"), function)(outcome)
    return figure


def stored(outcome: Outcome[Any]) -> tuple[np.ndarray, float]:
    """The times (s) of the field files, and the temperature (K) that rises count from."""
    import numpy as np

    from validate.report.fields import stored_times

    scene, options = outcome.scene, outcome.options
    if scene.kind == "sink":
        times = stored_times(scene.end_time, options.field_times)
        return times[:0] if options.steady else times, scene.room_temperature
    times = (
        np.unique([0.0, *scene.output_times, scene.end_time]) if scene.output_times else stored_times(scene.end_time)
    )
    return times[:0] if scene.steady else times, scene.initial_temperature


def field_of(outcome: Outcome[Any]) -> Field:
    """The field to render: of a sink the steady rise; of a free scene the temperature above its coldest place, of a
    transient at its hottest (of a cooled scene coldest) moment."""
    import numpy as np

    scene, fields = outcome.scene, outcome.solved.details["fields"]
    cells = fields.points, fields.cells
    if scene.kind == "sink":
        room = scene.room_temperature
        size = " x ".join(f"{side * 1e6:.4g}" for side in (scene.length, scene.width, scene.thickness))
        title = f"Figure 4: steady 3D rise, {sink_text(scene)} ({size} µm, "
        checks, instead = tuple(c for c in outcome.checks if c.id == "fig4"), "the top faces, from above: no OpenGL"
        return Field(
            *cells, fields.steady - room, title, "thickness", f"rise above {room:g} K (K)", 0.0, checks, instead
        )
    if outcome.solved.traces is None:
        kelvins, when = fields.steady, "steady"
    else:
        from compare.hottest import moments

        time, above = farthest(fields, moments(outcome.solved.traces), scene.initial_temperature)
        kelvins = fields.at(np.array([time]))[0]
        when = f"{TIME.show(float(f'{time:.3g}'))}, when it is {'hottest' if above else 'coldest'}"
    coldest = float(kelvins.min())
    title = f"{scene.name}: temperature, {when} ("
    return Field(*cells, kelvins - coldest, title, "z", "temperature (K)", coldest)


def farthest(fields: Any, times: np.ndarray, initial: float) -> tuple[float, bool]:
    """The time (s) at which the field is farthest from its ``initial`` temperature (K) anywhere, and whether above."""
    from compare.hottest import snapshots

    ends = [(time, float(T.max()) - initial, initial - float(T.min())) for time, T in snapshots(fields, times)]
    time, above, below = max(ends, key=lambda each: max(each[1:]))
    return time, above >= below
