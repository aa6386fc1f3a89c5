"""Parts that all figures share: style, margins, the title with the verdicts, the picture of a field, files.

Margins are fixed and not computed from the drawn texts, and powers of ten are plain text: matplotlib's automatic layout
and its mathematical text would take longer than the 3D solution.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullLocator

from compare.verdict import Check, amount
from validate.report.checks import claimed, off_by, sides
from validate.report.figures import INK, table, with_mu
from validate.report.figures.render import Field

DPI = 130  # Dots per inch of .png files.
_LINE = 0.215  # Inches of a line of the title.
_STYLE: dict[Any, Any] = {
    "font.size": 10.0, "font.family": "sans-serif", "axes.edgecolor": INK, "axes.labelcolor": INK,
    "axes.spines.top": False, "axes.spines.right": False, "axes.grid": True, "axes.axisbelow": True,
    "grid.color": "#dddddd", "grid.linewidth": 0.6, "axes.formatter.useoffset": False, "lines.linewidth": 1.8,
    "hatch.linewidth": 0.5, "legend.frameon": False, "svg.fonttype": "none", "svg.hashsalt": "validate",
}  # fmt: skip


def style() -> Any:
    return rc_context(_STYLE)


def new_figure(
    width: float, height: float, text: str, checks: Sequence[Check | str], bottom: float = 0.55, left: float = 0.75
) -> Figure:
    """A figure (inches) with its title and a line for each check and its verdict (or text), wrapped to the width; below
    them room for axes, within margins (inches) for labels."""
    figure = Figure(figsize=(width, height))
    said = [check if isinstance(check, str) else drawn(check) for check in checks]
    title = textwrap.wrap(kept(text), int(width * 10.5))
    lines = [*title, *(line for each in said for line in textwrap.wrap(kept(each), int(width * 12.5)))]
    for i, line in enumerate(lines):
        place, weight = 1 - (0.1 + i * _LINE) / height, "bold" if i < len(title) else None
        figure.text(0.12 / width, place, line, ha="left", va="top", fontsize=10.5, color=INK, weight=weight)
    top = 1 - (0.3 + len(lines) * _LINE) / height
    figure.subplots_adjust(left=left / width, right=1 - 0.25 / width, bottom=bottom / height, top=top)
    return figure


def drawn(check: Check) -> str:
    """Return a check as a line under a figure's title."""
    mark = {"agrees": "\N{CHECK MARK}", "differs": "\N{MULTIPLICATION X}", "unresolved": "?"}[check.verdict]
    verdict = check.verdict.upper() if check.verdict == "differs" else check.verdict
    measured, off, (claimant, finder) = amount(check.measured, check.unit), off_by(check), sides(check)
    off = off if off.isalpha() else f"off by {off}"
    said = f"{check.title}, {claimant} {claimed(check)}, {finder} {measured} ({off})"
    return with_mu(f"{mark} {check.id} {verdict}: {said}")


def kept(text: str) -> str:
    """With spaces that no line is broken at between a number and its unit."""
    return re.sub(r"(?<=\d) (?=[A-Za-z%])", "\N{NO-BREAK SPACE}", text)


def logarithmic(ax: Any, name: str) -> None:
    """Makes the "x" or "y" axis logarithmic, with plain numbers and without the dozens of small ticks between the
    decades, which take longer to draw than all the rest."""
    ax.set(**{f"{name}scale": "log"})
    axis = getattr(ax, f"{name}axis")
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_locator(NullLocator())


def band(ax: Any, x: np.ndarray, y: np.ndarray, half: np.ndarray | float, colour: str) -> None:
    """Draw the error band around a curve."""
    ax.fill_between(x, y - half, y + half, color=colour, alpha=0.25, lw=0)


def legend(figure: Figure, *axes: Any, columns: int = 0, **look: Any) -> None:
    """Draw one legend below all axes, in one row or in some ``columns``."""
    sides = [ax.get_legend_handles_labels() for ax in axes]
    handles, labels = ([item for part in side for item in part] for side in zip(*sides, strict=True))
    figure.legend(handles, labels, loc="lower center", ncols=columns or len(labels), **look)


def field_figure(field: Field, image: np.ndarray | None) -> Figure:
    """The rendered field with its colour bar; where nothing could be rendered, a map of the top faces."""
    top = field.above + float(field.rise.max())
    colours = ScalarMappable(Normalize(field.above, top), ListedColormap(table() / 255))
    height, (bottom, left) = 3.7, (1.2, 0.75) if image is None else (0.85, 0.25)
    seen = "true proportions" if field.factor <= 1 else f"{field.height} drawn x{field.factor:g}"
    title = f"{field.title}{'seen from above' if image is None else seen})"
    figure = new_figure(8.5, height, title, field.under, bottom=bottom, left=left)
    ax = figure.subplots()
    if image is None:
        _map(ax, field, colours)
    else:
        ax.imshow(image, interpolation="antialiased")
        ax.set_axis_off()
    place = (0.2, 0.45 / height, 0.6, 0.14 / height)
    bar = figure.colorbar(colours, cax=figure.add_axes(place), orientation="horizontal")
    bar.set_label(field.scale, color=INK)
    bar.outline.set_edgecolor(INK)  # type: ignore[operator]
    return figure


def _map(ax: Any, field: Field, colours: ScalarMappable) -> None:
    """Top faces of a sink in true proportions, along the beam from left to right."""
    # In VTK's order these are the upper corners of a hexahedron, in turn around it.
    rise, top, z = field.rise, field.cells[:, 4:8], field.points[:, 2]
    top = top[(z[top] > z.max() - 1e-6 * np.ptp(z)).all(axis=1)]
    triangles = np.concatenate([top[:, [0, 1, 2]], top[:, [0, 2, 3]]])
    levels, (x, y, _) = np.linspace(0.0, float(rise.max()), 129), field.points.T * 1e6
    ax.tricontourf(y, x, triangles, rise, levels, cmap=colours.cmap, norm=colours.norm).set_rasterized(True)
    ax.set(aspect="equal", xlabel="along the beam y (µm)", ylabel="across it x (µm)")
    ax.grid(False)


def save(figure: Figure, folder: Path, name: str) -> list[str]:
    """Writes <name>.png and <name>.svg; returns their names."""
    figure.set_dpi(DPI)
    png = folder / f"{name}.png"
    FigureCanvasAgg(figure).print_png(png, metadata={"Software": None}, pil_kwargs={"compress_level": 3})
    FigureCanvasSVG(figure).print_svg(folder / f"{name}.svg", metadata={"Date": None, "Creator": None})
    return [f"{name}.png", f"{name}.svg"]
