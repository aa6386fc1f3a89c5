"""What a run of a free scene says in the terminal, at most 80 columns wide."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from compare.solve.scope import UNITS
from compare.solve.traces import at
from compare.table import Style, plan_text, where_text, wrapped
from compare.words import quantity, with_error
from scenes.dimensions import TIME

if TYPE_CHECKING:
    from compare.solve.outcome import SolveOutcome
    from scenes.meshed.model import GroupProbe
    from scenes.model import Probe
    from scenes.plan import Step
    from scenes.result import Result

_NAME = 30
_PER_BLOCK = 4
_MOST_TIMES = 20


def headline(outcome: SolveOutcome, style: Style) -> str:
    """What was solved, in one line where it fits."""
    scene, details = outcome.scene, outcome.result.details
    what = "steady state" if scene.steady else f"transient to {TIME.show(scene.end_time)}"
    balance = details["energy_imbalance"] if scene.steady else details.get("transient_imbalance")
    closed = f", heat balanced to {balance:.0e}" if balance is not None and np.isfinite(balance) else ""
    text = f"{scene.name}: {what} in 3D, {details['unknowns']} unknowns{closed}."
    return style.paint(wrapped(text), "heading")


def outcome_text(outcome: SolveOutcome, style: Style, planned: tuple[Step, ...] | None = None) -> str:
    """Everything about a run; ``planned`` is the plan if it has been printed, so that only what turned out otherwise is
    added."""
    parts = [headline(outcome, style)]
    if outcome.scene.probes:
        parts.append(_probes(outcome, style))
    parts += _at_times(outcome, style)
    changed = [step for step in outcome.plan if planned is not None and step not in planned]
    if changed:
        parts.append(plan_text(changed, style).replace("Plan", "As it turned out", 1))
    parts += [wrapped(f"Warning: {text.rstrip('.')}.") for text in outcome.warnings]
    parts.append(where_text(outcome.folder, outcome.files, outcome.timing))
    return "\n\n".join(parts)


def _probes(outcome: SolveOutcome, style: Style) -> str:
    """Of every probe the steady value, or the last one with the range that the transient passes through."""
    scene, result = outcome.scene, outcome.result
    heads = f"  {'probe':<{_NAME}}{'steady state' if scene.steady else 'at the end':>26}"
    if result.traces is not None:
        heads += f"{'least':>11}{'largest':>11}"
    lines = [style.paint(heads, "heading")]
    lines += [_line(probe, result, style) for probe in scene.probes]
    return "\n".join(lines)


def _line(probe: Probe | GroupProbe, result: Result, style: Style) -> str:
    unit, name = UNITS[probe.quantity], cut(probe.name, _NAME - 1)
    if result.traces is None:
        found = result.steady[probe.name]
        value, error, shown, _, _ = with_error(found.value, found.error, unit)
        return f"  {name:<{_NAME}}{f'{value} {style.plus_minus} {error} {shown}':>26}"
    values = result.traces.values[probe.name]
    value, error, shown, _, _ = with_error(float(values[-1]), result.traces.errors[probe.name], unit)
    ends = "".join(f"{quantity(float(v), unit):>11}" for v in (values.min(), values.max()))
    return f"  {name:<{_NAME}}{f'{value} {style.plus_minus} {error} {shown}':>26}{ends}"


def _at_times(outcome: SolveOutcome, style: Style) -> list[str]:
    """The probes at the times that were asked for, a few columns at a time."""
    scene, traces = outcome.scene, outcome.result.traces
    times = scene.output_times
    if traces is None or not times or not scene.probes:
        return []
    if len(times) > _MOST_TIMES:
        return [wrapped(f"The {len(times)} output times are in summary.json and traces.csv.")]
    blocks = []
    for first in range(0, len(scene.probes), _PER_BLOCK):
        probes: Sequence[Probe | GroupProbe] = scene.probes[first : first + _PER_BLOCK]
        heads = "".join(f"{cut(probe.name, 15):>16}" for probe in probes)
        lines = [style.paint(f"  {'time':<12}{heads}", "heading")]
        columns = [at(traces, probe.name, np.array(times)) for probe in probes]
        for i, time in enumerate(times):
            row = "".join(
                f"{quantity(float(c[i]), UNITS[p.quantity], 6):>16}" for c, p in zip(columns, probes, strict=True)
            )
            lines.append(f"  {TIME.show(time):<12}{row}")
        blocks.append("\n".join(lines))
    return blocks


def cut(text: str, longest: int) -> str:
    """The text, at most so long."""
    return text if len(text) <= longest else f"{text[: longest - 2]}.."
