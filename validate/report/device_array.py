"""How several whole sensors on one substrate are told and kept."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from scenes.formats import quantity, with_error
from validate.report import checks
from validate.report.array import FIELD_FIGURE as FIELD_FIGURE
from validate.report.array import MOST_ROWS, extremes, middle
from validate.report.array import columns as columns
from validate.report.array import headline as headline
from validate.report.table import Section, Style, Table

if TYPE_CHECKING:
    from compare.verdict import Check
    from fem3d.device.array import Known, Solved
    from reduced1d.device.array import Beside
    from scenes.array import DeviceArray
    from scenes.loop.array import Rest
    from validate.run.outcome import Outcome

FIGURES = {"array": "device_array_figure.draw"}
MATRIX = 100
"""summary.json has whole matrices of this many elements at most; of more, the column of a middle one."""


def title(outcome: Outcome[DeviceArray]) -> str:
    from validate.run.kinds.device_array import text

    return text(outcome.scene)


def sections(outcome: Outcome[DeviceArray], contrary: Sequence[Check], style: Style) -> list[Section]:
    """The elements, and the check with its reason."""
    return [_elements(outcome, style), *checks.of_device(outcome.checks, contrary, style)]


def solved_of(outcome: Outcome[DeviceArray]) -> Solved:
    return outcome.solved.details["array"]


def in_1d(outcome: Outcome[DeviceArray]) -> Beside:
    assert outcome.reduced1d is not None
    return outcome.reduced1d.details["array"]


def _elements(outcome: Outcome[DeviceArray], style: Style) -> Section:
    solved, reduced1d, rows = solved_of(outcome), in_1d(outcome), []
    count = len(solved.at_work)
    shown = list(range(count))
    if count > MOST_ROWS and not style.page:
        shown = extremes(solved.closed.plate_rise.value)

    def cell(known: Known, k: int, unit: str) -> str:
        if not known.value[k]:
            return quantity(0.0, unit)
        value, bound, shown_unit, _, _ = with_error(float(known.value[k]), float(known.error[k]), unit, prefixed=True)
        return f"{value} {style.plus_minus} {bound} {shown_unit}"

    for k in shown:
        cells = [f"{k + 1}{'' if solved.at_work[k] else ', idle'}", cell(solved.closed.plate_rise, k, "K")]
        for each in (solved.closed, solved.sinks_off):
            cells.append(cell(each.power_change, k, "W") if solved.at_work[k] else "none")
        rows.append(cells)
        changes = [quantity(float(each.power_change[k]), "W", 4) for each in (reduced1d.closed, reduced1d.sinks_off)]
        plate = quantity(float(reduced1d.closed.plate_rise[k]), "K", 4, prefixed=True)
        rows.append(["   in 1D", plate, *(changes if solved.at_work[k] else ["none"] * 2)])
    said = (
        "Plate: how much warmer it is under an element by the others. Closed, off: what that changes in the "
        "power of its sensor, with all loops closed and with all sinks off. Outside all have the initial temperature."
    )
    if len(shown) < count:
        said += f" Shown are the elements on the warmest and the coolest of {count} places."
    heads = ("element", "plate", "closed", "sinks off")
    return Section("Elements", [Table(heads, rows), said], headed=False)


def entries(outcome: Outcome[DeviceArray]) -> dict[str, Any]:
    from validate.report.summary import check_document, of_3d

    solved, reduced1d = solved_of(outcome), in_1d(outcome)
    count = len(solved.at_work)
    element = middle(solved.array.sink)
    column = slice(None) if count <= MATRIX else element

    def together(each: Any) -> dict[str, Any]:
        names = {
            "plate_rise_K": each.plate_rise, "sensor_power_change_W": each.power_change,
            "sensor_power_per_outside_W_per_K": each.per_outside,
        }  # fmt: skip
        return {
            name: {q: getattr(known, q)[..., column] if known.value.ndim > 1 else getattr(known, q)
                   for q in ("value", "error")}
            for name, known in names.items()
        }  # fmt: skip

    def alone(each: Rest) -> dict[str, Any]:
        return {
            "plate_rise_K": each.plate_rise, "sensor_power_change_W": each.power_change,
            "sensor_power_per_outside_W_per_K": each.per_outside[:, column],
        }  # fmt: skip

    over = [
        {"loops": loops, "outside_of": each.stepped + 1, "sensor_of": each.read + 1, "time_s": each.time_s,
         "plate_rise_K_per_K": each.plate_rise, "sensor_power_W_per_K": each.sensor_power, "error": each.error,
         "reduced1d_sensor_power_W_per_K": beside.sensor_power}
        for loops, each, beside in zip(("closed", "sinks off"), solved.over_time, reduced1d.over_time, strict=False)
    ]  # fmt: skip
    return {
        "fem3d": of_3d(outcome.solved, "unknowns"), "answer": outcome.answer,
        "reduced1d": {"array": {"closed": alone(reduced1d.closed), "sinks_off": alone(reduced1d.sinks_off)}},
        "checks": [check_document(check) for check in outcome.checks],
        "array": {
            "places_m": solved.places, "at_work": [k + 1 for k in np.flatnonzero(solved.at_work).tolist()],
            "of_element": None if count <= MATRIX else element + 1,
            "plate_K_per_W": {"value": solved.plate.value[:, column], "error": solved.plate.error[:, column]},
            "closed": together(solved.closed), "sinks_off": together(solved.sinks_off),
            "slopes": {name: asdict(each) for name, each in solved.slopes.items()}, "over_time": over,
        },
    }  # fmt: skip
