"""Drawing a view with pyvista: the field, and the line probe's plot along a line through the structure."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pyvista as pv
from matplotlib.colors import ListedColormap
from vtkmodules.util.numpy_support import numpy_to_vtk

from validate.report.figures import INK, LINES, table
from validate.viewer.source import QUANTITIES, Source, View, keys_text, title

MICRO = 1e6
POINTS = 401
"""Number of points of the line probe."""
FIELD, PLOT, SLIDER, KEYS, TITLE = range(5)
"""Parts of the window."""
PLOT_SHARE = 0.3  # Height of the line plot, as a part of the window's.
SLIDER_HIGH, TITLE_HIGH, ROW_HIGH, COLUMN_WIDE = 72, 30, 16, 240
"""Pixels of a window of usual size: heights of slider, title and a row of the list of keys; width of its columns."""
BAR_WIDE = 120
"""Pixels of a window of usual size, and an eighth of it at least: width of the colour bar."""


class Stage:
    """A plotter that shows a source; ``show`` brings it to a view."""

    def __init__(self, source: Source, off_screen: bool, size: tuple[int, int]) -> None:
        self.source = source
        self._ranges: dict[tuple[str, int | None], tuple[float, float]] = {}
        # Any: pyvista's decorators hide the signatures of its methods.
        plotter: Any = pv.Plotter
        self.plotter: Any = plotter(shape=(5, 1), off_screen=off_screen, window_size=list(size), border=False)
        self._ink = max(1.0, min(size[0] / 1400, size[1] / 800))
        self._bar = max(0.125, BAR_WIDE * self._ink / size[0])
        self._slider = not off_screen and len(source.times) > 1
        self.plotter.set_background("white", all_renderers=True)
        # Not of the plot, whose size it would halve.
        self.plotter.subplot(FIELD, 0)
        self.plotter.enable_anti_aliasing("ssaa" if off_screen else "msaa", all_renderers=False)
        self._bounds = np.array(source.grid(0).bounds).reshape(3, 2)
        self._layout: tuple[bool, bool] | None = None
        self._chart: Any = None
        self._drawn: list[tuple[int, Any]] = []

    def show(self, view: View) -> None:
        """Draws everything of a view; the camera stays where it is."""
        # Nothing half done is ever seen: pyvista would draw after every addition.
        self.plotter.suppress_rendering = True
        self._strike()
        self._frame(view)
        self._field(view)
        self._text(TITLE, title(view, self.source.name, self.source.times[view.step]), 12, "arial")
        self._text(KEYS, self._keys(view), 9, "courier")
        self._probe(view)
        if self._layout != (view.probe, view.keys):
            self.look(view)
            self._layout = (view.probe, view.keys)
        self.plotter.suppress_rendering = False

    def _strike(self) -> None:
        """Remove all parts of the last view; the time slider stays."""
        for bar in list(self.plotter.scalar_bars.keys()):
            self.plotter.remove_scalar_bar(bar, render=False)
        for number, actor in self._drawn:
            self.plotter.renderers[number].remove_actor(actor, render=False)
        self._drawn.clear()
        if self._chart is not None:
            self.plotter.renderers[PLOT].remove_chart(self._chart)
            self._chart = None

    def _add(self, mesh: Any, view: View, **options: Any) -> Any:
        """Draws a mesh, with the thickness exaggerated."""
        self.plotter.subplot(FIELD, 0)
        actor = self.plotter.add_mesh(mesh, lighting=False, render=False, reset_camera=False, **options)
        actor.scale = self._scale(view)
        self._drawn.append((FIELD, actor))
        return actor

    def look(self, view: View) -> None:
        """The first view: the longest side across the window, from above one side, as large as the window allows."""
        longest = int(np.argmax(np.ptp(self._bounds, axis=1)[:2]))
        direction = np.array((1.0, -0.22, 0.5) if longest == 1 else (-0.22, -1.0, 0.5))
        self.plotter.subplot(FIELD, 0)
        self.plotter.enable_parallel_projection()
        self.plotter.view_vector(direction, viewup=(0, 0, 1))
        self.plotter.reset_camera()
        # How far the corners reach to the side and up, as the camera sees them.
        ahead = -direction / np.linalg.norm(direction)
        side = np.cross(ahead, (0.0, 0.0, 1.0))
        side /= np.linalg.norm(side)
        corners = np.stack(np.meshgrid(*(self._bounds * np.array(self._scale(view))[:, None])), axis=-1).reshape(-1, 3)
        wide, high = np.ptp(corners @ side), np.ptp(corners @ np.cross(side, ahead))
        x0, y0, x1, y1 = self.plotter.renderers[FIELD].GetViewport()
        width, height = self.plotter.window_size
        aspect = width * (x1 - x0) / (height * (y1 - y0))
        # The right is the colour bar's.
        self.plotter.camera.parallel_scale = max(high / 0.94, wide / aspect / (0.96 - self._bar)) / 2
        self.plotter.camera.SetWindowCenter(self._bar, 0.0)
        for renderer in self.plotter.renderers:
            renderer.camera_set = True  # else the first drawing would set it anew

    def _frame(self, view: View) -> None:
        """Gives each part its place: the title on top, then field, plot, keys, and the slider."""
        high = self.plotter.window_size[1]
        slider = SLIDER_HIGH / high if self._slider else 0.0
        keys = slider + (self._keys(view).count("\n") + 2) * ROW_HIGH * self._ink / high * view.keys
        plot = keys + PLOT_SHARE * view.probe
        top = 1.0 - TITLE_HIGH * self._ink / high
        ends = {FIELD: (plot, top), SLIDER: (0.0, slider), KEYS: (slider, keys), PLOT: (keys, plot), TITLE: (top, 1.0)}
        for number, renderer in enumerate(self.plotter.renderers):
            bottom, end = ends[number]
            renderer.SetDraw(end > bottom)
            renderer.SetInteractive(number == FIELD)
            if end > bottom:
                renderer.SetViewport(0.0, bottom, 1.0, end)

    def _field(self, view: View) -> None:
        surface, lines = self._surface(view), self._outline(view)
        if not surface.n_points:
            return
        data = name = view.quantity
        if name == "current_density":
            surface.cell_data["size"] = np.linalg.norm(surface.cell_data[name], axis=1)
            data = "size"
        low, high = self._range(name, view.step if view.own_scale else None)
        ticks, (called, unit) = round_ticks(low, high, 5), QUANTITIES[name]
        bar = {
            "title": f"{called}\n({unit})", "n_labels": len(ticks), "color": INK,
            "fmt": label_format(ticks), "vertical": True, "width": 0.5 * self._bar, "height": 0.82,
            "position_x": 1.0 - 0.75 * self._bar, "position_y": 0.06, "title_font_size": round(15 * self._ink),
            "label_font_size": round(15 * self._ink), "unconstrained_font_size": True,
        }  # fmt: skip
        actor = self._add(
            surface, view, scalars=data, cmap=ListedColormap(table() / 255), clim=(low, high), nan_color="#d9d9d9",
            scalar_bar_args=bar, interpolate_before_map=True,
        )  # fmt: skip
        drawn_bar = self.plotter.scalar_bars[bar["title"]]
        drawn_bar.SetUseCustomLabels(True)
        drawn_bar.SetCustomLabels(numpy_to_vtk(ticks, deep=True))
        # A little farther from the eye than the lines on it, which would show in parts otherwise.
        actor.mapper.SetResolveCoincidentTopologyToPolygonOffset()
        actor.mapper.SetRelativeCoincidentTopologyPolygonOffsetParameters(2.0, 2.0)
        if lines.n_points:
            self._add(lines, view, color="#404040", line_width=1.5)
        if view.edges:
            # The edges of the cells, not of the triangles in the drawing.
            edges = self._surface(view, subdivision=0).extract_all_edges()
            self._add(edges, view, color="#303030", line_width=0.7, opacity=0.55)

    def _scale(self, view: View) -> tuple[float, float, float]:
        return MICRO, MICRO, MICRO * view.factor

    def _surface(self, view: View, subdivision: int = 2) -> Any:
        """The surface, clipped by the view; quadratic cells are cut into enough triangles to look curved."""
        grid = self.source.grid(view.step)
        if view.cut:
            grid = grid.clip(normal=f"-{view.cut}", origin=self._origin(view), invert=True)
        return grid.extract_surface(algorithm="dataset_surface", nonlinear_subdivision=subdivision)

    def _outline(self, view: View) -> Any:
        """The edges of the surface and the rim of a cut, whose slivers of cells would draw edges of their own."""
        surface = self.source.grid(view.step).extract_surface(algorithm="dataset_surface", nonlinear_subdivision=2)
        lines = surface.extract_feature_edges(30, boundary_edges=True, manifold_edges=False)
        if not view.cut:
            return lines
        plane = {"normal": f"-{view.cut}", "origin": self._origin(view)}
        return lines.clip(**plane, invert=True).merge(surface.slice(**plane))

    def _origin(self, view: View) -> tuple[float, ...]:
        """A point (m) of the plane that clips."""
        axis, origin = "xyz".index(view.cut), self._bounds.mean(axis=1)
        origin[axis] = self._bounds[axis, 0] + view.place * np.ptp(self._bounds[axis])
        return tuple(origin)

    def _range(self, name: str, step: int | None) -> tuple[float, float]:
        """Return the least and the largest value of a state, or of all states (``None``)."""
        if (name, step) not in self._ranges:
            steps = [step] if step is not None else range(len(self.source.times))
            states = (self.source.grid(k) for k in steps)
            values = np.stack([(g.point_data if name in g.point_data else g.cell_data)[name] for g in states])
            if values.ndim > 2:
                values = np.linalg.norm(values, axis=2)
            low, high = float(np.nanmin(values)), float(np.nanmax(values))
            # A zero off by rounding and the solution's error would be an unreadable label of the bar.
            low = 0.0 if abs(low) < 1e-3 * abs(high) else low
            self._ranges[name, step] = (low, high if high > low else low + 1.0)
        return self._ranges[name, step]

    def _keys(self, view: View) -> str:
        columns = max(1, int(self.plotter.window_size[0] / (COLUMN_WIDE * self._ink)))
        return keys_text(view, columns) if view.keys else ""

    def _text(self, number: int, text: str, size: int, font: str) -> None:
        if not text:
            return
        self.plotter.subplot(number, 0)
        _, low, _, high = self.plotter.renderers[number].GetViewport()
        top = int((high - low) * self.plotter.window_size[1]) - 6
        actor = self.plotter.add_text(text, position=(10, top), font_size=size, font=font, color=INK, render=False)
        self._drawn.append((number, actor))
        actor.prop.justification_vertical = "top"
        actor.prop.font_size = round((size + 3) * self._ink)

    def _probe(self, view: View) -> None:
        if not view.probe:
            return
        points, axis = self._line()
        self._add(pv.lines_from_points(points[[0, -1]]), view, color="#2b6cb0", line_width=3)
        sample = pv.PolyData(points).sample(self.source.grid(view.step))
        inside = np.asarray(sample["vtkValidPointMask"], dtype=bool)
        values = np.asarray(sample[view.quantity])[inside]
        values = np.linalg.norm(values, axis=1) if values.ndim > 1 else values
        label, unit = QUANTITIES[view.quantity]
        self._chart = pv.Chart2D(
            size=(0.96, 0.96), loc=(0.02, 0.02), x_label=f"{'xyz'[axis]} (um)", y_label=f"{label} ({unit})"
        )
        good = np.isfinite(values)
        self._chart.line(points[inside, axis][good] * MICRO, values[good], color=LINES["peak_K"], width=2.0)
        self.plotter.subplot(PLOT, 0)
        self.plotter.add_chart(self._chart)

    def _line(self) -> tuple[np.ndarray, int]:
        """Points (n, 3) in m through the middle along the longest side, and which that is."""
        sides = np.ptp(self._bounds, axis=1)
        axis = int(np.argmax(sides))
        points = np.tile(self._bounds.mean(axis=1), (POINTS, 1))
        points[:, axis] = self._bounds[axis, 0] + np.linspace(1e-6, 1 - 1e-6, POINTS) * sides[axis]
        return points, axis


def round_ticks(low: float, high: float, count: int) -> np.ndarray:
    """Return (n,) round numbers in a range, about ``count``, a step of 1, 2, 2.5 or 5 times a power of ten apart."""
    ten = 10.0 ** math.floor(math.log10((high - low) / count))

    def multiples(step: float) -> np.ndarray:
        return step * np.arange(math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9) + 1)

    return min(
        (multiples(ten * part) for part in (1.0, 2.0, 2.5, 5.0, 10.0)), key=lambda ticks: abs(len(ticks) - count)
    )


def label_format(ticks: np.ndarray) -> str:
    """A printf format with as many digits as the numbers at a colour bar have, at most twelve."""
    least = 1e-6 * (ticks[-1] - ticks[0])
    digits = (n for n in range(3, 12) if all(abs(float(f"{t:.{n}g}") - t) <= least for t in ticks))
    return f"%.{next(digits, 12)}g"
