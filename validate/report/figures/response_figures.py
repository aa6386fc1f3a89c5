"""Figures 9 to 11: the start from cold and the outer step, by power, by heat flow, and sampled slowly.

The start takes a fiftieth of the run and ten times the power, so that each figure has it in a panel of its own. What is
held from sample to sample is drawn so; the heat flow isn't held.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from reduced1d.device.lumped import steady
from scenes.formats import scale
from scenes.loop.runs import Run
from validate.report.checks import drawn, with_mu
from validate.report.figures import INK, LAYERS
from validate.report.figures.drawing import legend, new_figure

if TYPE_CHECKING:
    from compare.outcome import Outcome
    from scenes.device import Device

Curve = tuple[str, str, str, dict[str, Any]]
"""A quantity with its label, its colour and how its line looks."""

SINK: Curve = ("sink_power_W", "power of the sink", LAYERS["sink"], {"drawstyle": "steps-post"})
SENSOR: Curve = ("sensor_power_W", "power of the sensor", LAYERS["sensor"], {"drawstyle": "steps-post", "ls": "--"})
FLOW: Curve = ("polymer_flux_W", "heat into the polymer", LAYERS["polymer"], {"lw": 3.0})
IN_3D = {"color": "black", "lw": 0.9, "ls": ":"}
_START, _START_SAMPLES = 0.02, 30


def power(outcome: Outcome[Device]) -> Figure:
    """Figure 9: the electrical power of sink and sensor."""
    run = outcome.runs.base
    text = f"Figure 9: power of sink and sensor, {_scene(run)}"
    return _draw(outcome, run, "fig9_", text, (SINK, SENSOR), "power", three=_three(outcome))


def flow(outcome: Outcome[Device]) -> Figure:
    """Figure 10: the heat flow into the polymer, and the sensor's power, which it becomes."""
    run = outcome.runs.base
    text = f"Figure 10: heat flow into the polymer, {_scene(run)}"
    return _draw(outcome, run, "fig10_", text, (FLOW, SENSOR), "heat flow, power", three=_three(outcome))


def slow(outcome: Outcome[Device]) -> Figure:
    """Figure 11: the power of sink and sensor when sampled every 5 ms."""
    run = outcome.runs.slow
    assert run is not None
    control = run.device.control
    text = (
        f"Figure 11: power sampled every {control.sample_time * 1e3:g} ms, gains {control.sink_gain:g} and "
        f"{control.sensor_gain:g} V"
    )
    three = None if outcome.device_3d is None else outcome.device_3d.runs.slow
    return _draw(outcome, run, "fig11_", text, (SINK, SENSOR), "power", outcome.runs.base, three)


def _three(outcome: Outcome[Device]) -> Run | None:
    return None if outcome.device_3d is None else outcome.device_3d.runs.base


def _beside(ax: Any, base: Run, run: Run) -> None:
    """The scene's own sampling, thin, once its start is over."""
    at = base.result.time_s >= run.device.control.sample_time
    time, factor = base.result.time_s[at] * 1e3, scale(steady(run.device).sensor_power_W, "W")[0]
    name = f"the same every {base.device.control.sample_time * 1e3:g} ms"
    for quantity, line in ((SINK[0], "-"), (SENSOR[0], "--")):
        ax.plot(time, base.result.trace(quantity)[at] * factor, color="#777777", lw=0.9, ls=line, zorder=1,
                label=name if quantity == SINK[0] else None)  # fmt: skip


def _scene(run: Run) -> str:
    external = run.device.external
    if external.step_time >= run.device.end_time:
        return f"{external.initial_temperature:g} K outside"
    return (
        f"{external.initial_temperature:g} K outside, {external.final_temperature:g} K from "
        f"{external.step_time * 1e3:g} ms on"
    )


def _draw(
    outcome: Outcome[Device], run: Run, family: str, text: str, curves: tuple[Curve, ...], label: str,
    beside: Run | None = None, three: Run | None = None,
) -> Figure:  # fmt: skip
    """Left the start, at its own scale; right the whole run, at the scale of what follows, thin the run ``beside``,
    dotted the same run in ``three`` dimensions."""
    checks = [drawn(check) for check in outcome.checks if check.id.startswith(family)]
    figure = new_figure(9.5, 5.0, text, checks, bottom=0.95, left=0.95)
    start, whole = figure.subplots(1, 2, gridspec_kw={"wspace": 0.2, "width_ratios": [1, 1.6]})
    result = run.result
    end = max(float(result.time_s[-1]), run.device.control.sample_time)
    first = min(max(_START, _START_SAMPLES * run.device.control.sample_time), end)
    final = abs(getattr(steady(run.device), curves[-1][0])) or float(np.abs(result.trace(curves[-1][0])).max())
    factor, unit = scale(final, "W")
    for ax, until in ((start, first), (whole, end)):
        at = result.time_s <= until * (1 + 1e-9)
        for quantity, name, colour, look in curves:
            ax.plot(result.time_s[at] * 1e3, result.trace(quantity)[at] * factor, color=colour, label=name, **look)
        if three is not None:
            at = three.result.time_s <= until * (1 + 1e-9)
            for number, (quantity, *_, look) in enumerate(curves):
                ax.plot(three.result.time_s[at] * 1e3, three.result.trace(quantity)[at] * factor, **look | IN_3D,
                        label="the same in 3D" if not number else None)  # fmt: skip
        ax.set_xlim(0.0, until * 1e3)
        ax.xaxis.set_major_locator(MaxNLocator(5))
        ax.set_xlabel("time (ms)")
    start.set_ylabel(with_mu(f"{label} ({unit})"))
    start.set_title("the start from cold", fontsize=10, color=INK)
    low, high = _range(run, curves, factor)
    beyond = max(float(result.trace(quantity).max()) for quantity, *_ in curves) * factor > high
    whole.set_title("the whole run" + beyond * " (its start goes off the scale)", fontsize=10, color=INK)
    whole.set_ylim(low, high)
    if beside is not None:
        _beside(whole, beside, run)
    legend(figure, whole, columns=len(curves) + 2)
    return figure


def _range(run: Run, curves: tuple[Curve, ...], factor: float) -> tuple[float, float]:
    """The range of what follows the start: of the steady values and of the second half of the time."""
    result = run.result
    late = result.time_s >= min(0.1, 0.2 * float(result.time_s[-1]))
    values = np.concatenate([result.trace(quantity)[late] for quantity, *_ in curves]) * factor
    low, high = min(float(values.min()), 0.0), float(values.max())
    room = 0.08 * ((high - low) or 1.0)
    return low - (room if low < 0 else 0.0), high + room
