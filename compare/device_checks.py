"""The paper's claims on Figures 9 to 14 and (one-sided) on meters: predicted is the paper, measured 1D."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from compare.verdict import Comparison, Definitions, relative
from reduced1d.device.accurate import shown
from reduced1d.device.design import PXI_4070, delivered
from reduced1d.device.lumped import at_sample_time, ground_effects, largest_eigenvalue, lump
from scenes.device import Device
from scenes.errors import SceneError
from scenes.formats import kelvin, milliseconds, percent, quantity
from statespace.result import BAND, SLOW_TIME, Run, Runs

if TYPE_CHECKING:
    from fem3d.device.solve import Solved

PAPER_SETTLING = 0.1
"""The settling time (s) that the paper gives, "about 0.1 s"."""
ROUNDING = 1e-12
"""Added to relative errors: exact claims are compared in double precision, in sums of many terms."""
METER_RESISTANCE, METER_POWER, METER_RATE = 60e-6, 23e-9, 5.0
"""The paper on meters (section 5): an NI 4070 reads the gold's resistance to some 60 uohm and its power to 23 nW, at 5
readings a second, "which is more than sufficient"."""
METER_RANGES = 1.0, 20e-3
"""The ranges, in V and A, that the paper quotes."""


@dataclass(frozen=True)
class Both:
    """The runs of a device in 1D, and in 3D where it was solved."""

    one: Runs
    three: Solved | None = None

    @property
    def device(self) -> Device:
        """The scene."""
        return self.one.base.device

    @property
    def in_3d(self) -> Solved:
        """The 3D runs; ValueError where there are none."""
        if self.three is None:
            raise ValueError("this check needs the device in 3D")
        return self.three


CHECKS: Definitions[Both] = Definitions()
Make = Callable[[Both], Comparison]


def after_step(*runs: Callable[[Both], Run | None]) -> Callable[[Make], Make]:
    """Leave a check open where one of the runs was stopped before the outer step."""

    def guard(make: Make) -> Make:
        def made(both: Both) -> Comparison:
            for run in (each(both) for each in runs):
                if run is not None and run.stopped:
                    said = f"the run was stopped at {run.result.time_s[-1]:.6g} s, before the outer step"
                    return Comparison("not reached", math.nan, math.nan, "", math.inf, 0.0, said)
            return make(both)

        return made

    return guard


def _base(both: Both) -> Run:
    return both.one.base


@CHECKS.check("fig9_settling", "figure9", "outer step")
@after_step(_base)
def fig9_settling(both: Both) -> Comparison:
    """Compare the settling time with the paper's; the paper names no band, here it is 1 %."""
    run = both.one.base
    time, error = run.settled()
    bands = ", ".join(f"{percent(part, 1)} in {milliseconds(run.settled(part)[0])}" for part in (BAND, 1e-3, 1e-4))
    said = f"paper: about {PAPER_SETTLING:g} s, no band given; here after the step to {bands}{_yet(run)}"
    return Comparison("settling time", PAPER_SETTLING, time, "s", *_against(PAPER_SETTLING, time, error, run), said)


@CHECKS.check("fig9_balance", "figure9", "outer step")
@after_step(_base)
def fig9_balance(both: Both) -> Comparison:
    """Compare the sensor's steady power with the heat into the polymer."""
    run = both.one.base
    (power, d_power), (flow, d_flow) = run.final("sensor_power_W"), run.final("polymer_flux_W")
    size = max(abs(power), abs(flow)) or 1.0
    values = f"{quantity(power, 'W', 7)} and {quantity(flow, 'W', 7)}"
    said = f"paper: the steady power becomes heat in the polymer entirely; here {values}{_yet(run)}"
    u_num = (d_power + d_flow) / size + ROUNDING
    return Comparison("heat to polymer", power, flow, "W", (power - flow) / size, u_num, said)


