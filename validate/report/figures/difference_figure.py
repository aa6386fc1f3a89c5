"""How far a model is from 3D, probe by probe: bars in the steady state and over time, with the tolerance in grey."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from compare.outcome import Outcome
from scenes.formats import cut
from scenes.model import OVER_TIME, AnyScene
from validate.report.figures import INK, LINES
from validate.report.figures.drawing import legend, new_figure
from validate.report.figures.trace_figure import MOST_NAME

_ROW = 0.32
"""Inches of a bar's row."""
_OF = {"in the steady state": LINES["end_K"], "at its worst over time": LINES["mean_K"]}  # Colours of the bars.
_BEYOND = 10.0
"""Bars are cut at this relative difference, as relative to a scale near zero a difference says nothing."""


def draw(outcome: Outcome[AnyScene]) -> Figure:
    """A bar for every check, in percent of its scale, with the error of the difference."""
    checks = [c for c in outcome.checks if not c.id.startswith("slope_") and np.isfinite(c.difference)]
    model = outcome.reduced1d.model if outcome.reduced1d is not None else "the model"
    height = 2.0 + _ROW * max(len(checks), 1)
    figure = new_figure(8.5, height, f"{outcome.scene.name}: {model} less 3D", [outcome.answer], 0.95, 2.6)
    ax = figure.subplots()
    rows = np.arange(len(checks))[::-1]
    for word, colour in _OF.items():
        bars = [(row, c) for row, c in zip(rows, checks, strict=True) if (c.time is None) == word.startswith("in")]
        if not bars:
            continue
        at = [row for row, _ in bars]
        off = 100 * np.clip([c.difference for _, c in bars], -_BEYOND, _BEYOND)
        errors = [100 * min(c.u_num, _BEYOND) for _, c in bars]
        ax.barh(at, off, 0.62, xerr=errors, color=colour, ecolor=INK, capsize=3, label=word)
    for row, c in zip(rows, checks, strict=True):
        ax.barh(row, 200 * c.tolerance, 0.9, left=-100 * c.tolerance, color="#dddddd", zorder=0)
    ax.set_yticks(rows, [cut(c.id.removesuffix(OVER_TIME), MOST_NAME) for c in checks])
    ax.axvline(0, color=INK, lw=0.8)
    ax.set_xlabel("difference (%); of a temperature relative to its rise; grey is the tolerance")
    legend(figure, ax)
    return figure
