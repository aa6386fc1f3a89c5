"""Figures of a sink of several spans: the rise along the whole row, and how the differences run with its sizes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure

from compare.checks import FOLLOWED, Varied
from compare.verdict import PAPERS
from reduced1d.equations import parabola_between, unequal_ends
from reduced1d.ladder.lumps import half_island
from scenes.formats import sink_text
from scenes.sink import start
from validate.report.figures import INK, LINES
from validate.report.figures.drawing import new_figure

if TYPE_CHECKING:
    from compare.outcome import Outcome
    from scenes.result import Result
    from scenes.sink import Sink

_MANY = 8
"""Spans from which on a second panel shows the outer ones alone."""
_TOO_MANY = 30
"""Spans from which on the whole row would be a texture."""
_SHOWN = 4
"""How many that are."""
_COLOURS = ("#0b5394", "#b45f06", "#38761d", "#741b47", "#555555")


def profile(outcome: Outcome[Sink]) -> Figure:
    """The steady rise along the row in 3D and 1D, with the islands shaded; of a long row its outer spans below, and of
    one whose curves would run into each other the spans' tops alone above."""
    sink, three, one = outcome.scene, outcome.solved, outcome.reduced1d
    checks = [check for check in outcome.checks if check.id in ("islands_peak_inner", "islands_equivalent")]
    text = f"Steady rise along {sink.spans} spans, {sink_text(sink)}"
    panels = 2 if sink.spans > _MANY else 1
    figure = new_figure(9.5, 3.4 * panels + 1.0, text, checks, bottom=0.95, left=0.95)
    axes = np.atleast_1d(figure.subplots(panels, 1, gridspec_kw={"hspace": 0.3}))
    ends = (sink.row_length, start(sink, _SHOWN) + sink.length)
    for ax, end in zip(axes, ends, strict=False):
        if end == sink.row_length and sink.spans > _TOO_MANY:
            _tops(ax, sink, three, one)
            continue
        _islands(ax, sink, end)
        y, rise = three.details["profile"]["y_m"], three.details["profile"]["rise_K"]
        seen = y <= end
        ax.plot(y[seen] * 1e6, rise[seen], color=INK, label="3D, along the axis")
        if one is not None:
            _one(ax, sink, one, end)
        ax.set_xlim(0.0, end * 1e6)
        ax.set_ylim(bottom=0.0)
        ax.set_ylabel("rise above room (K)")
    axes[-1].set_xlabel("place along the row y (µm); islands shaded")
    figure.legend(*axes[-1].get_legend_handles_labels(), loc="lower center", ncols=2)
    return figure


def _tops(ax: Any, sink: Sink, three: Result, one: Result | None) -> None:
    """The largest rise of each span, in its middle."""
    numbers = range(1, sink.spans + 1)
    middles = [(start(sink, n) + sink.length / 2) * 1e6 for n in numbers]
    for model, colour, marker in ((three, INK, "o"), (one, LINES["end_K"], "x")):
        if model is not None:
            tops = [model.steady[f"span{min(n, sink.spans + 1 - n)}_peak_rise_K"].value for n in numbers]
            ax.plot(middles, tops, color=colour, ls="none", marker=marker, ms=3)
    ax.set_xlim(0.0, sink.row_length * 1e6)
    ax.set_ylabel("top of each span (K)")


def _islands(ax: Any, sink: Sink, end: float) -> None:
    """Shades the islands, and numbers the spans as their quantities are."""
    few = sink.spans <= _MANY or end < sink.row_length
    for number in range(1, sink.spans + 1):
        first = start(sink, number)
        if first >= end:
            break
        if number < sink.spans and first + sink.length < end:
            ax.axvspan((first + sink.length) * 1e6, min(start(sink, number + 1), end) * 1e6, color="#cccccc", lw=0)
        if few:
            name = f"span {min(number, sink.spans + 1 - number)}"
            ax.text((first + sink.length / 2) * 1e6, 0.3, name, ha="center", va="bottom", fontsize=9, color="#555555")


def _one(ax: Any, sink: Sink, one: Result, end: float) -> None:
    """The paper's model as its parabola in each span; of another what it says of a span's middle."""
    papers, k = one.model in PAPERS, sink.silicon.thermal_conductivity
    places, rises = [], []
    for number in range(1, sink.spans + 1):
        first, of = start(sink, number), min(number, sink.spans + 1 - number)
        if first >= end:
            break
        if not papers:
            places.append(np.array([first + sink.length / 2]))
            rises.append(np.array([one.steady[f"span{of}_middle_rise_K"].value]))
            continue
        R1 = one.steady["anchor_resistance_K_per_W"].value if of == 1 else half_island(sink)
        mean, y = one.steady[f"span{of}_mean_rise_K"].value, np.linspace(0.0, sink.length, 101)
        found = unequal_ends(mean, R1, half_island(sink), k, sink.cross_section, sink.length)
        own = parabola_between(y, *found, sink.length)
        places.append(np.append(first + y, np.nan))
        rises.append(np.append(own if number == of else own[::-1], np.nan))
    style: dict[str, Any] = {"ls": (0, (5, 3))} if papers else {"ls": "none", "marker": "o", "ms": 5}
    label = "1D, eqs 13 to 19 with unequal ends" if papers else one.model
    ax.plot(np.concatenate(places) * 1e6, np.concatenate(rises), color=LINES["end_K"], label=label, **style)


def runs(outcome: Outcome[Sink]) -> Figure:
    """The steady differences of the checks against the number of spans, and against an island's length."""
    sink = outcome.scene
    figure = new_figure(9.5, 4.4, f"How the differences run, {sink_text(sink)}", [], bottom=1.0)
    axes = figure.subplots(1, 2, sharey=True, gridspec_kw={"wspace": 0.08})
    labels = ("number of spans; dotted: this sink", "length of an island (µm)")
    for ax, varied, label, factor in zip(axes, outcome.varied, labels, (1.0, 1e6), strict=True):
        _curves(ax, varied, factor)
        ax.set_xscale("log")
        ax.set_xticks(np.array(varied.values) * factor, [f"{v * factor:.4g}" for v in varied.values])
        ax.minorticks_off()
        ax.set_xlabel(label)
        ax.axhline(0.0, color=INK, lw=0.8)
        ax.axvline(varied.own * factor, color="#999999", lw=0.8, ls=":")
    axes[0].set_ylabel("difference (%)")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="lower center", ncols=len(FOLLOWED))
    return figure


def _curves(ax: Any, varied: Varied, factor: float) -> None:
    for (check, name), colour in zip(FOLLOWED.items(), _COLOURS, strict=True):
        at = [
            (v * factor, 100 * d[check]) for v, d in zip(varied.values, varied.differences, strict=True) if check in d
        ]
        ax.plot(*np.array(at).T, color=colour, marker="o", ms=4, label=name)
