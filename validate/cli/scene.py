"""Print a built-in scene as commented TOML, to copy and edit.

examples:
  validate scene sink > mine.toml                 for validate sink
  validate scene bridge > mine.toml               for validate solve
  validate scene sink --boxes > mine.toml         the sink as boxes, for validate solve
"""

from __future__ import annotations

import argparse

from scenes.loading import builtin_text, known_names
from validate.cli.terminal import FINE, show

OPTIONS = {
    "name NAME": f"the scene: {', '.join(known_names())}",
    "--boxes": "the sink (or a file of one) as the boxes that are solved in 3D",
}


def run(arguments: argparse.Namespace) -> int:
    if arguments.boxes:
        from scenes.free.tables import as_toml
        from scenes.keys import SINK
        from scenes.loading import load

        show(as_toml(load(arguments.name, scene_type=SINK).scene()).rstrip("\n"))
    else:
        show(builtin_text(arguments.name).rstrip("\n"))
    return FINE
