"""Draw a field with pyvista, into pictures and films or in a window with keys."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pyvista as pv
from matplotlib.colors import ListedColormap
from matplotlib.ticker import MaxNLocator

from scenes.errors import SceneError, quoted
from validate.report.fields import ARRAYS
from validate.report.figures import INK, LINES, table
from validate.viewer.source import Field, size, stored

KEYS = {"space": "play", "t": "next quantity", "x": "clip", "l": "line plot", "r": "reset the camera", "q": "close"}
STEPS_PER_SECOND = 4
"""Stored states that the window plays a second."""
FRAMES, FRAMES_PER_SECOND = 40, 10
"""Of a film, which then rests for a second."""


def draw(request: dict[str, Any]) -> list[str]:
    """Draw a field by the options of the command, and return notes. Raises SceneError before anything is drawn."""
    path, movie, notes = Path(request["path"]), request["movie"], list[str]()
    files = stored(path)
    number = len(files) - 1
    if request["time"] is not None:
        number, notes = nearest([time for time, _ in files], request["time"])
    if movie and len(files) == 1:
        raise SceneError("--movie needs a transient, and this is one state: run without --steady, view the folder")
    if movie and Path(movie).suffix.lower() == ".mp4" and not find_spec("imageio_ffmpeg"):
        raise SceneError(
            f"--movie {quoted(Path(movie))} needs pip install 'imageio[ffmpeg]'; a .gif needs nothing more"
        )
    name = path.resolve().name
    if request["screenshot"]:
        # The colours are of this state alone.
        state = Field.read(name, files[number : number + 1], request["exaggerate"])
        Stage(state, request).plotter.screenshot(request["screenshot"])
    if movie or not request["screenshot"]:
        stage = Stage(Field.read(name, files, request["exaggerate"]), request, number)
        stage.film(Path(movie)) if movie else stage.open()
    return notes


def nearest(times: Sequence[float | None], wanted: float) -> tuple[int, list[str]]:
    """Return the number of the stored time nearest to a given time (s), and note a difference; SceneError outside."""
    known = np.array([time for time in times if time is not None])
    if not known.size:
        raise SceneError("--time needs a transient, and this is one state")
    number, when = int(np.argmin(np.abs(known - wanted))), f"{wanted * 1e3:.6g}"
    if not known[0] <= wanted <= known[-1]:
        raise SceneError(f"--time {when} ms is outside this run, from {known[0] * 1e3:.4g} to {known[-1] * 1e3:.4g} ms")
    found = f"{known[number] * 1e3:.4g} ms"
    note = f"{when} ms is not stored: this is {found}, the nearest (a run with --field-times {when}ms stores it)"
    return number, [] if np.isclose(known[number], wanted) else [note]


class Stage:
    """A plotter with a field, and the state of the view.

    Attributes
    ----------
    place : number of the state, with a fraction between two
    array : name of the array that is shown
    axis, part : "x", "y" or "z" across which the field is clipped, or none, and the place as a part of the extent
    line : whether the line plot is shown
    """

    def __init__(self, field: Field, request: dict[str, Any], place: float = 0.0) -> None:
        self.field, self.place, self.line, self.edges = field, place, request["probe"], request["edges"]
        clip: tuple[str, float] = request["clip"] or ("", 0.5)
        self.axis, self.part = clip
        self.array = ARRAYS[request["show"]]
        if self.array not in field.arrays:
            raise SceneError(f"--show {request['show']}: the field has no such data, but {', '.join(field.arrays)}")
        self._bounds = np.reshape(field.grids[0].bounds, (3, 2))
        self._outline = _surface(field.grids[0]).extract_feature_edges(30, manifold_edges=False)
        self._longest = int(np.argmax(np.ptp(self._bounds, axis=1)))
        pv.global_theme.allow_empty_mesh = True  # a round body has no outline
        # Any: pyvista's decorators hide the signatures of its methods.
        plotter: Any = pv.Plotter
        self.plotter: Any = plotter(
            shape=(2, 1), border=False, off_screen=request["off_screen"], window_size=request["size"]
        )
        self.plotter.set_background("white")
        self.plotter.enable_anti_aliasing("msaa", all_renderers=False)
        self.plotter.enable_parallel_projection()
        self.plotter.camera.SetWindowCenter(0.1, 0.0)  # the right is the colour bar's
        self._chart: Any = pv.Chart2D(size=(0.96, 0.96), loc=(0.02, 0.02), x_label=f"{'xyz'[self._longest]} (um)")
        self._curve = self._chart.line([0.0, 1.0], [0.0, 1.0], color=LINES["peak_K"], width=2.0)
        # A window has a place for the line plot from the start.
        plotted = self.line or not request["off_screen"]
        field_part, plot_part = self.plotter.renderers
        field_part.SetViewport(0.0, 0.3 * plotted, 1.0, 1.0)
        plot_part.SetViewport(0.0, 0.0, 1.0, 0.3)
        plot_part.SetDraw(plotted)
        self.plotter.subplot(1, 0)
        self.plotter.add_chart(self._chart)
        self.plotter.subplot(0, 0)
        self.draw()
        along_y = np.ptp(self._bounds[1]) > np.ptp(self._bounds[0])
        self.plotter.view_vector((1.0, -0.22, 0.5) if along_y else (-0.22, -1.0, 0.5), viewup=(0, 0, 1))
        self.plotter.renderer.ResetCameraScreenSpace(0.75)

    def draw(self) -> None:
        """Draw the view anew; the camera stays."""
        self.plotter.suppress_rendering = True
        grid = self.field.at(self.place, self.array)
        clipped = self._clip(grid)
        low, high = self.field.range(self.array)
        label, unit = _label(self.array)
        field = self._add(
            "field", _surface(clipped), scalars=self.array, clim=(low, high), cmap=ListedColormap(table() / 255),
            nan_color="#d9d9d9", interpolate_before_map=True, show_scalar_bar=False,
        )  # fmt: skip
        # Lines on the surface are nearer to the eye.
        field.mapper.SetResolveCoincidentTopologyToPolygonOffset()
        field.mapper.SetRelativeCoincidentTopologyPolygonOffsetParameters(2.0, 2.0)
        for bar in [*self.plotter.scalar_bars.keys()]:
            self.plotter.remove_scalar_bar(bar)
        bar = self.plotter.add_scalar_bar(
            f"{label}\n({unit})", mapper=field.mapper, vertical=True, color=INK, fmt="%.7g", position_x=0.88,
            position_y=0.1, width=0.06, height=0.75,
        )  # fmt: skip
        bar.SetUseCustomLabels(True)
        bar.SetCustomLabels(pv.convert_array(round_ticks(low, high)))
        self._add("outline", self._clip(self._outline), color="#404040", line_width=1.5)
        if self.edges:
            self._add("edges", _surface(clipped, 0).extract_all_edges(), color="#303030", line_width=0.7, opacity=0.5)
        self.plotter.add_text(self._title(label), position="upper_left", font_size=12, color=INK, name="title")
        self._plot(grid)
        self._chart.y_axis.label, self._chart.y_range = f"{label} ({unit})", (low, high)
        self.plotter.suppress_rendering = False
        self.plotter.render()

    def _add(self, name: str, mesh: Any, **options: Any) -> Any:
        """Draw a mesh in place of the one with this name."""
        return self.plotter.add_mesh(mesh, name=name, lighting=False, reset_camera=False, **options)

    def _title(self, label: str) -> str:
        field, before = self.field, int(self.place)
        said = [f"{field.name}: {label}"]
        if (time := field.times[before]) is not None:
            after = field.times[min(before + 1, len(field.times) - 1)] or 0.0
            said.append(f"{1e3 * (time + (self.place - before) * (after - time)):.4g} ms")
        return ", ".join([*said, f"thickness drawn x{field.factor:g}"])

    def _clip(self, mesh: Any) -> Any:
        if not self.axis:
            return mesh
        origin = self._bounds.mean(axis=1)
        low, high = self._bounds["xyz".index(self.axis)]
        origin["xyz".index(self.axis)] = low + self.part * (high - low)
        return mesh.clip(normal=f"-{self.axis}", origin=origin, invert=True)

    def _plot(self, grid: Any) -> None:
        """Plot the array along the longest line through the middle, below the field."""
        self._chart.visible = self.line
        self.plotter.remove_actor("line")
        if not self.line:
            return
        ends = np.tile(self._bounds.mean(axis=1), (2, 1))
        ends[:, self._longest] = self._bounds[self._longest]
        self._add("line", pv.Line(*ends), color="#2b6cb0", line_width=3)
        sample = grid.sample_over_line(*ends, resolution=400)
        inside = sample["vtkValidPointMask"].astype(bool)
        place = sample.points[inside, self._longest] / (self.field.factor if self._longest == 2 else 1.0)
        self._curve.update(place, size(sample[self.array][inside]))

    def film(self, path: Path) -> None:
        """Write the transient at an even pace to a .gif or .mp4 file."""
        times, frames = np.array(self.field.times, dtype=float), []
        for time in np.linspace(times[0], times[-1], FRAMES):
            self.place = float(np.interp(time, times, np.arange(len(times))))
            self.draw()
            frames.append(self.plotter.screenshot(return_img=True))
        frames += frames[-1:] * FRAMES_PER_SECOND
        if path.suffix.lower() == ".mp4":
            import imageio.v2 as imageio

            imageio.mimwrite(path, frames, fps=FRAMES_PER_SECOND, macro_block_size=2)
            return
        from PIL import Image

        # One palette for all frames, else colours would flicker.
        palette = Image.fromarray(np.concatenate(frames)).quantize(method=Image.Quantize.MAXCOVERAGE)
        images = [Image.fromarray(frame).quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
        images[0].save(path, save_all=True, append_images=images[1:], duration=1000 // FRAMES_PER_SECOND, loop=0)

    def open(self) -> None:
        """Open a window with keys and a slider over the stored states, until it is closed."""
        steps, playing, plotter = len(self.field.grids), False, self.plotter

        def press(key: str) -> None:
            nonlocal playing
            if key == "space":
                playing = not playing
            elif key == "t":
                self.array = _next(self.field.arrays, self.array)
            elif key == "x":
                self.axis, self.part = _next(("", "x", "y", "z"), self.axis), 0.5
            else:
                self.line = not self.line
            self.draw()

        def move(place: float) -> None:
            self.place = place
            self.draw()

        def tick(*_: object) -> None:
            if playing:
                slider.GetRepresentation().SetValue((int(self.place) + 1) % steps)
                move(slider.GetRepresentation().GetValue())

        for key in ("space", "t", "x", "l"):
            plotter.add_key_event(key, partial(press, key))
        keys = ", ".join(f"{key}: {does}" for key, does in KEYS.items())
        plotter.add_text(keys, position="lower_left", font_size=9, color=INK)
        if steps > 1:
            slider = plotter.add_slider_widget(
                move, (0, steps - 1), value=self.place, title="stored time", title_height=0.02, fmt="%.0f",
                pointa=(0.55, 0.92), pointb=(0.85, 0.92), color=INK, interaction_event="always",
            )  # fmt: skip
            plotter.iren.initialize()
            plotter.iren.add_observer("TimerEvent", tick)
            plotter.iren.create_timer(1000 // STEPS_PER_SECOND, repeating=True)
        plotter.show(title=f"validate view {self.field.name}")


def _surface(grid: Any, subdivision: int = 2) -> Any:
    """The surface; quadratic cells are cut into enough triangles to look curved."""
    return grid.extract_surface(algorithm="dataset_surface", nonlinear_subdivision=subdivision)


def _label(array: str) -> tuple[str, str]:
    """The words and the unit in the name of an array."""
    short = next(short for short, name in ARRAYS.items() if name == array)
    return short.replace("_", " "), array.removeprefix(f"{short}_").replace("_per_", "/")


def _next(names: Sequence[str], name: str) -> str:
    return names[(names.index(name) + 1) % len(names)]


def round_ticks(low: float, high: float) -> np.ndarray:
    """Return some round numbers in a range, a step of 1, 2, 2.5 or 5 times a power of ten apart."""
    ticks = np.asarray(MaxNLocator(6, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high))
    small = 1e-9 * (high - low)
    return ticks[(ticks >= low - small) & (ticks <= high + small)]
