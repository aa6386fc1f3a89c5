"""Find where over two keys the 1D model is within a tolerance of 3D: a map of cells. Some hundred cells are
solved, along the line and where neighbours disagree; the others are interpolated. Each has its error.

examples:
  validate map sink --vary sink.width=10um:200um --vary anchor.oxide_length=10um:140um --check fig4 \\
    --tolerance 5%
  validate map sink --vary drive.voltage=0.1:10:log --vary sink.length=0.2mm:2mm --check fig6_end

results: map.csv, points.csv (the solved cells), sweep.json, a figure and report.html
exit status: 0 finished (points without an answer are rows with the reason), 2 bad input, 3 no point has an answer
"""

from __future__ import annotations

import argparse

from scenes.checks import OVER_TIME
from scenes.errors import SceneError, quoted
from validate.cli import common, sweep

CELLS, SOLVES = 100, 400  # Defaults of --cells (along either key) and --solves.


OPTIONS = {
    **sweep.shared("KEY=FROM:TO[:log], twice"),
    "--check ID!": "the check whose line is wanted: fig4, fig6_end, eq14 ...; of a model of your own a probe",
    "--tolerance T": "its tolerance, 5%% (default: the scene's)",
    "--cells N": f"cells along either key, or NxM (default {CELLS})",
    "--solves N": f"at most so many 3D solutions (default {SOLVES})",
}


def run(arguments: argparse.Namespace) -> int:
    from validate.sweep.design import Design, parse

    parts = (arguments.cells or str(CELLS)).split("x")
    if len(parts) > 2:
        raise SceneError(f"--cells {quoted(arguments.cells)} is not allowed: give N, or NxM")
    cells = [common.whole("--cells", part, 2, 1000) for part in parts]
    solves = common.whole("--solves", arguments.solves or str(SOLVES), 16, 1_000_000)
    base, asked = sweep.scene(arguments)
    if base.kind != "sink" and not arguments.model:
        raise SceneError(
            f"{quoted(arguments.scene)} has no 1D model, so there is no line to map: give --model, or validate sweep"
        )
    if len(arguments.vary) != 2:
        raise SceneError(f"a map is over two keys, and {len(arguments.vary)} are varied: give --vary KEY=FROM:TO twice")
    axes = tuple(
        parse(base, text, "range").taken((i + 0.5) / count for i in range(count))
        for text, count in zip(arguments.vary, (cells[0], cells[-1]), strict=True)
    )
    steady = arguments.check not in OVER_TIME
    return sweep.execute(
        arguments, base, asked, Design(axes), steady=steady, solves=solves, tolerance=arguments.tolerance
    )
