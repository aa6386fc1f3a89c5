"""The report of a device: the sensor over time, the claims of the paper, and answers for the designer."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from compare.outcome import Outcome
from compare.quantities import OF_A_DEVICE
from compare.report import checks
from compare.report.table import Section, Style, Table, checks_document, sentences, wrapped
from compare.verdict import Check
from reduced1d.device.design import Design
from reduced1d.device.lumped import shielding as shielding_1d
from scenes.device import Device
from scenes.formats import milliseconds, percent, quantity
from statespace.result import BAND, QUANTITIES, Run, settling


def headline(outcome: Outcome[Device], contrary: Sequence[Check], style: Style) -> str:
    """State the effects left out, the end of the run, and the number of checks that differ."""
    scene, external, run = outcome.scene, outcome.scene.external, outcome.runs.base
    when = f"from cold, with {external.initial_temperature:g} K outside,"
    if scene.steps_outside:
        when = f"after the step from {external.initial_temperature:g} to {external.final_temperature:g} K outside"
    after = scene.end_time > external.step_time
    power = quantity((run.after if after else run.before).sensor_power_W, "W")
    ends = [each.time for each in settling(run.device, run.result, "sensor_power_W", BAND)]
    how = f"does not settle to {percent(BAND, 1)}: it is bound for {power} (see Findings)"
    if ends and math.isfinite(ends[-1]):
        how = f"settles to {percent(BAND, 1)} in {milliseconds(ends[-1])}, at {power}"
    by = ", by the paper's scheme," * (outcome.options.scheme == "paper")
    counted = checks.counted("checks", outcome, contrary).removeprefix("checks: ")
    said = f"{scene.name}: {when}{by} the sensor's power {how}. {counted}".rstrip()
    return style.paint(wrapped(said), "heading")


def sections(outcome: Outcome[Device], contrary: Sequence[Check], style: Style) -> list[Section]:
    """Return the findings, the quantities, the claims with their reasons, and the designer's answers."""
    return [
        Section("Findings", sentences(outcome.runs.base.result.findings)),
        _quantities(outcome.runs.base, "in 1D"),
        *([] if outcome.fem3d is None else [_quantities(outcome.device_3d.runs.base, "in 3D")]),
        *checks.sections(outcome.checks, contrary, style),
        *([] if outcome.design is None else [_design(outcome.design, style)]),
    ]


def _quantities(run: Run, model: str) -> Section:
    """Of every quantity the steady values before and after the step, the peak, and the settling times."""
    highest, rows = _peaks(run), []
    for key, (name, unit) in OF_A_DEVICE.items():
        times = [milliseconds(each.time) for each in settling(run.device, run.result, key, BAND)]
        states = (quantity(getattr(state, key), unit, 5) for state in (run.before, run.after))
        peak = quantity(highest[key]["value"], unit, 4), f"{highest[key]['time_s'] * 1e3:.4g} ms"
        rows.append([name, *states, *peak, *times, *[""] * (2 - len(times))])
    errors = run.result.errors
    error, flow = max(errors["sink_K"], errors["sensor_K"]), quantity(errors["polymer_flux_W"], "W", 2)
    said = (
        f"Steady states before and after the outer step; the times until within {percent(BAND, 1)} of a change for "
        f"good. Estimated errors: of the temperatures {error:.1e} K, of the heat into the polymer {flow}."
    )
    heads = (model, "before", "after", "peak", "at", "from cold", "from step")
    return Section(f"Over the run, {model}", [Table(heads, rows), said], headed=False)


