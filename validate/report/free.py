"""How a run of a free scene is told and kept: its probes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from compare.plan import skipped_figures
from scenes.dimensions import TIME
from scenes.formats import Column, cut, quantity, with_error
from scenes.model import UNITS
from scenes.plan import Step
from validate.report import asked_for
from validate.report.table import Section, Style, Table, wrapped

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from compare.outcome import Outcome
    from compare.verdict import Check
    from scenes.model import AnyScene, GroupProbe, Probe
    from scenes.plan import Request
    from scenes.result import Result, Traces
    from validate.report.figures.render import Field

_NAME = 30
_PER_BLOCK = 4
_MOST_TIMES = 20
_TOLD = 3
"""How many probes the first line has room for."""


def title(outcome: Outcome[AnyScene]) -> str:
    """What the run is of."""
    return outcome.scene.name


def headline(outcome: Outcome[AnyScene], contrary: Sequence[Check], style: Style) -> str:
    """What the first probes are, then how that was found."""
    scene, details = outcome.scene, outcome.solved.details
    what = "steady state" if scene.steady else f"transient to {TIME.show(scene.end_time)}"
    balance = details["energy_imbalance"] if scene.steady else details.get("transient_imbalance")
    closed = f", heat balanced to {balance:.0e}" if balance is not None and np.isfinite(balance) else ""
    how = f"{what[0].upper()}{what[1:]} in 3D, {details['unknowns']} unknowns{closed}."
    shown = [_answer(probe, outcome.solved, style) for probe in scene.probes[:_TOLD]]
    more = f" ({len(scene.probes) - _TOLD} more below)" if len(scene.probes) > _TOLD else ""
    when = "in the steady state" if scene.steady else f"after {TIME.show(scene.end_time)}"
    said = wrapped(f"{scene.name}: {', '.join(shown)} {when}{more}.")
    return f"{style.paint(said, 'heading')}\n{wrapped(how)}"


def sections(outcome: Outcome[AnyScene], contrary: Sequence[Check], style: Style) -> list[Section]:
    """The probes, and those of a transient at the times asked for."""
    return [_probes(outcome, style), *_at_times(outcome, style), *asked_for(outcome, style)]


def value_text(probe: Probe | GroupProbe, result: Result, style: Style) -> str:
    """A probe's value with its error: the steady one, or that at the end."""
    if result.traces is None:
        found, error = result.steady[probe.name].value, result.steady[probe.name].error
    else:
        found, error = float(result.traces.values[probe.name][-1]), result.traces.errors[probe.name]
    value, bound, unit, _, _ = with_error(found, error, UNITS[probe.quantity])
    return f"{value} {style.plus_minus} {bound} {unit}"


def _answer(probe: Probe | GroupProbe, result: Result, style: Style) -> str:
    """A probe's name and value, and of a transient the largest size where that is not the end's."""
    said = f"{probe.name} {value_text(probe, result, style)}"
    if result.traces is None:
        return said
    values, error = result.traces.values[probe.name], result.traces.errors[probe.name]
    i = int(np.argmax(np.abs(values)))
    if abs(values[i]) <= abs(values[-1]) + 2 * error:
        return said
    unit = UNITS[probe.quantity]
    return f"{said} (at most {quantity(float(values[i]), unit)}, at {quantity(float(result.traces.time[i]), 's', 3)})"


def _probes(outcome: Outcome[AnyScene], style: Style) -> Section:
    """Of every probe the steady value, or the last one with the range that the transient passes through."""
    result = outcome.solved
    rows = [_row(probe, result, style) for probe in outcome.scene.probes]
    heads = ("probe", "steady state") if result.traces is None else ("probe", "at the end", "least", "largest")
    said = []
    start = result.details.get("accurate_from_s")
    if result.traces is not None and start:
        again = ", and that long after each jump of a given temperature" if result.details.get("jumps") else ""
        said.append(f"The errors hold from {quantity(start, 's', 3)} on{again}; before that they may be larger.")
    off = result.details.get("field_error")
    if off:
        said.append(f"The field is known to {off:.2g} of its largest rise, at its worst place.")
    title = "Steady state" if result.traces is None else "Over time"
    return Section(title, [Table(heads, rows), *said], headed=False)


def _row(probe: Probe | GroupProbe, result: Result, style: Style) -> list[str]:
    name = cut(probe.name, _NAME)
    if result.traces is None:
        return [name, value_text(probe, result, style)]
    values, column = result.traces.values[probe.name], _column(probe, result.traces)
    value, error = column.show(float(values[-1])), column.show_error(result.traces.errors[probe.name])
    few = replace(column, places=min(column.places, 3))
    ends = (f"{few.show(float(v))} {few.unit}" for v in (values.min(), values.max()))
    return [name, f"{value} {style.plus_minus} {error} {column.unit}", *ends]


def _column(probe: Probe | GroupProbe, traces: Traces) -> Column:
    largest = float(np.abs(traces.values[probe.name]).max())
    return Column.of(largest, traces.errors[probe.name], UNITS[probe.quantity])


def _at_times(outcome: Outcome[AnyScene], style: Style) -> list[Section]:
    """The probes at the times that were asked for, in a terminal a few columns at a time."""
    scene, traces = outcome.scene, outcome.solved.traces
    times = scene.output_times
    if traces is None or not times:
        return []
    if len(times) > _MOST_TIMES:
        said = f"The {len(times)} output times are in summary.json and traces.csv."
        return [Section("At the output times", [said], headed=False)]
    found, most = [], len(scene.probes) if style.page else _PER_BLOCK
    for first in range(0, len(scene.probes), most):
        probes: Sequence[Probe | GroupProbe] = scene.probes[first : first + most]
        columns = [(_column(probe, traces), at(traces, probe.name, np.array(times))) for probe in probes]
        rows = [
            [TIME.show(time), *(f"{c.show(float(values[i]))} {c.unit}" for c, values in columns)]
            for i, time in enumerate(times)
        ]
        table = Table(("time", *(cut(probe.name, _NAME if style.page else 15) for probe in probes)), rows)
        found.append(Section("At the output times", [table], headed=False))
    return found


