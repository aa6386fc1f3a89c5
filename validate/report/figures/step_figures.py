"""Figures 12 and 13: outer steps of many heights, by the sensor's power over time and in its steady state."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from reduced1d.device.lumped import lump
from scenes.formats import percent, quantity
from scenes.loop.runs import BAND
from validate.report.checks import drawn, with_mu
from validate.report.figures import INK, LAYERS
from validate.report.figures.drawing import legend, logarithmic, new_figure
from validate.report.figures.response_figures import IN_3D

if TYPE_CHECKING:
    from compare.outcome import Outcome
    from scenes.device import Device

_SHOWN, _BEFORE = 0.1, 0.02
"""How long after the step is shown (s), unless the runs have fewer than that many samples; and of that, before it."""
_SAMPLES = 30


def responses(outcome: Outcome[Device]) -> Figure:
    """Figure 12: the sensor's power after each step, and how much of its change is still to come."""
    checks = [drawn(check) for check in outcome.checks if check.id.startswith("fig12")]
    text = "Figure 12: the sensor's power after outer steps from room temperature"
    figure = new_figure(9.5, 5.0, text, checks, bottom=0.95)
    power, rest = figure.subplots(1, 2, gridspec_kw={"wspace": 0.28})
    longest = max(float(run.result.time_s[-1]) - run.device.external.step_time for run in outcome.runs.steps)
    shown = min(max(_SHOWN, _SAMPLES * outcome.scene.control.sample_time), longest) * 1e3
    three = {} if outcome.device_3d is None else {run.step: run for run in outcome.device_3d.runs.steps}
    for run, colour in zip(outcome.runs.steps, _colours(len(outcome.runs.steps)), strict=True):
        time = (run.result.time_s - run.device.external.step_time) * 1e3
        values = run.result.sensor_power_W * 1e3
        above = run.device.external.final_temperature >= run.device.control.set_temperature
        look: dict[str, Any] = {"color": colour, "lw": 1.7, "ls": "--" if above else "-", "drawstyle": "steps-post"}
        at = (time >= -_BEFORE / _SHOWN * shown) & (time <= shown)
        power.plot(time[at], values[at], label=f"{run.step:+g} K" if run.step else "0 K", **look)
        if run.step in three:
            found = three[run.step].result
            near = (found.time_s - run.device.external.step_time) * 1e3
            within = (near >= -_BEFORE / _SHOWN * shown) & (near <= shown)
            power.plot(near[within], found.sensor_power_W[within] * 1e3, drawstyle="steps-post", **IN_3D,
                       label="in 3D" if run is outcome.runs.steps[-1] else None)  # fmt: skip
        final = run.after.sensor_power_W * 1e3
        change = abs(final - run.before.sensor_power_W * 1e3)
        if change:
            at &= time >= 0
            left = np.abs(final - values[at]) / change
            rest.plot(time[at][left > 1e-4], left[left > 1e-4], **look)
    for ax in (power, rest):
        ax.set_xlabel("time after the step (ms)")
        ax.xaxis.set_major_locator(MaxNLocator(5))
    power.set_ylabel("power of the sensor (mW)")
    rest.set_ylabel("part of the change still to come")
    rest.set_ylim(8e-5, 1.5)
    logarithmic(rest, "y")
    rest.axhline(BAND, color=INK, lw=1.0, ls=":", label=f"band of {percent(BAND, 1)}")
    rest.set_xlim(0.0, shown)
    legend(figure, power, rest, handlelength=1.5, columnspacing=1.2, fontsize=9)
    return figure


def characteristic(outcome: Outcome[Device]) -> Figure:
    """Figure 13: the steady power against the outer temperature, with the slope and the limit."""
    checks = [drawn(check) for check in outcome.checks if check.id.startswith("fig13")]
    device = outcome.scene
    text = "Figure 13: steady power of the sensor against the outer temperature"
    figure = new_figure(9.5, 5.0, text, checks, bottom=0.95)
    ax = figure.subplots()
    conductance, setpoint = lump(device).polymer.conductance, device.control.set_temperature
    outer = np.array([run.device.external.final_temperature for run in outcome.runs.steps])
    power = np.array([run.final("sensor_power_W")[0] for run in outcome.runs.steps])
    high = max(float(outer.max()), setpoint) + 5.0
    ends = np.array([float(outer.min()) - 5.0, setpoint, high])
    slope = with_mu(quantity(-conductance, "W/K", 4))
    ax.plot(ends, np.maximum(conductance * (setpoint - ends), 0.0) * 1e3, color=LAYERS["polymer"], lw=2.2,
            label=f"slope -k A/t = {slope} below the set point, else zero")  # fmt: skip
    ax.plot(outer, power * 1e3, "o", ms=6, color=LAYERS["sink"], label="1D, at the end of each run")
    if outcome.device_3d is not None:
        steady = [run.after.sensor_power_W * 1e3 for run in outcome.device_3d.runs.steps]
        ax.plot(outer[: len(steady)], steady, "x", ms=9, color="black", label="3D, steady")
    ax.axvline(setpoint, color=INK, lw=1.0, ls=":", label=f"set point, {setpoint:g} K")
    ax.set_xlim(ends[0], high)
    ax.set_xlabel("outer temperature (K)")
    ax.set_ylabel("steady power of the sensor (mW)")
    figure.legend(loc="lower center", ncols=4, fontsize=9)
    return figure


def _colours(count: int) -> list[Any]:
    """Colours of rising lightness, so that the order of the steps is seen in greyscale too."""
    from matplotlib import colormaps

    return [colormaps["inferno"](x) for x in np.linspace(0.08, 0.8, count)]
