"""Run a sweep, or the map of a tolerance's line, from the request to the folder of results."""

from __future__ import annotations

import json
import time
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from compare.processes import processors
from scenes.errors import SceneError
from scenes.sink import Sink
from validate.sweep.design import Design, Job, Task, listed, load, parse, prepare
from validate.sweep.store import SUMMARY, Store

if TYPE_CHECKING:
    from scenes.model import AnyScene
    from validate.sweep.table import Table


def run(
    job: Job, store: Store, say: Callable[[str], None], *, workers: int | None = None, scheduler: str | None = None,
    seconds: float | None = None, figures: bool = False,
) -> tuple[Table, dict[str, Any]]:  # fmt: skip
    """Solve all points that are not stored, write the files, and return the columns and the content of sweep.json.

    ``workers`` processes here (default: one a processor) or a ``scheduler``'s solve, with ``seconds`` for each point.
    Raises SceneError for an unusable scheduler, and NumericsError.
    """
    from validate.sweep.mapping import refine
    from validate.sweep.point import solver
    from validate.sweep.table import read

    started, count = time.monotonic(), job.design.count
    say("starting the workers")
    with solver(min(workers or processors(), max(count - len(store.rows), 1)), scheduler, seconds) as solve:

        def gather(tasks: Iterable[Task], total: int, more: str = "") -> None:
            for row in solve(tasks):
                store.append(row)
                say(f"{len(store.rows)} of {total} points{more}")

        cells = None
        if job.solves is None:
            gather((job.task(number) for number in range(count) if number not in store.rows), count)
        else:
            cells = refine(job, store.rows, gather)
    say("writing the results")
    table = read(job, store.rows, cells)
    return table, _write(store, table, figures, time.monotonic() - started)


def _write(store: Store, table: Table, figures: bool, seconds: float) -> dict[str, Any]:
    """Write the files; return the content of sweep.json."""
    from compare.report.table import Section
    from compare.report.table import Table as Tabular
    from validate.report import page
    from validate.report.output import write_columns
    from validate.report.summary import as_json, provenance
    from validate.sweep.mapping import VERDICTS

    columns, asked = table.columns, table.job.asked
    counts: dict[str, Any] = {"points": len(table), **Counter(columns["status"].tolist())}
    tables = {"points.csv": table.keys | columns}
    if table.map:
        tables["map.csv"] = table.map
        counts["cells"] = {"all": table.job.design.count, **Counter(table.map["verdict"].tolist())}
    for name, content in tables.items():
        with store.writing(name) as file:
            write_columns(file, content, missing="")
    files = [*tables]
    if figures:
        from validate.report.figures.drawing import save, style
        from validate.sweep.figures import draw

        with style():
            files += [file for name, figure in draw(table).items() for file in save(figure, store.folder, name)]
    made = {name.removesuffix("_verdict"): words for name, words in columns.items() if name.endswith("_verdict")}
    document: dict[str, Any] = as_json(
        {
            "schema": 1,
            "asked": asked,
            "finished": True,
            "sentence": table.sentence,
            "counts": counts,
            "verdicts": {check: dict(Counter(filter(None, words.tolist()))) for check, words in made.items()},
            "seconds": {"this_run": round(seconds, 1), "points": round(float(columns["seconds"].sum()), 1)},
            "provenance": provenance(),
            "files": [*files, "report.html", SUMMARY],
        }
    )
    rows = [[check, *(str(n.get(word, 0)) for word in VERDICTS)] for check, n in document["verdicts"].items()]
    request = [f"{key}: {value}" for key, value in {**asked, **counts}.items() if key not in ("scene", "vary")]
    checks = Section("Checks", [Tabular(("check", *VERDICTS), rows)] if rows else [])
    sections = [checks, Section("Request and counts", [[f"varied: {', '.join(table.keys)}", *request]])]
    with store.writing("report.html") as file:
        said, content = f"{table.sentence}.", document | {"scene": asked["scene"]["document"]}
        file.write(page.page(store.folder, asked["scene"]["name"], said, sections, content))
    with store.writing(SUMMARY) as file:
        json.dump(document, file, indent=1)
    return document


def sweep(
    scene: Sink | AnyScene | str | Path = "sink",
    vary: Mapping[str, Sequence[Any] | str] | None = None,
    *,
    sample: int | None = None,
    seed: int = 0,
    reduction: str | Sequence[str] = "paper",
    steady: bool = False,
    accuracy: float = 1e-2,
    check: str | None = None,
    blame: bool = True,
    workers: int | None = None,
    scheduler: str | None = None,
    point_timeout: float | None = None,
    model: str = "",
    out: str | Path | None = None,
    fresh: bool = False,
    figures: bool = False,
    progress: Callable[[str], None] | None = None,
) -> Table:
    """Solve and compare a scene at many designs, and return the columns of points.csv.

    ``vary`` has the values of each key: numbers in SI units, texts with units, words, or the text of a command line,
    "10um:200um:20", with ``sample`` "10um:200um". Solved points are kept in the folder ``out``, where the same call
    goes on; without it nothing stays. ``model`` is the file of the user's own model of a free scene, as for --model.
    ``point_timeout`` is in s; ``workers`` are processes (default: one a processor). Raises SceneError for bad input,
    ArithmeticError where a cluster is lost.
    """
    from compare.models import parse_reductions

    if figures and out is None:
        raise SceneError("figures need a folder to go to: give out=")
    given, asked = load(scene, [f"run.accuracy={accuracy!r}"])
    form = "grid" if sample is None else "sample"
    axes = [
        parse(given, f"{key}={values}", form) if isinstance(values, str) else listed(given, key, list(values))
        for key, values in (vary or {}).items()
    ]
    models = parse_reductions([model or reduction] if isinstance(reduction, str) else reduction)
    job = prepare(given, asked, Design(tuple(axes), sample, seed), models, check, steady, blame)
    with TemporaryDirectory() as folder, Store(Path(out or folder), job.asked, fresh) as store:
        say = progress or (lambda _: None)
        return run(job, store, say, workers=workers, scheduler=scheduler, seconds=point_timeout, figures=figures)[0]
