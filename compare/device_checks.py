"""Checks of the device: the paper's claims on Figures 9 to 13 and on meters, and 1D and the claims against 3D.

In a check of a figure or a meter, predicted is the paper and measured is 1D. In a check ``dev3d_*``, predicted is 1D,
or the paper's claim, and measured is 3D.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from compare.outcome import Outcome
from compare.verdict import Check, Definitions, Sense, part
from reduced1d.device.design import PXI_4070, delivered
from reduced1d.device.lumped import at_sample_time, largest_eigenvalue, lump, stability
from reduced1d.device.schemes import shown
from scenes.device import Device
from scenes.errors import SceneError
from scenes.formats import kelvin, milliseconds, percent, quantity
from statespace.result import BAND, SLOW_TIME, Run, Runs

PAPER_SETTLING = 0.1
"""The settling time (s) that the paper gives, "about 0.1 s"."""
ROUNDING = 1e-12
"""Added to relative errors: exact claims are compared in double precision, in sums of many terms."""
METER_RESISTANCE, METER_POWER, METER_RATE = 60e-6, 23e-9, 5.0
"""The paper on meters (section 5): an NI 4070 reads the gold's resistance to some 60 uohm and its power to 23 nW, at 5
readings a second, "which is more than sufficient"."""
METER_RANGES = 1.0, 20e-3
"""The ranges, in V and A, that the paper quotes."""
FILMS = "sink", "sensor"


CHECKS: Definitions[Outcome[Device]] = Definitions()
Make = Callable[["Outcome[Device]"], Check]


def _check(name: str, *needs: str, waits: bool = False) -> Callable[[Make], Make]:
    """Register a check; one that ``waits`` for the outer step is open where a run was stopped before it."""

    def register(make: Make) -> Make:
        @CHECKS.check(name, *needs)
        def made(outcome: Outcome[Device]) -> Check:
            slow, three = "figure11" in needs and outcome.runs.slow, "3D" in needs and outcome.device_3d.runs.base
            runs = [run for run in (outcome.runs.base, slow, three) if run and waits and outcome.scene.steps_outside]
            for run in runs:
                if run.stopped:
                    note = f"the run was stopped at {run.result.time_s[-1]:.6g} s, before the outer step"
                    return Check("not reached", math.nan, math.nan, "", math.inf, 0.0, note)
            return make(outcome)

        return make

    return register


def _pair(
    title: str, unit: str, predicted: float, measured: float, error: float, note: str = "",
    scale: float | None = None, **more: Any,
) -> Check:  # fmt: skip
    """Compare two values, given the error of their difference, relative to a scale, by default the measured value."""
    scale = measured if scale is None else scale
    reason = f"{quantity(predicted, unit, 5)} against {quantity(measured, unit, 5)}" + (note and f"; {note}")
    difference, u_num = part(predicted - measured, scale), part(error, abs(scale))
    return Check(title, predicted, measured, unit, difference, u_num, reason, **more)


Range = tuple[float, float, float]
"""A time (s) between its least and its largest value."""


def _settling_time(run: Run) -> Range:
    """The settling time of a run; one that does not come is at least the run after the step."""
    time, error = run.settled()
    return (time - error, time, time + error) if time < math.inf else (run.watched, time, time)


def _compare_times(title: str, expected: Range, found: Range, note: str, sense: Sense = "equal") -> Check:
    """Compare two settling times by the interval of their ratio; without one the check is open, or fails."""
    (low, claim, high), (least, time, most) = expected, found
    if min(low, least) == math.inf:  # Neither ever settles.
        return Check(title, claim, time, "s", math.inf, 0.0, note, sense=sense)
    if not time:  # Nothing moves.
        return Check(title, claim, time, "s", part(claim, time), 0.0, note, sense=sense)
    if min(low, least) <= 0 or high == math.inf:
        return Check(title, claim, time, "s", math.inf, math.inf, note, sense=sense)
    ends = [low / most - 1, high / least - 1]
    middle = claim / time - 1 if time < math.inf else sum(ends) / 2
    if sense == "at least":
        ends, middle = [max(end, 0.0) for end in ends], max(middle, 0.0)
    u_num = max(abs(end - middle) for end in ends)
    return Check(title, claim, time, "s", middle, u_num + ROUNDING * (u_num > 0), note, sense=sense)


@_check("fig9_settling", "figure9", "outer step", waits=True)
def _settling(outcome: Outcome[Device]) -> Check:
    """Compare the settling time with the paper's, which names no band; here it is 1 %."""
    run = outcome.runs.base
    bands = ", ".join(f"{percent(part, 1)} in {milliseconds(run.settled(part)[0])}" for part in (BAND, 1e-3, 1e-4))
    note = f"paper: about {PAPER_SETTLING:g} s, no band given; here after the step to {bands}"
    return _compare_times("settling time", (PAPER_SETTLING,) * 3, _settling_time(run), f"{note}{_rest(run)}")


