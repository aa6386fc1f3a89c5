"""Figure 4: the steady temperature field in 3D."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.figure import Figure

from compare.words import sink_text
from validate.report.figures.colours import INK, table
from validate.report.figures.drawing import new_figure

if TYPE_CHECKING:
    from compare.outcome import Outcome


def draw(outcome: Outcome, image: np.ndarray | None, factor: float) -> Figure:
    """The rendered field with its colour bar; where nothing could be rendered, a map of the top faces."""
    assert outcome.fem3d is not None
    sink, fields = outcome.sink, outcome.fem3d.details["fields"]
    rise = fields.steady - sink.room_temperature
    colours = ScalarMappable(Normalize(0.0, float(rise.max())), ListedColormap(table() / 255))
    drawn = "seen from above" if image is None else f"thickness drawn x{factor:g}" if factor > 1 else "true proportions"
    size = " x ".join(f"{side * 1e6:.4g}" for side in (sink.length, sink.width, sink.thickness))
    text = f"Figure 4: steady 3D temperature, {sink_text(sink)} (beam {size} µm, {drawn})"
    checks = [check for check in outcome.checks if check.id == "fig4"]
    figure = new_figure(
        8.5, 3.6, text, checks, bottom=1.2 if image is None else 0.8, left=0.75 if image is None else 0.25
    )
    ax = figure.subplots()
    if image is None:
        _map(ax, fields.points, fields.hexes, rise, colours, sink.thickness)
    else:
        ax.imshow(image, interpolation="antialiased")
        ax.set_axis_off()
    bar = figure.colorbar(colours, cax=figure.add_axes((0.2, 0.45 / 3.6, 0.6, 0.14 / 3.6)), orientation="horizontal")
    bar.set_label(f"rise above {sink.room_temperature:g} K (K)", color=INK)
    bar.outline.set_edgecolor(INK)
    return figure


def _map(
    ax: Any, points: np.ndarray, hexes: np.ndarray, rise: np.ndarray, colours: ScalarMappable, thickness: float
) -> None:
    """Top faces in true proportions, along the beam from left to right."""
    corners = points[hexes]
    face = np.abs(corners[:, :, 2] - thickness) < 1e-6 * thickness
    top = hexes[face.sum(axis=1) == 4][face[face.sum(axis=1) == 4]].reshape(-1, 4)
    # Ascending around each face's middle, so that two triangles cover it.
    around = points[top] - points[top].mean(axis=1, keepdims=True)
    order = np.argsort(np.arctan2(around[..., 1], around[..., 0]), axis=1)
    ring = np.take_along_axis(top, order, axis=1)
    triangles = np.concatenate([ring[:, [0, 1, 2]], ring[:, [0, 2, 3]]])
    levels = np.linspace(0.0, float(rise.max()), 129)
    y, x = points[:, 1] * 1e6, points[:, 0] * 1e6
    ax.tricontourf(y, x, triangles, rise, levels, cmap=colours.cmap, norm=colours.norm).set_rasterized(True)
    ax.set_aspect("equal")
    ax.set_xlabel("along the beam y (µm)")
    ax.set_ylabel("across it x (µm)")
    ax.grid(False)
