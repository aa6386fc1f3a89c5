"""What each effect that both models leave out would change."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullLocator

from compare.kinds import kind_of
from compare.outcome import Outcome
from validate.report.figures import INK, LINES
from validate.report.figures.drawing import legend, new_figure

_LEAST = 0.1
"""Percent below which the axis is linear."""
_COLOURS = LINES["peak_K"], LINES["end_K"], INK
_BAR = 0.26  # Height of a bar, of a row of 1.


def draw(outcome: Outcome[Any]) -> Figure:
    """A row of bars for each effect, the largest first, with the numerical error of each; all together at the foot."""
    left_out = outcome.analyses["left_out"]
    assert left_out is not None
    effects = dict(left_out.effects) | ({} if left_out.together is None else {"together": left_out.together})
    height = 2.4 + 0.62 * len(effects)
    kind = kind_of(outcome.scene)
    text = f"What both models leave out, {kind.title(outcome.scene)}"
    said = [left_out.sentence]
    figure = new_figure(8.5, height, text, said, bottom=1.0, left=1.5)
    ax = figure.subplots()
    for n, (key, colour) in enumerate(zip(kind.shown, _COLOURS, strict=True)):
        made = [(place, each.changes[key]) for place, each in enumerate(effects.values()) if each.changes]
        values = np.array([100 * change.value for _, change in made])
        errors = np.array([100 * change.error for _, change in made])
        places = np.array([place for place, _ in made]) + (n - 1) * _BAR
        ax.barh(places, values, 0.9 * _BAR, color=colour, label=left_out.called[key])
        ax.errorbar(values, places, xerr=errors, fmt="none", ecolor="#777777", elinewidth=1.0, capsize=2)
    for place, each in enumerate(effects.values()):
        if not each.changes:
            ax.text(0.02 * _LEAST, place, "runs away", va="center", fontsize=9, color=INK)
    most = max((abs(100 * c.value) for each in effects.values() for c in each.changes.values()), default=1.0)
    ax.set_xscale("symlog", linthresh=_LEAST)
    tens = [10.0**n for n in range(-1, 6) if 10.0**n <= 3 * most]
    ax.set_xticks([-ten for ten in tens[::-1]] + [0.0] + tens)
    ax.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:+g}" if value else "0"))
    ax.xaxis.set_minor_locator(NullLocator())
    ax.axvline(0.0, color=INK, lw=0.8)
    ax.set_yticks(range(len(effects)), [name.replace("_", " ") for name in effects])
    ax.set(ylim=(len(effects) - 0.5, -0.5), xlabel="change of the 3D steady state (%)")
    ax.grid(visible=False, axis="y")
    legend(figure, ax)
    return figure
