"""The report of a sink: the answer first, then the numbers, then the reasons."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from compare.outcome import Outcome
from compare.report import checks
from compare.report.table import Section, Style, Table, checks_document, steady_document, wrapped
from compare.verdict import PAPER, Check, part
from scenes.checks import OF_THE_REDUCTION
from scenes.formats import percent, quantity, sink_text, with_error
from scenes.sink import OF_A_SINK, Sink


def headline(outcome: Outcome[Sink], contrary: Sequence[Check], style: Style) -> str:
    """State the answer, then the number of checks that differ."""
    name, reduced1d = sink_text(outcome.scene), outcome.reduced1d
    if reduced1d is not None and reduced1d.model != PAPER:
        name += f", {reduced1d.model}" + " against 3D" * (outcome.fem3d is not None)
    counted = checks.counted(name, outcome, contrary)
    said = [style.paint(wrapped(text), "heading") for text in (outcome.answer, counted) if text]
    return "\n".join(said)


def sections(outcome: Outcome[Sink], contrary: Sequence[Check], style: Style) -> list[Section]:
    """Return the steady quantities, and the checks with their reasons."""
    fem3d, reduced1d, rows = outcome.fem3d, outcome.reduced1d, []
    for entry in OF_A_SINK.values():
        three, one = (None if r is None else r.steady.get(entry.steady) for r in (fem3d, reduced1d))
        cells, in_1d, off = [entry.called], "" if one is None else quantity(one.value, entry.unit, 6), ""
        if three is not None:
            value, error, shown, places, factor = with_error(three.value, three.error, entry.unit)
            cells.append(f"{value} {style.plus_minus} {error} {shown}")
            if one is not None:
                in_1d = f"{one.value * factor:.{min(places, 4)}f} {shown}"
                off = percent(part(one.value - three.value, three.value), sign=True)
        rows.append(cells + [in_1d, *[off] * (fem3d is not None)] * (reduced1d is not None))
    heads = ["steady state"] + ["3D"] * (fem3d is not None)
    if reduced1d is not None:
        heads += ["1D" if reduced1d.model == PAPER else reduced1d.model, *["1D/3D - 1"] * (fem3d is not None)]
    judged = checks.sections(outcome.checks, contrary, style)
    return [Section("Steady state", [Table(heads, rows)], headed=False), *judged]


def document(outcome: Outcome[Sink]) -> dict[str, Any]:
    """Return the entries of summary.json."""
    fem3d, reduced1d = outcome.fem3d, outcome.reduced1d
    document: dict[str, Any] = {"fem3d": None, "reduced1d": None, "answer": outcome.answer}
    if fem3d is not None:
        document["fem3d"] = steady_document(fem3d, "energy_imbalance", "unknowns", "steps", "symmetry", "mesh")
        if fem3d.traces is not None:
            imbalance = fem3d.details.get("transient_imbalance")
            document["fem3d"]["transient"] = {"errors": fem3d.traces.errors, "imbalance": imbalance}
    judged = checks_document(outcome)
    if reduced1d is not None:
        document["reduced1d"] = {
            "name": reduced1d.model, "steady": {key: {"value": e.value} for key, e in reduced1d.steady.items()},
            "details": {k: v for k, v in reduced1d.details.items() if k != "own_model"},
        }  # fmt: skip
        # The others are of the paper's equations, whichever reduction was chosen.
        judged = [c | {"model": reduced1d.model} if c["id"] in OF_THE_REDUCTION else c for c in judged]
    return document | {"checks": judged}


def columns(outcome: Outcome[Sink]) -> dict[str, np.ndarray]:
    """Return time_s, then <model>_<quantity>_<unit>, temperatures in kelvin; every 1D model is "reduced1d"."""
    results = {"fem3d": outcome.fem3d, "reduced1d": outcome.reduced1d}
    traces = {name: each.traces for name, each in results.items() if each is not None and each.traces is not None}
    columns = {"time_s": max((each.time for each in traces.values()), key=len)} if traces else {}
    for name, each in traces.items():
        columns |= {f"{name}_{key}": np.interp(columns["time_s"], each.time, v) for key, v in each.values.items()}
    return columns
