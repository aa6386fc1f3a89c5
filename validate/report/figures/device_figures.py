"""Figures 9 to 14 of the device, and its shielding.

Figures 9 to 11: the start from cold and the outer step, by power, by heat flow, and sampled slowly. Figures 12 and 13:
outer steps of many heights, by the sensor's power over time and in its steady state. Figure 14: a common ground.

The start takes a fiftieth of the run and ten times the power, so that Figures 9 to 11 have it in a panel of its own.
Values that are held from sample to sample are drawn as steps; the heat flow is not held.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from compare.device_checks import METER_POWER, METER_RESISTANCE
from compare.outcome import Outcome
from compare.report.checks import drawn, with_mu
from reduced1d.device.lumped import ground_effects, lump, steady
from reduced1d.device.lumped import shielding_response as in_1d
from scenes.device import Device
from scenes.formats import percent, quantity, scale
from statespace.result import BAND, Run
from validate.report.figures import INK, LAYERS
from validate.report.figures.drawing import legend, logarithmic, new_figure

Curve = tuple[str, str, str, dict[str, Any]]
"""A quantity with its label, its colour and how its line looks."""

SINK: Curve = ("sink_power_W", "power of the sink", LAYERS["sink"], {"drawstyle": "steps-post"})
SENSOR: Curve = ("sensor_power_W", "power of the sensor", LAYERS["sensor"], {"drawstyle": "steps-post", "ls": "--"})
FLOW: Curve = ("polymer_flux_W", "heat into the polymer", LAYERS["polymer"], {"lw": 3.0})
IN_3D = {"lw": 5.0, "ls": "-", "alpha": 0.3, "zorder": 1}
"""A pale band of the 1D curve's colour under it, visible where the two differ."""
_SAMPLES = 30
"""The least number of samples in a panel."""
_START = 0.02
"""s: the least time of a start that is shown."""
_SHOWN, _BEFORE = 0.1, 0.02
"""s: what is shown after and before a step."""
IN_1D: dict[str, Any] = {"color": "black", "lw": 0.9, "ls": ":", "drawstyle": "steps-post"}
SETTLED = 0.02
"""What is shown ends where both powers stay within this part of the sink's change."""


def power(outcome: Outcome[Device]) -> Figure:
    """Figure 9: the electrical power of sink and sensor."""
    return _start_and_whole(outcome, 9, f"power of sink and sensor, {_outside(outcome.scene)}", (SINK, SENSOR), "power")


def flow(outcome: Outcome[Device]) -> Figure:
    """Figure 10: the heat flow into the polymer, and the sensor's power, which it becomes."""
    text = f"heat flow into the polymer, {_outside(outcome.scene)}"
    return _start_and_whole(outcome, 10, text, (FLOW, SENSOR), "heat flow, power")


def slow(outcome: Outcome[Device]) -> Figure:
    """Figure 11: the power of sink and sensor when sampled every 5 ms."""
    assert outcome.runs.slow is not None
    control = outcome.runs.slow.device.control
    how = f"every {control.sample_time * 1e3:g} ms, gains {control.sink_gain:g} and {control.sensor_gain:g} V"
    return _start_and_whole(outcome, 11, f"power sampled {how}", (SINK, SENSOR), "power", slow=True)


def _outside(device: Device) -> str:
    external = device.external
    first = f"{external.initial_temperature:g} K outside"
    if external.step_time >= device.end_time:
        return first
    return f"{first}, {external.final_temperature:g} K from {external.step_time * 1e3:g} ms on"


def _figure(outcome: Outcome[Device], number: int, what: str, left: float = 0.75) -> Figure:
    checks = [drawn(check) for check in outcome.checks if check.id.startswith(f"fig{number}_")]
    return new_figure(9.5, 5.0, f"Figure {number}: {what}", checks, bottom=0.95, left=left)


