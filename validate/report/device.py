"""How a run of the device is told and kept: what the sensor does, what of the paper comes out, a designer's answers."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict
from itertools import groupby
from typing import TYPE_CHECKING, Any

import numpy as np

from compare.verdict import Check
from reduced1d.device.stability import largest_eigenvalue, shown
from scenes.formats import kelvin, milliseconds, percent, quantity
from scenes.loop.result import QUANTITIES
from scenes.loop.runs import BAND, Run
from scenes.loop.settling import settling
from validate.report import asked_for, checks
from validate.report.checks import NAMES, amount, claimed, in_full, off_by, sides
from validate.report.table import Row, Section, Style, Table, sentences, wrapped

if TYPE_CHECKING:
    from compare.outcome import Outcome
    from fem3d.device.solve import Model
    from reduced1d.device.design import Design
    from scenes.device import Device
    from scenes.loop.result import Steady
    from scenes.plan import Request

FRACTIONS = (0.05, 0.01, 1e-3, 1e-4)
"""The bands that summary.json has settling times for."""


def title(outcome: Outcome[Device]) -> str:
    """What the run is of."""
    return f"{outcome.scene.name}: the whole sensor in 1D{' and 3D' if outcome.device_3d is not None else ''}"


def headline(outcome: Outcome[Device], contrary: Sequence[Check], style: Style) -> str:
    """The answer, with the paper's claims that differ; on the page, which lists them below, their number alone."""
    return style.paint(wrapped(_answer(outcome, contrary, named=not style.page)), "heading")


def _answer(outcome: Outcome[Device], contrary: Sequence[Check], named: bool) -> str:
    """What happens and what of the paper differs, ``named`` or counted only; ``contrary`` are the checks that
    contradict the scene."""
    run, external = outcome.runs.base, outcome.scene.external
    by = ", by the paper's scheme," if outcome.request.scheme == "paper" else ""
    if outcome.scene.steps_outside:
        when = f"after the step from {external.initial_temperature:g} to {external.final_temperature:g} K outside"
    else:
        when = f"from cold, with {_outside(run):g} K outside,"
    return f"{outcome.scene.name}: {when}{by} {_happens(run)}. {_claims(outcome, contrary, named)}"


def _happens(run: Run) -> str:
    """What the sensor's power does, the worst first: runs away, never settles, has not yet, is none, or settles."""
    control, external = run.device.control, run.device.external
    outside = _outside(run)
    state = run.after if outside == external.final_temperature else run.before
    largest = largest_eigenvalue(run.device, outside)
    end = float(run.result.time_s[-1])
    why = f"the loop is unstable, its largest eigenvalue per sample {shown(largest)}" if abs(largest) >= 1 else ""
    if run.ran_away:
        why += f"{', and ' if why else ''}the run was stopped after {milliseconds(end)} (see Findings)"
    if why:
        return f"nothing settles: {why}"
    if not (run.before.sensor_power_W or run.after.sensor_power_W):
        over = kelvin(state.sensor_K - control.set_temperature)
        why = "is above the set point" if state.sensor_saturated else "has no gain"
        return f"the sensor gets no power, as it {why}: it settles at {state.sensor_K:.5g} K, {over} off the set point"
    found = settling(run.device, run.result, "sensor_power_W", BAND)
    power = run.result.sensor_power_W
    if not found or not math.isfinite(found[-1].time):
        left = end - (found[-1].start if found else 0.0)
        return (
            f"the sensor's power does not settle to {percent(BAND, 1)} in the {milliseconds(left)} of the run: it ends "
            f"at {quantity(float(power[-1]), 'W')}, bound for {quantity(state.sensor_power_W, 'W')}"
        )
    return (
        f"the sensor's power settles to {percent(BAND, 1)} in {milliseconds(found[-1].time)}, at "
        f"{quantity(state.sensor_power_W, 'W')}"
    )


def _outside(run: Run) -> float:
    """The outer temperature (K) that the run ends with."""
    external = run.device.external
    late = run.device.end_time > external.step_time
    return external.final_temperature if late else external.initial_temperature


def _claims(outcome: Outcome[Device], contrary: Sequence[Check], named: bool) -> str:
    """How many of the paper's claims fail, and whether the scene knows."""
    of_paper = [check for check in outcome.checks if sides(check) == ("paper", "1D")]
    said = _of_paper(outcome, of_paper, contrary, named)
    return said if outcome.device_3d is None else f"{_three(outcome)} {said}"


def _three(outcome: Outcome[Device]) -> str:
    """What 3D says of 1D, and of the claim that the device is built on."""
    found = {check.id: check for check in outcome.checks}
    said = []
    if power := found.get("dev3d_sink_power"):
        said.append(f"In 3D the sink takes {off_by(power)[1:]} {'more' if power.difference < 0 else 'less'}")
    if claim := found.get("dev3d_claim_steady"):
        kept = "is" if claim.verdict == "agrees" else "is not"
        said.append(f"the sensor's power {kept} the heat through the polymer's top in the steady state")
    return f"{', and '.join(said)}." if said else ""