@_check("fig9_balance", "figure9", "outer step", waits=True)
def _balance(outcome: Outcome[Device]) -> Check:
    """Compare the sensor's steady power with the heat into the polymer."""
    (power, drift), (flow, _) = (outcome.runs.base.final(name) for name in ("sensor_power_W", "polymer_flux_W"))
    note, scale = "the steady power becomes heat in the polymer entirely", max(abs(power), abs(flow))
    return _flow(outcome, "heat to polymer", power, drift, note, scale)


@_check("fig10_steady", "figure10", "outer step", waits=True)
def _steady_flow(outcome: Outcome[Device]) -> Check:
    """Compare the steady heat flow into the polymer with k A/t times the temperature difference across it."""
    across = outcome.scene.control.set_temperature - outcome.scene.external.final_temperature
    heat = lump(outcome.scene).polymer.conductance * across
    note = f"the flow follows the sensor's power; k A/t at {kelvin(across)}"
    return _flow(outcome, "steady heat flow", heat, 0.0, note, abs(heat))


def _flow(outcome: Outcome[Device], title: str, predicted: float, error: float, note: str, scale: float) -> Check:
    (flow, drift), scale = outcome.runs.base.final("polymer_flux_W"), scale or 1.0
    note = f"paper: {note}{_rest(outcome.runs.base)}"
    return _pair(title, "W", predicted, flow, error + drift + ROUNDING * scale, note, scale)


@_check("fig11_slow", "figure11", "outer step", waits=True)
def _slow(outcome: Outcome[Device]) -> Check:
    """Compare the settling time of the loop sampled every 5 ms with the scene's own, which the paper calls shorter."""
    base, slow = outcome.runs.base, outcome.runs.slow
    assert slow is not None
    note = (
        f"paper: the behaviour is not ideal; here settled in {milliseconds(slow.settled()[0])} when sampled every "
        f"{SLOW_TIME * 1e3:g} ms, {milliseconds(base.settled()[0])} in the scene"
    )
    return _compare_times("slower at 5 ms", _settling_time(base), _settling_time(slow), note, "at least")


@_check("fig12_same_time", "figure12")
def _same_time(outcome: Outcome[Device]) -> Check:
    """Compare the times to the steady state after outer steps from -80 to +20 K with each other."""
    moving = [run for run in outcome.runs.steps if run.step]
    times = {run.step: run.settled()[0] for run in moving}
    typical = float(np.median([times[run.step] for run in moving if not _above(run)]))
    # A step that never settles is the farthest from any time that the others take, most of all where it never will.
    never = [run for run in moving if times[run.step] == math.inf]
    worst = max(never or moving, key=lambda run: run.watched if never else abs(times[run.step] - typical))
    note = f"paper: the same for all; here {milliseconds(typical)} in the middle of steps that stay below the set point"
    note += f", {milliseconds(times[worst.step])} for {worst.step:+g} K{_rest(worst)}"
    if not typical:  # Where no step moves the power, there is no common time.
        return Check("same, all steps", typical, times[worst.step], "s", math.inf, 0.0, note)
    return _compare_times("same, all steps", (typical,) * 3, _settling_time(worst), note)


@_check("fig13_slope", "figure13")
def _slope(outcome: Outcome[Device]) -> Check:
    """Compare the slope of the steady power by the outer temperature with -k A/t of the polymer."""
    conductance, (slope, _, error) = lump(outcome.scene).polymer.conductance, _line(outcome.runs)
    note = f"paper: a straight line, by R(T); here linear as conduction is{_rest(*_below(outcome.runs))}"
    measured = slope if math.isfinite(error) else math.nan
    return Check("slope of power", -conductance, measured, "W/K", part(-conductance - slope, slope), error, note)


@_check("fig13_limit", "figure13")
def _limit(outcome: Outcome[Device]) -> Check:
    """Compare the outer temperature from which on the power is zero with the set point."""
    setpoint, (_, zero, error) = outcome.scene.control.set_temperature, _line(outcome.runs)
    note = f"paper: no higher temperature than the set one is seen; here the line ends at {zero:.7g} K"
    off = (setpoint - zero) / outcome.scene.set_rise
    return Check("end of the range", setpoint, zero, "K", off, error, f"{note}{_rest(*_below(outcome.runs))}")


def _line(runs: Runs) -> tuple[float, float, float]:
    """Slope (W/K) and zero (K) of the steady power against the outer temperature, and the relative error."""
    below = _below(runs)
    if len(below) < 2:
        raise SceneError(
            "control.set_temperature and the materials leave fewer than two outer temperatures for figure 13: choose "
            "other figures with --figure"
        )
    estimates = [run.final("sensor_power_W") for run in below]
    outer, power = np.array([run.device.external.final_temperature for run in below]), np.array(estimates)[:, 0]
    error = sum(bound for _, bound in estimates)
    if error >= np.ptp(power):
        return 0.0, math.inf, math.inf if error else 0.0
    slope, level = np.polyfit(outer - outer.mean(), power, 1)
    return float(slope), float(outer.mean() - level / slope), error / float(np.ptp(power)) + ROUNDING


