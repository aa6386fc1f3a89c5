"""Drawing a view with pyvista: one panel, or three with 3D, 1D and their difference, and the line probe's plot."""

from __future__ import annotations

from typing import Any

import numpy as np
import pyvista as pv

from compare.colours import INK, table
from compare.viewer import probe
from compare.viewer.source import Source
from compare.viewer.state import QUANTITIES, View, keys_text, title

MICRO = 1e6
_PANELS = (("rise", "3D"), ("rise_1d", "1D model on the same geometry"), ("difference", "1D less 3D"))
PLOT = 0.3
"""The part of the window for the line probe's plot."""
STRIP = 0.09
"""The part of the window for the time slider."""


class Stage:
    """A plotter that shows a source; ``show`` brings it to a view."""

    def __init__(self, source: Source, off_screen: bool, size: tuple[int, int]) -> None:
        self.source = source
        self._ranges: dict[tuple[str, int | None], tuple[float, float]] = {}
        # Any: pyvista's decorators hide from a type checker what its methods take.
        plotter: Any = pv.Plotter
        self.plotter: Any = plotter(shape=(5, 1), off_screen=off_screen, window_size=list(size), border=False)
        self._strip = STRIP if not off_screen and len(source.times) > 1 else 0.0
        self.plotter.renderers[4].SetViewport(0.0, 0.0, 1.0, max(self._strip, 1e-3))
        self.plotter.set_background("white", all_renderers=True)
        for number in range(3):  # not the plot, whose size it would halve
            self.plotter.subplot(number, 0)
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
        panels = _PANELS if view.compare else ((view.quantity, ""),)
        for number in range(4):
            self.plotter.subplot(number, 0)
            self._frame(number, len(panels), view.probe)
            if number < len(panels):
                self._panel(view, number, *panels[number])
        self.plotter.subplot(0, 0)
        self._texts(view)
        self._probe(view)
        if self._layout != (view.compare, view.probe):
            self.look(view)
            self._layout = (view.compare, view.probe)
        self.plotter.suppress_rendering = False

    def _strike(self) -> None:
        """Takes away what the last view drew, and nothing else: the time slider stays."""
        for bar in list(self.plotter.scalar_bars.keys()):
            self.plotter.remove_scalar_bar(bar, render=False)
        for number, actor in self._drawn:
            self.plotter.renderers[number].remove_actor(actor, render=False)
        self._drawn.clear()
        if self._chart is not None:
            self.plotter.renderers[3].remove_chart(self._chart)
            self._chart = None

    def _add(self, number: int, mesh: Any, view: View, **options: Any) -> Any:
        """Draws a mesh in a panel, with the thickness exaggerated."""
        self.plotter.subplot(number, 0)
        actor = self.plotter.add_mesh(mesh, lighting=False, render=False, reset_camera=False, **options)
        actor.scale = self._scale(view)
        self._drawn.append((number, actor))
        return actor

    def look(self, view: View) -> None:
        """The first view: the longest side across the window, from above one side, as large as the panel allows."""
        longest = int(np.argmax(np.ptp(self._bounds, axis=1)[:2]))
        direction = np.array((1.0, -0.22, 0.5) if longest == 1 else (-0.22, -1.0, 0.5))
        self.plotter.subplot(0, 0)
        self.plotter.enable_parallel_projection()
        self.plotter.view_vector(direction, viewup=(0, 0, 1))
        self.plotter.reset_camera()
        # How far the corners reach to the side and up, as the camera sees them.
        ahead = -direction / np.linalg.norm(direction)
        side = np.cross(ahead, (0.0, 0.0, 1.0))
        side /= np.linalg.norm(side)
        corners = np.stack(np.meshgrid(*(self._bounds * np.array(self._scale(view))[:, None])), axis=-1).reshape(-1, 3)
        wide, high = np.ptp(corners @ side), np.ptp(corners @ np.cross(side, ahead))
        x0, y0, x1, y1 = self.plotter.renderers[0].GetViewport()
        width, height = self.plotter.window_size
        aspect = width * (x1 - x0) / (height * (y1 - y0))
        # The lower part of a panel is the colour bar's.
        bar = 0.34 if view.compare else 0.14
        self.plotter.camera.parallel_scale = max(high / (1 - bar - 0.1), wide / aspect / 0.94) / 2
        self.plotter.camera.SetWindowCenter(0.0, -0.8 * bar)
        self.plotter.link_views([0, 1, 2])
        for renderer in self.plotter.renderers:
            renderer.camera_set = True  # else the first drawing would set it anew

    def _frame(self, number: int, count: int, probe: bool) -> None:
        """A panel's part of the window: all of it for one, a third for three; none for those not shown."""
        bottom = self._strip + (PLOT if probe else 0.0)
        high = (1.0 - bottom) / count
        box = (0.0, 1.0 - (number + 1) * high, 1.0, 1.0 - number * high)
        if number == 3:
            box = (0.0, self._strip, 1.0, bottom)
        shown = probe if number == 3 else number < count
        renderer = self.plotter.renderers[number]
        renderer.SetDraw(shown)
        renderer.SetInteractive(shown and number < 3)
        if shown:
            renderer.SetViewport(*box)

    def _panel(self, view: View, number: int, name: str, words: str) -> None:
        grid = self.source.grid(view.step)
        surface = self._surface(grid, view)
        if not surface.n_points:
            return
        data = name
        if name == "current_density":
            surface.cell_data["size"] = np.linalg.norm(surface.cell_data[name], axis=1)
            data = "size"
        step = view.step if view.own_scale else None
        low, high = self._range(name, step)
        if view.compare and name != "difference":
            # One range for both models, so that their colours mean the same.
            low, high = 0.0, max(self._range(model, step)[1] for model in ("rise", "rise_1d"))
        words = words or QUANTITIES[name][0]
        unit = QUANTITIES.get(name, ("", "K"))[1]
        bar = {
            "title": f"{words} ({unit})", "n_labels": 2, "fmt": "%.4g", "color": INK, "vertical": False,
            "width": 0.42, "height": 0.2 if view.compare else 0.06, "position_x": 0.29, "position_y": 0.03,
            "title_font_size": 15, "label_font_size": 14,
        }  # fmt: skip
        actor = self._add(
            number, surface, view, scalars=data, cmap=_colours(name), clim=(low, high), nan_color="#d9d9d9",
            scalar_bar_args=bar, interpolate_before_map=True,
        )  # fmt: skip
        # A little farther from the eye than the lines on it, which would show in parts otherwise.
        actor.mapper.SetResolveCoincidentTopologyToPolygonOffset()
        actor.mapper.SetRelativeCoincidentTopologyPolygonOffsetParameters(2.0, 2.0)
        lines = surface.extract_feature_edges(30, boundary_edges=True, manifold_edges=False)
        if lines.n_points:
            self._add(number, lines, view, color="#404040", line_width=1.5)
        if view.edges:
            self._add(number, self._mesh_edges(grid, view), view, color="#303030", line_width=0.7, opacity=0.55)

    def _scale(self, view: View) -> tuple[float, float, float]:
        return MICRO, MICRO, MICRO * view.factor

    def _surface(self, grid: Any, view: View) -> Any:
        """The surface, clipped if asked; quadratic cells are cut into enough triangles to look curved."""
        if view.cut:
            grid = self._clipped(grid, view)
        return grid.extract_surface(algorithm="dataset_surface", nonlinear_subdivision=2)

    def _clipped(self, grid: Any, view: View) -> Any:
        axis = "xyz".index(view.cut)
        origin = self._bounds.mean(axis=1)
        origin[axis] = self._bounds[axis, 0] + view.place * np.ptp(self._bounds[axis])
        return grid.clip(normal=f"-{view.cut}", origin=tuple(origin), invert=True)

    def _mesh_edges(self, grid: Any, view: View) -> Any:
        """The edges of the cells themselves, not those of the triangles that they are drawn by."""
        found = self._clipped(grid, view) if view.cut else grid
        surface = found.extract_surface(algorithm="dataset_surface", nonlinear_subdivision=0)
        return surface.extract_all_edges()

    def _range(self, name: str, step: int | None) -> tuple[float, float]:
        """The least and the largest value of a state, or of all of them (``None``)."""
        if (name, step) not in self._ranges:
            steps = [step] if step is not None else range(len(self.source.times))
            values = np.stack([self._values(name, k) for k in steps])
            low, high = float(np.nanmin(values)), float(np.nanmax(values))
            if name == "difference":
                high = max(abs(low), abs(high))
                low = -high
            low = 0.0 if abs(low) < 1e-9 * abs(high) else low
            self._ranges[name, step] = (low, high if high > low else low + 1.0)
        return self._ranges[name, step]

    def _values(self, name: str, step: int) -> np.ndarray:
        state = self.source.grid(step)
        values = np.asarray(state.point_data[name] if name in state.point_data else state.cell_data[name])
        return np.linalg.norm(values, axis=1) if values.ndim > 1 else values

    def _texts(self, view: View) -> None:
        time = self.source.times[view.step]
        self._text(title(view, self.source.name, time), 0, 12, "arial")
        if view.keys:
            self._text(keys_text(view), 30, 9, "courier")

    def _text(self, text: str, down: int, size: int, font: str) -> None:
        """Text at the first panel's left, some pixels below its top."""
        _, y0, _, y1 = self.plotter.renderers[0].GetViewport()
        top = int((y1 - y0) * self.plotter.window_size[1]) - 6 - down
        actor = self.plotter.add_text(text, position=(10, top), font_size=size, font=font, color=INK, render=False)
        self._drawn.append((0, actor))
        actor.prop.justification_vertical = "top"
        actor.prop.font_size = size + 3

    def _probe(self, view: View) -> None:
        if not view.probe:
            return
        line = probe.through(self.source, self._bounds)
        self._add(0, pv.lines_from_points(line.points[[0, -1]]), view, color="#2b6cb0", line_width=3)
        self.plotter.subplot(3, 0)
        self._chart = probe.plot(self.source, line, view)
        self.plotter.add_chart(self._chart)
        self.plotter.subplot(0, 0)


def _colours(name: str) -> Any:
    if name == "difference":
        return "RdBu_r"
    from matplotlib.colors import ListedColormap

    return ListedColormap(table() / 255)
