"""Everything that is made of the stored rows: tables, figures, the page, sweep.json."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from validate.sweep import table as tables
from validate.sweep.job import Job
from validate.sweep.store import ASKED, Store
from validate.sweep.table import Table

if TYPE_CHECKING:
    from validate.sweep.mapping import Map


@dataclass(frozen=True, eq=False)
class Outcome:
    """The columns, what they say in a sentence, and what sweep.json holds."""

    table: Table
    sentence: str
    document: dict[str, Any]


def write(job: Job, store: Store, found: Map | None, figures: bool, seconds: float) -> Outcome:
    """Writes the files; all are there when this returns, and made anew by another run of the same."""
    from validate.report.summary import as_json

    table = tables.read(job, store)
    tolerances = _tolerances(job, table)
    said = tables.sentence(job.base, job.asked, table, tolerances.get(job.asked.check, 0.0), found)
    tables.write_points(job, store)
    files = ["points.csv"]
    if found is not None:
        tables.write_map(job, store, found)
        files.append("map.csv")
    if figures:
        files += _draw(job, store, table, tolerances, found)
    document = as_json(
        {
            "schema": 1,
            "asked": job.document(),
            "finished": True,
            "sentence": said,
            "counts": {"points": len(table), **table.counts} | _verdicts(found),
            "verdicts": _by_check(table),
            "seconds": {"this_run": round(seconds, 1), "points": round(float(table.columns["seconds"].sum()), 1)},
            "provenance": _provenance(),
            "files": [*files, "report.html", ASKED],
        }
    )
    from validate.sweep.report import page

    with store.writing("report.html") as file:
        file.write(page(job, store.folder, table, found, tolerances, document))
    store.write(ASKED, document)
    return Outcome(table, said, document)


def _provenance() -> dict[str, Any]:
    """What the rows were computed with: the solvers' processes have these, whatever is loaded here."""
    import os
    import platform
    from importlib import metadata

    from validate.report.summary import provenance

    versions = {name: metadata.version(name) for name in ("numpy", "scipy", "scikit-fem", "dask", "distributed")}
    return provenance() | versions | {"system": platform.system(), "processors": os.cpu_count()}


def _tolerances(job: Job, table: Table) -> dict[str, float]:
    """The tolerance of every check that was made."""
    if job.base.kind == "free":
        return {}
    sink: Any = job.base.at(())
    names = [name.removesuffix("_difference") for name in table.columns if name.endswith("_difference")]
    known = [
        job.asked.check,
        *(name for name in names if not name.startswith(tuple(f"{r}_" for r in job.asked.reductions[1:]))),
    ]
    return {name: sink.tolerance(name) for name in known}


def _verdicts(found: Map | None) -> dict[str, Any]:
    if found is None:
        return {}
    words = found.verdicts.ravel().tolist()
    return {"cells": {"all": len(words), **Counter(words)}}


def _by_check(table: Table) -> dict[str, dict[str, int]]:
    """How often each check came out how."""
    return {
        name.removesuffix("_verdict"): {
            word: int((column == word).sum()) for word in dict.fromkeys(column.tolist()) if word
        }
        for name, column in table.columns.items()
        if name.endswith("_verdict")
    }


def _draw(job: Job, store: Store, table: Table, tolerances: dict[str, float], found: Map | None) -> list[str]:
    """The figures as .png and .svg; their names."""
    from validate.report.figures.drawing import save, style
    from validate.sweep.figures import draw

    names = []
    with style():
        for name, figure in draw(job, table, tolerances, found).items():
            names += save(figure, store.folder, name)
    return names
