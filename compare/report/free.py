"""The report of a free scene: its probes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from importlib import import_module
from typing import Any, NamedTuple

import numpy as np

from compare.course import at as interpolated
from compare.outcome import Outcome
from compare.report import checks
from compare.report.table import Section, Style, Table, stacked, wrapped
from compare.verdict import Check
from scenes.formats import Column, cut, quantity, with_error
from scenes.model import UNITS, AnyScene, GroupProbe, Probe
from scenes.result import Result, Traces
from scenes.units import TIME

_NAME = 30  # Characters of a probe's name that a table has room for.
_PER_BLOCK = 4  # Probes beside one another in a terminal.
_MOST_TIMES = 20  # Output times that a table has room for.
_UNSURE = " (errors larger)"
_TOLD = 3
"""Probes that the first line has room for."""


def headline(outcome: Outcome[AnyScene], contrary: Sequence[Check], style: Style) -> str:
    """State the first probes, or the answer about a model, then unknowns and heat balance."""
    scene, details = outcome.scene, outcome.solved.details
    end = TIME.show(scene.end_time)
    what, when, key = f"Transient to {end}", f"after {end}", "transient_imbalance"
    if scene.steady:
        what, when, key = "Steady state", "in the steady state", "energy_imbalance"
    balance = details.get(key)
    # None is stated where no heat passes.
    closed = f", heat balanced to {balance:.0e}" if balance and np.isfinite(balance) else ""
    shown = [_answer(probe, outcome.solved, style) for probe in scene.probes[:_TOLD]]
    more = f" ({len(scene.probes) - _TOLD} more below)" if len(scene.probes) > _TOLD else ""
    said = [f"{scene.name}: {', '.join(shown)} {when}{more}."]
    if outcome.answer:
        said = [outcome.answer, checks.counted(scene.name, outcome, contrary)]
    how = wrapped(f"{what} in 3D, {details['unknowns']} unknowns{closed}.")
    return "\n".join([*(style.paint(wrapped(text), "heading") for text in said), how])


def sections(outcome: Outcome[AnyScene], contrary: Sequence[Check], style: Style) -> list[Section]:
    """Return the probes, at the output times too, and the checks of a model."""
    judged = checks.sections(checks.without_slopes(outcome.checks), contrary, style)
    parts = [_probes(outcome, style), *_at_times(outcome, style), *judged]
    return [*parts, network.section(outcome.scene, style)] if (network := _network(outcome)) else parts


def _network(outcome: Outcome[AnyScene]) -> Any:
    is_one = outcome.reduced1d is not None and outcome.reduced1d.model == "network"
    return import_module("compare.report.network") if is_one else None


def value_text(probe: Probe | GroupProbe, result: Result, style: Style) -> str:
    """Write a probe's value with its error: steady, or at the end of the transient."""
    if result.traces is None:
        number, error = result.steady[probe.name].value, result.steady[probe.name].error
    else:
        number, error = float(result.traces.values[probe.name][-1]), result.traces.errors[probe.name]
    value, bound, unit, _, _ = with_error(number, error, UNITS[probe.quantity])
    return f"{value} {style.plus_minus} {bound} {unit}"


def _answer(probe: Probe | GroupProbe, result: Result, style: Style) -> str:
    """A probe's name and value, and of a transient the largest size where that is not the end's."""
    said = f"{probe.name} {value_text(probe, result, style)}"
    if result.traces is None:
        return said
    values, error = result.traces.values[probe.name], result.traces.errors[probe.name]
    least, largest = _extremes(result.traces, probe.name)
    most = max(least, largest, key=lambda extreme: abs(extreme.value))
    if abs(most.value) <= abs(values[-1]) + 2 * error:
        return said
    shown = quantity(most.value, UNITS[probe.quantity])
    if most.error > error:
        number, bound, unit, _, _ = with_error(most.value, most.error, UNITS[probe.quantity])
        shown = f"{number} {style.plus_minus} {bound} {unit}"
    return f"{said} (at most {shown}, at {quantity(most.time, 's', 3)})"


def _probes(outcome: Outcome[AnyScene], style: Style) -> Section:
    """Of every probe the steady value, or the last one with its extremes over time."""
    result, rows, said = outcome.solved, [], []
    for probe in outcome.scene.probes:
        cells = [cut(probe.name, _NAME)]
        if result.traces is None:
            cells.append(value_text(probe, result, style))
        else:
            last, column = float(result.traces.values[probe.name][-1]), _column(probe, result.traces)
            few = replace(column, places=min(column.places, 3))
            error = column.show_error(result.traces.errors[probe.name])
            cells.append(f"{column.show(last)} {style.plus_minus} {error} {column.unit}")
            for value, bound, _ in _extremes(result.traces, probe.name):
                wide = bound > result.traces.errors[probe.name]
                own = f" {style.plus_minus} {few.show_error(bound)}" * wide
                cells.append(f"{few.show(value)}{own} {few.unit}")
        rows.append(cells)
    title, heads = "Steady state", ["probe", "steady state"]
    if result.traces is not None:
        title, heads = "Over time", ["probe", "at the end", "least", "largest"]
        if result.traces.since:
            again = ", and that long after each jump of a given temperature" * bool(result.traces.jumps)
            start = quantity(result.traces.since, "s", 3)
            said.append(f"The errors hold from {start} on{again}; earlier extremes have their own.")
    if off := result.details.get("field_error"):
        said.append(f"The field is known to {off:.2g} of its largest rise, at its worst place.")
    return Section(title, [Table(heads, rows), *said], headed=False)


