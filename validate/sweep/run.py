"""A sweep, or the map of a tolerance's line, from what is asked to a folder: the rows, and all that is made of them."""

from __future__ import annotations

import csv
import math
import time
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

from compare.processes import processors
from scenes.errors import SceneError
from scenes.formats import quantity
from scenes.sink import Sink
from validate.sweep.design import Design, base, listed, parse
from validate.sweep.point import Job, Scope, Work, checked
from validate.sweep.store import SUMMARY, Store
from validate.sweep.table import Table, read, sentence

if TYPE_CHECKING:
    import xarray

    from scenes.model import AnyScene
    from validate.sweep.mapping import Map


_CAPTIONS = {
    "figure_map": "Where the reduction is within the tolerance, and which assumption is to blame where it is not.",
    "figure_lines": "Differences from 3D over the varied key, with their errors; grey is within the tolerance.",
    "figure_pairs": "Every pair of keys; the largest differences on top.",
    "figure_indices": "How much of the difference's variance each key explains.",
}


def run(
    job: Job,
    store: Store,
    say: Callable[[str], None],
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    seconds: float | None = None,
    figures: bool = False,
) -> tuple[Table, dict[str, Any]]:
    """Solves what is not stored yet, by ``workers`` processes here (default: one a processor) or a ``scheduler``'s,
    with ``seconds`` for each point, and reports progress. Then writes all other files and returns their columns and
    what sweep.json holds. Raises SceneError for an unusable scheduler, and LostError."""
    from validate.sweep.cluster import Cluster

    already, started, count = len(store), time.monotonic(), job.design.count
    # Those that a map's number of solutions doesn't count.
    free = 0 if job.solves is None else sum(row.status == "refused" for row in store.rows())

    def gather(tasks: Iterable[Work], total: int, more: str = "") -> None:
        nonlocal free
        for solved in cluster.solve(tasks):
            store.append(solved)
            rate = (len(store) - already) / (time.monotonic() - started)
            if job.solves is not None:
                free += sum(row.status == "refused" for rows in solved for row in rows)
            done = len(store) - free
            rest = quantity(max(total - done, 0) / rate, "s", 2)
            say(f"{done} of {total} points, {rate:.2g} a second, {rest} left{more}")

    cells = None
    with Cluster(min(workers or processors(), max(count - already, 1)), scheduler, seconds, say) as cluster:
        if job.solves is None:
            gather(
                (job.work(new) for task in job.design.tasks() if (new := [n for n in task if n not in store])), count
            )
        else:
            from validate.sweep.mapping import refine

            cells = refine(job, store, gather)
    say("writing the results")
    return _written(job, store, cells, figures, time.monotonic() - started)


def _written(
    job: Job, store: Store, cells: Map | None, figures: bool, seconds: float
) -> tuple[Table, dict[str, Any]]:  # fmt: skip
    """Writes the files, made anew by another run of the same; the columns, and what sweep.json holds."""
    from validate.report.summary import as_json

    table = read(job, store, cells)
    columns = table.columns
    files = [_write(store, "points.csv", table.keys | columns)]
    counts: dict[str, Any] = {"points": len(table), **Counter(columns["status"].tolist())}
    if table.map:
        files.append(_write(store, "map.csv", table.map))
        verdicts = table.map["verdict"].tolist()
        counts["cells"] = {"all": len(verdicts), **Counter(verdicts)}
    if figures:
        from validate.report.figures.drawing import save, style
        from validate.sweep.figures import draw

        with style():
            files += [file for name, figure in draw(table).items() for file in save(figure, store.folder, name)]
    made = {name.removesuffix("_verdict"): words for name, words in columns.items() if name.endswith("_verdict")}
    document: dict[str, Any] = as_json(
        {
            "schema": 1,
            "asked": job.document(),
            "finished": True,
            "sentence": sentence(table),
            "counts": counts,
            "verdicts": {check: dict(Counter(filter(None, words.tolist()))) for check, words in made.items()},
            "seconds": {"this_run": round(seconds, 1), "points": round(float(columns["seconds"].sum()), 1)},
            "provenance": _provenance(),
            "files": [*files, "report.html", SUMMARY],
        }
    )
    with store.writing("report.html") as file:
        file.write(_page(store.folder, table, document))
    store.write(document)
    return table, document


