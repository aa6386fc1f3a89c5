"""How a run of the sink is told and kept: the verdict first, then the numbers, then the reasons."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from compare import plan
from compare.verdict import PAPERS, Check, relative
from scenes.checks import OF_THE_PAPER, OF_THE_REDUCTION
from scenes.formats import difference_text, percent, quantity, sink_text, with_error
from validate.report.table import Style, declared, listed, wrapped

if TYPE_CHECKING:
    import numpy as np
    from matplotlib.figure import Figure

    from compare.outcome import Outcome
    from reduced1d.painted import Reduction
    from scenes.plan import Request, Step
    from scenes.result import Result
    from scenes.sink import Sink
    from validate.report.figures.render import Field

NAME_WIDTH = 40  # columns of a check's id and title in the table of a terminal of 80
ID_WIDTH = 20  # up to which ids set a column of their own

QUANTITIES = {
    "peak_rise_K": ("peak rise", "K"),
    "end_rise_K": ("end rise", "K"),
    "mean_rise_K": ("mean rise", "K"),
    "current_A": ("current", "A"),
    "power_W": ("power", "W"),
    "heat_out_W": ("heat to the substrate", "W"),
    "anchor_resistance_K_per_W": ("anchor resistance", "K/W"),
}


def title(outcome: Outcome[Sink]) -> str:
    """What the run is of."""
    return sink_text(outcome.scene)


def headline(outcome: Outcome[Sink], contrary: Sequence[Check], style: Style) -> str:
    """The answer of the run, then how many checks differ, and whether that was known."""
    said = [style.paint(wrapped(outcome.answer), "heading")]
    name = f"{sink_text(outcome.scene)}{_against(outcome)}"
    listed_ones = without_slopes(outcome.checks)
    own = [check for check in listed_ones if check.own]
    if own:
        said.append(_verdicts(name, own, contrary, outcome.scene.expected_to_differ is not None, style))
    rest = [check for check in listed_ones if not check.own]
    if rest:
        count = sum(check.verdict == "differs" for check in rest)
        off = f"{count} differs" if count == 1 else f"{count} differ"
        said.append(wrapped(f"Of the paper's own {len(rest)} equations, which are not this model's, {off}."))
    return "\n".join(said)


def tables(outcome: Outcome[Sink], contrary: Sequence[Check], style: Style) -> list[str]:
    """The quantities, the checks with their reasons and, where asked for, the parts of the differences."""
    parts = [quantities_text(outcome, style)]
    if outcome.against is not None:
        parts.append(wrapped(outcome.against.said()))
    shown = without_slopes(outcome.checks)
    if shown:
        parts.append(checks_text(shown, style))
    parts.append(_reasons([check for check in shown if check.own], contrary, style))
    if outcome.propagated is not None:
        from validate.report.inputs import inputs_text

        parts.append(inputs_text(outcome, outcome.propagated, style))
    if outcome.fit is not None:
        from validate.report.calibration import fit_text

        parts.append(fit_text(outcome.fit, style))
    if outcome.validation is not None:
        from validate.report.validation import validation_text

        parts.append(validation_text(outcome.validation, style))
    if outcome.air is not None:
        from validate.report.air import air_text

        parts.append(air_text(outcome.air, style))
    if outcome.sensitivities is not None:
        from validate.report.sensitivities import followed, sensitivities_text

        parts.append(sensitivities_text(outcome.sensitivities, outcome.checks, style, followed(outcome)))
    if outcome.why is not None:
        from validate.report.budget import budget_text

        parts.append(budget_text(outcome.why, style))
    return parts


def without_slopes(checks: Sequence[Check]) -> list[Check]:
    """The checks but those of slopes, which have a table of their own."""
    return [check for check in checks if not check.id.startswith("slope_")]


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


def quantities_text(outcome: Outcome[Sink], style: Style) -> str:
    """Steady quantities: 3D with its error, 1D, and how far 1D is off."""
    name = outcome.reduced1d.model if _against(outcome) and outcome.reduced1d else "1D"
    heads = ("steady state", "3D" if outcome.fem3d else "", name if outcome.reduced1d else "")
    both = outcome.fem3d is not None and outcome.reduced1d is not None
    lines = [
        style.paint(
            f"  {heads[0]:<23}{heads[1]:>26}{heads[2]:>15}{'1D/3D - 1' if both else '':>13}".rstrip(), "heading"
        )
    ]
    for key, (name, unit) in QUANTITIES.items():
        lines.append(_quantity_line(key, name, unit, outcome.fem3d, outcome.reduced1d, style))
    return "\n".join(lines)


def _quantity_line(
    key: str, name: str, unit: str, fem3d: Result | None, reduced1d: Result | None, style: Style
) -> str:  # fmt: skip
    left, right, off = "", "", ""
    if fem3d is not None:
        found = fem3d.steady[key]
        value, error, shown, places, factor = with_error(found.value, found.error, unit)
        left = f"{value} {style.plus_minus} {error} {shown}"
        if reduced1d is not None:
            other = reduced1d.steady[key].value
            right = f"{other * factor:.{min(places, 4)}f} {shown}"
            off = percent(relative(other, found.value), sign=True)
    elif reduced1d is not None:
        right = quantity(reduced1d.steady[key].value, unit, 6)
    return f"  {name:<23}{left:>26}{right:>15}{off:>13}".rstrip()


def checks_text(checks: Sequence[Check], style: Style) -> str:
    """A line for every check, under what is compared in it; a second for a title that doesn't fit beside its id."""
    lines = [style.paint(f"  {'check':<40}{'difference':>17}{'tolerance':>10}", "heading")]
    room = max((len(check.id) + 1 for check in checks if len(check.id) < ID_WIDTH), default=0)
    for kind, found in by_kind(checks).items():
        lines += [f"  {kind}"] if kind else []
        for check in found:
            difference = difference_text(check.difference, check.u_num, style.plus_minus)
            word = style.paint(check.verdict, check.verdict)
            mark = style.paint(style.mark(check.verdict), check.verdict)
            name = f"{check.id:<{max(room, 14)}}{check.title}"
            below = [] if len(name) < NAME_WIDTH else [f"    {check.title}"]
            beside = check.id if below else name
            lines.append(f"{mark} {beside:<{NAME_WIDTH}}{difference:>18}{percent(check.tolerance, 1):>8}  {word}")
            lines += below
    return "\n".join(lines)


