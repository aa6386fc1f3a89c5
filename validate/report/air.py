"""What the air does to a sink: how far a model is off that leaves it out, or lumps it, by the coefficient."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from compare.air import QUANTITIES, STILL
from scenes.formats import percent, sink_text
from validate.report.table import Section, Style, Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from compare.outcome import Outcome
    from scenes.sink import Sink

SHOWN = (1.0, STILL, 20.0, 50.0, 100.0, 200.0, 500.0, 1e3, 1e4)
"""Coefficients (W/(m2 K)) of which the terminal has room; the page and the summary have all."""
_LEAST = 1e-2
"""Percent below which nothing is drawn."""


def section(outcome: Outcome[Sink], style: Style) -> Section:
    """The differences at some coefficients, and up to which the air may be left out, or lumped."""
    air = outcome.air
    assert air is not None
    places = [int(np.abs(np.log(air.coefficients / wanted)).argmin()) for wanted in SHOWN]
    rows = [
        [f"{air.coefficients[at]:.4g}", *(f"{100 * of[n][at]:+.2f}" for of in (air.left_out, air.lumped) for n in of)]
        for at in (range(len(air.coefficients)) if style.page else places)
    ]
    limits = (of[n] for of in (air.limits, air.lumped_limits) for n in QUANTITIES)
    rows.append(["up to", *("all" if limit is None else f"{limit:.3g}" for limit in limits)])
    heads = [f"{kind}\n{name}" for kind in ("left out", "lumped") for name in QUANTITIES]
    worst = min((limit for limit in air.limits.values() if limit is not None), default=None)
    said = "The air may be left out at every coefficient tried"
    if worst is not None:
        said = f"It may be left out up to {worst:.3g} W/(m2 K)"
    share = max(abs(float(np.interp(air.conduction, air.coefficients, values))) for values in air.left_out.values())
    told = (
        f"In %. {said}. Still air is usually given {STILL:g} W/(m2 K); at this size it conducts "
        f"{air.conduction:.3g}, with which leaving it out is {percent(share)} off where it is worst, and through a "
        f"gap below the beam as high as the oxide {air.gap:.3g}."
    )
    return Section("Air", [Table(("W/(m2 K)", *heads), rows), told], headed=False)


def figure(outcome: Outcome[Sink]) -> Figure:
    """Sizes of the differences, left out in full and lumped in broken lines, with still air marked."""
    from validate.report.figures.colours import INK, LINES
    from validate.report.figures.drawing import legend, logarithmic, new_figure

    air = outcome.air
    assert air is not None
    figure = new_figure(8.5, 5.2, f"Leaving out the air, {sink_text(outcome.scene)}", air.checks[:1], bottom=1.1)
    ax = figure.subplots()
    colours = {"peak": LINES["peak_K"], "mean": LINES["mean_K"], "end": LINES["end_K"], "current": INK}
    for name, colour in colours.items():
        for of, line, word in ((air.left_out, "-", "left out"), (air.lumped, (0, (4, 3)), "lumped")):
            size = 100 * np.abs(of[name])
            shown = np.where(size > _LEAST, size, np.nan)
            ax.plot(air.coefficients, shown, color=colour, ls=line, label=f"{name}, {word}")
    ax.axhline(100 * outcome.scene.tolerance("air_peak"), color="#999999", lw=0.9, ls=":")
    for at, word in ((STILL, "still air, large bodies"), (air.conduction, "still air, this size")):
        ax.axvline(at, color="#999999", lw=0.9)
        ax.text(
            at * 0.94, 0.97, word, rotation=90, ha="right", va="top", fontsize=8.5, transform=ax.get_xaxis_transform()
        )
    logarithmic(ax, "x", "y")
    ax.set_xlabel("coefficient (W/(m² K)); dotted: the tolerance of rises")
    ax.set_ylabel("difference from 3D with air (%)")
    legend(figure, ax, columns=4, fontsize=8.5)
    return figure
