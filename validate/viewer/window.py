"""Draw a picture, a film or a window in a process that owns the graphics.

It has a process of its own because VTK without a working OpenGL may end it.
"""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from compare.worker import EndedError, Worker
from scenes.errors import SceneError, quoted
from scenes.model import Scene
from validate.viewer.source import KEYS, QUANTITIES, Source, View, find, present

STEPS_PER_SECOND = 4
"""Stored states that are played a second."""
FRAMES, FRAMES_PER_SECOND, HOLD = 40, 10, 10
"""Frames of a film, frames a second, and frames for which it rests on its end."""


class NoGraphicsError(ArithmeticError):
    """The machine cannot draw; everything else still works."""


def start(request: dict[str, Any], progress: Callable[[str], None]) -> list[str]:
    """Draw the view and return notes; raise SceneError for bad input, NoGraphicsError without OpenGL."""
    if "parts" not in request:
        present(Path(request["path"]))
    if not request["off_screen"] and sys.platform.startswith("linux"):
        if not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
            instead = "" if "parts" in request else " or --movie FILE, or open the run's report.html"
            raise NoGraphicsError(f"there is no display to open a window on: give --screenshot FILE{instead}")
    progress("starting the viewer")
    worker, notes = Worker("the viewer"), list[str]()
    for task in (get_ready, draw) if "parts" in request else (get_ready, read, draw):
        try:
            notes += worker.run(math.inf, task, request)
        except EndedError as error:
            if task is not read:
                raise _no_graphics(str(error)) from None
            raise SceneError(
                f"{quoted(Path(request['path']))} cannot be read: VTK ended at it ({error}); is the file whole?"
            ) from None
        except ImportError as error:
            raise _no_graphics(str(error)) from None
    if not all(Path(name).exists() for name in (request["screenshot"], request["movie"]) if name):
        raise _no_graphics("it wrote no file")
    return notes


def _no_graphics(why: str) -> NoGraphicsError:
    return NoGraphicsError(
        f"the viewer could not draw here ({why}): pyvista needs OpenGL, or a VTK with software rendering; the run's "
        "files are whole, and its report.html shows the field without it"
    )


def save_picture(scene: Scene, path: Path, size: tuple[int, int] = (1430, 900)) -> None:
    """Draw a scene that was checked to a file of so many pixels. Raises NoGraphicsError."""
    from validate.viewer.boxes import parts

    drawing = {"off_screen": True, "screenshot": str(path), "movie": None, "size": list(size)}
    start({**drawing, **parts(scene)}, lambda _: None)


def get_ready(request: dict[str, Any]) -> list[str]:
    """Load pyvista."""
    import pyvista  # noqa: F401

    return []


_held: list[tuple[Source, View]] = []
"""The source and the first view that this process has read."""


def read(request: dict[str, Any]) -> list[str]:
    """Read the field, and return notes. Raises SceneError for what can't be shown, before anything is drawn."""
    source = find(Path(request["path"]))
    view, notes = begin(request, source)
    if request["movie"]:
        _check_film(view, Path(request["movie"]))
    _held[:] = [(source, view)]
    return notes


def draw(request: dict[str, Any]) -> list[str]:
    """Draw a scene, or the field that was read."""
    if "parts" in request:
        from validate.viewer import boxes

        boxes.show(request)
        return []
    ((source, view),) = _held
    from validate.viewer.stage import Stage

    size = tuple(request["size"])
    if request["screenshot"] or not request["off_screen"]:
        stage = Stage(source, bool(request["off_screen"]), size)
        stage.show(view)
        if request["screenshot"]:
            stage.plotter.screenshot(request["screenshot"])
    if request["movie"]:
        film(Stage(source.evenly(FRAMES, view.quantity), True, size), view, Path(request["movie"]))
    if not request["off_screen"]:
        interact(stage, view)
    return []


def begin(request: dict[str, Any], source: Source) -> tuple[View, list[str]]:
    """Return the first view, of the last state or the state nearest to a given time, and notes.

    Raises SceneError for data or a time that the source lacks.
    """
    from validate.report.figures.render import exaggeration

    grid, notes = source.grid(0), list[str]()
    names = [n for n in QUANTITIES if n in grid.point_data or n in grid.cell_data]
    quantity = request["show"]
    if quantity not in names:
        raise SceneError(f"--show {quantity}: the field has no such data, but {', '.join(names)}")
    step = len(source.times) - 1
    if request["time"] is not None:
        times = [time for time in source.times if time is not None]
        if not times:
            raise SceneError("--time needs a transient, and this is a steady state")
        step, notes = nearest(times, request["time"])
    factor = request["exaggerate"] or exaggeration(grid.points)
    axis, place = request["clip"] or ("", 0.5)
    view = View(
        tuple(names), len(source.times), factor, step, quantity, request["edges"], axis, place, request["probe"],
        bool(request["screenshot"]) and not request["movie"],
    )  # fmt: skip
    return view, notes


