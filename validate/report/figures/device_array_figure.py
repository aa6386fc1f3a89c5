"""Several whole sensors on one substrate: how much warmer the others make the plate, and what a step outside of one
does to its neighbour's sensor over time."""

from __future__ import annotations

import numpy as np
from matplotlib import colormaps
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from scenes.array import DeviceArray
from validate.report.checks import drawn
from validate.report.device_array import in_1d, solved_of, title
from validate.report.figures import INK, LAYERS
from validate.report.figures.drawing import legend, logarithmic, new_figure
from validate.run.outcome import Outcome


def draw(outcome: Outcome[DeviceArray]) -> Figure:
    """Left the elements on their plate, coloured by its rise under each; right the size of what is added to the power
    of the neighbour's sensor."""
    solved, sink = solved_of(outcome), outcome.scene.sink
    figure = new_figure(10.0, 4.8, title(outcome), [drawn(check) for check in outcome.checks], bottom=0.95)
    plan, curve = figure.subplots(1, 2, gridspec_kw={"wspace": 0.62})
    rise = solved.closed.plate_rise.value * 1e3
    norm, colours = Normalize(0.0, float(max(rise.max(), 1e-300))), colormaps["viridis"]
    long, wide = (sink.length + 2 * sink.pad_length) * 1e3, max(sink.pad_width, sink.width) * 1e3
    for warmer, at_work, (x, y) in zip(rise, solved.at_work, np.array(solved.places) * 1e3, strict=True):
        place = (x - wide / 2, y - long / 2)
        hatch = None if at_work else "///"
        plan.add_patch(
            Rectangle(place, wide, long, facecolor=colours(norm(warmer)), edgecolor=INK, lw=0.5, hatch=hatch)
        )
    size = np.array([sink.substrate_width, sink.substrate_length]) * 1e3 / 2
    plan.add_patch(Rectangle((-size[0], -size[1]), *(2 * size), fill=False, edgecolor=INK))
    plan.set(xlim=1.03 * size[0] * np.array([-1, 1]), ylim=1.03 * size[1] * np.array([-1, 1]))
    plan.set(xlabel="across (mm)", ylabel="along (mm)", aspect="equal")
    figure.colorbar(ScalarMappable(norm, colours), ax=plan, label="the others warm the plate by (mK)", shrink=0.8)
    ways = (("loops closed", "-"), ("all sinks off", "--"))
    for each, one, (name, look) in zip(solved.over_time, in_1d(outcome).over_time, ways, strict=False):
        for power, style in (
            (each.sensor_power, {"color": LAYERS["sensor"], "ls": look, "label": name}),
            (one.sensor_power, {"color": INK, "ls": look, "lw": 0.9, "label": f"{name}, 1D"}),
        ):
            curve.plot(each.time_s[1:] * 1e3, np.maximum(np.abs(power[1:]), 1e-300), **style)
        curve.axhline(each.error, color=LAYERS["sensor"], ls=look, lw=0.6)
    logarithmic(curve, "x")
    logarithmic(curve, "y")
    most = max((float(np.abs(each.sensor_power).max()) for each in solved.over_time), default=1.0)
    curve.set(
        xlabel="time since the step outside of its neighbour (ms)", ylabel="|sensor's power| (W/K), thin: its error"
    )
    curve.set_ylim(1e-8 * most, 3 * most)
    if solved.over_time:
        legend(figure, curve)
    return figure
