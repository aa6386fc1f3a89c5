"""The report of a device: the sensor over time, the claims of the paper, and answers for the designer."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from compare.device_checks import METER_POWER, METER_RESISTANCE
from compare.report import checks
from compare.report.checks import NAMES, sides
from compare.report.table import Section, Style, Table, sentences, wrapped
from compare.verdict import Check, relative
from reduced1d.device.closed_loop import ground_effects, largest_eigenvalue
from reduced1d.device.closed_loop import shielding as of_shielding
from reduced1d.device.findings import shown
from scenes.formats import kelvin, milliseconds, percent, quantity
from statespace.result import BAND, QUANTITIES, Run, settling

if TYPE_CHECKING:
    from compare.outcome import Outcome
    from fem3d.device.solve import Model
    from scenes.device import Device
    from statespace.ground import Shared
    from statespace.result import Steady

FRACTIONS = (0.05, 0.01, 1e-3, 1e-4)
"""Bands of the settling times in summary.json, as parts of the step."""


def headline(outcome: Outcome[Device], contrary: Sequence[Check], style: Style) -> str:
    """State the result and the claims of the paper that differ; on the page their number alone."""
    run, external = outcome.runs.base, outcome.scene.external
    when = f"from cold, with {_outside(run):g} K outside,"
    if outcome.scene.steps_outside:
        when = f"after the step from {external.initial_temperature:g} to {external.final_temperature:g} K outside"
    by = ", by the paper's scheme," if outcome.options.scheme == "paper" else ""
    in_3d = "" if outcome.device_3d is None else f"{_in_3d(outcome.checks)} "
    said = f"{outcome.scene.name}: {when}{by} {_happens(run)}. {in_3d}{_claims(outcome, contrary, not style.page)}"
    if left_out := outcome.analyses.get("left_out"):
        said = f"{left_out.sentence} {said}"
    return style.paint(wrapped(said), "heading")


def _happens(run: Run) -> str:
    outside, end = _outside(run), float(run.result.time_s[-1])
    state = run.after if outside == run.device.external.final_temperature else run.before
    largest = largest_eigenvalue(run.device, outside)
    unstable = f"the loop is unstable, its largest eigenvalue per sample {shown(largest)}" if abs(largest) >= 1 else ""
    stopped = f"the run was stopped after {milliseconds(end)} (see Findings)" if run.ran_away else ""
    if unstable or stopped:
        return f"nothing settles: {', and '.join(filter(None, (unstable, stopped)))}"
    if state.cycles:
        return (
            "nothing settles: over the common ground a film can neither be held at the set temperature nor rest "
            "without power, and its loop swings"
        )
    if not (run.before.sensor_power_W or run.after.sensor_power_W):
        over = kelvin(state.sensor_K - run.device.control.set_temperature)
        why = "is above the set point" if state.sensor_saturated else "has no gain"
        return f"the sensor gets no power, as it {why}: it settles at {state.sensor_K:.5g} K, {over} off the set point"
    settled = settling(run.device, run.result, "sensor_power_W", BAND)
    power = quantity(state.sensor_power_W, "W")
    if settled and math.isfinite(settled[-1].time):
        return f"the sensor's power settles to {percent(BAND, 1)} in {milliseconds(settled[-1].time)}, at {power}"
    remaining, last = end - (settled[-1].start if settled else 0.0), float(run.result.sensor_power_W[-1])
    return (
        f"the sensor's power does not settle to {percent(BAND, 1)} in the {milliseconds(remaining)} of the run: it "
        f"ends at {quantity(last, 'W')}, bound for {power}"
    )


def _outside(run: Run) -> float:
    external = run.device.external
    late = run.device.end_time > external.step_time
    return external.final_temperature if late else external.initial_temperature


def _in_3d(compared: Sequence[Check]) -> str:
    said, by_id = [], {check.id: check for check in compared}
    if power := by_id.get("dev3d_sink_power"):
        more = relative(power.measured, power.predicted)
        resolved = abs(power.difference) > power.u_num
        size = f"{percent(abs(more))} {'more' if more > 0 else 'less'}" if resolved else "as much as in 1D"
        said.append(f"In 3D the sink takes {size}")
    if claim := by_id.get("dev3d_claim_steady"):
        kept = "is" if claim.verdict == "agrees" else "is not"
        said.append(f"the sensor's power {kept} the heat through the polymer's top in the steady state")
    sentences = f"{', and '.join(said)}." if said else ""
    if shielding := by_id.get("dev3d_shielding"):
        sentences += (
            f" A substrate 1 K warmer changes the sensor's power by {quantity(shielding.measured, 'W', 2)}, "
            f"{percent(abs(shielding.difference))} of what it does with the sink off."
        )
    return sentences


def _claims(outcome: Outcome[Device], contrary: Sequence[Check], named: bool) -> str:
    """How many of the paper's claims fail, with their names where ``named``, and whether the scene knows."""
    of_paper = [check for check in outcome.checks if sides(check) == ("paper", "1D")]
    if not of_paper:
        return "Nothing of the paper was checked."
    differ, unresolved = ([c.id for c in of_paper if c.verdict == verdict] for verdict in ("differs", "unresolved"))
    said = f"{len(differ)} of {len(of_paper)} claims of the paper differ"
    if contrary:
        return f"{said}; not as expected: {', '.join(check.id for check in contrary)}."
    if outcome.scene.expected_to_differ is not None and not unresolved:
        said += ", as the scene declares"
    if not named:
        return said + (f", {len(unresolved)} open." if unresolved else ".")
    said += f": {', '.join(differ)}" if differ else ""
    return said + (f"; open: {', '.join(unresolved)}." if unresolved else ".")


