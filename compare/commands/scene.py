"""`validate scene`: a built-in scene as TOML."""

from __future__ import annotations

import argparse

from compare.terminal import FINE, show
from scenes.loading import builtin_text, known_names


def describe(parser: argparse.ArgumentParser) -> None:
    """What the command takes."""
    parser.description = "Print a built-in scene as commented TOML, to copy and edit."
    parser.epilog = "example:\n  validate scene sink > mine.toml"
    parser.add_argument("name", metavar="NAME", help=f"the scene: {', '.join(known_names())}")


def run(arguments: argparse.Namespace) -> int:
    """Prints the scene."""
    show(builtin_text(arguments.name).rstrip("\n"))
    return FINE
