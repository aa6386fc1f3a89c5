"""`validate view`: the fields of a run in pyvista, in a window, a picture or a film."""

from __future__ import annotations

import argparse
import re
from pathlib import Path
from typing import Any

from scenes.errors import SceneError, quoted
from validate.cli.terminal import FINE, Progress, show

SHOWN = ("rise", "temperature", "potential", "current_density", "heat_source", "compare")


def describe(parser: argparse.ArgumentParser) -> None:
    """What the command takes."""
    parser.description = (
        "Look at the 3D fields of a run (made with --fields) in pyvista: over time, clipped, along a line, and beside\n"
        "the 1D model painted on the same geometry. In the window every key is listed."
    )
    parser.epilog = (
        "examples:\n"
        "  validate sink --fields && validate view results/sink-1V-fields\n"
        "  validate view results/sink-1V-fields --show compare --screenshot compare.png\n"
        "  validate view results/sink-1V-fields --movie heating.gif\n\n"
        "exit status: 0 shown or written, 2 bad input, 3 this machine cannot draw"
    )
    add = parser.add_argument
    add("path", metavar="RUN_OR_FILE", help="a results folder, or a .pvd, .vtu or .vtkhdf file")
    add(
        "--show",
        choices=SHOWN,
        default="rise",
        help="what to show first (default: rise); compare is 3D, 1D, difference",
    )
    add("--time", metavar="T", help="the stored time nearest to T, such as 0.5ms (default: the last)")
    add("--exaggerate", metavar="N", help="draw the thickness N times as large (default: a round factor, stated)")
    add("--clip", metavar="AXIS[=PART]", help="clip across x, y or z, at a part of the extent: y=0.25 (default 0.5)")
    add("--probe", action="store_true", help="plot the quantity along the longest line through the middle")
    add("--edges", action="store_true", help="draw the mesh's edges")
    add("--screenshot", metavar="FILE", help="write a picture (.png) and open no window")
    add("--movie", metavar="FILE", help="write a film of the transient (.gif, or .mp4) and open no window")
    add("--off-screen", action="store_true", help="open no window, as on a server; needs --screenshot or --movie")
    add("--size", metavar="WxH", default="1400x800", help="size of window or picture in pixels (default: 1400x800)")


def run(arguments: argparse.Namespace) -> int:
    """Shows or writes."""
    from validate.viewer.start import start

    asked = _asked(arguments)
    with Progress() as progress:
        notes = start(asked, progress)
    for note in notes:
        show(note)
    for name in (asked["screenshot"], asked["movie"]):
        if name:
            show(f"Wrote {name}")
    return FINE


def _asked(arguments: argparse.Namespace) -> dict[str, Any]:
    """The options as plain values; SceneError for those that are wrong."""
    from scenes.kinds import Quantity
    from scenes.units import NUMBER, TIME

    written = [name for name in (arguments.screenshot, arguments.movie) if name]
    if arguments.off_screen and not written:
        raise SceneError("--off-screen shows nothing by itself: give --screenshot FILE or --movie FILE")
    _ending("--screenshot", arguments.screenshot, (".png", ".jpg", ".jpeg"))
    _ending("--movie", arguments.movie, (".gif", ".mp4"))
    factor, time = arguments.exaggerate, arguments.time
    return {
        "path": str(Path(arguments.path)),
        "show": arguments.show,
        "time": None if time is None else Quantity(TIME, 0.0, 1e6).read("--time", time),
        "exaggerate": None if factor is None else Quantity(NUMBER, 1e-3, 1e6).read("--exaggerate", factor),
        "clip": _clip(arguments.clip),
        "probe": arguments.probe,
        "edges": arguments.edges,
        "screenshot": arguments.screenshot,
        "movie": arguments.movie,
        "off_screen": bool(arguments.off_screen or written),
        "size": _size(arguments.size),
    }


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
    found = re.fullmatch(r"(\d{2,5})[x\N{MULTIPLICATION SIGN}](\d{2,5})", given)
    if not found or not all(64 <= int(side) <= 8192 for side in found.groups()):
        raise SceneError(f"--size {quoted(given)}: give width and height from 64 to 8192, such as 1400x800")
    return [int(side) for side in found.groups()]
