"""The temperature field of a free scene, rendered: the steady one, or that at the end of a transient."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.figure import Figure

from compare.colours import INK, table
from compare.drawing import new_figure
from compare.render import Renderer
from scenes.dimensions import TIME
from scenes.free.asks import AnyScene
from scenes.result import Result


def send(scene: AnyScene, result: Result, renderer: Renderer) -> None:
    """Gives the renderer the field, in kelvin above its coldest place."""
    fields, temperature = result.details["fields"], temperatures(scene, result)
    drawn = SimpleNamespace(points=fields.points, hexes=fields.hexes, steady=temperature)
    renderer.send(drawn, float(temperature.min()))


def temperatures(scene: AnyScene, result: Result) -> np.ndarray:
    """(points,): the temperatures (K) that are drawn."""
    fields = result.details["fields"]
    found: np.ndarray = fields.steady if scene.steady else fields.at(np.array([scene.end_time]))[0]
    return found


def draw(scene: AnyScene, result: Result, image: np.ndarray, factor: float) -> Figure:
    """The rendered field with its colour bar."""
    temperature = temperatures(scene, result)
    low, high = float(temperature.min()), float(temperature.max())
    colours = ScalarMappable(Normalize(low, high), ListedColormap(table() / 255))
    when = "steady" if scene.steady else f"at {TIME.show(scene.end_time)}"
    drawn = f"z drawn x{factor:g}" if factor > 1 else "true proportions"
    figure = new_figure(8.5, 3.9, f"{scene.name}: temperature, {when} ({drawn})", [], bottom=0.85, left=0.25)
    ax = figure.subplots()
    ax.imshow(image, interpolation="antialiased")
    ax.set_axis_off()
    bar = figure.colorbar(colours, cax=figure.add_axes((0.2, 0.45 / 3.9, 0.6, 0.14 / 3.9)), orientation="horizontal")
    bar.set_label("temperature (K)", color=INK)
    bar.outline.set_edgecolor(INK)
    return figure