def _below(runs: Runs) -> list[Run]:
    return [run for run in runs.steps if not _above(run)]


def _above(run: Run) -> bool:
    return run.device.external.final_temperature >= run.device.control.set_temperature


def _rest(*runs: Run) -> str:
    """Why a run is not yet at rest at its end; empty where it is."""
    run = max(runs, key=lambda run: run.remaining)
    if run.ran_away:
        return f"; it runs away and is stopped at {run.result.time_s[-1]:.4g} s"
    if run.watched == math.inf:
        return f"; the loop is unstable, its largest eigenvalue per sample {shown(run.eigenvalue)}"
    left = f"{milliseconds(run.watched)} after the step {percent(run.remaining)} of the loop's slowest mode is left"
    return f"; {left}: a longer run.end_time leaves less" * (run.remaining >= 1e-6)


def _meter(title: str, claim: float, at: int, unit: str, outcome: Outcome[Device]) -> Check:
    """Compare the smallest step that a meter reads with the paper's."""
    run, step = outcome.runs.base, math.inf
    note = f"paper: {quantity(claim, unit, 2)} in ranges of {METER_RANGES[0]:g} V and {METER_RANGES[1]:g} A; here "
    try:
        voltage, power = delivered(run.device, run.after, 1)
        step = PXI_4070.steps(voltage, power)[at]
        note += f"the sensor takes {quantity(run.after.sensor_V, 'V')} and {quantity(power / voltage, 'A')}"
    except ValueError as error:
        note += str(error) if run.after.sensor_power_W else "the sensor takes no power, and nothing can be read"
    return _at_most(title, claim, step, unit, note)


def _at_most(title: str, claim: float, measured: float, unit: str, note: str) -> Check:
    return Check(title, claim, measured, unit, min(part(claim - measured, measured), 0.0), 0.0, note, sense="at most")


_check("meter_resistance", "all figures")(partial(_meter, "NI 4070, gold", METER_RESISTANCE, 0, "ohm"))
_check("meter_power", "all figures")(partial(_meter, "NI 4070, power", METER_POWER, 1, "W"))


@_check("meter_rate", "all figures")
def _rate(outcome: Outcome[Device]) -> Check:
    """Compare the meter's rate with that of the controllers, a reading per sample."""
    eigenvalue = shown(largest_eigenvalue(at_sample_time(outcome.scene, 1 / METER_RATE)))
    note = f"paper: {METER_RATE:g} S/s is more than sufficient; there the loop's largest eigenvalue is {eigenvalue}"
    return _at_most("NI 4070, rate", METER_RATE, 1 / outcome.scene.control.sample_time, "S/s", note)


def _steady(film: str, name: str, outcome: Outcome[Device]) -> Check:
    one, three = (getattr(run.after, name) for run in (outcome.runs.base, outcome.device_3d.runs.base))
    note = "the sensor's power leaves through the polymer in both"
    if film == "sink":
        note = "heat goes along the layers too, and eq 14 leaves out the constriction in pad and oxide"
    error = outcome.device_3d.model.steady_errors(outcome.scene)[name]
    word = "voltage" if name.endswith("V") else "power"
    return _pair(f"steady {word}, {film}", name[-1], one, three, error, note)


def _peak(film: str, when: bool, outcome: Outcome[Device]) -> Check:
    """Compare the highest rise of a film before the outer step, or its time."""
    device, result = outcome.scene, outcome.device_3d.runs.base.result
    error, rises, highest = result.errors[f"{film}_K"], [], []
    for each in (outcome.runs.base.result, result):
        early = each.time_s <= (device.external.step_time if device.steps_outside else math.inf)
        rises.append(each.trace(f"{film}_K") - device.sink.room_temperature)
        at = int(np.argmax(rises[-1][early]))
        highest.append((float(rises[-1][at]), float(each.time_s[at])))
    (rise_1d, time_1d), (rise_3d, time_3d) = highest
    if not when:
        return _pair(f"peak, {film}", "K", rise_1d, rise_3d, error)
    near = result.time_s[rises[-1] > rise_3d - 2 * error]
    return _pair(f"when, {film}", "s", time_1d, time_3d, float(np.abs(near - time_3d).max(initial=0.0)))


for _word, _unit in (("power", "power_W"), ("voltage", "V")):
    for _film in FILMS:
        _check(f"dev3d_{_film}_{_word}", "3D", "figure9")(partial(_steady, _film, f"{_film}_{_unit}"))
