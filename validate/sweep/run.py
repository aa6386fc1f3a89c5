"""Run a sweep, or the map of a tolerance's line, from the request to the folder of results."""

from __future__ import annotations

import os
import platform
import time
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from importlib import metadata
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from compare.processes import processors
from scenes.errors import SceneError
from scenes.formats import quantity
from scenes.sink import Sink
from validate.sweep.design import Design, base, listed, parse
from validate.sweep.point import Job, Work, prepare
from validate.sweep.store import SUMMARY, Store
from validate.sweep.table import Table, read

if TYPE_CHECKING:
    from scenes.model import AnyScene

_CAPTIONS = {
    "figure_map": "Where the reduction is within the tolerance, and which assumption is to blame where it is not.",
    "figure_lines": "Differences from 3D over the varied keys, with their errors; grey is within the tolerance.",
}


def run(
    job: Job, store: Store, say: Callable[[str], None], *, workers: int | None = None, scheduler: str | None = None,
    seconds: float | None = None, figures: bool = False,
) -> tuple[Table, dict[str, Any]]:  # fmt: skip
    """Solve all points that are not stored, write the files, and return the columns and the content of sweep.json.

    ``workers`` processes here (default: one a processor) or a ``scheduler``'s solve, with ``seconds`` for each point.
    Raises SceneError for an unusable scheduler, and LostError.
    """
    from validate.sweep.cluster import Cluster

    already, started, count = len(store), time.monotonic(), job.design.count

    def gather(points: Iterable[Work], total: int, more: str = "") -> None:
        for row in cluster.solve(points):
            store.append([row])
            rate = (len(store) - already) / (time.monotonic() - started)
            # The number of solutions of a map does not count points that are refused.
            done = len(store) if job.solves is None else sum(each.status != "refused" for each in store.rows())
            rest = quantity(max(total - done, 0) / rate, "s", 2)
            say(f"{done} of {total} points, {rate:.2g} a second, {rest} left{more}")

    cells = None
    with Cluster(min(workers or processors(), max(count - already, 1)), scheduler, seconds, say) as cluster:
        if job.solves is None:
            gather((job.work(number) for number in range(count) if number not in store), count)
        else:
            from validate.sweep.mapping import refine

            cells = refine(job, store, gather)
    say("writing the results")
    table = read(job, store, cells)
    return table, _write(store, table, figures, time.monotonic() - started)


def _write(store: Store, table: Table, figures: bool, seconds: float) -> dict[str, Any]:
    """Write the files; return the content of sweep.json."""
    from validate.report.output import write_columns
    from validate.report.summary import as_json, provenance

    columns = table.columns
    tables = {"points.csv": table.keys | columns} | ({"map.csv": table.map} if table.map else {})
    for name, content in tables.items():
        with store.writing(name) as file:
            write_columns(file, content, missing="")
    files = [*tables]
    counts: dict[str, Any] = {"points": len(table), **Counter(columns["status"].tolist())}
    if table.map:
        verdicts = table.map["verdict"].tolist()
        counts["cells"] = {"all": len(verdicts), **Counter(verdicts)}
    if figures:
        from validate.report.figures.drawing import save, style
        from validate.sweep.figures import draw

        with style():
            files += [file for name, figure in draw(table).items() for file in save(figure, store.folder, name)]
    made = {name.removesuffix("_verdict"): words for name, words in columns.items() if name.endswith("_verdict")}
    versions = {name: metadata.version(name) for name in ("numpy", "scipy", "scikit-fem")}
    document: dict[str, Any] = as_json(
        {
            "schema": 1,
            "asked": table.job.document(),
            "finished": True,
            "sentence": table.sentence,
            "counts": counts,
            "verdicts": {check: dict(Counter(filter(None, words.tolist()))) for check, words in made.items()},
            "seconds": {"this_run": round(seconds, 1), "points": round(float(columns["seconds"].sum()), 1)},
            "provenance": provenance() | versions | {"system": platform.system(), "processors": os.cpu_count()},
            "files": [*files, "report.html", SUMMARY],
        }
    )
    with store.writing("report.html") as file:
        file.write(_page(store.folder, table, document))
    store.write(document)
    return document


def _page(folder: Path, points: Table, document: Mapping[str, Any]) -> str:
    """Return report.html: the sentence, the counts of verdicts, the figures from ``folder``, and the request."""
    from compare.report.table import html_section as section
    from compare.report.table import html_table as table
    from compare.report.table import html_text as text
    from validate.report import page

    name, said, verdicts = points.job.base.name, document["sentence"], ("agrees", "differs", "unresolved")
    rows = [
        [text(check), *(f'<span class="{word}">{n.get(word, 0)}</span>' for word in verdicts)]
        for check, n in document["verdicts"].items()
    ]
    request = {key: value for key, value in document["asked"].items() if key not in ("scene", "vary")}
    varied = {a.key: "range" if a.range else f"{len(a.values)} values" for a in points.job.design.axes}

    def in_columns(items: Mapping[str, Any]) -> str:
        return f'<div class="columns">{page.values(items)}</div>'

    parts = [
        section("Checks", table(("check", *verdicts), rows, (1, 2, 3)) if rows else ""),
        page.figures(folder, document, _CAPTIONS),
        section("Request", in_columns({"scene": name, "varied": varied, **request})),
        section("Versions and counts", in_columns({"counts": document["counts"], **document["provenance"]})),
    ]
    return page.whole(name, f'<p class="verdict">{text(said[0].upper() + said[1:])}.</p>', parts)


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
    scene_base = base(scene, [f"run.accuracy={accuracy!r}"])
    form = "grid" if sample is None else "sample"
    axes = [
        parse(scene_base, f"{key}={given}", form) if isinstance(given, str) else listed(scene_base, key, list(given))
        for key, given in (vary or {}).items()
    ]
    models = parse_reductions([model or reduction] if isinstance(reduction, str) else reduction)
    job = prepare(scene_base, Design(tuple(axes), sample, seed), models, check, steady, blame)
    with TemporaryDirectory() as folder, Store(Path(out or folder), job.document(), fresh) as store:
        say = progress or (lambda _: None)
        return run(job, store, say, workers=workers, scheduler=scheduler, seconds=point_timeout, figures=figures)[0]
