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


def write(job: Job, store: Store, cells: Map | None, figures: bool, seconds: float) -> Outcome:
    """Writes the files; all are there when this returns, and made anew by another run of the same."""
    from validate.report.summary import as_json
    from validate.sweep.report import page

    table = tables.read(job, store, cells)
    said = tables.sentence(table)
    tables.write_points(job, store)
    files = ["points.csv"]
    counts: dict[str, Any] = {"points": len(table), **table.counts}
    if cells is not None:
        tables.write_map(job, store, cells)
        files.append("map.csv")
        words = cells.verdicts.ravel().tolist()
        counts["cells"] = {"all": len(words), **Counter(words)}
    if figures:
        files += _draw(store, table)
    document = as_json(
        {
            "schema": 1,
            "asked": job.document(),
            "finished": True,
            "sentence": said,
            "counts": counts,
            "verdicts": _by_check(table),
            "seconds": {"this_run": round(seconds, 1), "points": round(float(table.columns["seconds"].sum()), 1)},
            "provenance": _provenance(),
            "files": [*files, "report.html", ASKED],
        }
    )
    with store.writing("report.html") as file:
        file.write(page(store.folder, table, document))
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


def _by_check(table: Table) -> dict[str, dict[str, int]]:
    """How often each check came out how."""
    return {
        name.removesuffix("_verdict"): {
            word: int((column == word).sum()) for word in dict.fromkeys(column.tolist()) if word
        }
        for name, column in table.columns.items()
        if name.endswith("_verdict")
    }


def _draw(store: Store, table: Table) -> list[str]:
    """The figures as .png and .svg; their names."""
    from validate.report.figures.drawing import save, style
    from validate.sweep.figures import draw

    with style():
        return [file for name, figure in draw(table).items() for file in save(figure, store.folder, name)]
