"""Several whole sensors on one substrate: how much warmer the others make the plate, and what a step outside of one
does to its neighbour's sensor over time."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from scenes.array import DeviceArray
from validate.report.checks import drawn
from validate.report.device_array import in_1d, solved_of, title
from validate.report.figures import INK, LAYERS
from validate.report.figures.array_figure import lay_out
from validate.report.figures.drawing import legend, logarithmic, new_figure
from validate.run.outcome import Outcome


def draw(outcome: Outcome[DeviceArray]) -> Figure:
    """Left the elements, coloured by their plate's rise; right what is added to the power of the neighbour's sensor."""
    solved, sink = solved_of(outcome), outcome.scene.sink
    figure = new_figure(10.0, 4.8, title(outcome), [drawn(check) for check in outcome.checks], bottom=0.95)
    plan, curve = figure.subplots(1, 2, gridspec_kw={"wspace": 0.62})
    rise = solved.closed.plate_rise.value * 1e3
    norm, colours = Normalize(0.0, float(max(rise.max(), 1e-300))), colormaps["viridis"]

    def look(number: int) -> dict[str, Any]:
        idle = {} if solved.at_work[number] else {"hatch": "///"}
        return {"facecolor": colours(norm(rise[number])), **idle}

    lay_out(plan, sink, look)
    label = f"the others warm the plate by (mK){'' if solved.at_work.all() else ', hatched: idle'}"
    figure.colorbar(ScalarMappable(norm, colours), ax=plan, label=label, shrink=0.8)
    ways = (("loops closed", "-"), ("all sinks off", "--"))
    for each, one, (name, line) in zip(solved.over_time, in_1d(outcome).over_time, ways, strict=False):
        for power, style in (
            (each.sensor_power, {"color": LAYERS["sensor"], "ls": line, "label": name}),
            (one.sensor_power, {"color": INK, "ls": line, "lw": 0.9, "label": f"{name}, 1D"}),
        ):
            curve.plot(each.time_s[1:] * 1e3, np.maximum(np.abs(power[1:]), 1e-300), **style)
        curve.axhline(each.error, color=LAYERS["sensor"], ls=line, lw=0.6)
    logarithmic(curve, "x")
    logarithmic(curve, "y")
    most = max((float(np.abs(each.sensor_power).max()) for each in solved.over_time), default=1.0)
    curve.set(
        xlabel="time since the step outside of its neighbour (ms)", ylabel="|sensor's power| (W/K), thin: its error"
    )
    if most:
        curve.set_ylim(1e-8 * most, 3 * most)
    if solved.over_time:
        legend(figure, curve)
    return figure
