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
from typing import Any

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
    "--size WxH": "size of window or picture in pixels (default: 1400x800)",
}  # fmt: skip


def run(arguments: argparse.Namespace) -> int:
    from validate.viewer.window import start

    endings = {"screenshot": (".png", ".jpg", ".jpeg"), "movie": (".gif", ".mp4")}
    files = {name: Path(given) for name in endings if (given := vars(arguments)[name])}
    for name, path in files.items():
        said, known = f"--{name} {quoted(path)}", " or ".join(endings[name])
        refuse(
            (path.suffix.lower() not in endings[name], f"{said}: give a file that ends in {known}"),
            (not path.absolute().parent.is_dir(), f"{said}: the folder {quoted(path.parent)} does not exist"),
        )
    module, request = _scene(arguments) if is_scene(arguments.path) else _fields(arguments)
    size = _size(arguments.size or "1400x800")
    with progress() as say:
        say("drawing" if files else "starting the viewer")
        notes = start(module, {**vars(arguments), **request, "off_screen": bool(files), "size": size})
    for line in (*notes, *(f"Wrote {name}" for name in files.values())):
        show(line)
    return FINE


def is_scene(path: str) -> bool:
    """Return whether a path is a scene file or the name of a built-in scene, and not a run."""
    from scenes.loading import known_names

    return path.endswith(".toml") or (path in known_names() and not Path(path).exists())


def _fields(arguments: argparse.Namespace) -> tuple[str, dict[str, Any]]:
    """Return the module that draws fields and the options that it reads."""
    from scenes.kinds import Quantity
    from scenes.units import NUMBER, TIME

    path, options = quoted(Path(arguments.path)), vars(arguments)
    refuse(
        (arguments.set, f"--set is for a scene, and {path} is none: leave it out"),
        (arguments.time and arguments.movie, "--movie shows all times: leave out --time, or give --screenshot"),
        (not Path(arguments.path).exists(), f"{path} does not exist: give a results folder, or a .pvd or .vtu file"),
    )
    axis, _, part = ("x" if arguments.clip is None else arguments.clip).partition("=")
    if axis not in ("x", "y", "z"):
        raise SceneError(f"--clip {quoted(arguments.clip)}: give x, y or z, and maybe a part of the extent: y=0.25")
    kinds = {"time": Quantity(TIME, 0.0, 1e6), "exaggerate": Quantity(NUMBER, 1e-3, 1e6)}
    read = {name: kind.read(f"--{name}", options[name]) for name, kind in kinds.items() if options[name] is not None}
    place = Quantity(NUMBER, 0.0, 0.99).read("--clip", part or "0.5")
    return "stage", {**read, "show": arguments.show or "rise", "clip": arguments.clip and (axis, place)}


def _scene(arguments: argparse.Namespace) -> tuple[str, dict[str, Any]]:
    """Return the module that draws a scene before its solution, and the parts to draw."""
    from scenes.loading import document, known_names, load, says_nothing, type_of_file
    from validate.viewer.boxes import of_boxes, request

    for name in ("show", "time", "exaggerate", "clip", "probe", "edges", "movie"):
        is_given, path = vars(arguments)[name], quoted(Path(arguments.path))
        refuse((is_given, f"--{name} is for fields, and {path} is a scene: leave it out"))
    content = document(arguments.path, known_names())[0]
    if says_nothing(content) and not arguments.set:
        raise SceneError(f"{quoted(Path(arguments.path))} has no [[box]], so there is nothing to draw: add some")
    # A scene to look at needs no end time yet.
    said = "run" in content or any(text.startswith(("run.", "end_time", "steady")) for text in arguments.set)
    steady = ["run.steady=true"] if type_of_file(content) is None and not said else []
    return "boxes", request(of_boxes(load(arguments.path, [*steady, *arguments.set])))


def _size(given: str) -> list[int]:
    match = re.fullmatch(r"(\d{2,5})[x\N{MULTIPLICATION SIGN}](\d{2,5})", given)
    if not match or not all(64 <= int(side) <= 8192 for side in match.groups()):
        raise SceneError(f"--size {quoted(given)}: give width and height from 64 to 8192, such as 1400x800")
    return [int(side) for side in match.groups()]
