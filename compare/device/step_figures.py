"""Figures 12 and 13: outer steps of many heights, by the sensor's power over time and in its steady state."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, MaxNLocator, NullLocator

from compare.colours import INK, LAYERS
from compare.device.runs import BAND, Run
from compare.drawing import new_figure
from compare.words import percent
from reduced1d.device.lumped import lump

if TYPE_CHECKING:
    from compare.device.outcome import DeviceOutcome

_SHOWN = 0.1


def responses(outcome: DeviceOutcome) -> Figure:
    """Figure 12: the sensor's power after each step, and how much of its change is still to come."""
    checks = [check for check in outcome.checks if check.id.startswith("fig12")]
    text = "Figure 12: the sensor's power after outer steps from room temperature"
    figure = new_figure(9.5, 5.0, text, checks, bottom=0.6)
    power, rest = figure.subplots(1, 2, gridspec_kw={"wspace": 0.32})
    figure.subplots_adjust(right=1 - 0.9 / 9.5)
    colours = _colours(len(outcome.runs.steps))
    for run, colour in zip(outcome.runs.steps, colours, strict=True):
        result, start = run.result, run.device.external.step_time
        time, values = (result.time_s - start) * 1e3, result.sensor_power_W * 1e3
        at = time <= _SHOWN * 1e3
        power.plot(time[at], values[at], color=colour, lw=1.7)
        name = f"{run.step:+g} K" if run.step else "0 K"
        power.annotate(name, (time[at][-1], values[at][-1]), xytext=(4, 0), textcoords="offset points", va="center",
                       fontsize=9, color=INK)  # fmt: skip
        change = values[-1] - values[0]
        if run.step and change:
            at &= time >= 0
            left = np.abs(values[-1] - values[at]) / abs(change)
            shown = left > 1e-4
            rest.semilogy(time[at][shown], left[shown], color=colour, lw=1.7)
            _mark(rest, run, time[at][shown], left[shown], colour)
    for ax in (power, rest):
        ax.set_xlabel("time after the step (ms)")
        ax.xaxis.set_major_locator(MaxNLocator(5))
    power.set_ylabel("power of the sensor (mW)")
    rest.set_ylabel("part of the change still to come")
    rest.set_ylim(8e-5, 1.5)
    rest.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    rest.yaxis.set_minor_locator(NullLocator())
    rest.axhline(BAND, color=INK, lw=1.0, ls=":")
    rest.annotate(f"band of {percent(BAND, 1)}", (0, BAND), xytext=(4, 3), textcoords="offset points", fontsize=9)
    rest.set_xlim(0.0, _SHOWN * 1e3)
    return figure


def _mark(ax: Any, run: Run, time: np.ndarray, left: np.ndarray, colour: Any) -> None:
    """The name of a step on the curves that leave the bundle of the others: those that reach the limit."""
    if run.device.external.final_temperature >= run.device.control.set_temperature and len(time):
        ax.annotate(f"{run.step:+g} K,\nto zero power", (time[-1], left[-1]), xytext=(-6, 4),
                    textcoords="offset points", ha="right", va="bottom", fontsize=9, color=INK)  # fmt: skip


def characteristic(outcome: DeviceOutcome) -> Figure:
    """Figure 13: the steady power against the outer temperature, with the slope and the limit."""
    checks = [check for check in outcome.checks if check.id.startswith("fig13")]
    device = outcome.device
    text = "Figure 13: steady power of the sensor against the outer temperature"
    figure = new_figure(9.5, 5.0, text, checks, bottom=0.6)
    ax = figure.subplots()
    conductance, setpoint = lump(device).polymer.conductance, device.control.set_temperature
    outer = np.array([run.device.external.final_temperature for run in outcome.runs.steps])
    power = np.array([run.final("sensor_power_W")[0] for run in outcome.runs.steps])
    high = max(float(outer.max()), setpoint) + 5.0
    ends = np.array([float(outer.min()) - 5.0, setpoint, high])
    ax.plot(ends, np.maximum(conductance * (setpoint - ends), 0.0) * 1e3, color=LAYERS["polymer"], lw=2.2,
            label="k A/t (set point - outer temperature), and not below zero")  # fmt: skip
    ax.plot(outer, power * 1e3, "o", ms=6, color=LAYERS["sink"], label="simulated, at the end of each run")
    ax.axvline(setpoint, color=INK, lw=1.0, ls=":")
    top = float(power.max()) * 1e3
    ax.annotate(f"set point {setpoint:g} K", (setpoint, 0.55 * top), xytext=(-5, 0), textcoords="offset points",
                ha="right", fontsize=9.5, color=INK)  # fmt: skip
    middle = float(np.mean(ends[:2]))
    ax.annotate(f"slope {-conductance * 1e6:.6g} uW/K", (middle, conductance * (setpoint - middle) * 1e3),
                xytext=(10, 8), textcoords="offset points", fontsize=9.5, color=INK)  # fmt: skip
    ax.set_xlim(ends[0], high)
    ax.set_xlabel("outer temperature (K)")
    ax.set_ylabel("steady power of the sensor (mW)")
    ax.legend(loc="lower left")
    return figure


def _colours(count: int) -> list[Any]:
    """Colours of rising lightness, so that the order of the steps is seen in greyscale too."""
    from matplotlib import colormaps

    return [colormaps["inferno"](x) for x in np.linspace(0.08, 0.8, count)]
