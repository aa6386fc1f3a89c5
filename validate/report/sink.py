"""How a run of the sink is told and kept: the verdict first, then the numbers, then the reasons."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from compare import plan
from compare.verdict import PAPERS, Check, relative
from scenes.checks import OF_THE_REDUCTION
from scenes.formats import percent, quantity, sink_text, with_error
from scenes.quantities import OF_A_SINK
from validate.report import asked_for, checks
from validate.report.table import Section, Style, Table, wrapped

if TYPE_CHECKING:
    import numpy as np
    from matplotlib.figure import Figure

    from compare.outcome import Outcome
    from reduced1d.painted import Reduction
    from scenes.plan import Request, Step
    from scenes.result import Result
    from scenes.sink import Sink
    from validate.report.figures.render import Field

QUANTITIES = {asked.steady: (asked.called, asked.unit) for asked in OF_A_SINK.values()}


def title(outcome: Outcome[Sink]) -> str:
    """What the run is of."""
    return sink_text(outcome.scene)


def headline(outcome: Outcome[Sink], contrary: Sequence[Check], style: Style) -> str:
    """The answer of the run, then how many checks differ, and whether that was known."""
    said = [style.paint(wrapped(outcome.answer), "heading")]
    name = f"{sink_text(outcome.scene)}{_against(outcome)}"
    listed_ones = checks.without_slopes(outcome.checks)
    own = [check for check in listed_ones if check.own]
    if own:
        said.append(_verdicts(name, own, contrary, outcome.scene.expected_to_differ is not None, style))
    rest = [check for check in listed_ones if not check.own]
    if rest:
        count = sum(check.verdict == "differs" for check in rest)
        off = f"{count} differs" if count == 1 else f"{count} differ"
        said.append(wrapped(f"Of the paper's own {len(rest)} equations, which are not this model's, {off}."))
    return "\n".join(said)


def sections(outcome: Outcome[Sink], contrary: Sequence[Check], style: Style) -> list[Section]:
    """The quantities, the checks with their reasons and, where asked for, the parts of the differences."""
    found = [quantities(outcome, style)]
    if outcome.against is not None:
        found.append(Section("Your data", [outcome.against.said()], headed=False))
    found += checks.sections(checks.without_slopes(outcome.checks), contrary, style)
    return found + asked_for(outcome, style)


def _against(outcome: Outcome[Sink]) -> str:
    """The 1D model, where it is another than the paper's."""
    if outcome.reduced1d is None or outcome.reduced1d.model in PAPERS:
        return ""
    return f", {outcome.reduced1d.model}" + (" against 3D" if outcome.fem3d is not None else "")


def _verdicts(
    name: str, checks: Sequence[Check], contrary: Sequence[Check], declared: bool, style: Style
) -> str:  # fmt: skip
    """How many checks differ, and whether that was known of the scene."""
    count = {v: sum(check.verdict == v for check in checks) for v in ("agrees", "differs", "unresolved")}
    differ = f"{count['differs']} of {len(checks)} checks {'differs' if count['differs'] == 1 else 'differ'}"
    said = f"{name}: {differ if count['agrees'] < len(checks) else f'all {len(checks)} checks agree'}"
    if count["unresolved"]:
        said += f", {count['unresolved']} unresolved"
    if contrary:
        said += f"; not as expected: {', '.join(check.id for check in contrary)}."
    elif declared and count["unresolved"]:
        said += "; the others are as the scene declares."
    elif declared:
        said += ", as the scene declares: all were known."
    else:
        said += "; nothing was declared of this scene beforehand."
    return style.paint(wrapped(said), "heading")


def quantities(outcome: Outcome[Sink], style: Style) -> Section:
    """Steady quantities: 3D with its error, 1D, and how far 1D is off."""
    three, one = outcome.fem3d, outcome.reduced1d
    heads = ["steady state", *(["3D"] if three else []), *([one.model if _against(outcome) else "1D"] if one else [])]
    rows = []
    for key, (name, unit) in QUANTITIES.items():
        cells = [name]
        if three is not None:
            value, error, shown, places, factor = with_error(three.steady[key].value, three.steady[key].error, unit)
            cells.append(f"{value} {style.plus_minus} {error} {shown}")
        if one is not None and three is not None:
            other = one.steady[key].value
            cells.append(f"{other * factor:.{min(places, 4)}f} {shown}")
            cells.append(percent(relative(other, three.steady[key].value), sign=True))
        elif one is not None:
            cells.append(quantity(one.steady[key].value, unit, 6))
        rows.append(cells)
    return Section("Steady state", [Table(heads + ["1D/3D - 1"] * (len(heads) > 2), rows)], headed=False)


def entries(outcome: Outcome[Sink]) -> dict[str, Any]:
    """What summary.json has of a sink."""
    from validate.report.summary import check_document

    fem3d, reduced1d = outcome.fem3d, outcome.reduced1d
    # The others are of the paper's equations, whichever reduction was chosen.
    model = {} if reduced1d is None else {check: {"model": reduced1d.model} for check in OF_THE_REDUCTION}
    found: dict[str, Any] = {
        "fem3d": None if fem3d is None else _fem3d(fem3d),
        "reduced1d": None if reduced1d is None else _reduced1d(reduced1d),
        "answer": outcome.answer,
        "checks": [check_document(check) | model.get(check.id, {}) for check in outcome.checks],
    }
    if outcome.why is not None:
        from validate.report.budget import document

        found["why"] = document(outcome.why)
    if outcome.propagated is not None:
        from validate.report.inputs import entered

        entered(found, outcome.propagated, outcome.sampled)
    for entry, part in (
        ("calibration", outcome.fit), ("validation", outcome.validation), ("air", outcome.air),
        ("sensitivities", outcome.sensitivities), ("against", outcome.against),
    ):  # fmt: skip
        if part is not None:
            found[entry] = part.document()
    return found