def nearest(times: Sequence[float], time: float) -> tuple[int, list[str]]:
    """Return the number of the stored time nearest to a given time (s), and note a difference; SceneError outside."""
    step = min(range(len(times)), key=lambda k: abs(times[k] - time))
    when = f"{time * 1e3:.6g} ms"
    if not times[0] <= time <= times[-1] * (1 + 1e-6):
        ends = f"{times[0] * 1e3:.4g} to {times[-1] * 1e3:.4g} ms"
        raise SceneError(f"--time {when} is not in this run, which goes from {ends}")
    note = (
        f"{when} is not stored: this is {times[step] * 1e3:.4g} ms, the nearest (a run with --field-times "
        f"{time * 1e3:.6g}ms stores it)"
    )
    return step, [note] if abs(times[step] - time) > 1e-6 * time else []


def _check_film(view: View, path: Path) -> None:
    """SceneError where a film can't be made, before anything is drawn."""
    if view.steps < 2:
        raise SceneError("--movie needs a transient, and this is one state: run without --steady, view the folder")
    if path.suffix.lower() == ".mp4":
        try:
            import imageio.v2  # noqa: F401
            import imageio_ffmpeg

            imageio_ffmpeg.get_ffmpeg_exe()
        except (ImportError, RuntimeError) as error:
            raise SceneError(
                f"--movie {quoted(path)} needs the package imageio with its ffmpeg (pip install 'imageio[ffmpeg]'); a "
                f".gif needs nothing more ({type(error).__name__})"
            ) from None


def film(stage: Any, view: View, path: Path) -> None:
    """The whole transient at an even pace into a .gif or .mp4."""
    frames = []
    view = replace(view, steps=FRAMES, own_scale=False)
    for step in range(FRAMES):
        stage.show(view.at(step))
        stage.plotter.render()
        frames.append(stage.plotter.screenshot(return_img=True))
    if path.suffix.lower() == ".gif":
        from PIL import Image

        # One palette for all frames, else colours would flicker.
        palette = Image.fromarray(np.concatenate(frames)).quantize(dither=Image.Dither.NONE)
        images = [Image.fromarray(frame).quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
        each = 1000 // FRAMES_PER_SECOND
        lasting = [each] * (FRAMES - 1) + [each * (1 + HOLD)]
        colours = bytes(palette.getpalette() or ())
        images[0].save(path, save_all=True, append_images=images[1:], duration=lasting, loop=0, palette=colours)
        return
    import imageio.v2 as imageio

    # The codec wants even sides.
    even = [frame[: frame.shape[0] // 2 * 2, : frame.shape[1] // 2 * 2] for frame in frames + [frames[-1]] * HOLD]
    imageio.mimwrite(path, even, fps=FRAMES_PER_SECOND, macro_block_size=2)


def interact(stage: Any, view: View) -> None:
    """A window with the keys, a time slider and playback, until it is closed."""
    now = [view]
    plotter = stage.plotter

    def change(made: View) -> None:
        if made != now[0]:
            now[0] = made
            stage.show(made)
            plotter.render()

    plotter.reset_key_events()
    for name, (_, _, moved) in KEYS.items():
        if name not in "rq":
            plotter.add_key_event(name, lambda moved=moved: press(moved))
    plotter.subplot(0, 0)
    slider = view.steps > 1 and plotter.add_slider_widget(
        lambda value: change(now[0].at(round(value))), (0, view.steps - 1), value=view.step, title="stored time",
        pointa=(0.55, 0.95), pointb=(0.85, 0.95), fmt="%.0f", style="modern", interaction_event="always",
    )  # fmt: skip

    def press(moved: Callable[[View], View]) -> None:
        change(moved(now[0]))
        if slider:
            slider.GetRepresentation().SetValue(now[0].step)

    def tick(*_: object) -> None:
        if now[0].playing:
            press(lambda v: v.at(v.step + 1))

    if slider:
        plotter.iren.initialize()
        plotter.iren.add_observer("TimerEvent", tick)
        plotter.iren.create_timer(1000 // STEPS_PER_SECOND, repeating=True)
    plotter.show(title=f"validate view {stage.source.name}", auto_close=False)
