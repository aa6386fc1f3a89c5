"""A scene's network over its geometry: outlines of boxes from above and from the side, lines, and joints."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from compare.outcome import Outcome
from reduced1d.network.lines import Layout, Touch, layout
from scenes.model import AnyScene
from validate.report.figures import INK, LINES, PARTS
from validate.report.figures.drawing import new_figure

_NAMES = 30
"""The most lines that are named."""
_UM = 1e6  # Micrometres per metre.
_WIDE, _TALLEST, _SIDE, _BETWEEN = 7.35, 5.0, 1.4, 0.2
"""Inches: width; height of the view from above at most; height of that from the side at least; gap."""
_ROOM = 1.06
"""Extent of the axes over that of the geometry."""


def draw(outcome: Outcome[AnyScene]) -> Figure:
    """From above, in true proportions, and from the side with heights drawn out, over one another."""
    shape = layout(outcome.scene)
    low, high = (np.array([f(getattr(line, side)[d] for line in shape.lines) for d in range(3)]) * _UM
                 for f, side in ((min, "lower"), (max, "upper")))  # fmt: skip
    extent, middle = (high - low) * _ROOM, (low + high) / 2
    longer = int(np.argmax(extent[:2]))
    tall = float(np.clip(_WIDE * extent[1 - longer] / extent[longer], _SIDE, _TALLEST))
    said = ["lines with their ends; squares are joints of two lines, dots are conditions"]
    name = f"{outcome.scene.name}: the network of its boxes"
    figure = new_figure(_WIDE + 1.15, 1.33 + tall + _BETWEEN + _SIDE, name, said, 0.6, 0.9)
    space = {"hspace": 2 * _BETWEEN / (tall + _SIDE)}
    above, side = figure.subplots(2, 1, sharex=True, height_ratios=(tall, _SIDE), gridspec_kw=space)
    scale = max(extent[longer] / _WIDE, extent[1 - longer] / tall)  # um per inch, along both
    above.set_xlim(middle[longer] - _WIDE * scale / 2, middle[longer] + _WIDE * scale / 2)
    seen = {above: (1 - longer, tall * scale), side: (2, extent[2])}
    for ax, (up, span) in seen.items():
        _view(ax, shape, longer, up, ax is above and len(shape.lines) <= _NAMES)
        ax.set_ylim(middle[up] - span / 2, middle[up] + span / 2)
        ax.set_ylabel(f"{'xyz'[up]} (um)")
    side.set_xlabel(f"{'xyz'[longer]} (um)")
    return figure


def _view(ax: Any, shape: Layout, across: int, up: int, named: bool) -> None:
    colours = {box: PARTS[n % len(PARTS)] for n, box in enumerate(dict.fromkeys(li.box.name for li in shape.lines))}
    for line in shape.lines:
        corner = line.lower[across] * _UM, line.lower[up] * _UM
        wide, tall = ((line.upper[d] - line.lower[d]) * _UM for d in (across, up))
        colour = colours[line.box.name]
        ax.add_patch(Rectangle(corner, wide, tall, facecolor=colour, edgecolor=INK, alpha=0.18, linewidth=0.6))
        middle = [(a + b) / 2 for a, b in zip(line.lower, line.upper, strict=True)]
        ends = [[*middle], [*middle]]
        ends[0][line.axis], ends[1][line.axis] = line.start, line.stop
        places = [[end[d] * _UM for end in ends] for d in (across, up)]
        ax.plot(*places, color=colour, marker="|" if line.axis == across else "_", markersize=7)
        if named:
            # Of lines that lie over one another the lowest one's name stands on the other side.
            side = -1 if line.lower[2] == min(other.lower[2] for other in shape.lines) else 1
            beside, ha = (0, 8 * side), "center"
            if line.axis != across:
                beside, ha = (4 * side, 0), "left" if side > 0 else "right"
            place = middle[across] * _UM, middle[up] * _UM
            look = {"textcoords": "offset points", "ha": ha, "va": "center", "fontsize": 7, "color": INK}
            ax.annotate(line.name, place, beside, **look)
    joints = [_middle(joint.one) for joint in shape.joints]
    conditions = [_middle(c.touch) for c in (*shape.conditions, *shape.electrodes)]
    for centres, mark, colour in ((joints, "s", INK), (conditions, "o", LINES["end_K"])):
        if centres:
            points = np.array(centres) * _UM
            ax.plot(points[:, across], points[:, up], mark, color=colour, markersize=3.5)


def _middle(touch: Touch) -> list[float]:
    return [(a + b) / 2 for a, b in zip(touch.lower, touch.upper, strict=True)]
