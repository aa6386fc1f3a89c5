"""The report of a run of a sink, and its entries of summary.json."""

from typing import Any

from compare.outcome import Outcome
from compare.report import Section, Style, Table
from compare.verdict import PAPER, ratio
from scenes.checks import OF_THE_REDUCTION
from scenes.formats import percent, quantity, sink_text, with_error
from scenes.sink import OF_A_SINK, Sink
from validate.report.checks import checked, checks_document, counted, steady_document


def headline(outcome: Outcome[Sink], style: Style) -> list[str]:
    name, reduced1d = sink_text(outcome.scene), outcome.reduced1d
    if reduced1d is not None and reduced1d.model != PAPER:
        name += f", {reduced1d.model}" + " against 3D" * (outcome.fem3d is not None)
    return [outcome.answer, counted(outcome, f"{name}: ")]


def sections(outcome: Outcome[Sink], style: Style) -> list[Section]:
    """Return the steady quantities, and the checks with their reasons."""
    fem3d, reduced1d, rows, off = outcome.fem3d, outcome.reduced1d, [], "1D/3D - 1"
    model = "" if reduced1d is None else "1D" if reduced1d.model == PAPER else reduced1d.model
    heads = [*["3D"] * (fem3d is not None), *[model] * bool(model), *[off] * bool(fem3d and model)]
    for entry in OF_A_SINK.values():
        three, one = (None if r is None else r.steady.get(entry.steady) for r in (fem3d, reduced1d))
        cells = dict.fromkeys(heads, "")
        if one is not None:
            cells[model] = quantity(one.value, entry.unit, 6)
        if three is not None:
            value, error, shown, places, factor = with_error(three.value, three.error, entry.unit)
            cells["3D"] = f"{value} {style.plus_minus} {error} {shown}"
            if one is not None:
                cells[model] = f"{one.value * factor:.{min(places, 4)}f} {shown}"
                change = ratio(one, three)
                surely = abs(change.value) > change.error
                cells[off] = percent(change.value, sign=True) if surely else f"within {percent(change.error)}"
        rows.append([entry.called, *cells.values()])
    return [
        Section("Steady state", [Table(("steady state", *heads), rows)], headed=False),
        *checked(outcome, style),
    ]


def document(outcome: Outcome[Sink]) -> dict[str, Any]:
    fem3d, reduced1d = outcome.fem3d, outcome.reduced1d
    document: dict[str, Any] = {"fem3d": None, "reduced1d": None, "answer": outcome.answer}
    if fem3d is not None:
        document["fem3d"] = steady_document(fem3d, "energy_imbalance", "unknowns", "steps", "symmetry", "mesh")
        if fem3d.traces is not None:
            imbalance = fem3d.details.get("transient_imbalance")
            document["fem3d"]["transient"] = {"errors": fem3d.traces.errors, "imbalance": imbalance}
    checks = checks_document(outcome)
    if reduced1d is not None:
        document["reduced1d"] = {
            "name": reduced1d.model, "steady": {key: {"value": e.value} for key, e in reduced1d.steady.items()},
            "details": {k: v for k, v in reduced1d.details.items() if k != "own_model"},
        }  # fmt: skip
        # The others are of the paper's equations, whichever reduction was chosen.
        checks = [c | {"model": reduced1d.model} if c["id"] in OF_THE_REDUCTION else c for c in checks]
    return document | {"checks": checks}