def by_kind(checks: Sequence[Check]) -> dict[str, list[Check]]:
    """Checks by what is compared in them, in words: one model with the other first."""
    found: dict[str, list[Check]] = {}
    for check in sorted(checks, key=lambda check: check.id not in OF_THE_REDUCTION):
        found.setdefault(kind_of(check.id, check.own), []).append(check)
    return found


def kind_of(check: str, own: bool) -> str:
    """What is compared in a check, by its id, and whether it is of the model that was chosen."""
    if check in OF_THE_REDUCTION:
        return "one model against the other: 1D less 3D"
    if check in OF_THE_PAPER:
        whose = "the paper's equations" if own else "the paper's equations (not this model's)"
        return f"{whose}: 3D numbers in, relative to 3D's own"
    if check.startswith("slope_"):
        return "how the models follow a key: 1D less 3D"
    if check.startswith("air_"):
        return "the air left out: 3D without it less 3D with it"
    if check == "islands_equivalent":
        return "3D alone"
    return {"energy": "3D alone"}.get(check, "your data less 3D" if check.startswith("against_") else "")


def _reasons(checks: Sequence[Check], contrary: Sequence[Check], style: Style) -> str:
    """Why, for every check that gives a reason, and for those that contradict the scene what it declares."""
    against = {check.id: declared(check) for check in contrary}
    found = [(check.id, [text for text in (against.get(check.id, ""), check.because) if text]) for check in checks]
    return listed("Why", [f"{name}: {'; '.join(said)}" for name, said in found if said], style)


def entries(outcome: Outcome[Sink]) -> dict[str, Any]:
    """What summary.json has of a sink."""
    from validate.report.budget import document
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
        found["why"] = document(outcome.why)
    if outcome.propagated is not None:
        from validate.report.inputs import entered

        entered(found, outcome.propagated, outcome.sampled)
    if outcome.fit is not None:
        found["calibration"] = outcome.fit.document()
    if outcome.validation is not None:
        found["validation"] = outcome.validation.document()
    if outcome.air is not None:
        found["air"] = outcome.air.document()
    if outcome.sensitivities is not None:
        found["sensitivities"] = outcome.sensitivities.document()
    if outcome.against is not None:
        found["against"] = outcome.against.document()
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
    "figure5": "profile_figure.draw",
    "figure6": "time_figures.rises",
    "figure7": "time_figures.current",
    "islands": "row_figures.profile",
    "air": "air_figure.draw",
    "islands_runs": "row_figures.runs",
    "why": "why_figure.draw",
    "sensitivity": "sensitivity_figure.draw",
    "validation": "validation_figure.draw",
}
"""What draws each figure of the plan but that of the field, in ``validate.report.figures``."""
FIELD_FIGURE = "figure4"


def draws_field(sink: Sink, request: Request) -> bool:
    """Whether there will be a field to render."""
    return FIELD_FIGURE not in plan.skipped_figures(request, sink)


def field(outcome: Outcome[Sink]) -> Field:
    """The steady field."""
    from validate.report.figures.render import Field

    fields = outcome.solved.details["fields"]
    return Field(fields.points, fields.hexes, fields.steady - outcome.scene.room_temperature)


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
        f"Figure 4: steady 3D temperature, {sink_text(sink)} (beam {size} µm, "
        f"{'seen from above' if image is None else thick})"
    )
    checks = [check for check in outcome.checks if check.id == "fig4"]
    label = f"rise above {sink.room_temperature:g} K (K)"
    return field_figure.draw(shown, image, 0.0, text, label, checks), note
