"""The report of a run of a free scene, and its entries of summary.json."""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from compare.outcome import Outcome
from compare.report import Row, Section, Style, Table
from scenes.formats import quantity, with_error
from scenes.model import UNITS, AnyScene
from scenes.result import Estimate, Result
from scenes.units import TIME
from validate.report.checks import checked, checks_document, counted, steady_document


def headline(outcome: Outcome[AnyScene], style: Style) -> list[str]:
    """State the first probes, or the answer about a model, then unknowns and heat balance."""
    scene, details, end = outcome.scene, outcome.solved.details, TIME.show(outcome.scene.end_time)
    what, when, key = f"Transient to {end}", f"after {end}", "transient_imbalance"
    if scene.steady:
        what, when, key = "Steady state", "in the steady state", "energy_imbalance"
    shown = (
        f"{probe.name} {_value(_read(outcome.solved, probe.name)[0], UNITS[probe.quantity], style)}"
        for probe in scene.probes[:4]
    )
    answer = outcome.answer or f"{scene.name}: {', '.join(shown)} {when}."
    # No balance is stated where no heat passes.
    balance = details.get(key)
    closed = f", heat balanced to {balance:.0e}" if balance and math.isfinite(balance) else ""
    how = f"{what} in 3D, {details['unknowns']} unknowns{closed}."
    return [answer, counted(outcome, f"{scene.name}: "), how]


def sections(outcome: Outcome[AnyScene], style: Style) -> list[Section]:
    """Return the probes, the checks of a model, and the lines of a network."""
    network = _network(outcome)
    return [_probes(outcome, style), *checked(outcome, style), *([_network_section(network)] if network else [])]


def document(outcome: Outcome[AnyScene]) -> dict[str, Any]:
    """Return the entries of summary.json: probes with errors; of a transient values at times and ranges."""
    scene, traces, reduced1d = outcome.scene, outcome.solved.traces, outcome.reduced1d
    named = ("field_error", "energy_imbalance", "unknowns", "steps", "levels", "symmetry", "mesh")
    units = {probe.name: UNITS[probe.quantity] for probe in scene.probes}
    in_3d: dict[str, Any] = {"units": units, **steady_document(outcome.solved, *named)}
    if traces is not None:
        times, ranges = sorted({*scene.output_times, scene.end_time}), {}
        for name in traces.values:
            last, least, most = _read(outcome.solved, name)
            ranges[name] = {
                "end": last.value, "least": least.value, "least_error": least.error,
                "largest": most.value, "largest_error": most.error,
            }  # fmt: skip
        in_3d["transient"] = {
            "errors": traces.errors, "accurate_from_s": traces.since, "jumps": len(traces.jumps),
            "imbalance": outcome.solved.details.get("transient_imbalance"),
            "runs_away": outcome.runs_away or None, "time_s": times,
            "values": {name: np.interp(times, traces.time, v) for name, v in traces.values.items()},
            "range": ranges,
        }  # fmt: skip
    checks = checks_document(outcome)
    if reduced1d is None:
        return {"fem3d": in_3d, **({"checks": checks} if checks else {})}
    model: dict[str, Any] = {"model": reduced1d.model, **steady_document(reduced1d)}
    if reduced1d.traces is not None:
        model["errors"] = reduced1d.traces.errors
    if network := _network(outcome):
        model["network"] = network
    return {"answer": outcome.answer, "fem3d": in_3d, "reduced1d": model, "checks": checks}


def _network(outcome: Outcome[AnyScene]) -> dict[str, list[dict[str, Any]]]:
    """Return the lines, joints and conditions of a network; nothing of another model."""
    if outcome.reduced1d is None or outcome.reduced1d.model != "network":
        return {}
    from reduced1d.network.lines import layout
    from reduced1d.network.model import table

    return table(layout(outcome.scene))


def _network_section(network: Mapping[str, Sequence[Mapping[str, Any]]]) -> Section:
    """Return tables of lines, joints and conditions; in one row joints of a kind and conditions with equal values."""

    def cell(row: Mapping[str, Any], unit: str) -> str:
        value = row[unit]["value"] if unit in row else None
        return "" if value is None else quantity(value, unit)

    tables = []
    for name, rows in network.items():
        units = [unit for unit in ("W/K", "J/K", "ohm", "W") if any(unit in row for row in rows)]
        alike: dict[tuple[str, ...], list[Mapping[str, Any]]] = {}
        for row in rows:
            kind = row["how"].partition(", ")[0] if name == "joints" else row["how"] * (name == "lines")
            alike.setdefault((kind, *(cell(row, unit) for unit in units)), []).append(row)
        lines = []
        for (_, *cells), (first, *more) in alike.items():
            others = [what + f" ({n} times)" * (n > 1) for what, n in Counter(row["what"] for row in more).items()]
            below = "; alike: ".join(filter(None, (first["how"], ", ".join(others))))
            lines.append(Row([first["what"], *cells], below=below))
        tables += [Table((name, *units), lines)] * bool(rows)
    return Section("The network", tables, headed=False)


def _value(estimate: Estimate, unit: str, style: Style) -> str:
    number, bound, shown, _, _ = with_error(estimate.value, estimate.error, unit)
    return f"{number} {style.plus_minus} {bound} {shown}"


def _read(result: Result, name: str) -> list[Estimate]:
    """The steady value of a probe; or over time its last value, and the extremes that have a known error bound."""
    if (traces := result.traces) is None:
        return [result.steady[name]]
    return [Estimate(float(traces.values[name][-1]), traces.errors[name]), *traces.extremes(name)]


def _probes(outcome: Outcome[AnyScene], style: Style) -> Section:
    """Of every probe the steady value, or the last one with its extremes over time."""
    result, traces, rows, said = outcome.solved, outcome.solved.traces, [], []
    title, heads = "Steady state", ["probe", "steady state"]
    for probe in outcome.scene.probes:
        rows.append([probe.name, *(_value(e, UNITS[probe.quantity], style) for e in _read(result, probe.name))])
    if traces is not None:
        title, heads = "Over time", ["probe", "at the end", "least", "largest"]
        wait = max((wait for _, wait in traces.jumps), default=0.0)
        again = f", but not for {quantity(wait, 's', 3)} after each jump of a drive" * bool(wait)
        start = f"The errors hold from {quantity(traces.since, 's', 3)} on{again}; earlier extremes have their own."
        said += [start] * bool(traces.since)
        said.append("summary.json has the values at the output times, traces.csv all values.")
    if off := result.details.get("field_error"):
        said.append(f"The field is known to {off:.2g} of its largest rise, at its worst place.")
    return Section(title, [Table(heads, rows), *said], headed=False)
