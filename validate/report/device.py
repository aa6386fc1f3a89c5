"""The report of a run of a device, and its entries of summary.json."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from compare.kinds.device import OF_A_DEVICE
from compare.outcome import Outcome
from compare.report import Section, Style, Table, sentences
from scenes.device import Device
from scenes.formats import milliseconds, percent, quantity
from statespace.result import BAND, QUANTITIES, Run, settling
from validate.report.checks import checked, checks_document, counted

if TYPE_CHECKING:
    from reduced1d.device.design import Design


def headline(outcome: Outcome[Device], style: Style) -> list[str]:
    """State what the sensor's power settles to and when, and the number of checks that differ."""
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
    return [f"{scene.name}: {when}{by} the sensor's power {how}. {counted(outcome)}".rstrip()]


def sections(outcome: Outcome[Device], style: Style) -> list[Section]:
    """Return the findings, the quantities, the claims with their reasons, and the designer's answers."""
    design = outcome.reduced.details.get("design")
    return [
        Section("Findings", sentences(outcome.runs.base.result.findings)),
        _quantities(outcome.runs.base, "in 1D"),
        *([] if outcome.fem3d is None else [_quantities(outcome.device_3d.runs.base, "in 3D")]),
        *checked(outcome, style),
        *([] if design is None else [_design(design, style)]),
    ]


def document(outcome: Outcome[Device]) -> dict[str, Any]:
    from reduced1d.device.lumped import shielding as shielding_1d

    solved, shielding = None if outcome.fem3d is None else outcome.device_3d, None
    design = outcome.reduced.details.get("design")
    if solved is not None and "dev3d_shielding" in {check.id for check in outcome.checks}:
        slopes, errors = solved.model.shielding
        shielding = _values(slopes, errors) | {"reduced1d": _values(shielding_1d(outcome.scene), {})}
    return {
        "fem3d": None if solved is None else _run(solved.runs.base, solved.model),
        "reduced1d": _run(outcome.runs.base),
        "checks": checks_document(outcome),
        "findings": list(outcome.runs.base.result.findings),
        "shielding": shielding,
        "design": None if design is None else asdict(design),
    }


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
        f"good. Estimated errors: of the temperatures {quantity(error, 'K', 2)}, of the heat into the polymer {flow}."
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
    places = {name: int(run.result.trace(name).argmax()) for name in run.result.quantities}
    return {name: {"value": float(run.result.trace(name)[at]), "time_s": float(run.result.time_s[at])}
            for name, at in places.items()}  # fmt: skip