@CHECKS.check("fig10_steady", "figure10", "outer step")
@after_step(_base)
def fig10_steady(both: Both) -> Comparison:
    """Compare the steady heat flow into the polymer with k A/t times the temperature difference across it."""
    run, device = both.one.base, both.device
    conductance = lump(device).polymer.conductance
    after = device.control.set_temperature - device.external.final_temperature
    flow, drift = run.final("polymer_flux_W")
    predicted = conductance * after
    size = abs(predicted) or 1.0
    values = f"{quantity(flow, 'W')} at {kelvin(after)}, k A/t = {quantity(conductance, 'W/K')}"
    said = f"paper: the flow follows the sensor's power; here it grows with the gradient, {values}{_yet(run)}"
    u_num = drift / size + ROUNDING
    return Comparison("steady heat flow", predicted, flow, "W", (predicted - flow) / size, u_num, said)


@CHECKS.check("fig11_slow", "figure11", "outer step")
@after_step(_base, lambda both: both.one.slow)
def fig11_slow(both: Both) -> Comparison:
    """Compare the settling time of the loop sampled every 5 ms with the scene's own.

    The paper: the behaviour is not ideal. The difference is one-sided: none where the slow loop settles later.
    """
    base, slow = both.one.base, both.one.slow
    assert slow is not None
    (base_time, base_error), (time, error) = base.settled(), slow.settled()
    said = (
        f"paper: the behaviour is not ideal; here within {percent(BAND, 1)} of the step after {milliseconds(time)} "
        f"when sampled every {SLOW_TIME * 1e3:g} ms, {milliseconds(base_time)} in the scene; largest eigenvalue per "
        f"sample {shown(slow.eigenvalue)} and {shown(base.eigenvalue)}"
    )
    if base_time == math.inf:
        # The scene's own time is at least as long as its run after the step.
        missing, u_num = (base.watched / time - 1, 0.0) if time < base.watched else (0.0, math.inf)
    elif time == math.inf:
        missing, u_num = 0.0, 0.0 if slow.watched > base_time else math.inf
    else:
        missing, u_num = max(relative(base_time, time), 0.0), (base_error + error) / time if time else 0.0
        u_num = 0.0 if time - error > base_time + base_error else u_num + ROUNDING
    return Comparison("slower at 5 ms", base_time, time, "s", missing, u_num, said, sense="at least")


@CHECKS.check("fig12_same_time", "figure12")
def fig12_same_time(both: Both) -> Comparison:
    """Compare the times to the steady state after outer steps from -80 to +20 K with each other."""
    moving = [run for run in both.one.steps if run.step]
    times = {run.step: run.settled() for run in moving}
    linear = [times[run.step][0] for run in moving if not _above(run)]
    typical = float(np.median(linear))
    # A step that never settles is the farthest from any time that the others take, most of all where it never will.
    never = [run for run in moving if times[run.step][0] == math.inf]
    worst = max(never or moving, key=lambda run: run.watched if never else abs(times[run.step][0] - typical))
    time, error = times[worst.step]
    below = f"{milliseconds(min(linear))} to {milliseconds(max(linear))} for steps that stay below the set point"
    said = f"paper: the same for all; here {below}, {milliseconds(time)} for {worst.step:+g} K{_yet(worst)}"
    # Where no step moves the power, there is no common time.
    off, u_num = _against(typical, time, error, worst) if typical else (math.inf, 0.0)
    return Comparison("same, all steps", typical, time, "s", off, u_num, said)


@CHECKS.check("fig13_slope", "figure13")
def fig13_slope(both: Both) -> Comparison:
    """Compare the slope of the steady power by the outer temperature with -k A/t of the polymer."""
    conductance = lump(both.device).polymer.conductance
    slope, _, error = _line(both.one)
    said = f"paper: a straight line, by R(T); here linear as conduction is, whatever R(T) is{_yet(*_below(both.one))}"
    measured = slope if math.isfinite(error) else math.nan
    return Comparison("slope of power", -conductance, measured, "W/K", relative(-conductance, slope), error, said)


@CHECKS.check("fig13_limit", "figure13")
def fig13_limit(both: Both) -> Comparison:
    """Compare the outer temperature from which on the power is zero with the set point."""
    _, zero, error = _line(both.one)
    setpoint = both.device.control.set_temperature
    beyond = [
        f"; {run.step:+g} K leaves {quantity(run.final('sensor_power_W')[0], 'W', 2)}"
        for run in both.one.steps
        if _above(run)
    ]
    said = f"paper: no higher temperature than the set one is seen; here the line ends at {zero:.7g} K"
    said += f"{''.join(beyond)}{_yet(*_below(both.one))}"
    return Comparison("end of the range", setpoint, zero, "K", (setpoint - zero) / both.device.set_rise, error, said)


