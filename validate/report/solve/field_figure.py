"""The temperature field of a free scene, rendered: the steady one, or that of a transient's hottest moment (its coldest
where the scene is cooled)."""

from __future__ import annotations

from types import SimpleNamespace
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.figure import Figure

from scenes.dimensions import TIME
from validate.report.figures.colours import INK, table
from validate.report.figures.drawing import new_figure
from validate.report.figures.render import Renderer

if TYPE_CHECKING:
    from compare.solve.outcome import SolveOutcome


def send(outcome: SolveOutcome, renderer: Renderer) -> None:
    """Gives the renderer the field, in kelvin above its coldest place."""
    fields, temperature = outcome.result.details["fields"], temperatures(outcome)
    drawn = SimpleNamespace(points=fields.points, hexes=fields.hexes, steady=temperature)
    renderer.send(drawn, float(temperature.min()))


def temperatures(outcome: SolveOutcome) -> np.ndarray:
    """(points,): the temperatures (K) that are drawn."""
    fields = outcome.result.details["fields"]
    found: np.ndarray = fields.steady if outcome.shown is None else fields.at(np.array([outcome.shown[0]]))[0]
    return found


def when(outcome: SolveOutcome) -> str:
    """What is drawn, in words."""
    if outcome.shown is None:
        return "steady"
    time, above = outcome.shown
    return f"{TIME.show(float(f'{time:.3g}'))}, when it is {'hottest' if above else 'coldest'}"


def draw(outcome: SolveOutcome, image: np.ndarray, factor: float) -> Figure:
    """The rendered field with its colour bar."""
    temperature = temperatures(outcome)
    low, high = float(temperature.min()), float(temperature.max())
    colours = ScalarMappable(Normalize(low, high), ListedColormap(table() / 255))
    drawn = f"z drawn x{factor:g}" if factor > 1 else "true proportions"
    figure = new_figure(
        8.5, 3.9, f"{outcome.scene.name}: temperature, {when(outcome)} ({drawn})", [], bottom=0.85, left=0.25
    )
    ax = figure.subplots()
    ax.imshow(image, interpolation="antialiased")
    ax.set_axis_off()
    bar = figure.colorbar(colours, cax=figure.add_axes((0.2, 0.45 / 3.9, 0.6, 0.14 / 3.9)), orientation="horizontal")
    bar.set_label("temperature (K)", color=INK)
    bar.outline.set_edgecolor(INK)
    return figure
