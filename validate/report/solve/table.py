"""What a run of a free scene says in the terminal, at most 80 columns wide."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from compare.solve.scope import UNITS
from compare.words import Column, quantity, with_error
from scenes.dimensions import TIME
from validate.report.solve.traces import at
from validate.report.table import Style, plan_text, warnings_text, where_text, wrapped

if TYPE_CHECKING:
    from compare.solve.outcome import SolveOutcome
    from scenes.model import GroupProbe, Probe
    from scenes.plan import Step
    from scenes.result import Result, Traces

_NAME = 30
_PER_BLOCK = 4
_MOST_TIMES = 20
_TOLD = 3
"""How many probes the first line has room for."""


def headline(outcome: SolveOutcome, style: Style) -> str:
    """What the first probes are, then how that was found."""
    scene, details = outcome.scene, outcome.result.details
    what = "steady state" if scene.steady else f"transient to {TIME.show(scene.end_time)}"
    balance = details["energy_imbalance"] if scene.steady else details.get("transient_imbalance")
    closed = f", heat balanced to {balance:.0e}" if balance is not None and np.isfinite(balance) else ""
    how = f"{what[0].upper()}{what[1:]} in 3D, {details['unknowns']} unknowns{closed}."
    shown = [_answer(probe, outcome.result, style) for probe in scene.probes[:_TOLD]]
    more = f" ({len(scene.probes) - _TOLD} more below)" if len(scene.probes) > _TOLD else ""
    when = "in the steady state" if scene.steady else f"after {TIME.show(scene.end_time)}"
    said = wrapped(f"{scene.name}: {', '.join(shown)} {when}{more}.")
    return f"{style.paint(said, 'heading')}\n{wrapped(how)}"


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


def outcome_text(outcome: SolveOutcome, style: Style, planned: tuple[Step, ...] | None = None) -> str:
    """Everything about a run; ``planned`` is the plan if it has been printed, so that only what turned out otherwise is
    added."""
    parts = [headline(outcome, style), _probes(outcome, style), *_at_times(outcome, style)]
    changed = [step for step in outcome.plan if planned is not None and step not in planned]
    if changed:
        parts.append(plan_text(changed, style).replace("Plan", "As it turned out", 1))
    parts += [*warnings_text(outcome), where_text(outcome)]
    return "\n\n".join(parts)


def _probes(outcome: SolveOutcome, style: Style) -> str:
    """Of every probe the steady value, or the last one with the range that the transient passes through."""
    scene, result = outcome.scene, outcome.result
    heads = f"  {'probe':<{_NAME}}{'steady state' if scene.steady else 'at the end':>26}"
    if result.traces is not None:
        heads += f"{'least':>11}{'largest':>11}"
    lines = [style.paint(heads, "heading")]
    lines += [_line(probe, result, style) for probe in scene.probes]
    start = result.details.get("accurate_from_s")
    if result.traces is not None and start:
        again = ", and that long after each jump of a given temperature" if result.details.get("jumps") else ""
        text = f"The errors hold from {quantity(start, 's', 3)} on{again}; before that they may be larger."
        lines.append(wrapped(text, "  "))
    off = result.details.get("field_error")
    if off:
        text = f"The field is known to {off:.2g} of its largest rise, at its worst place."
        lines.append(wrapped(text, "  "))
    return "\n".join(lines)


def _line(probe: Probe | GroupProbe, result: Result, style: Style) -> str:
    unit, name = UNITS[probe.quantity], cut(probe.name, _NAME - 1)
    if result.traces is None:
        found = result.steady[probe.name]
        value, error, shown, _, _ = with_error(found.value, found.error, unit)
        return f"  {name:<{_NAME}}{f'{value} {style.plus_minus} {error} {shown}':>26}"
    values, column = result.traces.values[probe.name], _column(probe, result.traces)
    value, error = column.show(float(values[-1])), column.show_error(result.traces.errors[probe.name])
    few = replace(column, places=min(column.places, 3))
    ends = "".join(f"{few.show(float(v))} {few.unit}".rjust(11) for v in (values.min(), values.max()))
    return f"  {name:<{_NAME}}{f'{value} {style.plus_minus} {error} {column.unit}':>26}{ends}"


def _column(probe: Probe | GroupProbe, traces: Traces) -> Column:
    largest = float(np.abs(traces.values[probe.name]).max())
    return Column.of(largest, traces.errors[probe.name], UNITS[probe.quantity])


def _at_times(outcome: SolveOutcome, style: Style) -> list[str]:
    """The probes at the times that were asked for, a few columns at a time."""
    scene, traces = outcome.scene, outcome.result.traces
    times = scene.output_times
    if traces is None or not times:
        return []
    if len(times) > _MOST_TIMES:
        return [wrapped(f"The {len(times)} output times are in summary.json and traces.csv.")]
    blocks = []
    for first in range(0, len(scene.probes), _PER_BLOCK):
        probes: Sequence[Probe | GroupProbe] = scene.probes[first : first + _PER_BLOCK]
        heads = "".join(f"{cut(probe.name, 15):>16}" for probe in probes)
        lines = [style.paint(f"  {'time':<12}{heads}", "heading")]
        columns = [(_column(probe, traces), at(traces, probe.name, np.array(times))) for probe in probes]
        for i, time in enumerate(times):
            row = "".join(f"{c.show(float(values[i]))} {c.unit}".rjust(16) for c, values in columns)
            lines.append(f"  {TIME.show(time):<12}{row}")
        blocks.append("\n".join(lines))
    return blocks


def cut(text: str, longest: int) -> str:
    """The text, at most so long."""
    return text if len(text) <= longest else f"{text[: longest - 2]}.."
