"""Figures 9 to 13 of the device.

Figures 9 to 11: the start from cold and the outer step, by power, by heat flow, and sampled slowly. Figures 12 and 13:
outer steps of many heights, by the sensor's power over time and in its steady state.

The start takes a fiftieth of the run and ten times the power, so that Figures 9 to 11 have it in a panel of its own.
Values that are held from sample to sample are drawn as steps; the heat flow is not held. 3D is a pale band under 1D.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from compare.outcome import Outcome
from reduced1d.device.lumped import lump
from scenes.device import Device
from scenes.formats import percent, quantity, scale
from statespace.result import BAND, Run
from validate.report.figures import INK, LAYERS, with_mu
from validate.report.figures.drawing import legend, logarithmic, new_figure

CURVES: dict[str, tuple[str, dict[str, Any]]] = {
    "sink_power_W": ("power of the sink", {"color": LAYERS["sink"], "drawstyle": "steps-post"}),
    "sensor_power_W": ("power of the sensor", {"color": LAYERS["sensor"], "drawstyle": "steps-post", "ls": "--"}),
    "polymer_flux_W": ("heat into the polymer", {"color": LAYERS["polymer"], "lw": 3.0}),
}
"""The label and the look of each quantity."""
IN_3D = {"lw": 5.0, "ls": "-", "alpha": 0.3, "zorder": 1}
_SAMPLES = 30
"""The least number of samples in a panel."""
_START, _SHOWN, _BEFORE = 0.02, 0.1, 0.02
"""s: the least time of a start that is shown, and the times after and before a step."""


def _figure(outcome: Outcome[Device], check: str, text: str, left: float = 0.75) -> Figure:
    checks = [each for each in outcome.checks if each.id.startswith(check)]
    return new_figure(9.5, 5.0, text, checks, bottom=0.95, left=left)


def _start_and_whole(outcome: Outcome[Device], number: int, what: str, first: str, slow: bool = False) -> Figure:
    """Left the start, at its own scale; right the whole run, at the scale after the start."""
    solved = [outcome.runs] + ([] if outcome.fem3d is None else [outcome.device_3d.runs])
    models = [run for run in (runs.slow if slow else runs.base for runs in solved) if run is not None]
    run = models[0]
    device, keys = run.device, (first, "sensor_power_W")
    outside, control = device.external, device.control
    text = f"Figure {number}: {what}, {outside.initial_temperature:g} K outside"
    if outside.step_time < device.end_time:
        text += f", {outside.final_temperature:g} K from {outside.step_time * 1e3:g} ms on"
    text += f", every {control.sample_time * 1e3:g} ms" * slow
    figure = _figure(outcome, f"fig{number}_", text, left=0.95)
    start, whole = figure.subplots(1, 2, gridspec_kw={"wspace": 0.2, "width_ratios": [1, 1.6]})
    result, end = run.result, max(float(run.result.time_s[-1]), control.sample_time)
    late = result.time_s >= min(0.1, 0.2 * end)
    values = np.concatenate([result.trace(key)[late] for key in keys])
    low, high = min(float(values.min()), 0.0), float(values.max())
    factor, unit = scale(max(high, -low) or float(result.trace(first).max()), "W")
    for ax, until in ((start, min(max(_START, _SAMPLES * control.sample_time), end)), (whole, end)):
        for model in models:
            at = model.result.time_s <= until * (1 + 1e-9)
            for key in keys:
                name, look = CURVES[key]
                if model is not run:
                    name, look = "the same in 3D" if key == first else "", look | IN_3D
                time, course = model.result.time_s[at] * 1e3, model.result.trace(key)[at] * factor
                ax.plot(time, course, label=name or None, **look)
        ax.set(xlim=(0.0, until * 1e3), xlabel="time (ms)")
        ax.xaxis.set_major_locator(MaxNLocator(5))
    start.set_ylabel(with_mu(f"power ({unit})"))
    start.set_title("the start from cold", fontsize=10, color=INK)
    whole.set_title("the whole run, at the scale after its start", fontsize=10, color=INK)
    room = 0.08 * (high - low or 1.0 / factor)
    whole.set_ylim(factor * (low - room * (low < 0)), factor * (high + room))
    legend(figure, whole)
    return figure


power = partial(_start_and_whole, number=9, what="power of sink and sensor", first="sink_power_W")
flow = partial(_start_and_whole, number=10, what="heat flow into the polymer", first="polymer_flux_W")
slow = partial(_start_and_whole, number=11, what="power when sampled slowly", first="sink_power_W", slow=True)


def responses(outcome: Outcome[Device]) -> Figure:
    """Figure 12: the sensor's power after each step, and how much of its change is still to come."""
    figure = _figure(outcome, "fig12_", "Figure 12: the sensor's power after outer steps from room temperature")
    power, rest = figure.subplots(1, 2, gridspec_kw={"wspace": 0.28})
    runs = outcome.runs.steps
    longest = max(float(run.result.time_s[-1]) - run.device.external.step_time for run in runs)
    shown = min(max(_SHOWN, _SAMPLES * outcome.scene.control.sample_time), longest) * 1e3

    def seen(run: Run) -> tuple[np.ndarray, np.ndarray]:
        """Times after the step (ms) and powers (mW)."""
        time = (run.result.time_s - run.device.external.step_time) * 1e3
        at = (time >= -_BEFORE / _SHOWN * shown) & (time <= shown)
        return time[at], run.result.sensor_power_W[at] * 1e3

    three = {} if outcome.fem3d is None else {run.step: run for run in outcome.device_3d.runs.steps}
    # Colours of rising lightness, so that the order of the steps is seen in greyscale too.
    for run, place in zip(runs, np.linspace(0.08, 0.8, len(runs)), strict=True):
        above = run.device.external.final_temperature >= run.device.control.set_temperature
        look: dict[str, Any] = {"color": colormaps["inferno"](place), "lw": 1.7, "drawstyle": "steps-post"}
        look["ls"] = "--" if above else "-"
        time, values = seen(run)
        power.plot(time, values, label=f"{run.step:+g} K" if run.step else "0 K", **look)
        if run.step in three:
            power.plot(*seen(three[run.step]), label="in 3D" if run is runs[-1] else None, **look | IN_3D)
        final = run.after.sensor_power_W * 1e3
        if change := abs(final - run.before.sensor_power_W * 1e3):
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
    figure = _figure(outcome, "fig13_", "Figure 13: steady power of the sensor against the outer temperature")
    ax, runs = figure.subplots(), outcome.runs.steps
    conductance, setpoint = lump(outcome.scene).polymer.conductance, outcome.scene.control.set_temperature
    outer = np.array([run.device.external.final_temperature for run in runs])
    ends = np.array([float(outer.min()) - 5.0, setpoint, max(float(outer.max()), setpoint) + 5.0])
    name = with_mu(f"slope -k A/t = {quantity(-conductance, 'W/K', 4)} below the set point, else zero")
    ax.plot(ends, np.maximum(conductance * (setpoint - ends), 0.0) * 1e3, color=LAYERS["polymer"], label=name)
    power = [run.final("sensor_power_W")[0] * 1e3 for run in runs]
    ax.plot(outer, power, "o", ms=6, color=LAYERS["sink"], label="1D, at the end of each run")
    if outcome.fem3d is not None:
        in_3d = [run.after.sensor_power_W * 1e3 for run in outcome.device_3d.runs.steps]
        ax.plot(outer[: len(in_3d)], in_3d, "x", ms=9, color="black", label="3D, steady")
    ax.axvline(setpoint, color=INK, lw=1.0, ls=":", label=f"set point, {setpoint:g} K")
    ax.set(xlim=ends[[0, -1]], xlabel="outer temperature (K)", ylabel="steady power of the sensor (mW)")
    legend(figure, ax, columns=4, fontsize=9)
    return figure
