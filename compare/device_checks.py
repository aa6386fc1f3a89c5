"""The paper's claims on Figures 9 to 14 and (one-sided) on meters: predicted is the paper, measured 1D."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable

import numpy as np

from compare.made import made_checks
from compare.options import Options
from compare.verdict import Check, Comparison, judged, relative
from reduced1d.device.closed_loop import at_sample_time, ground_effects, largest_eigenvalue
from reduced1d.device.design import PXI_4070, delivered, reading
from reduced1d.device.findings import shown
from reduced1d.device.lumped import lump
from scenes.device import Device
from scenes.errors import SceneError
from scenes.formats import kelvin, milliseconds, percent, quantity
from statespace.result import BAND, SLOW_TIME, Run, Runs

PAPER_SETTLING = 0.1  # s: the settling time that the paper gives ("about 0.1 s").
ROUNDING = 1e-12
"""Added to relative errors: what is stated as exact is compared in double precision, in sums of many terms."""
METER_RESISTANCE, METER_POWER, METER_RATE = 60e-6, 23e-9, 5.0
"""The paper on meters (section 5): an NI 4070 reads the gold's resistance to some 60 uohm and its power to 23 nW, at 5
readings a second, "which is more than sufficient"."""
METER_RANGES = 1.0, 20e-3
"""The ranges, in V and A, that the paper quotes."""


def evaluate(device: Device, options: Options, runs: Runs) -> tuple[Check, ...]:
    """Make the checks that the run allows, in their order."""
    needed_runs = {"fig9": (runs.base,), "fig10": (runs.base,), "fig11": (runs.base, runs.slow)}
    comparisons = {
        name: not_reached(needed_runs.get(name.partition("_")[0], ())) or DEFINITIONS[name](runs)
        for name in made_checks(device, options)
    }
    return tuple(judged(name, comparison, device, always=True) for name, comparison in comparisons.items())


def not_reached(runs: Iterable[Run | None]) -> Comparison | None:
    """Return an open comparison where one of the runs was stopped before the outer step."""
    for run in runs:
        if run is not None and run.stopped:
            said = f"the run was stopped at {run.result.time_s[-1]:.6g} s, before the outer step"
            return Comparison("not reached", math.nan, math.nan, "", math.inf, 0.0, said)
    return None


def fig9_settling(runs: Runs) -> Comparison:
    """Compare the settling time with the paper's "about 0.1 s"; the paper names no band, here it is 1 %."""
    run = runs.base
    settling = {fraction: run.settled(fraction) for fraction in (BAND, 1e-3, 1e-4)}
    bands = ", ".join(
        f"{percent(part, 1)} in {milliseconds(time)}" for part, (time, _) in settling.items() if time < math.inf
    )
    does = f"settles after the step to within a part of it, {bands}" if bands else _unsettled(run)
    does = "is none, before the step and after it" if _powerless(run) else does
    said = f"paper: it takes about {PAPER_SETTLING:g} s, no band given; here the sensor's power {does}"
    time, error = settling[BAND]
    return Comparison("settling time", PAPER_SETTLING, time, "s", *_against(PAPER_SETTLING, time, error, run), said)


def fig9_balance(runs: Runs) -> Comparison:
    """The paper: at steady state the sensor's power is converted entirely into heat in the polymer."""
    run = runs.base
    (power, d_power), (flow, d_flow) = run.final("sensor_power_W"), run.final("polymer_flux_W")
    size = max(abs(power), abs(flow)) or 1.0
    off = run.result.sensor_power_W - run.result.polymer_flux_W
    apart = float(np.abs(off[run.result.time_s >= run.device.external.step_time]).max())
    said = (
        "paper: at steady state the power becomes heat in the polymer entirely; here the sensor takes "
        f"{quantity(power, 'W', 7)} at the end and {quantity(flow, 'W', 7)} enter the polymer, "
        f"{quantity(abs(power - flow), 'W', 2)} apart, and up to {quantity(apart, 'W', 3)} after the step{_yet(run)}"
    )
    u_num = (d_power + d_flow) / size + ROUNDING
    return Comparison("heat to polymer", power, flow, "W", (power - flow) / size, u_num, said)


