"""`validate map`: the line over two keys on which the 1D model leaves a tolerance."""

from __future__ import annotations

import argparse
from dataclasses import replace

from scenes.errors import SceneError, quoted
from validate.cli import sweep
from validate.cli.common import whole

CELLS, SOLVES = 100, 400


def describe(parser: argparse.ArgumentParser) -> None:
    """What the command takes."""
    parser.description = (
        "Find where over two keys the 1D model is within a tolerance of 3D: a map of cells, some hundred of them\n"
        "solved, where the line runs and where neighbours disagree, the others interpolated, each with its error."
    )
    parser.epilog = (
        "examples:\n"
        "  validate map sink --vary sink.width=10um:200um --vary anchor.oxide_length=10um:140um --check fig4 \\\n"
        "    --tolerance 5%\n"
        "  validate map sink --vary drive.voltage=0.1:10:log --vary sink.length=0.2mm:2mm --check fig6_end\n\n"
        "results: map.csv, points.csv (what was solved), sweep.json, a figure and report.html\n"
    ) + sweep.EXIT
    sweep.options(parser, "KEY=FROM:TO[:log], twice")
    add = parser.add_argument
    add("--check", metavar="ID", required=True, help="the check whose line is wanted: fig4, fig6_end, eq14 ...")
    add("--tolerance", metavar="T", help="its tolerance, 5%% (default: the scene's)")
    add("--cells", metavar="N", help=f"cells along either key, or NxM (default {CELLS})")
    add("--solves", metavar="N", help=f"at most so many 3D solutions (default {SOLVES})")


def run(arguments: argparse.Namespace) -> int:
    """Maps, writes and reports."""
    from scenes.checks import OVER_TIME
    from validate.sweep.axes import Axis, parse
    from validate.sweep.design import Design
    from validate.sweep.job import checked

    cells = _cells(arguments.cells)
    solves = whole("--solves", arguments.solves or str(SOLVES), 16, 1_000_000)
    base = sweep.scene(arguments, [])
    if base.kind != "sink":
        raise SceneError(
            f"{quoted(arguments.scene)} has no 1D model, so there is no line to map: give a sink, or validate sweep"
        )
    if len(arguments.vary) != 2:
        raise SceneError(f"a map is over two keys, and {len(arguments.vary)} are varied: give --vary KEY=FROM:TO twice")
    steady = arguments.check not in OVER_TIME
    checked(base, arguments.check, steady)
    if arguments.tolerance is not None:
        setting = f"checks.tolerances.{arguments.check}={arguments.tolerance}"
        base.read(*setting.split("=", 1))
        base = replace(base, settings=(*base.settings, setting))
    ranges = [parse(base, text, "range") for text in arguments.vary]
    axes = tuple(Axis(given.key, given.cells(count), given.log) for given, count in zip(ranges, cells, strict=True))
    return sweep.execute(arguments, base, Design(axes), solves, steady)


def _cells(given: str | None) -> tuple[int, int]:
    parts = (given or str(CELLS)).split("x")
    if len(parts) > 2:
        raise SceneError(f"--cells {quoted(given)} is not allowed: give N, or NxM")
    counts = [whole("--cells", part, 2, 1000) for part in parts]
    return counts[0], counts[-1]