def sections(outcome: Outcome[Device], contrary: Sequence[Check], style: Style) -> list[Section]:
    """Return the findings, the quantities, the claims with their reasons, and the designer's answers."""
    runs = {"in 1D": outcome.runs.base}
    if solved := outcome.device_3d:
        runs["in 3D"] = solved.runs.base
    return [
        Section("Findings", [sentences(outcome.runs.base.result.findings)]),
        *(_quantities(run, model) for model, run in runs.items()),
        *checks.of_device(checks.without_slopes(outcome.checks), contrary, style),
        *([] if outcome.design is None else [_design(outcome, style)]),
        *([] if "fig14_ground" not in {check.id for check in outcome.checks} else [_ground(outcome)]),
        *(_settling(run, model) for model, run in runs.items() if style.page),
    ]


def _quantities(run: Run, model: str) -> Section:
    """Of every quantity the steady values before and after the step, the peak, and the settling times."""
    highest, rows, ends, times = _peaks(run), [], [], list[float]()
    for key, (name, unit) in NAMES.items():
        times = [s.time for s in settling(run.device, run.result, key, BAND)]
        ends.append(times[-1] if times else 0.0)
        settled = [f"{time * 1e3:.1f} ms" if time < math.inf else "never" for time in times]
        states = (quantity(getattr(state, key), unit, 5) for state in (run.before, run.after))
        peak = quantity(highest[key]["value"], unit, 4), f"{highest[key]['time_s'] * 1e3:.4g} ms"
        rows.append([name, *states, *peak, *settled, *[""] * (2 - len(settled))])
    said = "Before, after: the steady states that the controllers are bound for, before and after the outer step. "
    if min(ends) == math.inf:
        said += f"Nothing settles to {percent(BAND, 1)} of its change before the run ends. "
    elif times:
        said += (
            f"From cold, from step: how long until within {percent(BAND, 1)} of the change for good (of that from "
            "cold, where the step changes less than that); 0 where it never left that band. "
        )
    errors = run.result.errors
    error, flow = max(errors[name] for name in ("sink_K", "sensor_K")), quantity(errors["polymer_flux_W"], "W", 2)
    said += f"Estimated error of the temperatures at most {error:.1e} K, of the heat into the polymer {flow}."
    heads = (model, "before", "after", "peak", "at", "from cold", "from step")
    return Section(f"Over the run, {model}", [Table(heads, rows), said], headed=False)