class Extreme(NamedTuple):
    """The least or the largest value of a trace, with its error bound, and when it is (s)."""

    value: float
    error: float
    time: float


def _extremes(traces: Traces, name: str) -> tuple[Extreme, Extreme]:
    """Return the least and the largest value over all times at which an error bound is known."""
    errors = traces.error_at(name, traces.time)
    known = np.flatnonzero(np.isfinite(errors))
    values = traces.values[name][known]
    at = known[[values.argmin(), values.argmax()]].tolist()
    least, largest = (Extreme(float(traces.values[name][i]), float(errors[i]), float(traces.time[i])) for i in at)
    return least, largest


def _range(traces: Traces, name: str) -> dict[str, float]:
    """Return the last value and the extremes with their errors, for summary.json."""
    least, largest = _extremes(traces, name)
    return {
        "end": float(traces.values[name][-1]), "least": least.value, "least_error": least.error,
        "largest": largest.value, "largest_error": largest.error,
    }  # fmt: skip


def _column(probe: Probe | GroupProbe, traces: Traces) -> Column:
    largest = float(np.abs(traces.values[probe.name][traces.sure(traces.time)]).max())
    return Column.of(largest, traces.errors[probe.name], UNITS[probe.quantity])


def _at_times(outcome: Outcome[AnyScene], style: Style) -> list[Section]:
    scene, traces, title = outcome.scene, outcome.solved.traces, "At the output times"
    times = scene.output_times
    if traces is None or not times:
        return []
    if len(times) > _MOST_TIMES:
        said = f"The {len(times)} output times are in summary.json and traces.csv."
        return [Section(title, [said], headed=False)]
    blocks, most, sure = [], len(scene.probes) if style.page else _PER_BLOCK, traces.sure(np.array(times))
    for first in range(0, len(scene.probes), most):
        probes: Sequence[Probe | GroupProbe] = scene.probes[first : first + most]
        columns = [(_column(probe, traces), at(traces, probe.name, np.array(times))) for probe in probes]
        at_rows = [TIME.show(t) + ("" if holds else _UNSURE) for t, holds in zip(times, sure, strict=True)]
        shown = [[f"{c.show(float(v))} {c.unit}" for v in values] for c, values in columns]
        rows = [list(row) for row in zip(at_rows, *shown, strict=True)]
        heads = ("time", *(cut(p.name, _NAME) if style.page else stacked(p.name) for p in probes))
        blocks.append(Section(title, [Table(heads, rows)], headed=False))
    return blocks


def document(outcome: Outcome[AnyScene]) -> dict[str, Any]:
    """Return the entries of summary.json: the probes with their errors, and the largest error of the field.

    A transient has errors, the values at the output times and at the end, and each probe's range.
    """
    from compare.report.document import check_document, of_3d

    scene, traces, details, reduced1d = outcome.scene, outcome.solved.traces, outcome.solved.details, outcome.reduced1d
    named = ("field_error", "energy_imbalance", "unknowns", "steps", "levels", "symmetry", "mesh")
    units = {probe.name: UNITS[probe.quantity] for probe in scene.probes}
    in_3d: dict[str, Any] = {"units": units, **of_3d(outcome.solved, *named)}
    if traces is not None:
        times = np.array(sorted({*scene.output_times, scene.end_time}))
        in_3d["transient"] = {
            "errors": traces.errors,
            "accurate_from_s": traces.since,
            "jumps": len(traces.jumps),
            "imbalance": details.get("transient_imbalance"),
            "runs_away": outcome.runs_away or None,
            "time_s": times,
            "values": {probe.name: at(traces, probe.name, times) for probe in scene.probes},
            "range": {name: _range(traces, name) for name in traces.values},
        }
    judged = [check_document(check) for check in outcome.checks]
    if reduced1d is None:
        return {"fem3d": in_3d, **({"checks": judged} if judged else {})}
    model: dict[str, Any] = {"model": reduced1d.model}
    model["steady"] = {name: {"value": e.value, "error": e.error} for name, e in reduced1d.steady.items()}
    model |= {"errors": reduced1d.traces.errors} if reduced1d.traces is not None else {}
    model |= {"network": network.entries(scene)} if (network := _network(outcome)) else {}
    return {"answer": outcome.answer, "fem3d": in_3d, "reduced1d": model, "checks": judged}


def columns(outcome: Outcome[AnyScene]) -> dict[str, np.ndarray]:
    """Return time_s and a column for each probe (K, V, W or A); a model's beside them, at its times."""
    traces, reduced1d = outcome.solved.traces, outcome.reduced1d
    if traces is None:
        return {}
    if reduced1d is None or reduced1d.traces is None:
        return {"time_s": traces.time, **traces.values}
    columns = {"time_s": reduced1d.traces.time}
    for name in traces.values:
        columns[name] = interpolated(traces, name, reduced1d.traces.time)[0]
        columns |= {f"reduced1d {name}": reduced1d.traces.values[name]} if name in reduced1d.traces.values else {}
    return columns


def at(traces: Traces, name: str, times: np.ndarray) -> np.ndarray:
    """Return a trace at some times (s), linear between its own; the later of two values at one time."""
    return np.interp(times, traces.time, traces.values[name])
