"""The process that owns the graphics: reads what to show on standard input, then draws a picture, a film or a window.

A process of its own because VTK without a working OpenGL may end it. What a user did wrong is one line on standard
error with ``FAULT`` in front, and exit status 2.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from compare.viewer.source import find
from compare.viewer.state import KEYS, QUANTITIES, View
from scenes.errors import SceneError, quoted

FAULT = "fault: "
FILM = "film "
FRAMES_PER_SECOND = 4
HOLD = 6
"""Frames for which a film stays on its last state."""


def main() -> int:
    """Does what is asked; returns the exit status."""
    asked = json.loads(sys.stdin.read())
    try:
        _show(asked)
    except SceneError as error:
        print(f"{FAULT}{error}", file=sys.stderr, flush=True)
        return 2
    return 0


def _show(asked: dict[str, Any]) -> None:
    source = find(Path(asked["path"]))
    first = source.grid(0)
    view = begin(asked, source, first)
    from compare.viewer.stage import Stage

    stage = Stage(source, bool(asked["off_screen"]), tuple(asked["size"]))
    stage.show(view)
    if asked["screenshot"]:
        stage.plotter.screenshot(asked["screenshot"])
    if asked["movie"]:
        film(stage, view, Path(asked["movie"]))
    if not asked["off_screen"]:
        interact(stage, view)
    stage.plotter.close()


def begin(asked: dict[str, Any], source: Any, grid: Any) -> View:
    """The first view: the last state, unless another time is asked for; SceneError for what isn't there."""
    from compare.render import exaggeration

    names = [n for n in QUANTITIES if n in grid.point_data or n in grid.cell_data]
    if asked["show"] == "compare" and source.reduction is None:
        raise SceneError("--show compare needs the 1D model: a run of the sink in its folder, made with both models")
    quantity = "rise" if asked["show"] == "compare" else asked["show"]
    if quantity not in names:
        raise SceneError(f"--show {quantity}: the field has no such data, but {', '.join(names)}")
    step = len(source.times) - 1
    if asked["time"] is not None:
        if any(time is None for time in source.times):
            raise SceneError("--time needs a transient, and this is a steady state")
        step = min(range(len(source.times)), key=lambda k: abs(source.times[k] - asked["time"]))
    factor = asked["exaggerate"] or exaggeration(grid.points)
    axis, place = asked["clip"] or ("", 0.5)
    return View(
        tuple(names), len(source.times), factor, step, quantity, asked["show"] == "compare",
        source.reduction is not None, asked["edges"], axis, place, asked["probe"],
        bool(asked["screenshot"]) and not asked["movie"], not asked["off_screen"],
    )  # fmt: skip


def film(stage: Any, view: View, path: Path) -> None:
    """Every stored state in turn, a quarter of a second each, into a .gif or .mp4."""
    if view.steps < 2:
        raise SceneError("--movie needs a transient, and this is one state: run without --steady, view the folder")
    frames = []
    for step in range(view.steps):
        stage.show(view.at(step))
        stage.plotter.render()
        frames.append(stage.plotter.screenshot(return_img=True))
        print(f"{FILM}{step + 1} of {view.steps}", flush=True)
    frames += [frames[-1]] * HOLD
    if path.suffix == ".gif":
        from PIL import Image

        images = [Image.fromarray(frame).convert("P", palette=Image.Palette.ADAPTIVE, colors=128) for frame in frames]
        images[0].save(path, save_all=True, append_images=images[1:], duration=1000 // FRAMES_PER_SECOND, loop=0)
        return
    try:
        import imageio.v2 as imageio

        # The codec wants even sides.
        even = [frame[: frame.shape[0] // 2 * 2, : frame.shape[1] // 2 * 2] for frame in frames]
        imageio.mimwrite(path, even, fps=FRAMES_PER_SECOND, macro_block_size=2)
    except (ImportError, ValueError) as error:
        raise SceneError(
            f"--movie {quoted(path)} needs the package imageio with its ffmpeg (the extra movie); a .gif "
            f"needs nothing more ({type(error).__name__})"
        ) from None


def interact(stage: Any, view: View) -> None:
    """A window with the keys, a time slider and playback, until it is closed."""
    now = [view]
    plotter = stage.plotter
    slider = _slider(stage, now) if view.steps > 1 else None

    def pressed(change: Any) -> None:
        before, now[0] = now[0], change(now[0])
        if now[0] == before:
            return
        stage.show(now[0])
        if slider is not None:
            slider.GetRepresentation().SetValue(now[0].step)
        plotter.render()

    plotter.reset_key_events()
    for name, (_, _, change) in KEYS.items():
        plotter.add_key_event(name, lambda change=change: pressed(change))

    def tick(*_: object) -> None:
        if now[0].playing:
            pressed(lambda v: v.at(v.step + 1))

    if view.steps > 1:
        plotter.iren.initialize()
        plotter.iren.add_observer("TimerEvent", tick)
        plotter.iren.create_timer(1000 // FRAMES_PER_SECOND, repeating=True)
    plotter.show(title=f"validate view {stage.source.name}", auto_close=False)


def _slider(stage: Any, now: list[View]) -> Any:
    def moved(value: float) -> None:
        step = round(value)
        if step != now[0].step:
            now[0] = now[0].at(step)
            stage.show(now[0])
            stage.plotter.render()

    stage.plotter.subplot(4, 0)
    return stage.plotter.add_slider_widget(
        moved, (0, now[0].steps - 1), value=now[0].step, title="stored time", pointa=(0.2, 0.55), pointb=(0.8, 0.55),
        fmt="%.0f", style="modern", interaction_event="always", title_height=0.3, slider_width=0.25, tube_width=0.06,
    )  # fmt: skip


if __name__ == "__main__":
    sys.exit(main())