def _settling(run: Run, model: str) -> Section:
    """A row for each quantity and event, a column for each band."""
    heads = ["after the start, or the outer step", "at", *(f"within {percent(f, 1)}" for f in FRACTIONS)]
    rows = [
        [name, milliseconds(events[0].start), *(milliseconds(event.time) for event in events)]
        for key, (name, _) in NAMES.items()
        for events in zip(*(settling(run.device, run.result, key, f) for f in FRACTIONS), strict=True)
    ]
    return Section(f"Settling, {model}", [Table(heads, rows)])


def _design(outcome: Outcome[Device], style: Style) -> Section:
    design, control = outcome.design, outcome.scene.control
    assert design is not None
    rows = []
    for limit in design.limits:
        mode = f"{'decays' if limit.decay_per_s >= 0 else 'grows'} at {abs(limit.decay_per_s):.3g} 1/s"
        gains = _gain(limit.sink_gain_V), _gain(limit.sensor_gain_V)
        name, size = f"  sampled every {limit.sample_time_s * 1e3:g} ms", f"{limit.largest_eigenvalue:.4g}"
        rows.append([name, *gains, mode, size])
    rows.append(["largest for a smooth start", *(_gain(g) for g in design.smooth_start_gains_V), "", ""])
    said = (
        f"The scene has {control.sink_gain:g} V and {control.sensor_gain:g} V at {control.sample_time * 1e3:g} ms; "
        "each limit with the other gain as it is. Eigenvalue: the largest in size per sample, stable below 1. Smooth: "
        "from cold without the limit V >= 0 acting."
    )
    highest, limits = f"{control.set_temperature:g} K", design.range
    highest = "that of the common ground, below" if control.ground_resistance else highest
    reach = f"Range: up to {highest}; give --max-voltage or --max-power for its lower end"
    if limits is not None:
        most = f"{quantity(limits.sensor_power_W, 'W')} at {quantity(limits.sensor_V, 'V')}"
        reach = f"Range: {limits.lowest_K:.5g} K to {highest}, where the sensor takes at most {most}"
    answers = [reach, *(f"{name}: {text}" for name, text in design.meters.items())]
    answers += [f"Source of {name}: {text}" for name, text in design.sources.items()] if style.page else []
    table = Table(("largest stable gain", "sink", "sensor", "slowest mode", "eigenvalue"), rows)
    return Section("For the designer", [table, said, sentences(answers)])


def _leads(outcome: Outcome[Device]) -> dict[str, list[tuple[Shared, dict[str, float]]]]:
    ground = ground_effects(outcome.scene, METER_POWER, METER_RESISTANCE)
    leads: dict[str, list[tuple[Shared, dict[str, float]]]] = {"1D": [(each, {}) for each in ground.leads]}
    if solved := outcome.device_3d:
        leads["3D"] = solved.ground
    return leads


def _ground(outcome: Outcome[Device]) -> Section:
    """A lead to ground that both films share, by its resistance."""
    rows = []
    for model, leads in _leads(outcome).items():
        for each, _ in leads:
            held = "never" if math.isnan(each.highest_K) else f"{each.lowest_K:.1f} to {each.highest_K:.1f} K"
            off = [f"{value:+.3g} K" for value in (each.sink_off_K, each.sensor_off_K)]
            power = quantity(each.sensor_power_W, "W", 4)
            lead = f"{quantity(each.resistance_ohm, 'ohm', 3)}, {model}"
            rows.append([lead, *off, power, held, f"{each.largest_eigenvalue:.4f}"])
    said = (
        "Off: how far each film's temperature is from that without the lead, after the outer step, as the controllers "
        "see the lead in series with it. Held: the outer temperatures at which both films can be. Eigenvalue: the "
        "loop's largest per sample, about the state that it is bound for. Four wires, voltages measured at each "
        "film's own ends, avoid all of it."
    )
    heads = ("common ground", "sink off", "sensor off", "sensor power", "held", "eigenvalue")
    return Section("A common ground", [Table(heads, rows), said])


