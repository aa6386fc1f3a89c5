"""Rows of sinks on one substrate: what one driven element does to the others, and how that falls with the pitch."""

from __future__ import annotations

import numpy as np
from matplotlib import colormaps
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.ticker import FormatStrFormatter

from scenes.array import SinkArray, places
from scenes.formats import quantity
from validate.report.array import TOLERANCES, middle, title
from validate.report.checks import with_mu
from validate.report.figures import INK
from validate.report.figures.drawing import legend, logarithmic, new_figure
from validate.run.outcome import Outcome


def draw(outcome: Outcome[SinkArray]) -> Figure:
    """Left the elements on their plate, coloured by the mean rise of each per watt in one about the middle; right the
    part that an idle element beside a driven one gets, against the pitch."""
    sink, result = outcome.scene, outcome.solved
    figure = new_figure(10.0, 4.8, title(outcome), [], bottom=0.95)
    plan, curve = figure.subplots(1, 2, gridspec_kw={"wspace": 0.62})
    driven = middle(sink)
    column = np.array(result.details["crosstalk"])[:, driven]
    at = np.array(places(sink)) * 1e3
    high, low = float(np.delete(column, driven).max()), float(np.delete(column, driven).min())
    norm = LogNorm(max(low, 1e-6 * high), max(high, 2e-6 * high))
    long, wide = (sink.length + 2 * sink.pad_length) * 1e3, max(sink.pad_width, sink.width) * 1e3
    colours = colormaps["viridis"]
    for number, (x, y) in enumerate(at):
        is_driven = number == driven
        colour = "white" if is_driven else colours(norm(max(column[number], norm.vmin)))
        plan.add_patch(Rectangle((x - wide / 2, y - long / 2), wide, long, facecolor=colour, edgecolor=INK, lw=0.5))
    size = np.array([sink.substrate_width, sink.substrate_length]) * 1e3 / 2
    plan.add_patch(Rectangle((-size[0], -size[1]), *(2 * size), fill=False, edgecolor=INK))
    plan.set(xlim=1.03 * size[0] * np.array([-1, 1]), ylim=1.03 * size[1] * np.array([-1, 1]))
    plan.set(xlabel="across (mm)", ylabel="along (mm)", aspect="equal")
    label = "rise per watt in the white one (K/W)"
    bar = figure.colorbar(ScalarMappable(norm, colours), ax=plan, label=label, shrink=0.8, format="%.2g")
    bar.ax.yaxis.set_minor_formatter(FormatStrFormatter("%.2g"))
    for each, look in zip(result.details["fall"], ("-", "--", "-.", ":"), strict=False):
        curve.plot(each.pitch * 1e6, each.part, ls=look, label=with_mu(f"{quantity(each.thickness, 'm', 3)} thick"))
    for tolerance in TOLERANCES:
        curve.axhline(tolerance, color=INK, lw=0.6)
    curve.axvline(sink.pitch * 1e6, color=INK, lw=0.8, ls=":")
    logarithmic(curve, "x")
    logarithmic(curve, "y")
    curve.set(xlabel=with_mu("pitch (um)"), ylabel="idle neighbour's rise, of the driven one's", ylim=(1e-8, 1e-1))
    legend(figure, curve)
    return figure