@CHECKS.check("fig14_ground", "figure14")
def fig14_ground(both: Both) -> Comparison:
    """Compare a common lead to ground with the resistance at which the sensor's power is off by the paper's accuracy.

    The paper gives no resistance; without one in the scene it is one square of the sensor's film.
    """
    device = both.device
    square = float(lump(device).resistance[1]) * device.sink.width / device.sink.length
    limits = ground_effects(device, METER_POWER, METER_RESISTANCE)
    lead = device.control.ground_resistance or square
    said = (
        f"paper: sink and sensor may share a ground; here {quantity(limits.by_power_ohm, 'ohm', 3)} move the sensor's "
        f"power by {quantity(METER_POWER, 'W', 2)}, {quantity(limits.by_resistance_ohm, 'ohm', 3)} its "
        f"resistance by {quantity(METER_RESISTANCE, 'ohm', 2)}; four wires each avoid that"
    )
    missing = max(relative(lead, limits.by_power_ohm), 0.0)
    return Comparison("common ground", lead, limits.by_power_ohm, "ohm", missing, ROUNDING, said, sense="at least")


def _meter(check: str, title: str, claim: float, name: str, unit: str) -> None:
    """Register a claim about the smallest step that a meter reads, one-sided."""

    @CHECKS.check(check, "all figures")
    def make(both: Both) -> Comparison:
        run, step = both.one.base, math.inf
        said = f"paper: {quantity(claim, unit, 2)} in ranges of {METER_RANGES[0]:g} V and {METER_RANGES[1]:g} A; here "
        try:
            voltage, current = delivered(run.device, run.after, 1)
            step = PXI_4070.steps(voltage, current)[name == "power"]
            said += f"the sensor takes {quantity(run.after.sensor_V, 'V')} and {quantity(current / voltage, 'A')}"
        except ValueError as error:
            said += str(error) if run.after.sensor_power_W else "the sensor takes no power, and nothing can be read"
        return _at_most(title, claim, step, unit, said)


_meter("meter_resistance", "NI 4070, gold", METER_RESISTANCE, "resistance", "ohm")
_meter("meter_power", "NI 4070, power", METER_POWER, "power", "W")


@CHECKS.check("meter_rate", "all figures")
def meter_rate(both: Both) -> Comparison:
    """Compare the meter's rate with that of the controllers, a reading per sample."""
    needed = 1 / both.device.control.sample_time
    eigenvalue = largest_eigenvalue(at_sample_time(both.device, 1 / METER_RATE))
    said = (
        f"paper: {METER_RATE:g} S/s is more than sufficient; here {quantity(needed, 'S/s', 3)} are read; at "
        f"{METER_RATE:g} S/s the loop's largest eigenvalue per sample is {shown(eigenvalue)}"
    )
    return _at_most("NI 4070, rate", METER_RATE, needed, "S/s", said)


def _at_most(title: str, claim: float, measured: float, unit: str, said: str) -> Comparison:
    return Comparison(title, claim, measured, unit, min(relative(claim, measured), 0.0), 0.0, said, sense="at most")


def _against(expected: float, time: float, error: float, run: Run) -> tuple[float, float]:
    """The relative difference of two times and its error; a time that does not come is at least the run after it."""
    if time < math.inf and expected < math.inf:
        return relative(expected, time), error / time + ROUNDING if time else 0.0
    if expected == math.inf:
        return math.inf, 0.0 if run.watched == math.inf else math.inf
    most = expected / run.watched - 1
    return (most - 1) / 2, (most + 1) / 2


def _yet(*runs: Run) -> str:
    """Why a run is not yet at rest at its end; empty where it is."""
    run = max(runs, key=lambda run: run.remaining)
    if run.ran_away:
        return f"; it runs away and is stopped at {run.result.time_s[-1]:.4g} s"
    if run.watched == math.inf:
        return f"; the loop is unstable, its largest eigenvalue per sample {shown(run.eigenvalue)}"
    if run.remaining < 1e-6:
        return ""
    left = f"{milliseconds(run.watched)} after the step {percent(run.remaining)} of the loop's slowest mode is left"
    return f"; {left}: a longer run.end_time leaves less"


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
