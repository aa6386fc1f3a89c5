"""How a run of the sink is told and kept: the verdict first, then the numbers, then the reasons."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from compare.verdict import PAPERS, Check, relative
from scenes.checks import OF_THE_REDUCTION
from scenes.formats import percent, quantity, sink_text, with_error
from scenes.sink import OF_A_SINK
from validate.report import analysed, checks
from validate.report.table import Section, Style, Table, wrapped

if TYPE_CHECKING:
    import numpy as np

    from reduced1d.painted import Reduction
    from scenes.sink import Sink
    from validate.report.figures.render import Field
    from validate.run.outcome import Outcome

QUANTITIES = {entry.steady: (entry.called, entry.unit) for entry in OF_A_SINK.values()}
FIGURES = {
    "figure5": "sink_figures.profile",
    "figure6": "sink_figures.rises",
    "figure7": "sink_figures.current",
    "islands": "sink_figures.row",
    "left_out": "left_out_figure.draw",
    "islands_runs": "sink_figures.runs",
    "why": "analysis_figures.why",
    "sensitivity": "analysis_figures.sensitivity",
    "validation": "analysis_figures.validation",
}
FIELD_FIGURE = "figure4"


def title(outcome: Outcome[Sink]) -> str:
    return sink_text(outcome.scene)


def headline(outcome: Outcome[Sink], contrary: Sequence[Check], style: Style) -> str:
    """The answer of the run, then how many checks differ, and whether that was known."""
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
    """The quantities, the checks with their reasons and, where asked for, the parts of the differences."""
    data = [] if outcome.against is None else [Section("Your data", [outcome.against.said()], headed=False)]
    judged = checks.sections(checks.without_slopes(outcome.checks), contrary, style)
    return [quantities(outcome, style), *data, *judged, *analysed(outcome, style)]


def _model(outcome: Outcome[Sink]) -> str:
    """What the 1D model is called: "1D" where it is the paper's; empty where there is none."""
    reduced1d = outcome.reduced1d
    return "" if reduced1d is None else "1D" if reduced1d.model in PAPERS else reduced1d.model


def quantities(outcome: Outcome[Sink], style: Style) -> Section:
    """Steady quantities: 3D with its error, 1D, and how far 1D is off."""
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


def entries(outcome: Outcome[Sink]) -> dict[str, Any]:
    from validate.report.summary import check_document, of_3d

    fem3d, reduced1d = outcome.fem3d, outcome.reduced1d
    document: dict[str, Any] = {"fem3d": None, "reduced1d": None, "answer": outcome.answer}
    if fem3d is not None:
        document["fem3d"] = of_3d(fem3d, "energy_imbalance", "unknowns", "steps", "symmetry", "mesh")
        if fem3d.traces is not None:
            imbalance = fem3d.details.get("transient_imbalance")
            document["fem3d"]["transient"] = {"errors": fem3d.traces.errors, "imbalance": imbalance}
    if reduced1d is not None:
        steady = {key: {"value": e.value} for key, e in reduced1d.steady.items()}
        document["reduced1d"] = {"name": reduced1d.model, "steady": steady, "details": reduced1d.details}
    # The others are of the paper's equations, whichever reduction was chosen.
    model = {} if reduced1d is None else {check: {"model": reduced1d.model} for check in OF_THE_REDUCTION}
    return document | {"checks": [check_document(check) | model.get(check.id, {}) for check in outcome.checks]}


def columns(outcome: Outcome[Sink]) -> dict[str, np.ndarray]:
    """time_s, then <model>_<quantity>_<unit> with temperatures in kelvin, where every 1D model is "reduced1d": a reader
    of them need not know which it was. ValueError where the models' times differ."""
    import numpy as np

    columns: dict[str, np.ndarray] = {}
    for name, result in (("fem3d", outcome.fem3d), ("reduced1d", outcome.reduced1d)):
        if result is None or result.traces is None:
            continue
        if not np.array_equal(columns.setdefault("time_s", result.traces.time), result.traces.time):
            raise ValueError("the models' traces must be at the same times")
        columns |= {f"{name}_{key}": value for key, value in result.traces.values.items()}
    return columns


def stored(outcome: Outcome[Sink]) -> tuple[np.ndarray, float, Reduction | None]:
    from reduced1d.painted import of_result
    from validate.report.fields import stored_times

    sink, request, reduced1d = outcome.scene, outcome.request, outcome.reduced1d
    times = stored_times(sink.end_time, request.field_times)
    # A row's spans are not painted: the model that is painted has one.
    # Nor is a user's own, of which only numbers are known.
    painted = (
        None if reduced1d is None or sink.spans > 1 or outcome.own_model is not None else of_result(sink, reduced1d)
    )
    return times if request.transient else times[:0], sink.room_temperature, painted


def field(outcome: Outcome[Sink]) -> Field:
    """The steady field; of a row of spans, which would be a thread, those that were solved."""
    from validate.report.figures.render import Field

    sink, details = outcome.scene, outcome.solved.details
    fields, solved, room = details["fields"].distinct, details["spans_solved"], sink.room_temperature
    part = f"{solved} of {sink.spans} spans" if solved < sink.spans else ""
    size = " x ".join(f"{side * 1e6:.4g}" for side in (sink.length, sink.width, sink.thickness))
    under: list[Check | str] = [f"{part}, those that were solved: the others are as the middle one"] if part else []
    return Field(
        fields.points, fields.hexes, fields.steady - room, f"steady rise{part and f' of {part}'}",
        f"Figure 4: steady 3D temperature, {sink_text(sink)} ({'beam' if sink.spans == 1 else 'spans of'} {size} µm, ",
        "thickness", f"rise above {room:g} K (K)", under=(*under, *(c for c in outcome.checks if c.id == "fig4")),
        instead="the steady temperature of the top faces, from above: no OpenGL to render in 3D with",
    )  # fmt: skip
