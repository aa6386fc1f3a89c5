"""Drawing a view with pyvista: the field, and the line probe's plot along a line through the structure."""

from __future__ import annotations

from typing import Any

import numpy as np
import pyvista as pv
from matplotlib.colors import ListedColormap
from matplotlib.ticker import MaxNLocator
from vtkmodules.util.numpy_support import numpy_to_vtk

from validate.report.figures import INK, LINES, table
from validate.viewer.source import KEYS, QUANTITIES, Source, View, title

MICRO = 1e6
POINTS = 401
"""Number of points of the line probe."""
FIELD, PLOT = 0, 1
"""Parts of the window."""
LABEL = "%.7g"  # Of round numbers at the colour bar.
PLOT_SHARE = 0.3  # Height of the line plot, as a part of the window's.


class Stage:
    """A plotter that shows a source; ``show`` brings it to a view."""

    def __init__(self, source: Source, off_screen: bool, size: tuple[int, int]) -> None:
        self.source = source
        self._ranges: dict[tuple[str, int | None], tuple[float, float]] = {}
        # Any: pyvista's decorators hide the signatures of its methods.
        plotter: Any = pv.Plotter
        self.plotter: Any = plotter(shape=(2, 1), off_screen=off_screen, window_size=list(size), border=False)
        self._keys = "" if off_screen else ", ".join(f"{shown}: {what}" for shown, what, _ in KEYS.values())
        self._ink = max(1.0, min(size[0] / 1400, size[1] / 800))
        self.plotter.set_background("white", all_renderers=True)
        # Not of the plot, whose size it would halve.
        self.plotter.subplot(FIELD, 0)
        self.plotter.enable_anti_aliasing("ssaa" if off_screen else "msaa", all_renderers=False)
        self._bounds = np.array(source.grid(0).bounds).reshape(3, 2)
        self._has_plot: bool | None = None
        self._chart: Any = None
        self._drawn: list[Any] = []

    def show(self, view: View) -> None:
        """Draw everything of a view; the camera stays where it is."""
        # Nothing half done is ever seen: pyvista would draw after every addition.
        self.plotter.suppress_rendering = True
        for bar in list(self.plotter.scalar_bars.keys()):
            self.plotter.remove_scalar_bar(bar, render=False)
        for actor in self._drawn:
            self.plotter.renderers[FIELD].remove_actor(actor, render=False)
        self._drawn.clear()
        if self._chart is not None:
            self.plotter.renderers[PLOT].remove_chart(self._chart)
            self._chart = None
        self._frame(PLOT_SHARE * view.probe)
        self.plotter.subplot(FIELD, 0)
        self._field(view)
        self._text(title(view, self.source.name, self.source.times[view.step]), 12, "upper_left")
        self._text(self._keys, 9, "lower_left")
        if view.probe:
            self._probe(view)
        if self._has_plot != view.probe:
            self._look(view)
            self._has_plot = view.probe
        self.plotter.suppress_rendering = False

    def _frame(self, plot: float) -> None:
        """Give the field its place, above a plot with a share of the window's height."""
        for number, (bottom, end) in enumerate(((plot, 1.0), (0.0, plot))):
            renderer = self.plotter.renderers[number]
            renderer.SetDraw(end > bottom)
            renderer.SetInteractive(number == FIELD)
            if end > bottom:
                renderer.SetViewport(0.0, bottom, 1.0, end)

    def _add(self, mesh: Any, view: View, **options: Any) -> Any:
        """Draw a mesh, with the thickness exaggerated."""
        actor = self.plotter.add_mesh(mesh, lighting=False, render=False, reset_camera=False, **options)
        actor.scale = (MICRO, MICRO, MICRO * view.factor)
        self._drawn.append(actor)
        return actor

    def _text(self, text: str, size: int, position: str) -> None:
        actor = self.plotter.add_text(text, position=position, font_size=size, color=INK, render=False)
        self._drawn.append(actor)

    def _look(self, view: View) -> None:
        """The first view: the longest side across the window, from above one side."""
        longest = int(np.argmax(np.ptp(self._bounds, axis=1)[:2]))
        self.plotter.subplot(FIELD, 0)
        self.plotter.enable_parallel_projection()
        self.plotter.view_vector((1.0, -0.22, 0.5) if longest == 1 else (-0.22, -1.0, 0.5), viewup=(0, 0, 1))
        self.plotter.reset_camera()
        self.plotter.camera.zoom(1.4)
        # The right is the colour bar's.
        self.plotter.camera.SetWindowCenter(0.1, 0.0)
        for renderer in self.plotter.renderers:
            renderer.camera_set = True  # else the first drawing would set it anew

    def _field(self, view: View) -> None:
        surface, lines = self._surface(view), self._outline(view)
        if not surface.n_points:
            return
        data = name = view.quantity
        if name == "current_density":
            surface.cell_data["size"] = np.linalg.norm(surface.cell_data[name], axis=1)
            data = "size"
        low, high = self._range(name, view.step if view.own_scale else None)
        ticks, (called, unit) = round_ticks(low, high), QUANTITIES[name]
        bar = {
            "title": f"{called}\n({unit})", "n_labels": len(ticks), "color": INK, "fmt": LABEL,
            "vertical": True, "width": 0.06, "height": 0.8, "position_x": 0.9, "position_y": 0.08,
            "title_font_size": round(15 * self._ink), "label_font_size": round(15 * self._ink),
            "unconstrained_font_size": True,
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

    def _probe(self, view: View) -> None:
        """Plot the quantity along the longest line through the middle."""
        sides = np.ptp(self._bounds, axis=1)
        axis = int(np.argmax(sides))
        points = np.tile(self._bounds.mean(axis=1), (POINTS, 1))
        points[:, axis] = self._bounds[axis, 0] + np.linspace(1e-6, 1 - 1e-6, POINTS) * sides[axis]
        self._add(pv.lines_from_points(points[[0, -1]]), view, color="#2b6cb0", line_width=3)
        sample = pv.PolyData(points).sample(self.source.grid(view.step))
        values = np.asarray(sample[view.quantity], dtype=float)
        values = np.linalg.norm(values, axis=1) if values.ndim > 1 else values
        good = np.asarray(sample["vtkValidPointMask"], dtype=bool) & np.isfinite(values)
        label, unit = QUANTITIES[view.quantity]
        self._chart = pv.Chart2D((0.96, 0.96), (0.02, 0.02), f"{'xyz'[axis]} (um)", f"{label} ({unit})")
        self._chart.line(points[good, axis] * MICRO, values[good], color=LINES["peak_K"], width=2.0)
        self.plotter.subplot(PLOT, 0)
        self.plotter.add_chart(self._chart)


def round_ticks(low: float, high: float) -> np.ndarray:
    """Return some round numbers in a range, a step of 1, 2, 2.5 or 5 times a power of ten apart."""
    ticks = np.asarray(MaxNLocator(6, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high))
    small = 1e-9 * (high - low)
    return ticks[(ticks >= low - small) & (ticks <= high + small)]
