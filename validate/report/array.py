"""How rows of sinks on one substrate are told and kept."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from scenes.formats import quantity, with_error
from validate.report.table import Section, Style, Table, wrapped

if TYPE_CHECKING:
    from compare.verdict import Check
    from fem3d.runs.array import Fall
    from scenes.array import SinkArray
    from scenes.sink import Sink
    from validate.run.outcome import Outcome

FIGURES = {"array": "array_figure.draw"}
FIELD_FIGURE = ""
MOST_ROWS = 12
"""Elements that a terminal has room for."""
TOLERANCES = (1e-2, 1e-3, 1e-4)  # Crosstalk levels for which the pitch is reported.


def title(outcome: Outcome[SinkArray]) -> str:
    from validate.run.kinds.array import text

    return text(outcome.scene)


def headline(outcome: Outcome[Any], contrary: Sequence[Check], style: Style) -> str:
    return style.paint(wrapped(outcome.answer), "heading")


def sections(outcome: Outcome[SinkArray], contrary: Sequence[Check], style: Style) -> list[Section]:
    """The elements, and how crosstalk falls with the pitch."""
    return [_elements(outcome, style), _fall(outcome)]


def _elements(outcome: Outcome[SinkArray], style: Style) -> Section:
    result, rows = outcome.solved, []
    count, on = outcome.scene.count, set(result.details["driven"])
    shown = list(range(1, count + 1))
    if count > MOST_ROWS and not style.page:
        means = [result.steady[f"sink{k}_mean_rise_K"].value for k in shown]
        shown = [k + 1 for k in extremes(np.array(means))]
    for k in shown:
        cells = [f"{k}{'' if k in on else ', idle'}"]
        for q, unit in (("peak_rise_K", "K"), ("mean_rise_K", "K"), ("current_A", "A")):
            estimate = result.steady[f"sink{k}_{q}"]
            value, bound, shown_unit, _, _ = with_error(estimate.value, estimate.error, unit, prefixed=True)
            none = "none" if q == "current_A" else "0 K"
            cells.append(f"{value} {style.plus_minus} {bound} {shown_unit}" if estimate.value else none)
        rows.append(cells)
    said = [f"Shown are the warmest and the coolest of {count}."] if len(rows) < count else []
    return Section("Elements", [Table(("element", "peak rise", "mean rise", "current"), rows), *said], headed=False)


def _fall(outcome: Outcome[SinkArray]) -> Section:
    """Per thickness of the substrate the pitch from which crosstalk is below each tolerance."""
    rows = []
    for each in outcome.solved.details["fall"]:
        pitches = [_pitch(each, tolerance) for tolerance in TOLERANCES]
        rows.append([quantity(each.thickness, "m", 3), *pitches])
    heads = ("substrate thickness", *(f"below {tolerance:g} from" for tolerance in TOLERANCES))
    said = (
        "Crosstalk: the mean rise of an idle element beside a driven one, over that of the driven one, by the pitch "
        "between the two across, both about the middle of the substrate."
    )
    return Section("Crosstalk by pitch", [Table(heads, rows), said])


def _pitch(fall: Fall, tolerance: float) -> str:
    pitch = fall.below(tolerance)
    if pitch == fall.pitch[0]:
        return "all that fit"
    return f"{pitch * 1e6:.4g} um" if np.isfinite(pitch) else "none that fits"


def entries(outcome: Outcome[SinkArray]) -> dict[str, Any]:
    from fem3d.runs.array import MATRIX
    from validate.report.summary import of_3d

    result, matrix = outcome.solved, outcome.solved.details["crosstalk"]
    document: dict[str, Any] = {
        "fem3d": of_3d(result, "energy_imbalance", "unknowns"), "reduced1d": None, "answer": outcome.answer,
        "checks": [], "places_m": result.details["places"], "driven": list(result.details["driven"]),
    }  # fmt: skip
    if len(matrix) <= MATRIX:
        document["crosstalk"] = matrix.tolist()
    else:
        document["crosstalk_of"] = {
            "element": (column := middle(outcome.scene)) + 1,
            "mean_rise_K_per_W": matrix[:, column],
        }
    document["crosstalk_by_pitch"] = [
        {"substrate_thickness_m": each.thickness, "pitch_m": each.pitch, "part": each.part}
        for each in result.details["fall"]
    ]
    return document


def extremes(values: np.ndarray) -> list[int]:
    """The places of the largest and the smallest of many values, in order, as many as a terminal has room for."""
    order = np.argsort(values)
    return sorted({*order[: MOST_ROWS // 2].tolist(), *order[-MOST_ROWS // 2 :].tolist()})


def middle(sink: Sink) -> int:
    """The number, from 0, of an element about the middle."""
    return sink.rows // 2 * sink.columns + sink.columns // 2


def columns(outcome: Outcome[Any]) -> dict[str, np.ndarray]:
    return {}