def fig10_steady(runs: Runs) -> Comparison:
    """The heat flow into the polymer settles at k A/t times the temperature difference across it."""
    run, device, external = runs.base, runs.base.device, runs.base.device.external
    conductance, setpoint = lump(device).polymer.conductance, device.control.set_temperature
    before, after = setpoint - external.initial_temperature, setpoint - external.final_temperature
    flow, drift = run.final("polymer_flux_W")
    predicted = conductance * after
    size = abs(predicted) or 1.0
    index = int(np.searchsorted(run.result.time_s, external.step_time - 1e-12)) - 1
    said = (
        "paper: the flow follows the sensor's power (its caption has it grow as the gradient falls); here it goes from "
        f"{quantity(float(run.result.polymer_flux_W[index]), 'W')} at {kelvin(before)} across the polymer to "
        f"{quantity(flow, 'W')} at {kelvin(after)}, k A/t = {quantity(conductance, 'W/K')} times either: it grows with "
        f"the gradient{_yet(run)}"
    )
    u_num = drift / size + ROUNDING
    return Comparison("steady heat flow", predicted, flow, "W", (predicted - flow) / size, u_num, said)


def fig11_slow(runs: Runs) -> Comparison:
    """Compare the settling time of the loop sampled every 5 ms with the scene's own.

    The paper: the behaviour is not ideal. The difference is one-sided: none where the slow loop settles later.
    """
    assert runs.slow is not None
    base, slow = runs.base, runs.slow
    (base_time, base_error), (time, error) = base.settled(), slow.settled()
    said = (
        f"paper: the behaviour is not ideal; here the power is within {percent(BAND, 1)} of its step for good after: "
        f"{milliseconds(time)} when sampled every {SLOW_TIME * 1e3:g} ms, {milliseconds(base_time)} in the scene; the "
        f"loop's slowest mode {_decay(slow.decay)} (eigenvalue per sample {shown(slow.eigenvalue)}), in the scene it "
        f"{_decay(base.decay)} ({shown(base.eigenvalue)}); the sensor overshoots the set point by "
        f"{kelvin(_overshoot(slow))} instead of {kelvin(_overshoot(base))}"
    )
    if base_time == math.inf:
        # The scene's own time is at least as long as it was watched for.
        missing, u_num = (base.watched / time - 1, 0.0) if time < base.watched else (0.0, math.inf)
    elif time == math.inf:
        missing, u_num = 0.0, 0.0 if slow.watched > base_time else math.inf
    else:
        missing, u_num = max(relative(base_time, time), 0.0), (base_error + error) / time if time else 0.0
        u_num = 0.0 if time - error > base_time + base_error else u_num + ROUNDING
    return Comparison("slower at 5 ms", base_time, time, "s", missing, u_num, said, sense="at least")


def fig12_same_time(runs: Runs) -> Comparison:
    """The paper: the time to reach the steady state is the same for all outer steps, from -80 to +20 K."""
    moving = [run for run in runs.steps if run.step]
    limited = [run for run in moving if _above(run)]
    times = {run.step: run.settled() for run in moving}
    linear = [times[run.step][0] for run in moving if run not in limited]
    typical = float(np.median(linear))
    # A step that never settles is the farthest from any time that the others take, most of all where it never will.
    never = [run for run in moving if times[run.step][0] == math.inf]
    worst = max(never or moving, key=lambda run: run.watched if never else abs(times[run.step][0] - typical))
    said = "paper: the time is the same for all; here "
    if _powerless(*moving):
        said += "the sensor takes no power, whatever the outer temperature"
    else:
        said += (
            f"within {percent(BAND, 1)} of the step for good after: {milliseconds(min(linear))}"
            f"{f' to {milliseconds(max(linear))}' if min(linear) < math.inf else ''} for steps that stay below the set "
            "point"
        )
    if never:
        said += f"; after that of {worst.step:+g} K it {_unsettled(worst)}"
    for run in limited:
        said += (
            f"; the step of {run.step:+g} K ends {kelvin(run.step - run.device.set_rise)} above it, where the power "
            f"reaches its limit, zero: {milliseconds(times[run.step][0])}"
        )
    time, error = times[worst.step]
    # Where no step moves the power, no time is there to be the same.
    off, u_num = _against(typical, time, error, worst) if typical else (math.inf, 0.0)
    return Comparison("same, all steps", typical, time, "s", off, u_num, said)


def fig13_slope(runs: Runs) -> Comparison:
    """The paper: the steady power is linear in the outer temperature; its slope is -k A/t of the polymer."""
    conductance = lump(runs.base.device).polymer.conductance
    slope, _, error, bend = _line(runs)
    said, measured_slope = "no slope can be told", math.nan
    if math.isfinite(error):
        measured_slope = slope
        said = (
            f"the steady power falls by {quantity(abs(slope), 'W/K', 7)}, k A/t of the polymer is "
            f"{quantity(conductance, 'W/K', 7)}; it bends by at most {quantity(bend, 'W', 2)}; linear because "
            "conduction is, whatever R(T) is (the paper puts it down to R(T))"
        )
    said = f"paper: a straight line; here {said}{_yet(*_below(runs))}"
    off = relative(-conductance, slope)
    return Comparison("slope of power", -conductance, measured_slope, "W/K", off, error, said)