def _write(store: Store, name: str, columns: Mapping[str, np.ndarray]) -> str:
    """A table of numbers to the last digit; what there is none of is empty."""
    with store.writing(name) as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        for row in zip(*(column.tolist() for column in columns.values()), strict=True):
            writer.writerow("" if isinstance(cell, float) and math.isnan(cell) else cell for cell in row)
    return name


def _provenance() -> dict[str, Any]:
    """What the rows were computed with: the solvers' processes have these, whatever is loaded here."""
    import os
    import platform
    from importlib import metadata

    from validate.report.summary import provenance

    versions = {name: metadata.version(name) for name in ("numpy", "scipy", "scikit-fem")}
    return provenance() | versions | {"system": platform.system(), "processors": os.cpu_count()}


def _page(folder: Path, points: Table, document: Mapping[str, Any]) -> str:
    """Return report.html: the sentence, the counts of verdicts, the figures from ``folder``, and the request."""
    from compare.report.table import html_section as section
    from compare.report.table import html_table as table
    from compare.report.table import html_text as text
    from validate.report.html import page
    from validate.report.html.page import values

    name = points.job.base.name
    counts, said = document["counts"], document["sentence"]
    verdicts = ("agrees", "differs", "unresolved")
    rows = [
        [text(check), *(f'<span class="{word}">{n.get(word, 0)}</span>' for word in verdicts)]
        for check, n in document["verdicts"].items()
    ]
    settings = {key: value for key, value in document["asked"].items() if key not in ("scene", "vary")}
    varied = {
        key: "range" if axis["range"] else f"{len(axis['values'])} values"
        for key, axis in document["asked"]["vary"].items()
    }

    def in_columns(items: Mapping[str, Any]) -> str:
        return f'<div class="columns">{values(items)}</div>'

    parts = [
        section("Checks", table(("check", *verdicts), rows, (1, 2, 3)) if rows else ""),
        page.figures(folder, document, _CAPTIONS),
        section("Request", in_columns({"scene": name, "varied": varied, **settings})),
        section("Versions and counts", in_columns({"counts": counts, **document["provenance"]})),
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
) -> xarray.Dataset:
    """Solve and compare a scene at many designs; the columns of points.csv as an ``xarray.Dataset``.

    ``vary`` has the values of each key: numbers in SI units, texts with units, words, or as on a command line the text
    "10um:200um:20", with ``sample`` "10um:200um". A grid's dimensions are the keys; a sample has one, "point". What is
    solved is kept in the folder ``out``, where the same call goes on; without it nothing stays. ``model`` is the
    file of one's own of a free scene, as --model takes it. ``point_timeout`` is in
    s; ``workers`` are processes, one a processor if not given. Raises SceneError for bad input, ArithmeticError where a
    cluster is lost, ImportError without xarray.
    """
    from compare.models import parse_reductions

    try:
        import xarray
    except ImportError:
        raise ImportError(
            "a sweep from Python needs xarray: pip install 'heated-microstructure-validation[sweep]'"
        ) from None
    if figures and out is None:
        raise SceneError("figures need a folder to go to: give out=")
    scene_base = base(scene, [f"run.accuracy={accuracy!r}"])
    form = "grid" if sample is None else "sample"
    axes = [
        parse(scene_base, f"{key}={given}", form) if isinstance(given, str) else listed(scene_base, key, list(given))
        for key, given in (vary or {}).items()
    ]
    design = Design(tuple(axes), sample, seed)
    names, model_path = parse_reductions([model or reduction] if isinstance(reduction, str) else reduction)
    check = checked(scene_base, check, steady, design.keys, names[0], model_path)
    scope = Scope(names, steady, check, blame, model=model_path)
    job, say = Job(scene_base, design, scope), progress or (lambda _: None)
    question, count = job.document(), job.design.count
    with TemporaryDirectory() as folder, Store(Path(out or Path(folder, "sweep")), question, fresh, count) as store:
        table, document = run(
            job, store, say, workers=workers, scheduler=scheduler, seconds=point_timeout, figures=figures
        )
    dims = design.keys if sample is None else ("point",)
    columns = {name: (dims, column.reshape(design.shape)) for name, column in table.columns.items()}
    places: dict[str, Any] = {axis.key: (axis.key, list(axis.values)) for axis in design.axes}
    if sample is not None:
        places = {key: ("point", values) for key, values in table.keys.items()}
    coordinates = {key: (*place, {"units": table.units[key]}) for key, place in places.items()}
    return xarray.Dataset(columns, coordinates, {"sentence": document["sentence"], "scene": scene_base.name})
