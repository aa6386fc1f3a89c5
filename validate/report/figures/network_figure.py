"""The network of a scene over its geometry: boxes in outline from above and from the side, the lines in them, and where
they are joined."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from reduced1d.network.lines import Layout, Touch, layout
from scenes.model import AnyScene
from validate.report.figures import INK, LINES, PARTS
from validate.report.figures.drawing import new_figure
from validate.run.outcome import Outcome

_NAMES = 30
"""Lines that there is room to name."""
_UM = 1e6


def draw(outcome: Outcome[AnyScene]) -> Figure:
    """From above, and from the side with heights drawn out."""
    shape = layout(outcome.scene)
    said = ["lines with their ends; joints: squares where ends meet or sides, dots at conditions"]
    figure = new_figure(8.5, 8.0, f"{outcome.scene.name}: the network of its boxes", said, 0.6, 0.9)
    low, high = (np.array([f(getattr(line, side)[d] for line in shape.lines) for d in range(3)])
                 for f, side in ((min, "lower"), (max, "upper")))  # fmt: skip
    longer = int(np.argmax((high - low)[:2]))
    above, side = figure.subplots(2, 1, height_ratios=(3, 1))
    for ax, across, up in ((above, longer, 1 - longer), (side, longer, 2)):
        _view(ax, shape, across, up, ax is above and len(shape.lines) <= _NAMES)
        ax.set_xlim(low[across] * _UM, high[across] * _UM)
        ax.set_ylim(low[up] * _UM, high[up] * _UM)
        ax.margins(0.03)
        ax.autoscale()
        ax.set_xlabel(f"{'xyz'[across]} (um)")
        ax.set_ylabel(f"{'xyz'[up]} (um)")
    above.set_aspect("equal", adjustable="datalim")
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
            ax.annotate(line.name, (middle[across] * _UM, middle[up] * _UM), fontsize=7, color=INK)
    joints = [_middle(joint.one) for joint in shape.joints]
    conditions = [_middle(c.touch) for c in (*shape.conditions, *shape.electrodes)]
    for centres, mark, colour in ((joints, "s", INK), (conditions, "o", LINES["end_K"])):
        if centres:
            points = np.array(centres) * _UM
            ax.plot(points[:, across], points[:, up], mark, color=colour, markersize=3.5)


def _middle(touch: Touch) -> list[float]:
    return [(a + b) / 2 for a, b in zip(touch.lower, touch.upper, strict=True)]