def fig13_limit(runs: Runs) -> Comparison:
    """The paper: where the outer temperature is too high the power is zero. That is from the set point on."""
    device = runs.base.device
    _, zero, error, _ = _line(runs)
    setpoint = device.control.set_temperature
    said = "paper: no higher temperature than the set one is seen; here the line "
    said += f"reaches zero at {zero:.7g} K ({zero - 273.15:.4g} degC)" if zero < math.inf else "has no slope"
    said += f"; the set point is {setpoint:g} K"
    for run in runs.steps:
        if _above(run):
            said += (
                f"; at {run.device.external.final_temperature:g} K the power is "
                f"{quantity(run.final('sensor_power_W')[0], 'W', 2)} and the sensor "
                f"{kelvin(run.final('sensor_K')[0] - setpoint)} too hot"
            )
    said += _yet(*_below(runs))
    off = (setpoint - zero) / device.set_rise
    return Comparison("end of the range", setpoint, zero, "K", off, error, said)


def meter_rate(runs: Runs) -> Comparison:
    """How often the controllers need a reading: once per sample."""
    device = runs.base.device
    needed = 1 / device.control.sample_time
    eigenvalue = largest_eigenvalue(at_sample_time(device, 1 / METER_RATE))
    said = (
        f"paper: {METER_RATE:g} S/s to seven digits is more than sufficient; the controllers here need a reading "
        f"every {quantity(device.control.sample_time, 's', 3)}; at {METER_RATE:g} S/s, with the same gains, the loop's "
        f"largest eigenvalue per sample is {shown(eigenvalue)}, so that it "
    )
    fading = -math.log(abs(eigenvalue)) * METER_RATE
    said += f"takes {quantity(1 / fading, 's', 2)} to settle by a factor e" if fading > 0 else "is unstable"
    return _one_sided("NI 4070, rate", METER_RATE, needed, "S/s", said)


def _at_most(title: str, claim: float, run: Run, name: str, unit: str) -> Comparison:
    V, current = METER_RANGES
    parts = PXI_4070.voltage[1][1] / V, PXI_4070.current[0][1] / current
    value = V / current if name == "resistance" else V * current
    worst, squares = (quantity(value * part, unit, 2) for part in (sum(parts), math.hypot(*parts)))
    said = (
        f"paper: {quantity(claim, unit, 2)}, from its ranges of {quantity(V, 'V', 1)} and {quantity(current, 'A', 2)}, "
        f"which give {squares} at their ends as a root of squares and {worst} at worst; here the sensor takes "
    )
    state, step = run.after, math.inf
    try:
        drawn = delivered(run.device, state, 1)
        step = float(getattr(reading(PXI_4070, *drawn), name))
        taken = drawn[1] / drawn[0]
        said += f"{quantity(state.sensor_V, 'V')} and {quantity(taken, 'A')}"
        said += f", beyond {quantity(current, 'A', 2)}: the next range serves" if taken > current else ""
    except ValueError as error:
        said += str(error) if state.sensor_power_W else "no power, and there is nothing to be read"
    return _one_sided(title, claim, step, unit, said)


def _one_sided(title: str, claim: float, measured: float, unit: str, said: str) -> Comparison:
    return Comparison(title, claim, measured, unit, min(relative(claim, measured), 0.0), 0.0, said, sense="at most")


def _unsettled(run: Run) -> str:
    if run.watched == math.inf:
        return f"never settles: {_unsteady(run)}"
    return (
        f"does not settle to {percent(BAND, 1)} in the {milliseconds(run.watched)} left of the run (the "
        f"loop's slowest mode {_decay(run.decay)}, its eigenvalue per sample is {shown(run.eigenvalue)})"
    )


def _unsteady(run: Run) -> str:
    if run.ran_away:
        return f"it runs away and is stopped at {run.result.time_s[-1]:.4g} s"
    return f"the loop is unstable, its largest eigenvalue per sample {shown(run.eigenvalue)}"


def _powerless(*runs: Run) -> bool:
    return not any(run.before.sensor_power_W or run.after.sensor_power_W for run in runs)


