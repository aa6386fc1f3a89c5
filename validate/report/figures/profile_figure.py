"""Figure 5: the steady rise along the beam, and the parabola that the reduction takes it for."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from compare.figure_checks import profile
from compare.verdict import PAPERS, Models
from reduced1d.equations import parabola
from scenes.formats import quantity, sink_text
from validate.report.figures import INK, LINES
from validate.report.figures.drawing import band, new_figure

if TYPE_CHECKING:
    from compare.outcome import Outcome
    from scenes.sink import Sink


def draw(outcome: Outcome[Sink]) -> Figure:
    """The 3D profile with eq 9's parabola through its own end and peak, and the 1D model's; below, the distances, with
    the numerical error about them.

    A discrete solution has kinks between its cells, far smaller than its error but visible on the scale of the
    distance; the curve is smoothed by a twentieth of the error, and then nearer to a finer solution than before.
    """
    assert outcome.fem3d is not None
    sink = outcome.scene
    y, rise, fitted = profile(Models(sink, outcome.fem3d, outcome.reduced1d))
    checks = [check for check in outcome.checks if check.id == "fig5"]
    text = f"Figure 5: steady rise along the beam, {sink_text(sink)}"
    figure = new_figure(7.5, 5.4, text, checks, left=0.95)
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1.2))
    um = y * 1e6
    above.plot(um, rise, color=INK, label="3D, along the axis")
    above.plot(um, fitted, color=LINES["mean_K"], ls=(0, (5, 3)), label="eq 9's parabola through the 3D end and peak")
    # The error of the profile, and that of the parabola through two of its points.
    error = 2 * max(outcome.fem3d.steady[key].error for key in ("peak_rise_K", "end_rise_K", "mean_rise_K"))
    off = _smooth(um, rise - fitted, error / 40)
    band(below, um, off, error, LINES["mean_K"])
    below.plot(um, off, color=LINES["mean_K"])
    if outcome.reduced1d is not None:
        steady = outcome.reduced1d.steady
        end = steady["end_rise_K"].value
        peak, name = steady["peak_rise_K"].value, outcome.reduced1d.model
        if name in PAPERS:
            reduction = parabola(y, peak - end, end, sink.length)
            above.plot(um, reduction, color=LINES["end_K"], ls=":", lw=2.2, label="1D, eqs 9, 17 and 18")
        else:
            above.plot(um[[0, len(um) // 2, -1]], [end, peak, end], "o", color=LINES["end_K"], ms=5, label=name)
    below.axhline(0.0, color=INK, lw=0.8)
    above.set_ylabel("rise above room (K)")
    below.set_ylabel("3D less its\nparabola (K)")
    below.set_title(f"shaded: its numerical error, ±{quantity(error, 'K', 2)}", fontsize=9, loc="right", pad=3)
    below.set_xlabel("place along the beam y (µm)")
    above.set_ylim(bottom=0.0)
    above.set_xlim(um[0], um[-1])
    above.legend(loc="lower center")
    return figure


def _smooth(place: np.ndarray, values: np.ndarray, within: float) -> np.ndarray:
    """The values as a smooth curve, off them by ``within`` (RMS); as they are where that is too little to tell."""
    from scipy.interpolate import UnivariateSpline

    if within < 1e-4 * float(np.ptp(values)):
        return values
    return UnivariateSpline(place, values, k=5, s=len(place) * within**2)(place)
