"""How quantities follow the keys: a tornado of paired bars, 3D and 1D, the largest on top."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure

from compare.inputs.sensitivities import PREFIX, sentence
from scenes.formats import cut, sink_text
from scenes.sink import Sink
from validate.report.figures import INK
from validate.report.figures.drawing import new_figure
from validate.report.inputs import followed, short

if TYPE_CHECKING:
    from compare.outcome import Outcome

_3D, _1D = "#3a86c8", "#f0a030"
_ROW = 0.3  # inches of a key
_BAR = 0.38  # of a row


def draw(outcome: Outcome[Any]) -> Figure:
    """A panel for each quantity with a pair of bars for each key; an error in 3D as a line across its end, the names of
    keys that 1D follows beyond the tolerance in red."""
    found = outcome.sensitivities
    assert found is not None
    names = followed(outcome)
    keys = found.sorted(names)
    models = _models(outcome)
    differ = {check.id.removeprefix(PREFIX) for check in outcome.checks if check.verdict == "differs"}
    height = 1.5 + _ROW * max(len(keys), 3)
    whose = sink_text(outcome.scene) if isinstance(outcome.scene, Sink) else outcome.scene.name
    who = "the models follow" if len(models) > 1 else f"{next(iter(models.values()), '3D')} follows"
    text = f"How {who} each key, {whose}: % for each percent"
    said = sentence(outcome.checks)
    figure = new_figure(11.0, height, text, [said] if said else [], bottom=0.75 if len(models) > 1 else 0.4, left=2.75)
    axes = figure.subplots(1, len(names), sharey=True, squeeze=False, gridspec_kw={"wspace": 0.08})[0]
    places = np.arange(len(keys), dtype=float)
    for ax, name in zip(axes, names, strict=True):
        slopes = [found.steady[key].get(name) for key in keys]
        in_3d = [s.fem3d.value if s and s.fem3d else np.nan for s in slopes]
        errors = [s.fem3d.error if s and s.fem3d else np.nan for s in slopes]
        in_1d = [s.reduced1d if s and s.reduced1d is not None else np.nan for s in slopes]
        apart, wide = (_BAR / 2, _BAR) if len(models) > 1 else (0.0, 2 * _BAR)
        if "fem3d" in models:
            ax.barh(places - apart, in_3d, wide, xerr=errors, color=_3D, ecolor=INK, label=models["fem3d"])
        if "reduced1d" in models:
            ax.barh(places + apart, in_1d, wide, color=_1D, label=models["reduced1d"])
        ax.axvline(0.0, color=INK, lw=0.8)
        ax.set_title(cut(names[name], 34), fontsize=10)
        ax.grid(False, axis="y")
    axes[0].set_yticks(places, [cut(short(key), 36) for key in keys])
    for label, key in zip(axes[0].get_yticklabels(), keys, strict=True):
        label.set_color("#8b1a1a" if key in differ else INK)
    axes[0].set_ylim(len(keys) - 0.4, -0.6)
    if len(models) > 1:
        figure.legend(*axes[0].get_legend_handles_labels(), loc="lower center", ncols=2)
    return figure


def _models(outcome: Outcome[Any]) -> dict[str, str]:
    """What the models are called that have sensitivities."""
    assert outcome.sensitivities is not None
    slopes = [s for of in outcome.sensitivities.steady.values() for s in of.values()]
    found = {"fem3d": "3D"} if any(s.fem3d is not None for s in slopes) else {}
    if any(s.reduced1d is not None for s in slopes):
        found["reduced1d"] = outcome.reduced1d.model if outcome.reduced1d else "1D"
    return found
