"""Look at the 3D fields of a run (made with --fields) in pyvista: over time, clipped, along a line. In the
window every key is listed. Of a scene file, before it is solved: its boxes, boundaries, electrodes and probes by name.

examples:
  validate view bridge --screenshot bridge.png
  validate view mine.toml --set parameters.w=12um
  validate sink --fields && validate view results/sink-1V-fields
  validate view results/sink-1V-fields --show potential --screenshot potential.png
  validate view results/sink-1V-fields --movie heating.gif

exit status: 0 shown or written, 2 bad input, 3 this machine cannot draw
"""

from __future__ import annotations

import argparse
import re
from pathlib import Path

from scenes.errors import SceneError, quoted
from validate.cli.common import refuse
from validate.cli.terminal import FINE, progress, show

OPTIONS = {
    "path RUN_OR_FILE": "a results folder, a .pvd or .vtu file; or a scene: its file, or bridge, sink ...",
    "--set KEY=VALUE ...": "of a scene, override a key, as often as needed",
    "--show {rise,temperature,potential,current_density,heat_source}": "what to show first (default: rise)",
    "--time T": "the stored time nearest to T, such as 0.5ms (default: the last)",
    "--exaggerate N": "draw the thickness N times as large (default: a round factor, stated)",
    "--clip AXIS[=PART]": "clip across x, y or z, at a part of the extent: y=0.25 (default 0.5)",
    "--probe": "plot the quantity along the longest line through the middle",
    "--edges": "draw the mesh's edges",
    "--screenshot FILE": "write a picture (.png) and open no window",
    "--movie FILE": "write a film of the transient (.gif, or .mp4) and open no window",
    "--off-screen": "open no window, as on a server; needs --screenshot or --movie",
    "--size WxH": "size of window or picture in pixels (default: 1400x800)",
}  # fmt: skip


def run(arguments: argparse.Namespace) -> int:
    from scenes.kinds import Quantity
    from scenes.units import NUMBER, TIME
    from validate.viewer.window import start

    files = [name for name in (arguments.screenshot, arguments.movie) if name]
    if arguments.off_screen and not files:
        raise SceneError("--off-screen shows nothing by itself: give --screenshot FILE or --movie FILE")
    _ending("--screenshot", arguments.screenshot, (".png", ".jpg", ".jpeg"))
    if is_scene(arguments.path):
        return _scene(arguments)
    refuse((arguments.set, f"--set is for a scene, and {quoted(Path(arguments.path))} is none: leave it out"))
    _ending("--movie", arguments.movie, (".gif", ".mp4"))
    options = vars(arguments) | {
        "path": str(Path(arguments.path)),
        "show": arguments.show or "rise",
        "clip": _clip(arguments.clip),
        "off_screen": bool(arguments.off_screen or files),
        "size": _size(arguments.size or "1400x800"),
    }
    for name, kind in (("time", Quantity(TIME, 0.0, 1e6)), ("exaggerate", Quantity(NUMBER, 1e-3, 1e6))):
        if options[name] is not None:
            options[name] = kind.read(f"--{name}", options[name])
    with progress() as say:
        notes = start(options, say)
    for line in (*notes, *(f"Wrote {name}" for name in files)):
        show(line)
    return FINE


def is_scene(path: str) -> bool:
    """Return whether a path is a scene file or the name of a built-in scene, and not a run."""
    from scenes.loading import known_names

    return path.endswith(".toml") or (path in known_names() and not Path(path).exists())


def _scene(arguments: argparse.Namespace) -> int:
    """A scene that isn't solved yet: its picture, or a window with it."""
    from scenes.loading import document, known_names, load, says_nothing, type_of_file
    from validate.viewer.boxes import of_boxes, parts
    from validate.viewer.window import save_picture, start

    values = vars(arguments)
    for name in ("show", "time", "exaggerate", "clip", "probe", "edges", "movie"):
        refuse((values[name], f"--{name} is for fields, and {quoted(Path(arguments.path))} is a scene: leave it out"))
    content = document(arguments.path, known_names())[0]
    if says_nothing(content) and not arguments.set:
        raise SceneError(f"{quoted(Path(arguments.path))} has no [[box]], so there is nothing to draw: add some")
    # A scene to look at needs no end time yet.
    said = "run" in content or any(text.startswith(("run.", "end_time", "steady")) for text in arguments.set)
    steady = ["run.steady=true"] if type_of_file(content) is None and not said else []
    size, scene = _size(arguments.size or "1400x800"), of_boxes(load(arguments.path, [*steady, *arguments.set]))
    if arguments.screenshot:
        save_picture(scene, Path(arguments.screenshot), (size[0], size[1]))
        show(f"Wrote {arguments.screenshot}")
        return FINE
    with progress() as say:
        start({"off_screen": False, "screenshot": None, "movie": None, "size": size, **parts(scene)}, say)
    return FINE


def _ending(option: str, given: str | None, allowed: tuple[str, ...]) -> None:
    if given is None:
        return
    path = Path(given)
    if path.suffix.lower() not in allowed:
        raise SceneError(f"{option} {quoted(path)}: give a file that ends in {' or '.join(allowed)}")
    if not path.resolve().parent.is_dir():
        raise SceneError(f"{option} {quoted(path)}: the folder {quoted(path.parent)} does not exist")


def _clip(given: str | None) -> tuple[str, float] | None:
    if given is None:
        return None
    from scenes.kinds import Quantity
    from scenes.units import NUMBER

    axis, _, part = given.partition("=")
    if axis not in ("x", "y", "z"):
        raise SceneError(f"--clip {quoted(given)}: give x, y or z, and maybe a part of the extent: y=0.25")
    return axis, float(Quantity(NUMBER, 0.0, 1.0).read("--clip", part) or 0.0) if part else 0.5


def _size(given: str) -> list[int]:
    match = re.fullmatch(r"(\d{2,5})[x\N{MULTIPLICATION SIGN}](\d{2,5})", given)
    if not match or not all(64 <= int(side) <= 8192 for side in match.groups()):
        raise SceneError(f"--size {quoted(given)}: give width and height from 64 to 8192, such as 1400x800")
    return [int(side) for side in match.groups()]