def _fem3d(result: Result) -> dict[str, Any]:
    details = result.details
    found = {
        "steady": {key: {"value": e.value, "error": e.error} for key, e in result.steady.items()},
        "energy_imbalance": details["energy_imbalance"],
        "dofs": details["unknowns"],
        "steps": details["steps"],
        "symmetry": details.get("symmetry"),
        "mesh": details.get("mesh"),
    }
    if result.traces is not None:
        found["transient"] = {"errors": result.traces.errors, "imbalance": details.get("transient_imbalance")}
    return found


def _reduced1d(result: Result) -> dict[str, Any]:
    found = {"name": result.model, "steady": {key: {"value": e.value} for key, e in result.steady.items()}}
    return {**found, "details": result.details}


def columns(outcome: Outcome[Sink]) -> dict[str, np.ndarray]:
    """The columns of traces.csv: time_s, then <model>_<quantity>_<unit> with temperatures in kelvin, where every 1D
    model is "reduced1d": a reader of them need not know which it was. Empty without a transient. ValueError where the
    models' times differ."""
    import numpy as np

    found: dict[str, np.ndarray] = {}
    for name, result in (("fem3d", outcome.fem3d), ("reduced1d", outcome.reduced1d)):
        if result is None or result.traces is None:
            continue
        if not np.array_equal(found.setdefault("time_s", result.traces.time), result.traces.time):
            raise ValueError("the models' traces must be at the same times")
        found |= {f"{name}_{key}": value for key, value in result.traces.values.items()}
    return found


def more_columns(outcome: Outcome[Sink]) -> dict[str, dict[str, np.ndarray]]:
    """The columns of other files, by their names."""
    if outcome.sensitivities is None or outcome.sensitivities.course is None:
        return {}
    return {"sensitivities.csv": outcome.sensitivities.course.columns()}


def stored(outcome: Outcome[Sink]) -> tuple[np.ndarray, float, Reduction | None]:
    """Of the field files the times (s), what rises are above (K), and the 1D model beside 3D."""
    from reduced1d.painted import of_result
    from validate.report.fields import stored_times

    sink, request, one = outcome.scene, outcome.request, outcome.reduced1d
    times = stored_times(sink.end_time, request.field_times)
    # A row's spans are not painted: the model that is painted has one.
    painted = None if one is None or sink.spans > 1 else of_result(sink, one)
    return times if request.transient else times[:0], sink.room_temperature, painted


FIGURES = {
    "figure5": "figures.profile_figure.draw",
    "figure6": "figures.time_figures.rises",
    "figure7": "figures.time_figures.current",
    "islands": "figures.row_figures.profile",
    "air": "air.figure",
    "islands_runs": "figures.row_figures.runs",
    "why": "figures.why_figure.draw",
    "sensitivity": "figures.sensitivity_figure.draw",
    "validation": "figures.validation_figure.draw",
}
"""What draws each figure of the plan but that of the field, in ``validate.report``."""
FIELD_FIGURE = "figure4"


def draws_field(sink: Sink, request: Request) -> bool:
    """Whether there will be a field to render."""
    return FIELD_FIGURE not in plan.skipped_figures(sink, request)


def field(outcome: Outcome[Sink]) -> Field:
    """The steady field; of a row of spans, which would be a thread, those that were solved."""
    from validate.report.figures.render import Field

    sink, fields = outcome.scene, outcome.solved.details["fields"].distinct
    rise, part = fields.steady - sink.room_temperature, _part(outcome)
    return Field(fields.points, fields.hexes, rise, f"steady rise{part and f' of {part}'}")


def _part(outcome: Outcome[Sink]) -> str:
    """Which of a row's spans the field has, where it has not all."""
    spans, solved = outcome.scene.spans, outcome.solved.details["spans_solved"]
    return f"{solved} of {spans} spans" if solved < spans else ""


def field_figure(outcome: Outcome[Sink], shown: Field, image: np.ndarray | None) -> tuple[Figure, Step | None]:
    """Figure 4, and what the plan says of it where it turned out otherwise."""
    from scenes.plan import Step
    from validate.report.figures import field_figure

    sink, note = outcome.scene, None
    if image is None:
        said = "the steady temperature of the top faces, from above: no OpenGL to render in 3D with"
        note = Step(FIELD_FIGURE, "done", said)
    thick = "true proportions" if shown.factor <= 1 else f"thickness drawn x{shown.factor:g}"
    size = " x ".join(f"{side * 1e6:.4g}" for side in (sink.length, sink.width, sink.thickness))
    text = (
        f"Figure 4: steady 3D temperature, {sink_text(sink)} ({'beam' if sink.spans == 1 else 'spans of'} {size} µm, "
        f"{'seen from above' if image is None else thick})"
    )
    under: list[Check | str] = [check for check in outcome.checks if check.id == "fig4"]
    if part := _part(outcome):
        under.insert(0, f"{part}, those that were solved: the others are as the middle one")
    label = f"rise above {sink.room_temperature:g} K (K)"
    return field_figure.draw(shown, image, 0.0, text, label, under), note
