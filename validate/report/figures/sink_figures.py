"""Figure 5: the steady rise along the beam; of a sink of several spans the rise along the whole row."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from compare.outcome import Outcome
from compare.report.checks import with_mu
from compare.sink_checks import profile as sampled
from compare.verdict import PAPERS
from reduced1d.equations import parabola
from scenes.formats import quantity, sink_text
from scenes.sink import Sink, start
from validate.report.figures import INK, LINES
from validate.report.figures.drawing import band, legend, new_figure


def profile(outcome: Outcome[Sink]) -> Figure:
    """Figure 5: the 3D profile with eq 9's parabola through its own end and peak, and the 1D model's; below, the
    distance from the parabola within its numerical error."""
    sink, fem3d, reduced1d = outcome.scene, outcome.solved, outcome.reduced1d
    y, rise, fitted = sampled(outcome)
    checks = [check for check in outcome.checks if check.id == "fig5"]
    figure = new_figure(9.5, 5.4, f"Figure 5: steady rise along the beam, {sink_text(sink)}", checks, left=0.95)
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1.2))
    um = y * 1e6
    above.plot(um, rise, color=INK, label="3D, along the axis")
    above.plot(um, fitted, color=LINES["mean_K"], ls=(0, (5, 3)), label="eq 9's parabola through the 3D end and peak")
    # The errors of the profile and of the parabola through two of its points.
    error = 2 * max(fem3d.steady[key].error for key in ("peak_rise_K", "end_rise_K", "mean_rise_K"))
    off = rise - fitted
    band(below, um, off, error, LINES["mean_K"])
    below.plot(um, off, color=LINES["mean_K"])
    if reduced1d is not None and {"end_rise_K", "peak_rise_K"} <= reduced1d.steady.keys():
        end, peak = reduced1d.steady["end_rise_K"].value, reduced1d.steady["peak_rise_K"].value
        places, values, look, name = um[[0, len(um) // 2, -1]], np.array([end, peak, end]), "o", reduced1d.model
        if reduced1d.model in PAPERS:
            places, values, look = um, parabola(y, peak - end, end, sink.length), ":"
            name = "1D, eqs 9, 17 and 18"
        above.plot(places, values, look, color=LINES["end_K"], label=name)
    below.axhline(0.0, color=INK, lw=0.8)
    below.set(ylabel="3D less its\nparabola (K)", xlabel="place along the beam y (µm)")
    below.set_title(with_mu(f"shaded: its numerical error, ±{quantity(error, 'K', 2)}"), fontsize=9, loc="right", pad=3)
    above.set(ylabel="rise above room (K)", ylim=(0.0, None), xlim=(um[0], um[-1]))
    above.legend(loc="lower center")
    return figure


def row(outcome: Outcome[Sink]) -> Figure:
    """The steady rise along the row in 3D, with the islands shaded, and the peak of each span in 1D."""
    sink, reduced1d = outcome.scene, outcome.reduced1d
    checks = [check for check in outcome.checks if check.id in ("islands_peak_inner", "islands_equivalent")]
    text = f"Steady rise along {sink.spans} spans, {sink_text(sink)}"
    figure = new_figure(9.5, 4.6, text, checks, bottom=0.95, left=0.95)
    ax = figure.subplots()
    y, rise = (outcome.solved.details["profile"][key] for key in ("y_m", "rise_K"))
    ax.plot(y * 1e6, rise, color=INK, lw=min(1.8, 30 / sink.spans), label="3D, along the axis")
    begins = np.array([start(sink, n) for n in range(1, sink.spans + 1)])
    for first in begins[1:].tolist():
        ax.axvspan((first - sink.island) * 1e6, first * 1e6, color="#cccccc", lw=0)
    peaks = [f"span{min(n, sink.spans + 1 - n)}_peak_rise_K" for n in range(1, sink.spans + 1)]
    # A user's own model may have numbers of some spans alone.
    if reduced1d is not None and reduced1d.steady.keys() >= set(peaks):
        name = f"{'1D' if reduced1d.model in PAPERS else reduced1d.model}, peak of each span"
        middles, values = (begins + sink.length / 2) * 1e6, [reduced1d.steady[peak].value for peak in peaks]
        ax.plot(middles, values, "o", ms=4, color=LINES["end_K"], label=name)
    ax.set(xlim=(0.0, sink.row_length * 1e6), xlabel="place along the row y (µm); islands shaded")
    ax.set(ylabel="rise above room (K)", ylim=(0.0, None))
    legend(figure, ax)
    return figure