def _of_paper(outcome: Outcome[Device], checks: Sequence[Check], contrary: Sequence[Check], named: bool) -> str:
    if not checks:
        return "Nothing of the paper was checked."
    names = {v: [check.id for check in checks if check.verdict == v] for v in ("differs", "unresolved")}
    said = f"{len(names['differs'])} of {len(checks)} claims of the paper differ"
    if contrary:
        return f"{said}; not as expected: {', '.join(check.id for check in contrary)}."
    if outcome.scene.expected_to_differ is not None and not names["unresolved"]:
        said += ", as the scene declares"
    left = f", {len(names['unresolved'])} open" if names["unresolved"] else ""
    if not named:
        return f"{said}{left}."
    said += f": {', '.join(names['differs'])}" if names["differs"] else ""
    return said + (f"; open: {', '.join(names['unresolved'])}." if names["unresolved"] else ".")


def sections(outcome: Outcome[Device], contrary: Sequence[Check], style: Style) -> list[Section]:
    """The findings, the quantities, the claims with their reasons, the designer's answers."""
    found = [Section("Findings", [sentences(outcome.runs.base.result.findings)])]
    runs = {"in 1D": outcome.runs.base}
    if outcome.device_3d is not None:
        runs["in 3D"] = outcome.device_3d.runs.base
    found += [_quantities(run, model) for model, run in runs.items()]
    if outcome.checks and style.page:
        found.append(checks.on_page(outcome.checks, contrary))
    elif outcome.checks:
        found += [_checks(list(group)) for _, group in groupby(outcome.checks, sides)]
        found.append(Section("Why", [_reasons(outcome.checks, contrary, style)]))
    found += asked_for(outcome, style)
    if outcome.design is not None:
        found.append(_design(outcome.design, outcome, style))
    return found + [_settling(run, model) for model, run in runs.items() if style.page]


def _quantities(run: Run, model: str) -> Section:
    """Of every quantity the steady values before and after the step, the peak, and the settling times."""
    highest, events = _peaks(run), 0
    rows, never = [], True
    for key, (name, unit) in NAMES.items():
        times = [s.time for s in settling(run.device, run.result, key, BAND)]
        events, top = len(times), highest[key]
        never = never and bool(times) and times[-1] == math.inf
        shown = [f"{time * 1e3:.1f} ms" if time < math.inf else "never" for time in times]
        states = (quantity(getattr(state, key), unit, 5) for state in (run.before, run.after))
        peak = quantity(top["value"], unit, 4), f"{top['time_s'] * 1e3:.4g} ms"
        rows.append([name, *states, *peak, *shown, *[""] * (2 - len(shown))])
    errors = run.result.errors
    said = "Before, after: the steady states that the controllers are bound for, before and after the outer step. "
    if never:
        said += f"Nothing settles to {percent(BAND, 1)} of its change before the run ends. "
    elif events:
        said += (
            f"From cold, from step: how long until within {percent(BAND, 1)} of the change for good; 0 where it never "
            "left that band. "
        )
    said += f"Estimated error of the temperatures at most {max(errors['sink_K'], errors['sensor_K']):.1e} K."
    heads = (model, "before", "after", "peak", "at", "from cold", "from step")
    return Section(f"Over the run, {model}", [Table(heads, rows), said], headed=False)


def _settling(run: Run, model: str) -> Section:
    """A row for each quantity and event, a column for each band."""
    heads = ["after the start, or the outer step", "at", *(f"within {percent(f, 1)}" for f in FRACTIONS)]
    rows = []
    for key, (name, _) in NAMES.items():
        for events in zip(*(settling(run.device, run.result, key, f) for f in FRACTIONS), strict=True):
            rows.append([name, milliseconds(events[0].start), *(milliseconds(event.time) for event in events)])
    return Section(f"Settling, {model}", [Table(heads, rows)])


def _checks(found: Sequence[Check]) -> Section:
    """A line for every claim of the paper, with what 1D finds; for every result of 1D, with what 3D finds; and for the
    claim that the device is built on, with what 3D finds."""
    rows = []
    for c in found:
        values = claimed(c), amount(c.measured, c.unit), off_by(c)
        rows.append(Row([c.id, c.title, *values, c.verdict], c.verdict))
    return Section("Checks", [Table(("check", "", *sides(found[0]), "off by", ""), rows, "<<>>><")], headed=False)


