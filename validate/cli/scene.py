"""`validate scene`: a built-in scene as TOML."""

from __future__ import annotations

import argparse

from scenes.loading import builtin_text, known_names
from validate.cli import common
from validate.cli.terminal import FINE, show


def describe(parser: argparse.ArgumentParser) -> None:
    """What the command takes."""
    parser.description = "Print a built-in scene as commented TOML, to copy and edit."
    parser.epilog = (
        "examples:\n"
        "  validate scene sink > mine.toml                 for validate sink\n"
        "  validate scene bridge > mine.toml               for validate solve\n"
        "  validate scene sink --boxes > mine.toml         the sink as boxes, for validate solve"
    )
    parser.add_argument("name", metavar="NAME", help=f"the scene: {', '.join(known_names())}")
    common.add(parser, {"--boxes": "the sink (or a file of one) as the boxes that are solved in 3D"})


def run(arguments: argparse.Namespace) -> int:
    """Prints the scene."""
    if arguments.boxes:
        from scenes.free.document import as_toml
        from scenes.loading import load

        show(as_toml(load(arguments.name).scene()).rstrip("\n"))
    else:
        show(builtin_text(arguments.name).rstrip("\n"))
    return FINE