for _suffix in ("peak", "peak_time"):
    for _film in FILMS:
        _check(f"dev3d_{_film}_{_suffix}", "3D", "figure9", waits=True)(partial(_peak, _film, _suffix == "peak_time"))


@_check("dev3d_settling", "3D", "figure9", "outer step", waits=True)
def _settling_3d(outcome: Outcome[Device]) -> Check:
    one, three = (_settling_time(run) for run in (outcome.runs.base, outcome.device_3d.runs.base))
    return _compare_times("settling time", one, three, f"to {percent(BAND, 1)} of the step")


@_check("dev3d_slope", "3D", "figure13")
def _slope_3d(outcome: Outcome[Device]) -> Check:
    """Compare k A/t of the polymer with the slope of Figure 13, of the steady powers in 3D."""
    devices, model = [run.device for run in _below(outcome.runs)], outcome.device_3d.model
    outer = [device.external.final_temperature for device in devices]
    power = np.array([model.steady(device).sensor_power_W for device in devices])
    error = 2 * sum(model.steady_errors(device)["sensor_power_W"] for device in devices) / float(np.ptp(power))
    slope = float(np.polyfit(outer, power, 1)[0])
    return _pair("slope of power", "W/K", -lump(outcome.scene).polymer.conductance, slope, error * abs(slope))


def _gain(film: str, outcome: Outcome[Device]) -> Check:
    """Compare the largest stable gains; 3D's error is the change from the coarser mesh."""
    device, external, model, key = outcome.scene, outcome.scene.external, outcome.device_3d.model, f"{film}_gain_limit"
    limits: list[Callable[..., object]] = [stability, model.stability, replace(model, fine=model.low).stability]
    outer = external.initial_temperature, external.final_temperature
    in_1d, in_3d, coarser = (min(float(getattr(limit(device, t), key)) for t in outer) for limit in limits)
    error = abs(in_3d - coarser) if math.isfinite(in_3d) else 0.0
    return _pair(f"gain, {film}", "V", in_1d, in_3d, error, "largest stable gain, with the other gain as it is")


for _film in FILMS:
    _check(f"dev3d_{_film}_gain", "3D", "all figures")(partial(_gain, _film))


@_check("dev3d_claim_steady", "3D", "figure9", "outer step")
def _claim_steady(outcome: Outcome[Device]) -> Check:
    state, errors = outcome.device_3d.runs.base.after, outcome.device_3d.model.steady_errors(outcome.scene)
    power, flow = state.sensor_power_W, state.polymer_flux_W
    error, scale = errors["sensor_power_W"] + errors["polymer_flux_W"], max(abs(power), abs(flow)) or 1.0
    note = "paper: the sensor's power is the heat through the polymer; the rest passes between sink and sensor"
    return _pair("claim, steady", "W", power, flow, error, note, scale)


@_check("dev3d_claim_over_time", "3D", "figure9", "outer step", waits=True)
def _claim_over_time(outcome: Outcome[Device]) -> Check:
    """Compare the same from the outer step on, relative to the step of the steady power."""
    run = outcome.device_3d.runs.base
    result, errors, start = run.result, run.result.errors, run.device.external.step_time
    assert result.polymer_top_W is not None
    after = result.time_s > start + 1e-9 * run.device.control.sample_time
    time, power, top = (values[after] for values in (result.time_s, result.sensor_power_W, result.polymer_top_W))
    scale = abs(run.after.sensor_power_W - run.before.sensor_power_W) or abs(run.after.sensor_power_W) or 1.0
    at, error = int(np.abs(power - top).argmax()), errors["sensor_power_W"] + errors["polymer_top_W"]
    note = "paper: the sensor's power is the heat through the polymer; at its top only once the polymer stored its heat"
    whole = "the step of the steady power"
    moment, values = float(time[at]), (float(power[at]), float(top[at]))
    return _pair("claim, over time", "W", *values, error, note, scale, time=moment, relative_to=whole)


@_check("dev3d_shielding", "3D", "figure9")
def _shielding(outcome: Outcome[Device]) -> Check:
    """Compare the sensor's loss to the substrate with none, relative to the loss with the sink off."""
    slopes, errors = outcome.device_3d.model.shielding
    closed, off = slopes.sensor_power_per_substrate_W_per_K, slopes.sensor_power_per_substrate_sink_off_W_per_K
    note = (
        f"paper: the sensor loses nothing to the substrate; 1 K there changes its power by {quantity(closed, 'W', 2)}, "
        f"with the sink off by {quantity(off, 'W', 4)}"
    )
    scale = abs(off) or 1.0
    error, whole = errors["sensor_power_per_substrate_W_per_K"], "what it is with the sink off"
    return Check("shielding", 0.0, closed, "W/K", -closed / scale, error / scale, note, relative_to=whole)
