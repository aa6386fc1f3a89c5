"""What the paper says of Figures 9 to 13, checked against the runs: here predicted is the paper, measured the model."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from compare.checks import judged
from compare.comparison import Comparison
from compare.device.runs import BAND, SLOW_TIME, Run, Runs
from compare.device.scope import DeviceRequest, made_checks
from compare.device.words import band_text, kelvin, milliseconds
from compare.verdict import Check, relative
from compare.words import percent, quantity
from reduced1d.device.lumped import lump
from reduced1d.device.stability import stability
from scenes.device import Device
from scenes.errors import SceneError

PAPER_SETTLING = 0.1
ROUNDING = 1e-12


def evaluate(device: Device, request: DeviceRequest, runs: Runs) -> tuple[Check, ...]:
    """The checks that the run allows, in the order in which they are reported."""
    return tuple(judged(name, _find(name, runs), device, always=True) for name in made_checks(device, request))


def fig9_settling(runs: Runs) -> Comparison:
    """The paper: the sensor takes about 0.1 s to settle after the outer step. It says no band; here it is 1 %."""
    run = runs.base
    time, error = run.settled()
    bands = ", ".join(band_text(run, fraction) for fraction in (BAND, 1e-3, 1e-4))
    said = (
        f"paper: it takes about {PAPER_SETTLING:g} s, no band given; here the sensor's power settles after the step to "
        f"within a part of it, {bands}"
    )
    off = relative(PAPER_SETTLING, time)
    return _found("settling after a step", PAPER_SETTLING, time, "s", off, _part(error, time), said)


def fig9_balance(runs: Runs) -> Comparison:
    """The paper: at steady state the sensor's power is converted entirely into heat in the polymer."""
    (power, d_power), (flow, d_flow) = runs.base.final("sensor_power_W"), runs.base.final("polymer_flux_W")
    size = max(abs(power), abs(flow)) or 1.0
    result = runs.base.result
    off = result.sensor_power_W - result.polymer_flux_W
    apart = float(np.abs(off[result.time_s >= runs.base.device.external.step_time]).max())
    said = (
        "paper: at steady state the power becomes heat in the polymer entirely; here the sensor takes "
        f"{quantity(power, 'W', 7)} at the end and {quantity(flow, 'W', 7)} enter the polymer, "
        f"{quantity(abs(power - flow), 'W', 2)} apart, and up to {quantity(apart, 'W', 3)} after the step"
    )
    u_num = (d_power + d_flow) / size + ROUNDING
    return _found("power against polymer", power, flow, "W", (power - flow) / size, u_num, said)


def fig10_steady(runs: Runs) -> Comparison:
    """The heat flow into the polymer settles at k A/t times the temperature difference across it."""
    device, external = runs.base.device, runs.base.device.external
    conductance, setpoint = lump(device).polymer.conductance, device.control.set_temperature
    before, after = setpoint - external.initial_temperature, setpoint - external.final_temperature
    flow, drift = runs.base.final("polymer_flux_W")
    predicted = conductance * after
    size = abs(predicted) or 1.0
    index = int(np.searchsorted(runs.base.result.time_s, external.step_time - 1e-12)) - 1
    first = float(runs.base.result.polymer_flux_W[index])
    said = (
        "paper: the flow follows the sensor's power (its caption has it grow as the gradient falls); here it goes from "
        f"{quantity(first, 'W')} at {kelvin(before)} across the polymer to {quantity(flow, 'W')} at {kelvin(after)}, "
        f"k A/t = {quantity(conductance, 'W/K')} times either: it grows with the gradient"
    )
    return _found("steady heat flow", predicted, flow, "W", (predicted - flow) / size, drift / size + ROUNDING, said)


def fig11_slow(runs: Runs) -> Comparison:
    """The paper: sampled every 5 ms the loop does not behave ideally. Here: it settles later than the scene's own.

    One-sided: the difference is what the slow loop's settling time lacks, none where it is longer.
    """
    assert runs.slow is not None
    own, error = runs.base.settled()
    slow, slow_error = runs.slow.settled()
    rates = [-stability(run.device).growth_rate for run in (runs.slow, runs.base)]
    over = [_overshoot(run) for run in (runs.slow, runs.base)]
    said = (
        f"paper: the behaviour is not ideal; here the power is within {percent(BAND, 1)} of its step after "
        f"{milliseconds(slow)} when sampled every {SLOW_TIME * 1e3:g} ms, after {milliseconds(own)} in the scene: "
        f"the loop's slowest mode {_decay(rates[0])} 1/s, in the scene it {_decay(rates[1])} 1/s; the sensor "
        f"overshoots the set point by {kelvin(over[0])} instead of {kelvin(over[1])}"
    )
    missing = max(relative(own, slow), 0.0) if math.isfinite(own) else math.nan
    surely = slow == math.inf or slow - slow_error > own + error
    return _found("slower at 5 ms", own, slow, "s", missing, 0.0 if surely else _part(error + slow_error, slow), said)


