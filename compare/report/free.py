"""The report of a free scene: its probes, and the lines, joints and conditions of a network."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from itertools import islice
from typing import Any

import numpy as np

from compare.course import ascending
from compare.outcome import Outcome
from compare.report import checks
from compare.report.table import Row, Section, Style, Table, checks_document, steady_document, wrapped
from compare.verdict import Check
from reduced1d.network.lines import layout
from reduced1d.network.model import Row as Entry
from reduced1d.network.model import table
from scenes.formats import quantity, with_error
from scenes.model import UNITS, AnyScene
from scenes.result import Estimate, Traces
from scenes.units import TIME


def headline(outcome: Outcome[AnyScene], contrary: Sequence[Check], style: Style) -> str:
    """State the first probes, or the answer about a model, then unknowns and heat balance."""
    scene, details, end = outcome.scene, outcome.solved.details, TIME.show(outcome.scene.end_time)
    what, when, key = f"Transient to {end}", f"after {end}", "transient_imbalance"
    if scene.steady:
        what, when, key = "Steady state", "in the steady state", "energy_imbalance"
    shown = (
        f"{probe.name} {_value(_last(outcome, probe.name), UNITS[probe.quantity], style)}" for probe in scene.probes
    )
    said = [outcome.answer or f"{scene.name}: {', '.join(islice(shown, 4))} {when}."]
    said.append(checks.counted(scene.name, outcome, contrary))
    # No balance is stated where no heat passes.
    balance = details.get(key)
    closed = f", heat balanced to {balance:.0e}" if balance and np.isfinite(balance) else ""
    how = wrapped(f"{what} in 3D, {details['unknowns']} unknowns{closed}.")
    return "\n".join([*(style.paint(wrapped(text), "heading") for text in said if text), how])


def sections(outcome: Outcome[AnyScene], contrary: Sequence[Check], style: Style) -> list[Section]:
    """Return the probes, the checks of a model, and the lines of a network."""
    judged = checks.sections(outcome.checks, contrary, style)
    network = [_network(outcome.scene)] if _is_network(outcome) else []
    return [_probes(outcome, style), *judged, *network]


def _network(scene: AnyScene) -> Section:
    """Return tables of lines, joints and conditions."""

    def cell(row: Entry, unit: str) -> str:
        value = row[unit]["value"] if unit in row else None
        return "" if value is None else quantity(value, unit)

    tables = []
    for name, rows in table(layout(scene)).items():
        units = [unit for unit in ("W/K", "J/K", "ohm", "W") if any(unit in row for row in rows)]
        alike: dict[tuple[str, ...], list[str]] = {}
        for row in rows:
            alike.setdefault((row["how"], *(cell(row, unit) for unit in units)), []).append(row["what"])
        lines = []
        for (how, *cells), (first, *more) in alike.items():
            others = [name + f" ({n} times)" * (n > 1) for name, n in Counter(more).items()]
            lines.append(Row([first, *cells], below="; alike: ".join(filter(None, (how, ", ".join(others))))))
        tables += [Table((name, *units), lines)] * bool(rows)
    return Section("The network", tables, headed=False)


def _is_network(outcome: Outcome[AnyScene]) -> bool:
    return outcome.reduced1d is not None and outcome.reduced1d.model == "network"


def _value(estimate: Estimate, unit: str, style: Style) -> str:
    number, bound, shown, _, _ = with_error(estimate.value, estimate.error, unit)
    return f"{number} {style.plus_minus} {bound} {shown}"


def _last(outcome: Outcome[AnyScene], name: str) -> Estimate:
    """The steady value of a probe, or the value at the end."""
    result = outcome.solved
    if result.traces is None:
        return result.steady[name]
    return Estimate(float(result.traces.values[name][-1]), result.traces.errors[name])


def _probes(outcome: Outcome[AnyScene], style: Style) -> Section:
    """Of every probe the steady value, or the last one with its extremes over time."""
    result, traces, rows, said = outcome.solved, outcome.solved.traces, [], []
    title, heads = "Steady state", ["probe", "steady state"]
    for probe in outcome.scene.probes:
        extremes = [] if traces is None else _extremes(traces, probe.name)
        values = [_value(each, UNITS[probe.quantity], style) for each in (_last(outcome, probe.name), *extremes)]
        rows.append([probe.name, *values])
    if traces is not None:
        title, heads = "Over time", ["probe", "at the end", "least", "largest"]
        again = ", and that long after each jump of a given temperature" * bool(traces.jumps)
        start = f"The errors hold from {quantity(traces.since, 's', 3)} on{again}; earlier extremes have their own."
        said += [start] * bool(traces.since)
        said.append("summary.json has the values at the output times, traces.csv all values.")
    if off := result.details.get("field_error"):
        said.append(f"The field is known to {off:.2g} of its largest rise, at its worst place.")
    return Section(title, [Table(heads, rows), *said], headed=False)


def _extremes(traces: Traces, name: str) -> list[Estimate]:
    """The least and the largest value, over all times at which an error bound is known."""
    errors = traces.error_at(name, traces.time)
    known = np.flatnonzero(np.isfinite(errors))
    values = traces.values[name][known]
    return [Estimate(float(values[i]), float(errors[known[i]])) for i in (values.argmin(), values.argmax())]


def document(outcome: Outcome[AnyScene]) -> dict[str, Any]:
    """Return the entries of summary.json: probes with errors; of a transient values at times and ranges."""
    scene, traces, details, reduced1d = outcome.scene, outcome.solved.traces, outcome.solved.details, outcome.reduced1d
    named = ("field_error", "energy_imbalance", "unknowns", "steps", "levels", "symmetry", "mesh")
    units = {probe.name: UNITS[probe.quantity] for probe in scene.probes}
    in_3d: dict[str, Any] = {"units": units, **steady_document(outcome.solved, *named)}
    if traces is not None:
        times, ranges = np.array(sorted({*scene.output_times, scene.end_time})), {}
        for name in traces.values:
            least, most = _extremes(traces, name)
            ranges[name] = {
                "end": float(traces.values[name][-1]), "least": least.value, "least_error": least.error,
                "largest": most.value, "largest_error": most.error,
            }  # fmt: skip
        in_3d["transient"] = {
            "errors": traces.errors, "accurate_from_s": traces.since, "jumps": len(traces.jumps),
            "imbalance": details.get("transient_imbalance"), "runs_away": outcome.runs_away or None, "time_s": times,
            "values": {name: np.interp(times, traces.time, v) for name, v in traces.values.items()}, "range": ranges,
        }  # fmt: skip
    judged = checks_document(outcome)
    if reduced1d is None:
        return {"fem3d": in_3d, **({"checks": judged} if judged else {})}
    model: dict[str, Any] = {"model": reduced1d.model, **steady_document(reduced1d)}
    if reduced1d.traces is not None:
        model["errors"] = reduced1d.traces.errors
    if _is_network(outcome):
        model["network"] = table(layout(scene))
    return {"answer": outcome.answer, "fem3d": in_3d, "reduced1d": model, "checks": judged}


def columns(outcome: Outcome[AnyScene]) -> dict[str, np.ndarray]:
    """Return time_s and a column for each probe (K, V, W or A); a model's beside them."""
    traces, reduced1d = outcome.solved.traces, outcome.reduced1d
    if traces is None:
        return {}
    own = None if reduced1d is None else reduced1d.traces
    times = traces.time if own is None else own.time
    columns = {"time_s": times}
    for name, values in traces.values.items():
        columns[name] = values if own is None else np.interp(times, ascending(traces.time), values)
        columns |= {f"reduced1d {name}": own.values[name]} if own is not None and name in own.values else {}
    return columns