def entries(outcome: Outcome[AnyScene]) -> dict[str, Any]:
    """What summary.json has of a free scene: steady values of the probes with their errors, and that of the field at
    its worst node over its largest rise, null where it isn't known; of a transient the errors, the values at the times
    asked for and the last one, and the range that each probe passes through."""
    scene, result, details = outcome.scene, outcome.solved, outcome.solved.details
    found: dict[str, Any] = {
        "units": {probe.name: UNITS[probe.quantity] for probe in scene.probes},
        "steady": {name: {"value": e.value, "error": e.error} for name, e in result.steady.items()},
        "field_error": details.get("field_error"),
        "energy_imbalance": details["energy_imbalance"],
        "dofs": details["unknowns"],
        "steps": details["steps"],
        "levels": details["levels"],
        "symmetry": details["symmetry"],
        "mesh": details["mesh"],
    }
    if result.traces is not None:
        times = np.array(sorted({*scene.output_times, scene.end_time}))
        found["transient"] = {
            "errors": result.traces.errors,
            "accurate_from_s": details.get("accurate_from_s"),
            "jumps": details.get("jumps", 0),
            "imbalance": details.get("transient_imbalance"),
            "time_s": times,
            "values": {probe.name: at(result.traces, probe.name, times) for probe in scene.probes},
            "range": {
                name: {"end": values[-1], "least": values.min(), "largest": values.max()}
                for name, values in result.traces.values.items()
            },
        }
    entries: dict[str, Any] = {"fem3d": found}
    if outcome.propagated is not None:
        from validate.report.inputs import entered

        entered(entries, outcome.propagated, None)
    if outcome.sensitivities is not None:
        entries["sensitivities"] = outcome.sensitivities.document()
    return entries


def columns(outcome: Outcome[AnyScene]) -> dict[str, np.ndarray]:
    """The columns of traces.csv: time_s, and one for each probe by its name (K, V, W or A); empty of a steady scene."""
    traces = outcome.solved.traces
    return {} if traces is None else {"time_s": traces.time, **traces.values}


def more_columns(outcome: Outcome[AnyScene]) -> dict[str, dict[str, np.ndarray]]:
    """The columns of other files, by their names."""
    found = outcome.sensitivities
    return {} if found is None or found.course is None else {"sensitivities.csv": found.course.columns()}


def at(traces: Traces, name: str, times: np.ndarray) -> np.ndarray:
    """A trace at some times (s): linear between its own; where there are two values at a time, the later one."""
    own, values = traces.time, traces.values[name]
    after = np.clip(np.searchsorted(own, times, side="right"), 1, len(own) - 1)
    before = after - 1
    # The last time is not before any other, and two equal ones make a jump.
    step = own[after] - own[before]
    part = np.clip((times - own[before]) / np.where(step > 0, step, 1.0), 0.0, 1.0)
    found: np.ndarray = values[before] + np.where(step > 0, part, 1.0) * (values[after] - values[before])
    return found


def stored(outcome: Outcome[AnyScene]) -> tuple[np.ndarray, float, None]:
    """Of the field files the times (s), those asked for where there are any, with the start and the end; what rises are
    above (K); and no 1D model."""
    from validate.report.fields import stored_times

    scene = outcome.scene
    asked = np.unique([0.0, *scene.output_times, scene.end_time])
    times = asked if scene.output_times else stored_times(scene.end_time)
    return times[:0] if scene.steady else times, scene.initial_temperature, None


FIGURES = {"figure traces": "figures.trace_figure.draw", "sensitivity": "figures.sensitivity_figure.draw"}
"""What draws each figure of the plan but that of the field, in ``validate.report``."""
FIELD_FIGURE = "figure field"


def draws_field(scene: AnyScene, request: Request) -> bool:
    """Whether there will be a field to render."""
    return "field" not in skipped_figures(scene, request)


def field(outcome: Outcome[AnyScene]) -> Field:
    """The steady field above its coldest place, or that of a transient's hottest moment (its coldest where the scene is
    cooled)."""
    from validate.report.figures.render import Field

    fields, when = outcome.solved.details["fields"], "steady"
    if outcome.shown is None:
        kelvins = fields.steady
    else:
        time, above = outcome.shown
        kelvins = fields.at(np.array([time]))[0]
        when = f"{TIME.show(float(f'{time:.3g}'))}, when it is {'hottest' if above else 'coldest'}"
    coldest = float(kelvins.min())
    return Field(fields.points, fields.hexes, kelvins - coldest, f"{when}, above {coldest:.6g} K", when, coldest)


def field_figure(
    outcome: Outcome[AnyScene], shown: Field, image: np.ndarray | None
) -> tuple[Figure | None, Step | None]:  # fmt: skip
    """The rendered field, and what the plan says of it where it turned out otherwise."""
    if image is None:
        return None, Step(FIELD_FIGURE, "skipped", "no OpenGL to render with")
    from validate.report.figures import field_figure

    drawn = f"z drawn x{shown.factor:g}" if shown.factor > 1 else "true proportions"
    text = f"{outcome.scene.name}: temperature, {shown.when} ({drawn})"
    return field_figure.draw(shown, image, shown.above, text, "temperature (K)", []), None
