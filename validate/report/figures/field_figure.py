"""The temperature field in 3D, with its colour bar."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.figure import Figure

from validate.report.figures import INK, table
from validate.report.figures.drawing import new_figure

if TYPE_CHECKING:
    from compare.verdict import Check
    from validate.report.figures.render import Field

_HEIGHT = 3.7


def draw(
    field: Field, image: np.ndarray | None, above: float, text: str, label: str, checks: Sequence[Check | str]
) -> Figure:  # fmt: skip
    """The rendered field, its colours those of the values ``above`` (K) which its rises start; where nothing could be
    rendered, a map of the top faces."""
    colours = ScalarMappable(Normalize(above, above + float(field.rise.max())), ListedColormap(table() / 255))
    bottom, left = (1.2, 0.75) if image is None else (0.85, 0.25)
    figure = new_figure(8.5, _HEIGHT, text, checks, bottom=bottom, left=left)
    ax = figure.subplots()
    if image is None:
        _map(ax, field, colours)
    else:
        ax.imshow(image, interpolation="antialiased")
        ax.set_axis_off()
    place = (0.2, 0.45 / _HEIGHT, 0.6, 0.14 / _HEIGHT)
    bar = figure.colorbar(colours, cax=figure.add_axes(place), orientation="horizontal")
    bar.set_label(label, color=INK)
    bar.outline.set_edgecolor(INK)
    return figure


def _map(ax: Any, field: Field, colours: ScalarMappable) -> None:
    """Top faces in true proportions, along the beam from left to right."""
    points, hexes, rise = field.points, field.hexes, field.rise
    z = points[hexes][:, :, 2]
    face = np.abs(z - z.max()) < 1e-6 * float(np.ptp(z))
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
