"""How quantities follow the keys: a tornado of paired bars, 3D and 1D, the largest on top."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from compare.inputs.sensitivities import PREFIX, sentence
from scenes.formats import sink_text
from validate.report.figures import INK
from validate.report.figures.drawing import new_figure
from validate.report.inputs import followed, short

if TYPE_CHECKING:
    from compare.outcome import Outcome
    from scenes.sink import Sink

_3D, _1D = "#3a86c8", "#f0a030"
_ROW = 0.3  # inches of a key
_BAR = 0.38  # of a row


def draw(outcome: Outcome[Sink]) -> Figure:
    """A panel for each quantity with a pair of bars for each key; an error in 3D as a line across its end, the names of
    keys that 1D follows beyond the tolerance in red."""
    found = outcome.sensitivities
    assert found is not None
    names = followed(outcome)
    keys = found.sorted(names)
    differ = {check.id.removeprefix(PREFIX) for check in outcome.checks if check.verdict == "differs"}
    height = 1.5 + _ROW * max(len(keys), 3)
    text = f"How the models follow each key, {sink_text(outcome.scene)}: % for each percent"
    said = sentence(outcome.checks)
    figure = new_figure(11.0, height, text, [said] if said else [], bottom=0.75, left=2.75)
    axes = figure.subplots(1, len(names), sharey=True, gridspec_kw={"wspace": 0.08})
    places = np.arange(len(keys), dtype=float)
    for ax, name in zip(axes, names, strict=True):
        slopes = [found.steady[key].get(name) for key in keys]
        in_3d = [s.fem3d.value if s and s.fem3d else np.nan for s in slopes]
        errors = [s.fem3d.error if s and s.fem3d else np.nan for s in slopes]
        in_1d = [s.reduced1d if s and s.reduced1d is not None else np.nan for s in slopes]
        ax.barh(places - _BAR / 2, in_3d, _BAR, xerr=errors, color=_3D, ecolor=INK, label="3D")
        ax.barh(places + _BAR / 2, in_1d, _BAR, color=_1D, label=outcome.reduced1d.model if outcome.reduced1d else "1D")
        ax.axvline(0.0, color=INK, lw=0.8)
        ax.set_title(names[name], fontsize=10)
        ax.grid(False, axis="y")
    axes[0].set_yticks(places, [short(key) for key in keys])
    for label, key in zip(axes[0].get_yticklabels(), keys, strict=True):
        label.set_color("#8b1a1a" if key in differ else INK)
    axes[0].set_ylim(len(keys) - 0.4, -0.6)
    handles, labels = axes[0].get_legend_handles_labels()
    shown = [(h, n) for h, n, there in zip(handles, labels, (outcome.fem3d, outcome.reduced1d), strict=True) if there]
    figure.legend([h for h, _ in shown], [n for _, n in shown], loc="lower center", ncols=2)
    return figure
