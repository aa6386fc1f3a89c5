"""The budget as a figure: stacked over time, with the steady state at the side."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from compare.budget import of_current
from scenes.formats import sink_text
from validate.report.figures import INK
from validate.report.figures.drawing import kept, logarithmic, new_figure

if TYPE_CHECKING:
    from compare.budget import Budget, Split
    from compare.outcome import Outcome
    from scenes.sink import Sink

# Okabe and Ito's colours, which stay apart for colour-blind readers, in an order of alternating lightness.
_COLOURS = ("#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00", "#999999")
_WIDTH, _HEIGHT = 11.0, 4.9
_VISIBLE = 0.005
"""The share of an axis's height from which on a part can be seen."""


def draw(outcome: Outcome[Sink]) -> Figure:
    """A panel for each quantity: what every assumption adds to the reduction less 3D, stacked away from zero in percent
    of the final rise (or the current's change), against time; the bar beside it is the steady state, with its
    numerical error. The black line is the whole difference."""
    from validate.report.budget import named

    budget: Budget = outcome.why  # type: ignore[assignment]
    sink = outcome.scene
    figure = new_figure(
        _WIDTH, _HEIGHT, f"Why {named(budget.start)} differs from 3D, {sink_text(sink)}", [],
        bottom=1.2, left=1.1,
    )  # fmt: skip
    wrapped = textwrap.wrap(kept(f"{budget.sentence[0].upper()}{budget.sentence[1:]}."), 150)
    for i, line in enumerate(wrapped):
        figure.text(0.12 / _WIDTH, 1 - (0.32 + 0.19 * i) / _HEIGHT, line, ha="left", va="top", fontsize=9, color=INK)
    figure.subplots_adjust(top=1 - (0.62 + 0.19 * len(wrapped)) / _HEIGHT)
    over_time = budget.times is not None
    ratios = [4.0, 0.55, 0.9] if over_time else [0.0, 1.0, 0.5]
    grid = figure.add_gridspec(1, 8, width_ratios=(ratios * 3)[:8], wspace=0.12)
    for i, split in enumerate(budget.steady):
        if not split.scale:
            continue
        bar = figure.add_subplot(grid[0, 3 * i + 1])
        _bar(bar, split)
        if over_time:
            areas = figure.add_subplot(grid[0, 3 * i], sharey=bar)
            _areas(areas, budget, split)
            bar.tick_params(labelleft=False)
        first = areas if over_time else bar
        first.set_title(f"{split.quantity}", fontsize=10)
        if i == 0:
            first.set_ylabel(f"reduction less 3D (% of the final\nrise, or of the {of_current(sink)})")
    seen = _seen(budget)
    names = [part.blame for part in budget.steady[0].parts]
    handles: list[Any] = [Patch(color=_COLOURS[n % len(_COLOURS)], label=names[n]) for n in seen]
    if over_time:
        handles.append(Line2D([], [], color=INK, lw=1.4, label="in all"))
    handles.append(
        Line2D([], [], color=INK, marker="D", ms=4, ls="none", label="in all, steady, with its numerical error")
    )
    figure.legend(handles=handles, loc="lower center", ncols=4, fontsize=9, bbox_to_anchor=(0.5, 0.2 / _HEIGHT))
    small = ", ".join(name for n, name in enumerate(names) if n not in seen)
    if small:
        figure.text(0.5, 0.1 / _HEIGHT, f"too small to be seen: {small}", ha="center", fontsize=9, color=INK)
    return figure


def _seen(budget: Budget) -> list[int]:
    """The parts that are somewhere wider than a hair, by their place."""
    found = set()
    for split in budget.steady:
        parts = np.array([[part.value] for part in split.parts])
        if budget.times is not None:
            parts = np.hstack([parts, budget.over_time[split.quantity]])
        height = np.maximum(parts, 0).sum(axis=0).max() - np.minimum(parts, 0).sum(axis=0).min()
        found |= {n for n, part in enumerate(parts) if np.abs(part).max() > _VISIBLE * height}
    return sorted(found)


def _bar(ax: Any, split: Split) -> None:
    up = down = 0.0
    for n, part in enumerate(split.parts):
        height = 100 * part.value / split.scale
        ax.bar(0, height, bottom=up if height > 0 else down, color=_COLOURS[n % len(_COLOURS)], width=0.8)
        up, down = up + max(height, 0.0), down + min(height, 0.0)
    total, error = 100 * split.total / split.scale, 100 * split.error / split.scale
    ax.errorbar(0, total, error, fmt="D", color=INK, ms=4, capsize=3)
    ax.axhline(0.0, color=INK, lw=0.8)
    ax.set_xticks([0], ["steady"])
    ax.set_xlim(-0.7, 0.7)


def _areas(ax: Any, budget: Budget, split: Split) -> None:
    assert budget.times is not None
    parts = 100 * budget.over_time[split.quantity] / split.scale
    ms = budget.times * 1e3
    up, down = np.zeros(len(ms)), np.zeros(len(ms))
    for n, part in enumerate(parts):
        for base, side in ((up, np.maximum(part, 0.0)), (down, np.minimum(part, 0.0))):
            ax.fill_between(ms, base, base + side, color=_COLOURS[n % len(_COLOURS)], lw=0)
        up, down = up + np.maximum(part, 0.0), down + np.minimum(part, 0.0)
    ax.plot(ms, parts.sum(axis=0), color=INK, lw=1.4)
    ax.axhline(0.0, color=INK, lw=0.8)
    logarithmic(ax, "x")
    ax.set_xlim(ms[0], ms[-1])
    ax.set_xlabel("time (ms)")