def _reasons(found: Sequence[Check], contrary: Sequence[Check], style: Style) -> list[str]:
    """Of every check what the paper says and what comes out, the difference with its error, and the tolerance."""
    said = []
    for check in found:
        against = f"{text}; " if check in contrary and (text := checks.declared(check)) else ""
        said.append(f"{check.id}: {against}{check.because}; {in_full(check, style.plus_minus)}")
    return sentences(said)


def _design(design: Design, outcome: Outcome[Device], style: Style) -> Section:
    control = outcome.scene.control
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
    found = [_range(design, outcome), *(f"{name}: {text}" for name, text in design.meters.items())]
    found += [f"Source of {name}: {text}" for name, text in design.sources.items()] if style.page else []
    table = Table(("largest stable gain", "sink", "sensor", "slowest mode", "eigenvalue"), rows)
    return Section("For the designer", [table, said, sentences(found)])


def _gain(gain: float) -> str:
    return "none" if gain == 0 else quantity(gain, "V", 3) if gain < math.inf else "any"


def _range(design: Design, outcome: Outcome[Device]) -> str:
    highest = f"{outcome.scene.control.set_temperature:g} K"
    if design.range is None:
        return f"Range: up to {highest}; give --max-voltage or --max-power for its lower end"
    found = design.range
    return (
        f"Range: {found.lowest_K:.5g} K to {highest}, where the sensor takes at most "
        f"{quantity(found.sensor_power_W, 'W')} at {quantity(found.sensor_V, 'V')}"
    )


def entries(outcome: Outcome[Device]) -> dict[str, Any]:
    """What summary.json has of a device."""
    from validate.report.summary import check_document

    solved, followed = outcome.device_3d, outcome.sensitivities
    return {
        "fem3d": None if solved is None else _run(solved.runs.base, solved.model),
        "reduced1d": _run(outcome.runs.base),
        "checks": [check_document(check) for check in outcome.checks],
        "findings": list(outcome.runs.base.result.findings),
        "design": None if outcome.design is None else asdict(outcome.design),
        **({} if followed is None else {"sensitivities": followed.document()}),
    }


def _run(run: Run, model: Model | None = None) -> dict[str, Any]:
    """What summary.json has of a run; with a 3D ``model`` the steady values with their errors."""
    device, result = run.device, run.result
    initial = device.external.initial_temperature
    settled = [
        {
            "quantity": s.quantity,
            "after_s": s.start,
            "target": s.target,
            "band": s.band,
            "fraction": f,
            "time_s": s.time,
        }
        for name in ("sink_K", "sensor_K", "sink_power_W", "sensor_power_W", "polymer_flux_W")
        for f in FRACTIONS
        for s in settling(device, result, name, f)
    ]
    return {
        "scheme": result.scheme,
        "steady": _steady(run.after, {} if model is None else model.steady_errors(device)),
        "steady_before": _steady(run.before, {} if model is None else model.steady_errors(device, initial)),
        "peaks": _peaks(run),
        "settling": settled,
        "errors": result.errors,
        "error_parts": result.error_parts,
        "details": {k: asdict(v) if hasattr(v, "__dataclass_fields__") else v for k, v in result.details.items()},
    }


def _steady(state: Steady, errors: dict[str, float]) -> dict[str, dict[str, float]]:
    known = {name: {"error": error} for name, error in errors.items()}
    return {name: {"value": getattr(state, name)} | known.get(name, {}) for name in QUANTITIES}


def _peaks(run: Run) -> dict[str, dict[str, float]]:
    """The largest value of each quantity over the run, and when (s)."""
    result = run.result
    found = {}
    for name in result.quantities:
        values = result.trace(name)
        at = int(np.argmax(values))
        found[name] = {"value": float(values[at]), "time_s": float(result.time_s[at])}
    return found


def columns(outcome: Outcome[Device]) -> dict[str, np.ndarray]:
    """The columns of traces.csv, with a row for each controller sample."""
    one, found = outcome.runs.base.result, dict[str, np.ndarray]()
    if outcome.device_3d is not None:
        three = outcome.device_3d.runs.base.result
        found = {f"fem3d_{name}": three.trace(name) for name in three.quantities}
    found |= {f"reduced1d_{name}": one.trace(name) for name in one.quantities}
    rows = min(len(values) for values in found.values())  # a run that is stopped ends early
    return {"time_s": one.time_s[:rows], **{name: values[:rows] for name, values in found.items()}}


def draws_field(device: Device, request: Request) -> bool:
    """Whether there will be a field to render."""
    return False


FIGURES = {
    "figure9": "figures.response_figures.power",
    "figure10": "figures.response_figures.flow",
    "figure11": "figures.response_figures.slow",
    "figure12": "figures.step_figures.responses",
    "figure13": "figures.step_figures.characteristic",
    "sensitivity": "figures.sensitivity_figure.draw",
}
"""What draws each figure of the plan, in ``validate.report``."""