def _start_and_whole(
    outcome: Outcome[Device], number: int, what: str, curves: tuple[Curve, ...], label: str, slow: bool = False
) -> Figure:
    """Left the start, at its own scale; right the whole run, at the scale after the start, and thin the scene's own run
    beside the ``slow`` one, once its start is over; below, wide and pale, the same run in 3D."""
    run, three = (
        None if runs is None else runs.slow if slow else runs.base
        for runs in (outcome.runs, None if outcome.device_3d is None else outcome.device_3d.runs)
    )  # fmt: skip
    assert run is not None
    figure = _figure(outcome, number, what, left=0.95)
    start, whole = figure.subplots(1, 2, gridspec_kw={"wspace": 0.2, "width_ratios": [1, 1.6]})
    result, sample = run.result, run.device.control.sample_time
    end = max(float(result.time_s[-1]), sample)
    final = abs(getattr(steady(run.device), curves[-1][0])) or float(np.abs(result.trace(curves[-1][0])).max())
    factor, unit = scale(final, "W")
    for ax, until in ((start, min(max(_START, _SAMPLES * sample), end)), (whole, end)):
        for model in (run, three):
            if model is None:
                continue
            at = model.result.time_s <= until * (1 + 1e-9)
            for key, name, colour, look in curves:
                keywords = {"color": colour, "label": name} | look
                if model is three:
                    same = "the same in 3D" if key == curves[0][0] else None
                    keywords = look | IN_3D | {"color": colour, "label": same}
                ax.plot(model.result.time_s[at] * 1e3, model.result.trace(key)[at] * factor, **keywords)
        ax.set(xlim=(0.0, until * 1e3), xlabel="time (ms)")
        ax.xaxis.set_major_locator(MaxNLocator(5))
    start.set_ylabel(with_mu(f"{label} ({unit})"))
    start.set_title("the start from cold", fontsize=10, color=INK)
    low, high = _range(run, curves, factor)
    beyond = max(float(result.trace(key).max()) for key, *_ in curves) * factor > high
    whole.set_title("the whole run" + beyond * " (its start goes off the scale)", fontsize=10, color=INK)
    whole.set_ylim(low, high)
    if slow:
        base = outcome.runs.base
        at, per = base.result.time_s >= sample, scale(steady(run.device).sensor_power_W, "W")[0]
        name = f"the same every {base.device.control.sample_time * 1e3:g} ms"
        for key, line, own_name in ((SINK[0], "-", name), (SENSOR[0], "--", None)):
            whole.plot(base.result.time_s[at] * 1e3, base.result.trace(key)[at] * per, color="#777777", lw=0.9,
                       ls=line, zorder=1, label=own_name)  # fmt: skip
    legend(figure, whole, columns=len(curves) + 2)
    return figure


def _range(run: Run, curves: tuple[Curve, ...], factor: float) -> tuple[float, float]:
    """Return the range after the start: of the steady values and of the second half of the time."""
    result = run.result
    late = result.time_s >= min(0.1, 0.2 * float(result.time_s[-1]))
    values = np.concatenate([result.trace(key)[late] for key, *_ in curves]) * factor
    low, high = min(float(values.min()), 0.0), float(values.max())
    room = 0.08 * ((high - low) or 1.0)
    return low - (room if low < 0 else 0.0), high + room


