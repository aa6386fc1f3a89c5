"""How far a model is off that leaves the air out, or lumps it, against the coefficient."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from compare.air import STILL
from scenes.formats import sink_text
from validate.report.figures.colours import INK, LINES
from validate.report.figures.drawing import new_figure

if TYPE_CHECKING:
    from compare.outcome import Outcome
    from scenes.sink import Sink

_COLOURS = {"peak": LINES["peak_K"], "mean": LINES["mean_K"], "end": LINES["end_K"], "current": INK}
_LEAST = 1e-2
"""Percent below which nothing is drawn."""


def draw(outcome: Outcome[Sink]) -> Figure:
    """Sizes of the differences, left out in full and lumped in broken lines, with still air marked."""
    air = outcome.air
    assert air is not None
    figure = new_figure(8.5, 5.2, f"Leaving out the air, {sink_text(outcome.scene)}", air.checks[:1], bottom=1.1)
    ax = figure.subplots()
    for name, colour in _COLOURS.items():
        for of, line, word in ((air.left_out, "-", "left out"), (air.lumped, (0, (4, 3)), "lumped")):
            size = 100 * np.abs(of[name])
            ax.plot(
                air.coefficients, np.where(size > _LEAST, size, np.nan), color=colour, ls=line, label=f"{name}, {word}"
            )
    ax.axhline(100 * outcome.scene.tolerance("air_peak"), color="#999999", lw=0.9, ls=":")
    for at, word in ((STILL, "still air, large bodies"), (air.conduction, "still air, this size")):
        ax.axvline(at, color="#999999", lw=0.9)
        ax.text(
            at * 0.94, 0.97, word, rotation=90, ha="right", va="top", fontsize=8.5, transform=ax.get_xaxis_transform()
        )
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.minorticks_off()
    ax.set_xlabel("coefficient (W/(m² K)); dotted: the tolerance of rises")
    ax.set_ylabel("difference from 3D with air (%)")
    figure.legend(*ax.get_legend_handles_labels(), loc="lower center", ncols=4, fontsize=8.5)
    return figure
