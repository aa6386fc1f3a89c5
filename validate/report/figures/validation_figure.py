"""Data and both models, each with what it is known to, and below them the comparison error E = S - D."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from compare.inputs.validation import COVERS
from scenes.formats import sink_text
from validate.report.figures import INK
from validate.report.figures.drawing import band, legend, new_figure

if TYPE_CHECKING:
    from compare.outcome import Outcome
    from scenes.sink import Sink

_COLOURS = {"3D": "#3a86c8", "1D": "#f0a030"}
_MARKS = 40
"""How many of the data are drawn."""


def draw(outcome: Outcome[Sink]) -> Figure:
    """A column for each quantity of the data: above the values with bands of 2 sqrt(u_num^2 + u_input^2) and bars of 2
    u_D, below E of both models within 2 u_val."""
    found = outcome.validation
    assert found is not None
    keys = list(dict.fromkeys(course.quantity for course in found.courses))
    name = "" if outcome.against is None else f", {outcome.against.name[:40]}"
    text = f"Validation: {sink_text(outcome.scene)}{name}"
    width = 2.0 + 4.2 * len(keys)
    said = "bands of 2 u: of S by numerics and inputs, of D by the data; below E = S - D within 2 u_val"
    figure = new_figure(max(width, 7.0), 6.0, text, [said], bottom=0.9)
    axes = figure.subplots(2, len(keys), sharex=True, squeeze=False, gridspec_kw={"wspace": 0.3, "hspace": 0.12})
    for column, key in enumerate(keys):
        above, below = axes[0, column], axes[1, column]
        room = outcome.scene.room_temperature if key.endswith("_K") else 0.0
        for course in (c for c in found.courses if c.quantity == key):
            ms, colour = course.times * 1e3, _COLOURS[course.model]
            value = course.simulated - room
            half = COVERS * np.hypot(course.u_num, np.nan_to_num(course.u_input))
            above.plot(ms, value, color=colour, label=course.model)
            band(above, ms, value, half, colour)
            below.plot(ms, course.error, color=colour)
            band(below, ms, course.error, COVERS * np.nan_to_num(course.u_val), colour)
        few = np.unique(np.linspace(0, len(ms) - 1, _MARKS).astype(int))
        above.errorbar(
            ms[few], course.measured[few] - room, COVERS * course.u_data[few], fmt="o", ms=3.5, mfc="white", color=INK,
            lw=0.8, label="data",
        )  # fmt: skip
        below.axhline(0.0, color=INK, lw=0.8)
        unit = key.rpartition("_")[2]
        above.set_ylabel(f"{key.rpartition('_')[0]}{' rise' if unit == 'K' else ''} ({unit})")
        below.set_ylabel(f"E = S - D ({unit})")
        below.set_xlabel("time (ms)")
    legend(figure, axes[0, 0])
    return figure
