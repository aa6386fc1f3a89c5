"""The report of a sink: the verdict first, then the numbers, then the reasons."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from compare.report import checks
from compare.report.table import Section, Style, Table, wrapped
from compare.verdict import PAPERS, Check, relative
from scenes.checks import OF_THE_REDUCTION
from scenes.formats import percent, quantity, sink_text, with_error
from scenes.sink import OF_A_SINK

if TYPE_CHECKING:
    import numpy as np

    from compare.outcome import Outcome
    from scenes.sink import Sink

HIDDEN = ("own_model", "levels")
"""Details of a 1D result that are objects, not data."""
QUANTITIES = {entry.steady: (entry.called, entry.unit) for entry in OF_A_SINK.values()}


def headline(outcome: Outcome[Sink], contrary: Sequence[Check], style: Style) -> str:
    """State the answer, then the number of checks that differ."""
    said = [style.paint(wrapped(outcome.answer), "heading")]
    listed = checks.without_slopes(outcome.checks)
    name, model = sink_text(outcome.scene), _model(outcome)
    if model and model != "1D":
        name += f", {model}" + (" against 3D" if outcome.fem3d is not None else "")
    if counted := checks.counted(name, outcome, contrary):
        said.append(style.paint(wrapped(counted), "heading"))
    rest = Counter(check.verdict for check in listed if not check.own)
    if rest:
        off = f"{rest['differs']} differ{'s' * (rest['differs'] == 1)}"
        said.append(wrapped(f"Of the paper's own {rest.total()} equations, which are not this model's, {off}."))
    return "\n".join(said)


def sections(outcome: Outcome[Sink], contrary: Sequence[Check], style: Style) -> list[Section]:
    """Return the quantities, and the checks with their reasons."""
    judged = checks.sections(checks.without_slopes(outcome.checks), contrary, style)
    return [quantities(outcome, style), *judged]


def _model(outcome: Outcome[Sink]) -> str:
    reduced1d = outcome.reduced1d
    return "" if reduced1d is None else "1D" if reduced1d.model in PAPERS else reduced1d.model


def quantities(outcome: Outcome[Sink], style: Style) -> Section:
    """Return the steady quantities: 3D with its error, 1D, and the difference."""
    fem3d, reduced1d, rows = outcome.fem3d, outcome.reduced1d, []
    heads = ["steady state", *["3D"] * (fem3d is not None), *[_model(outcome)] * (reduced1d is not None)]
    for key, (name, unit) in QUANTITIES.items():
        cells = [name]
        if fem3d is not None:
            value, error, shown, places, factor = with_error(fem3d.steady[key].value, fem3d.steady[key].error, unit)
            cells.append(f"{value} {style.plus_minus} {error} {shown}")
        if reduced1d is not None and key not in reduced1d.steady:
            cells += ["", ""][: 1 + (fem3d is not None)]
        elif reduced1d is not None and fem3d is not None:
            predicted = reduced1d.steady[key].value
            off = percent(relative(predicted, fem3d.steady[key].value), sign=True)
            cells += [f"{predicted * factor:.{min(places, 4)}f} {shown}", off]
        elif reduced1d is not None:
            cells.append(quantity(reduced1d.steady[key].value, unit, 6))
        rows.append(cells)
    return Section("Steady state", [Table(heads + ["1D/3D - 1"] * (len(heads) > 2), rows)], headed=False)


def document(outcome: Outcome[Sink]) -> dict[str, Any]:
    from compare.report.document import check_document, of_3d

    fem3d, reduced1d = outcome.fem3d, outcome.reduced1d
    document: dict[str, Any] = {"fem3d": None, "reduced1d": None, "answer": outcome.answer}
    if fem3d is not None:
        document["fem3d"] = of_3d(fem3d, "energy_imbalance", "unknowns", "steps", "symmetry", "mesh")
        if fem3d.traces is not None:
            imbalance = fem3d.details.get("transient_imbalance")
            document["fem3d"]["transient"] = {"errors": fem3d.traces.errors, "imbalance": imbalance}
    if reduced1d is not None:
        steady = {key: {"value": e.value} for key, e in reduced1d.steady.items()}
        document["reduced1d"] = {
            "name": reduced1d.model,
            "steady": steady,
            "details": {k: v for k, v in reduced1d.details.items() if k not in HIDDEN},
        }
    # The others are of the paper's equations, whichever reduction was chosen.
    model = {} if reduced1d is None else {check: {"model": reduced1d.model} for check in OF_THE_REDUCTION}
    return document | {"checks": [check_document(check) | model.get(check.id, {}) for check in outcome.checks]}


def columns(outcome: Outcome[Sink]) -> dict[str, np.ndarray]:
    """Return time_s, then <model>_<quantity>_<unit>, temperatures in kelvin; every 1D model is "reduced1d".

    Raises ValueError where the models' times differ.
    """
    import numpy as np

    columns: dict[str, np.ndarray] = {}
    for name, result in (("fem3d", outcome.fem3d), ("reduced1d", outcome.reduced1d)):
        if result is None or result.traces is None:
            continue
        if not np.array_equal(columns.setdefault("time_s", result.traces.time), result.traces.time):
            raise ValueError("the models' traces must be at the same times")
        columns |= {f"{name}_{key}": value for key, value in result.traces.values.items()}
    return columns
