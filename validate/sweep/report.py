"""report.html of a sweep: the sentence, the points to hover over, the figures, and what was asked."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from validate.report.html.page import figures, whole
from validate.report.html.parts import section, table, text, values
from validate.sweep.table import COLOURS, Table

_CAPTIONS = {
    "figure_map": "Where the reduction is within the tolerance, and which assumption is to blame where it is not.",
    "figure_lines": "Differences from 3D over the varied key, with their errors; grey is within the tolerance.",
    "figure_pairs": "Every pair of keys; the largest differences on top.",
    "figure_indices": "How much of the difference's variance each key explains.",
}
MOST = 40_000
"""Points that the page shows; of more it shows some, evenly chosen."""


def page(folder: Path, found: Table, document: Mapping[str, Any]) -> str:
    """The page as text, with nothing outside of it; figures are read from ``folder``."""
    job = found.job
    script = Path(__file__).with_name("hover.js").read_text(encoding="utf-8")
    data = json.dumps(_data(found), separators=(",", ":")).replace("</", "<\\/")
    counts, sentence = document["counts"], document["sentence"]
    said = f"{sentence[0].upper()}{sentence[1:]}."
    rows = [
        [
            text(check),
            *(f'<span class="{word}">{n.get(word, 0)}</span>' for word in ("agrees", "differs", "unresolved")),
        ]
        for check, n in document["verdicts"].items()
    ]
    asked = {key: value for key, value in document["asked"].items() if key not in ("scene", "vary")}
    varied = {
        key: f"{len(axis['values'])} values" if not axis["range"] else "range"
        for key, axis in document["asked"]["vary"].items()
    }
    parts = [
        section(
            "Points",
            '<div class="hover"><p class="choose"></p><canvas></canvas>',
            '<p class="said">Point at a place to read it.</p></div>',
        ),
        section("Checks", table(("check", "agrees", "differs", "unresolved"), rows, (1, 2, 3)) if rows else ""),
        figures(folder, document, _CAPTIONS),
        section("Asked", f'<div class="columns">{values({"scene": job.base.name, "varied": varied, **asked})}</div>'),
        section(
            "Versions and counts", f'<div class="columns">{values({"counts": counts, **document["provenance"]})}</div>'
        ),
    ]
    scripts = f'<script type="application/json" id="rows">{data}</script>\n<script>\n{script}</script>'
    return whole(job.base.name, f'<p class="verdict">{text(said)}</p>', parts, scripts, _STYLE)


_STYLE = """
.verdict { font-size: 1.35rem; }
.hover canvas { width: 100%; height: 30rem; max-width: 60rem; border: 1px solid var(--line); cursor: crosshair; }
.hover .choose { display: flex; flex-wrap: wrap; gap: 0.3rem 1.2rem; }
.hover .said { min-height: 3rem; white-space: pre-wrap; font-variant-numeric: tabular-nums; }
"""


def _data(found: Table) -> dict[str, Any]:
    """What the page draws: keys, values with errors, words, each a column over the points or the cells."""
    design, scope, cells = found.job.design, found.job.scope, found.cells
    if cells is not None:
        grid = [design.point(n) for n in range(design.count)]
        keys = {key: np.array([point[i] for point in grid]) for i, key in enumerate(design.keys)}
        how = np.full(design.count, "interpolated", object)
        how[list(cells.solved)] = "solved"
        numbers = {scope.check: (cells.surface.value.ravel(), cells.surface.error.ravel())}
        words = {"verdict": cells.verdicts.ravel(), "to blame": cells.blames.ravel(), "how": how}
    else:
        keys, numbers = found.keys, found.series()
        for reduction in scope.reductions[1:]:
            numbers |= {f"{reduction}_{name}": given for name, given in found.series(reduction).items()}
        names_of = {f"{scope.check}_verdict": "verdict", "blame": "to blame", "status": "status"}
        words = {word: found.columns[name] for name, word in names_of.items() if name in found.columns}
    size = len(next(iter(keys.values())))
    some = np.unique(np.linspace(0, size - 1, min(size, MOST)).round().astype(int))

    def column(values: np.ndarray) -> list[Any]:
        if values.dtype == object:
            return [str(value) for value in values[some]]
        return [float(f"{value:.6g}") if np.isfinite(value) else None for value in values[some]]

    return {
        "keys": {key: column(values) for key, values in keys.items()},
        "units": found.units,
        "log": [axis.key for axis in design.axes if axis.log],
        "relative": found.relative,
        "values": {name: [column(value), column(error)] for name, (value, error) in numbers.items()},
        "words": {name: column(given) for name, given in words.items() if given.dtype == object},
        "tolerances": found.tolerances,
        "cells": list(design.shape) if cells is not None else None,
        "colours": COLOURS,
    }