def responses(outcome: Outcome[Device]) -> Figure:
    """Figure 12: the sensor's power after each step, and how much of its change is still to come."""
    figure = _figure(outcome, 12, "the sensor's power after outer steps from room temperature")
    power, rest = figure.subplots(1, 2, gridspec_kw={"wspace": 0.28})
    runs = outcome.runs.steps
    longest = max(float(run.result.time_s[-1]) - run.device.external.step_time for run in runs)
    shown = min(max(_SHOWN, _SAMPLES * outcome.scene.control.sample_time), longest) * 1e3

    def seen(run: Run) -> tuple[np.ndarray, np.ndarray]:
        """Times after the step (ms) and powers (mW)."""
        time = (run.result.time_s - run.device.external.step_time) * 1e3
        at = (time >= -_BEFORE / _SHOWN * shown) & (time <= shown)
        return time[at], run.result.sensor_power_W[at] * 1e3

    three = {} if outcome.device_3d is None else {run.step: run for run in outcome.device_3d.runs.steps}
    # Colours of rising lightness, so that the order of the steps is seen in greyscale too.
    for run, place in zip(runs, np.linspace(0.08, 0.8, len(runs)), strict=True):
        above = run.device.external.final_temperature >= run.device.control.set_temperature
        look: dict[str, Any] = {
            "color": colormaps["inferno"](place), "lw": 1.7, "ls": "--" if above else "-", "drawstyle": "steps-post",
        }  # fmt: skip
        time, values = seen(run)
        power.plot(time, values, label=f"{run.step:+g} K" if run.step else "0 K", **look)
        if run.step in three:
            label = "in 3D" if run is runs[-1] else None
            power.plot(*seen(three[run.step]), label=label, **look | IN_3D)
        final = run.after.sensor_power_W * 1e3
        change = abs(final - run.before.sensor_power_W * 1e3)
        if change:
            remaining = np.abs(final - values) / change
            at = (time >= 0) & (remaining > 1e-4)
            rest.plot(time[at], remaining[at], **look)
    for ax in (power, rest):
        ax.set_xlabel("time after the step (ms)")
        ax.xaxis.set_major_locator(MaxNLocator(5))
    power.set_ylabel("power of the sensor (mW)")
    rest.set(ylabel="part of the change still to come", ylim=(8e-5, 1.5), xlim=(0.0, shown))
    logarithmic(rest, "y")
    rest.axhline(BAND, color=INK, lw=0.8, label=f"band of {percent(BAND, 1)}")
    legend(figure, power, rest, handlelength=1.5, columnspacing=1.2, fontsize=9)
    return figure


def characteristic(outcome: Outcome[Device]) -> Figure:
    """Figure 13: the steady power against the outer temperature, with the slope and the limit."""
    figure = _figure(outcome, 13, "steady power of the sensor against the outer temperature")
    ax, runs = figure.subplots(), outcome.runs.steps
    conductance, setpoint = lump(outcome.scene).polymer.conductance, outcome.scene.control.set_temperature
    outer = np.array([run.device.external.final_temperature for run in runs])
    high = max(float(outer.max()), setpoint) + 5.0
    ends = np.array([float(outer.min()) - 5.0, setpoint, high])
    slope = with_mu(quantity(-conductance, "W/K", 4))
    ax.plot(ends, np.maximum(conductance * (setpoint - ends), 0.0) * 1e3, color=LAYERS["polymer"], lw=2.2,
            label=f"slope -k A/t = {slope} below the set point, else zero")  # fmt: skip
    power = [run.final("sensor_power_W")[0] * 1e3 for run in runs]
    ax.plot(outer, power, "o", ms=6, color=LAYERS["sink"], label="1D, at the end of each run")
    if outcome.device_3d is not None:
        in_3d = [run.after.sensor_power_W * 1e3 for run in outcome.device_3d.runs.steps]
        ax.plot(outer[: len(in_3d)], in_3d, "x", ms=9, color="black", label="3D, steady")
    ax.axvline(setpoint, color=INK, lw=1.0, ls=":", label=f"set point, {setpoint:g} K")
    ax.set(xlim=(ends[0], high), xlabel="outer temperature (K)", ylabel="steady power of the sensor (mW)")
    legend(figure, ax, columns=4, fontsize=9)
    return figure