def _design(design: Design, style: Style) -> Section:
    """The largest stable gains, the range and the resolution of meters."""
    rows = []
    for limit in design.limits:
        mode = f"{'decays' if limit.decay_per_s >= 0 else 'grows'} at {abs(limit.decay_per_s):.3g} 1/s"
        largest = limit.sink_gain_V, limit.sensor_gain_V
        gains = (quantity(gain, "V", 3) if gain < math.inf else "any" for gain in largest)
        name = f"  sampled every {limit.sample_time_s * 1e3:g} ms"
        rows.append([name, *gains, mode, f"{limit.largest_eigenvalue:.4g}"])
    said = "Each limit is with the other gain as the scene has it; an eigenvalue (per sample) below 1 is stable."
    reach = "Range: give --max-voltage or --max-power"
    if (limits := design.range) is not None:
        most = f"{quantity(limits.sensor_power_W, 'W')} at {quantity(limits.sensor_V, 'V')}"
        reach = f"Range: {limits.lowest_K:.5g} K to {limits.highest_K:.5g} K, where the sensor takes at most {most}"
    answers = [reach, *(f"{name}: {text}" for name, text in design.meters.items())]
    answers += [f"Source of {name}: {text}" for name, text in design.sources.items()] * style.page
    table = Table(("largest stable gain", "sink", "sensor", "slowest mode", "eigenvalue"), rows)
    return Section("For the designer", [table, said, *sentences(answers)])


def document(outcome: Outcome[Device]) -> dict[str, Any]:
    """Return the entries of summary.json."""
    solved, shielding = None if outcome.fem3d is None else outcome.device_3d, None
    if solved is not None and "dev3d_shielding" in {check.id for check in outcome.checks}:
        slopes, errors = solved.model.shielding
        one_d = {"reduced1d": _values(shielding_1d(outcome.scene), {})}
        shielding = _values(slopes, errors) | one_d
    return {
        "fem3d": None if solved is None else _run(solved.runs.base, solved.model),
        "reduced1d": _run(outcome.runs.base),
        "checks": checks_document(outcome),
        "findings": list(outcome.runs.base.result.findings),
        "shielding": shielding,
        "design": None if outcome.design is None else asdict(outcome.design),
    }


def _values(state: Any, errors: Mapping[str, float], names: Sequence[str] = ()) -> dict[str, Any]:
    """The fields of a state, all or by ``names``, with the errors that are known."""
    values = {name: getattr(state, name) for name in names or asdict(state)}
    return {q: {"value": value} | ({"error": errors[q]} if q in errors else {}) for q, value in values.items()}


def _run(run: Run, model: Any = None) -> dict[str, Any]:
    device, result = run.device, run.result
    settled = [
        {"quantity": name, "after_s": s.start, "target": s.target, "band": s.band, "fraction": f, "time_s": s.time}
        for name in ("sink_K", "sensor_K", "sink_power_W", "sensor_power_W", "polymer_flux_W")
        for f in (0.05, 0.01, 1e-3, 1e-4)
        for s in settling(device, result, name, f)
    ]
    states = {"steady": (run.after, device.external.final_temperature),
              "steady_before": (run.before, device.external.initial_temperature)}  # fmt: skip
    steady = {name: _values(state, model.steady_errors(device, outer) if model else {}, QUANTITIES)
              for name, (state, outer) in states.items()}  # fmt: skip
    return {
        "scheme": result.scheme, **steady, "peaks": _peaks(run), "settling": settled, "errors": result.errors,
        "error_parts": result.error_parts, "details": result.details,
    }  # fmt: skip


def _peaks(run: Run) -> dict[str, dict[str, float]]:
    """The largest value of each quantity over the run, and when (s)."""
    places = {name: int(np.argmax(run.result.trace(name))) for name in run.result.quantities}
    return {name: {"value": float(run.result.trace(name)[at]), "time_s": float(run.result.time_s[at])}
            for name, at in places.items()}  # fmt: skip


def columns(outcome: Outcome[Device]) -> dict[str, np.ndarray]:
    """Return time_s and the traces of both models; a run that is stopped ends early."""
    results = {"reduced1d": outcome.runs.base.result}
    if outcome.fem3d is not None:
        results = {"fem3d": outcome.device_3d.runs.base.result} | results
    rows = min(len(result.time_s) for result in results.values())
    traces = {f"{model}_{name}": result.trace(name)[:rows]
              for model, result in results.items() for name in result.quantities}  # fmt: skip
    return {"time_s": results["reduced1d"].time_s[:rows], **traces}