def fig12_same_time(runs: Runs) -> Comparison:
    """The paper: the time to reach the steady state is the same for all outer steps, from -80 to +20 K."""
    moving = [run for run in runs.steps if run.step]
    limited = [run for run in moving if _above(run)]
    times = {run.step: run.settled() for run in moving}
    typical = float(np.median([times[run.step][0] for run in moving if run not in limited]))
    worst = max(times, key=lambda step: abs(times[step][0] - typical))
    linear = [times[run.step][0] for run in moving if run not in limited]
    said = (
        f"paper: the time is the same for all; here within {percent(BAND, 1)} of the step after "
        f"{min(linear) * 1e3:.4g} to {milliseconds(max(linear))} for steps "
        "that stay below the set point"
    )
    for run in limited:
        said += (
            f"; the step of {run.step:+g} K ends {kelvin(run.step - run.device.set_rise)} above it, where the power "
            f"reaches its limit, zero, after {milliseconds(times[run.step][0])}"
        )
    time, error = times[worst]
    # Where no step moves the power, no time is there to be the same.
    off = relative(typical, time) if typical else math.inf
    return _found("same time, all steps", typical, time, "s", off, _part(error, time), said)


def fig13_slope(runs: Runs) -> Comparison:
    """The paper: the steady power is linear in the outer temperature; its slope is -k A/t of the polymer."""
    conductance = lump(runs.base.device).polymer.conductance
    slope, _, error, bend = _line(runs)
    said = (
        "paper: a straight line; here the steady power falls by "
        f"{quantity(-slope, 'W/K', 7)}, k A/t of the polymer; it bends by at most "
        f"{quantity(bend, 'W', 2)}; linear because conduction is, whatever R(T) is (the paper puts it down to R(T))"
    )
    return _found("slope of the power", -conductance, slope, "W/K", relative(-conductance, slope), error, said)


def fig13_limit(runs: Runs) -> Comparison:
    """The paper: where the outer temperature is too high the power is zero. That is from the set point on."""
    device = runs.base.device
    _, zero, error, _ = _line(runs)
    setpoint = device.control.set_temperature
    said = (
        "paper: no higher temperature than the set one is seen; here the line reaches zero at "
        f"{zero:.7g} K ({zero - 273.15:.4g} degC); the set point is {setpoint:g} K"
    )
    for run in runs.steps:
        if _above(run):
            said += (
                f"; at {run.device.external.final_temperature:g} K the power is "
                f"{quantity(run.final('sensor_power_W')[0], 'W', 2)} and the sensor "
                f"{kelvin(run.final('sensor_K')[0] - setpoint)} too hot"
            )
    return _found("limit of the range", setpoint, zero, "K", (setpoint - zero) / device.set_rise, error, said)


DEFINITIONS: dict[str, Callable[[Runs], Comparison]] = {
    "fig9_settling": fig9_settling,
    "fig9_balance": fig9_balance,
    "fig10_steady": fig10_steady,
    "fig11_slow": fig11_slow,
    "fig12_same_time": fig12_same_time,
    "fig13_slope": fig13_slope,
    "fig13_limit": fig13_limit,
}


def _find(name: str, runs: Runs) -> Comparison:
    """What a check finds; nothing that the paper says comes out in a run that was stopped before the outer step."""
    needed = {"fig9": (runs.base,), "fig10": (runs.base,), "fig11": (runs.base, runs.slow)}
    for run in needed.get(name.partition("_")[0], ()):
        if run is not None and run.stopped:
            said = f"the run was stopped at {run.result.time_s[-1]:.6g} s, before the outer step"
            return _found("not reached", math.nan, math.nan, "", math.inf, 0.0, said)
    return DEFINITIONS[name](runs)


def _line(runs: Runs) -> tuple[float, float, float, float]:
    """Slope (W/K) and zero (K, infinite without a slope) of the straight line through the steady powers below the set
    point, the relative error of either, and the largest distance of a power from the line (W)."""
    below = [run for run in runs.steps if not _above(run)]
    found = [run.final("sensor_power_W") for run in below]
    outer = np.array([run.device.external.final_temperature for run in below])
    power = np.array([value for value, _ in found])
    if len(below) < 2:
        raise SceneError(
            "control.set_temperature and the materials leave fewer than two outer temperatures for figure 13: choose "
            "other figures with --figure"
        )
    if not np.ptp(power):
        return 0.0, math.inf, 0.0, 0.0
    slope, level = np.polyfit(outer - outer.mean(), power, 1)
    zero = outer.mean() - level / slope
    bend = np.abs(power - level - slope * (outer - outer.mean())).max()
    return float(slope), float(zero), sum(d for _, d in found) / float(np.ptp(power)) + ROUNDING, float(bend)


def _above(run: Run) -> bool:
    return run.device.external.final_temperature >= run.device.control.set_temperature


def _overshoot(run: Run) -> float:
    """How far the sensor goes above the set temperature (K) before the outer step."""
    result = run.result
    start = result.sensor_K[result.time_s < run.device.external.step_time]
    return float(max(start.max() - run.device.control.set_temperature, 0.0))


def _decay(rate: float) -> str:
    return f"{'decays' if rate >= 0 else 'grows'} at {abs(rate):.3g}"


def _part(error: float, value: float) -> float:
    """An error relative to its value, 0 for a value that is infinite: nothing is uncertain about that."""
    return error / value + ROUNDING if 0 < value < math.inf else 0.0


def _found(
    title: str, predicted: float, measured: float, unit: str, difference: float, u_num: float, said: str
) -> Comparison:
    return Comparison(title, predicted, measured, unit, difference, u_num, lambda: said)