def ground(outcome: Outcome[Device]) -> Figure:
    """Left the temperature errors of the films against the resistance of the lead, with the smallest leads that the
    paper's meter resolves; right the range of outer temperatures over which both are held."""
    device = outcome.scene
    ground = ground_effects(device, METER_POWER, METER_RESISTANCE)
    checks = [drawn(check) for check in outcome.checks if check.id == "fig14_ground"]
    figure = new_figure(9.5, 5.0, "Figure 14: a lead to ground that sink and sensor share", checks, bottom=0.95)
    off, reach = figure.subplots(1, 2, gridspec_kw={"wspace": 0.28})
    lead = np.array([each.resistance_ohm for each in ground.leads]) * 1e3
    for film in ("sensor", "sink"):
        # Where no outer temperature lets both films be held there is no state to be off by.
        values = np.abs([getattr(each, f"{film}_off_K") for each in ground.leads])
        values = np.where(np.isnan([each.highest_K for each in ground.leads]), np.nan, values)
        off.plot(lead, values, "o-", color=LAYERS[film], label=f"{film}, 1D, off the temperature without it")
        if outcome.device_3d is not None:
            three = outcome.device_3d.model.ground
            place = [each.resistance_ohm * 1e3 for each, _ in three]
            values = np.abs([getattr(each, f"{film}_off_K") for each, _ in three])
            off.plot(place, values, "x", ms=9, color="black", label="3D" if film == "sensor" else None)
    logarithmic(off, "x")
    logarithmic(off, "y")
    off.set(xlabel="resistance of the lead (mohm)", ylabel="off by (K)")
    low, high = (np.array([getattr(each, f"{end}_K") for each in ground.leads]) for end in ("lowest", "highest"))
    reach.fill_between(lead, low, high, color=LAYERS["polymer"], alpha=0.35, label="both films are held")
    reach.plot(lead, high, "o", color=INK, ms=4)
    external = device.external
    for outer, style in ((external.initial_temperature, ":"), (external.final_temperature, "--")):
        reach.axhline(outer, color=INK, lw=1.0, ls=style, label=f"{outer:g} K outside")
    logarithmic(reach, "x")
    reach.set(xlabel="resistance of the lead (mohm)", ylabel="outer temperature (K)", xlim=off.get_xlim())
    limits = " and ".join(quantity(each, "ohm", 3) for each in (ground.by_power_ohm, ground.by_resistance_ohm))
    off.set_title(with_mu(f"the paper's meter tells power and resistance from {limits} on"), fontsize=9, color=INK)
    legend(figure, off, reach, columns=3, fontsize=9)
    return figure


def shielding(outcome: Outcome[Device]) -> Figure:
    """Draw the change of the powers of sensor and sink after the substrate became 1 K warmer, in 3D and 1D."""
    device = outcome.scene
    assert outcome.device_3d is not None
    checks = [drawn(check) for check in outcome.checks if check.id == "dev3d_shielding"]
    figure = new_figure(9.5, 4.6, "Shielding: the substrate 1 K warmer from time 0 on", checks, bottom=0.95, left=0.95)
    fem3d, reduced1d = outcome.device_3d.model.response, in_1d(device)
    time = fem3d.time_s * 1e3
    last = fem3d.sink_power_W_per_K[-1]
    off = np.maximum(np.abs(fem3d.sink_power_W_per_K - last), np.abs(fem3d.sensor_power_W_per_K))
    late = np.flatnonzero(off > SETTLED * abs(last))
    until = 1.5 * float(time[late[-1]]) if len(late) else float(time[-1])
    shown = time <= max(until, float(time[min(30, len(time) - 1)]))
    ax = figure.subplots()
    for film in ("sensor", "sink"):
        in_3d, other = (getattr(model, f"{film}_power_W_per_K")[: len(time)] * 1e6 for model in (fem3d, reduced1d))
        ax.plot(time[shown], in_3d[shown], color=LAYERS[film], lw=1.9, label=f"{film}, 3D", drawstyle="steps-post")
        ax.plot(time[shown], other[shown], label="the same in 1D" if film == "sink" else None, **IN_1D)
    steady, _ = outcome.device_3d.model.shielding
    without = steady.sensor_power_per_substrate_sink_off_W_per_K * 1e6
    ax.axhline(without, color=LAYERS["sensor"], ls="--", lw=1.2, label="sensor with the sink off, steady")
    ax.axhline(0.0, color=INK, lw=0.8)
    ax.set(xlabel="time since the step (ms)", ylabel=with_mu("change of the power (uW/K)"))
    legend(figure, ax)
    return figure