def _against(expected: float, time: float, error: float, run: Run) -> tuple[float, float]:
    if time < math.inf and expected < math.inf:
        return relative(expected, time), error / time + ROUNDING if time else 0.0
    if expected == math.inf:
        return math.inf, 0.0 if run.watched == math.inf else math.inf
    most = expected / run.watched - 1
    return (most - 1) / 2, (most + 1) / 2


def _yet(*runs: Run) -> str:
    run = max(runs, key=lambda run: run.remaining)
    if run.watched == math.inf:
        return f"; but at {run.device.external.final_temperature:g} K outside {_unsteady(run)}"
    if run.remaining < 1e-6:
        return ""
    return (
        f"; but then, {milliseconds(run.watched)} after the step, {percent(run.remaining)} of the loop's slowest mode "
        "is left: a longer run.end_time leaves less"
    )


def _line(runs: Runs) -> tuple[float, float, float, float]:
    below = _below(runs)
    estimates = [run.final("sensor_power_W") for run in below]
    outer = np.array([run.device.external.final_temperature for run in below])
    power = np.array([value for value, _ in estimates])
    if len(below) < 2:
        raise SceneError(
            "control.set_temperature and the materials leave fewer than two outer temperatures for figure 13: choose "
            "other figures with --figure"
        )
    error = sum(d for _, d in estimates)
    if error >= np.ptp(power):
        return 0.0, math.inf, math.inf if error else 0.0, 0.0
    slope, level = np.polyfit(outer - outer.mean(), power, 1)
    zero = outer.mean() - level / slope
    bend = np.abs(power - level - slope * (outer - outer.mean())).max()
    return float(slope), float(zero), error / float(np.ptp(power)) + ROUNDING, float(bend)


def _below(runs: Runs) -> list[Run]:
    return [run for run in runs.steps if not _above(run)]


def _above(run: Run) -> bool:
    return run.device.external.final_temperature >= run.device.control.set_temperature


def _overshoot(run: Run) -> float:
    """How far the sensor goes above the set temperature (K) before the outer step."""
    start = run.result.sensor_K[run.result.time_s < run.device.external.step_time]
    return float(max(start.max() - run.device.control.set_temperature, 0.0))


def _decay(rate: float) -> str:
    return f"{'decays' if rate >= 0 else 'grows'} at {abs(rate):.3g} 1/s"


def fig14_ground(runs: Runs) -> Comparison:
    """Compare a common lead to ground with the resistance at which the sensor's power is off by the paper's accuracy.

    The paper gives no resistance; without one in the scene it is one square of the sensor's film.
    """
    device, film = runs.base.device, lump(runs.base.device)
    square = float(film.resistance[1]) * device.sink.width / device.sink.length
    ground_resistance = device.control.ground_resistance
    limits = ground_effects(device, METER_POWER, METER_RESISTANCE)
    lead = ground_resistance or square
    said = (
        "paper: sink and sensor may share a ground; here a lead of "
        f"{quantity(limits.by_power_ohm, 'ohm', 3)} in both circuits is where the sensor's power is off by the paper's "
        f"own {quantity(METER_POWER, 'W', 2)}, and one of {quantity(limits.by_resistance_ohm, 'ohm', 3)} where its "
        f"resistance is by {quantity(METER_RESISTANCE, 'ohm', 2)}; one square of the sensor's film has "
        f"{quantity(square, 'ohm', 3)}"
    )
    if ground_resistance:
        now = next(lead for lead in limits.leads if lead.resistance_ohm == ground_resistance)
        off = f"{quantity(now.sensor_off_K, 'K', 3)} and {quantity(now.sink_off_K, 'K', 3)}"
        said += f", and the scene's {quantity(ground_resistance, 'ohm', 3)} leave sensor and sink {off} off"
    said += "; measured by four wires each, voltages at the films' own ends, neither sees the lead"
    missing = max(relative(lead, limits.by_power_ohm), 0.0)
    return Comparison("common ground", lead, limits.by_power_ohm, "ohm", missing, ROUNDING, said, sense="at least")


DEFINITIONS: dict[str, Callable[[Runs], Comparison]] = {
    **{check.__name__: check for check in (fig9_settling, fig9_balance, fig10_steady, fig11_slow, fig12_same_time)},
    **{check.__name__: check for check in (fig13_slope, fig13_limit, fig14_ground)},
    "meter_resistance": lambda runs: _at_most("NI 4070, gold", METER_RESISTANCE, runs.base, "resistance", "ohm"),
    "meter_power": lambda runs: _at_most("NI 4070, power", METER_POWER, runs.base, "power", "W"),
    "meter_rate": meter_rate,
}
