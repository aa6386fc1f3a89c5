"""Rows of sinks on one substrate: what one driven element does to the others, and how that falls with the pitch."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.ticker import FormatStrFormatter, LogLocator, NullFormatter

from fem3d.runs.array import MATRIX
from scenes.array import SinkArray, driven, places
from scenes.formats import quantity
from scenes.sink import Sink
from validate.report.array import TOLERANCES, title
from validate.report.checks import with_mu
from validate.report.figures import INK
from validate.report.figures.drawing import legend, logarithmic, new_figure
from validate.run.outcome import Outcome

LEAST = 1e-8
"""The smallest part of the driven element's rise that is drawn."""
NOTHING = 1e-30
"""K/W: below it an element does not feel the driven one."""


def draw(outcome: Outcome[SinkArray]) -> Figure:
    """Left the elements on their plate, coloured by the mean rise of each per watt in the driven one that is nearest to
    the middle; right the part that an idle element beside a driven one gets, against the pitch."""
    sink, result = outcome.scene, outcome.solved
    falls = result.details["fall"]
    figure = new_figure(10.0, 4.8, title(outcome), [], bottom=0.95)
    plan, curve = figure.subplots(1, 2, gridspec_kw={"wspace": 0.62})
    on = np.array(driven(sink)) - 1
    source = int(on[np.hypot(*np.array(places(sink))[on].T).argmin()])
    column = np.array(result.details["crosstalk"])[:, source]
    others = np.delete(column, source)
    high = max(float(others.max()), NOTHING)
    least = max(float(others.min()), 1e-6 * high)
    norm = LogNorm(least, high)
    colours = colormaps["viridis"]

    def look(number: int) -> dict[str, Any]:
        if number == source:
            return {"facecolor": "white", "lw": 0.5}
        return {"facecolor": colours(norm(max(column[number], least)))}

    lay_out(plan, sink, look)
    label = "rise per watt in the white one (K/W)"
    bar = figure.colorbar(ScalarMappable(norm, colours), ax=plan, label=label, shrink=0.8, format="%.2g")
    # Between two decades there are ticks with numbers, over many of them there is no room.
    narrow = high < 10 * least
    bar.ax.yaxis.set_minor_formatter(FormatStrFormatter("%.2g") if narrow else NullFormatter())
    for each, line in zip(falls, ("-", "--", "-.", ":"), strict=False):
        curve.plot(each.pitch * 1e6, each.part, ls=line, label=with_mu(f"{quantity(each.thickness, 'm', 3)} thick"))
    for tolerance in TOLERANCES:
        curve.axhline(tolerance, color=INK, lw=0.6)
    curve.axvline(sink.pitch * 1e6, color=INK, lw=0.8, ls=":", label="the scene's pitch")
    logarithmic(curve, "x")
    curve.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    logarithmic(curve, "y")
    last = max(float(each.pitch[each.part > LEAST].max(initial=sink.pitch)) for each in falls)
    curve.set(xlabel=with_mu("pitch (um)"), ylabel="idle neighbour's rise, of the driven one's", ylim=(LEAST, 1e-1))
    curve.set_xlim(right=1.2e6 * last)
    legend(figure, curve)
    return figure


def lay_out(plan: Any, sink: Sink, look: Callable[[int], dict[str, Any]]) -> None:
    """The elements on their plate from above, each (numbers from 0) with a look of its own; of many without edges."""
    long, wide = (sink.length + 2 * sink.pad_length) * 1e3, max(sink.pad_width, sink.width) * 1e3
    usual: dict[str, Any] = {"edgecolor": INK, "lw": 0.5 if sink.count <= MATRIX else 0.0}
    for number, (x, y) in enumerate(np.array(places(sink)) * 1e3):
        plan.add_patch(Rectangle((x - wide / 2, y - long / 2), wide, long, **(usual | look(number))))
    size = np.array([sink.substrate_width, sink.substrate_length]) * 1e3 / 2
    plan.add_patch(Rectangle((-size[0], -size[1]), *(2 * size), fill=False, edgecolor=INK))
    plan.set(xlim=1.03 * size[0] * np.array([-1, 1]), ylim=1.03 * size[1] * np.array([-1, 1]))
    plan.set(xlabel="across (mm)", ylabel="along (mm)", aspect="equal")
    if size[1] < 0.1 * size[0]:
        plan.set_yticks([0.0])