def _gain(gain: float) -> str:
    return "none" if gain == 0 else quantity(gain, "V", 3) if gain < math.inf else "any"


def document(outcome: Outcome[Device]) -> dict[str, Any]:
    from compare.report.document import check_document

    solved = outcome.device_3d
    return {
        "fem3d": None if solved is None else _run(solved.runs.base, solved.model),
        "reduced1d": _run(outcome.runs.base),
        "checks": [check_document(check) for check in outcome.checks],
        "findings": list(outcome.runs.base.result.findings),
        "shielding": _shielding_document(outcome),
        "ground": _ground_document(outcome),
        "design": None if outcome.design is None else asdict(outcome.design),
    }


def _shielding_document(outcome: Outcome[Device]) -> dict[str, Any] | None:
    solved = outcome.device_3d
    if solved is None or "dev3d_shielding" not in {check.id for check in outcome.checks}:
        return None
    slopes, errors = solved.shielding
    document: dict[str, Any] = {q: {"value": v, "error": errors[q]} for q, v in asdict(slopes).items()}
    in_1d = asdict(of_shielding(outcome.scene))
    return document | {"reduced1d": {q: {"value": v} for q, v in in_1d.items()}, "over_time": asdict(solved.response)}


def _ground_document(outcome: Outcome[Device]) -> dict[str, Any] | None:
    if "fig14_ground" not in {check.id for check in outcome.checks}:
        return None
    ground = ground_effects(outcome.scene, METER_POWER, METER_RESISTANCE)
    listed = {
        {"1D": "reduced1d", "3D": "fem3d"}[model]: [
            {q: {"value": v} | ({"error": errors[q]} if q in errors else {}) for q, v in asdict(each).items()}
            for each, errors in leads
        ]
        for model, leads in _leads(outcome).items()
    }
    return listed | {"by_power_ohm": ground.by_power_ohm, "by_resistance_ohm": ground.by_resistance_ohm}


def _run(run: Run, model: Model | None = None) -> dict[str, Any]:
    device, result = run.device, run.result
    settled = [
        {"quantity": name, "after_s": s.start, "target": s.target, "band": s.band, "fraction": f, "time_s": s.time}
        for name in ("sink_K", "sensor_K", "sink_power_W", "sensor_power_W", "polymer_flux_W")
        for f in FRACTIONS
        for s in settling(device, result, name, f)
    ]
    after, before = {}, {}
    if model is not None:
        after = model.steady_errors(device)
        before = model.steady_errors(device, device.external.initial_temperature)
    return {
        "scheme": result.scheme,
        "steady": _steady(run.after, after),
        "steady_before": _steady(run.before, before),
        "peaks": _peaks(run),
        "settling": settled,
        "errors": result.errors,
        "error_parts": result.error_parts,
        "details": result.details,
    }


def _steady(state: Steady, errors: dict[str, float]) -> dict[str, dict[str, float]]:
    by_name = {name: {"error": error} for name, error in errors.items()}
    return {name: {"value": getattr(state, name)} | by_name.get(name, {}) for name in QUANTITIES}


def _peaks(run: Run) -> dict[str, dict[str, float]]:
    """The largest value of each quantity over the run, and when (s)."""
    traces = {name: run.result.trace(name) for name in run.result.quantities}
    places = {name: int(np.argmax(values)) for name, values in traces.items()}
    return {
        name: {"value": float(traces[name][at]), "time_s": float(run.result.time_s[at])} for name, at in places.items()
    }


def columns(outcome: Outcome[Device]) -> dict[str, np.ndarray]:
    one, traces = outcome.runs.base.result, dict[str, np.ndarray]()
    if solved := outcome.device_3d:
        three = solved.runs.base.result
        traces = {f"fem3d_{name}": three.trace(name) for name in three.quantities}
    traces |= {f"reduced1d_{name}": one.trace(name) for name in one.quantities}
    rows = min(len(values) for values in traces.values())  # a run that is stopped ends early
    return {"time_s": one.time_s[:rows], **{name: values[:rows] for name, values in traces.items()}}
