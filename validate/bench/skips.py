"""What each skip of the plan saves: the default sink with it and without it, in turns.

What is switched is the input of the solver (the part that is solved, the request, the scene), never a flag made for
this. Whole `validate` commands are timed from cold, on the wall as their user waits for them.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from validate.bench import measure
from validate.bench.entries import Entry

ACCURACY, QUICK_ACCURACY = 1e-3, 1e-2
SOLVER = {
    "symmetry": "symmetry: a quarter is solved in place of the whole",
    "transient": "transient (`--steady`)",
    "second voltage": "mesh, factorization and fields of a second voltage (those of the first serve)",
}
PLAIN = ["sink", "--no-figures"]
COMMANDS = {
    "figures (`--no-figures`), whole command from cold": (PLAIN, ["sink"]),
    "3D model (`--only 1d --no-figures`), whole command from cold": ([*PLAIN, "--only", "1d"], PLAIN),
    "fields: not written without `--fields`, whole command from cold": (PLAIN, [*PLAIN, "--fields"]),
}


def run(quick: bool, count: int, progress: Callable[[str], None]) -> list[dict[str, Any]]:
    """A row for each skip: median seconds with it and without."""
    accuracy = QUICK_ACCURACY if quick else ACCURACY
    pairs: dict[str, list[dict[str, Any]]] = {
        name: [{"skip": skip, "off": off, "accuracy": accuracy} for off in (False, True)]
        for skip, name in list(SOLVER.items())[: 2 if quick else None]
    }
    for name, both in list(COMMANDS.items())[: 1 if quick else None]:
        pairs[name] = [{"arguments": arguments} for arguments in both]
    entries = [Entry(name, ("on", "off")[i], "skips", both[i]) for name, both in pairs.items() for i in (0, 1)]
    rows = measure.in_turns(entries, count, progress, not quick)
    return [
        {"skip": name, "failure": on["failure"] or off["failure"], "on_s": on.get("median_s"),
         "off_s": off.get("median_s")}
        for name, on, off in zip(pairs, rows[::2], rows[1::2], strict=True)
    ]  # fmt: skip


def prepare(options: dict[str, Any]) -> tuple[Callable[[], Any], Callable[[Any], dict[str, Any]]]:
    """The job with the skip on, or without it; or a command."""
    if "arguments" in options:
        return lambda: _command(options["arguments"]), lambda seconds: {"seconds": [seconds]}
    from fem3d import adapt, sink_quantities
    from fem3d.run import solve
    from meshes import symmetry
    from scenes.loading import load
    from scenes.plan import Request

    sink, off = load("sink", [f"accuracy={options['accuracy']}"]), options["off"]
    if options["skip"] == "transient":
        return lambda: solve(sink, Request(transient=off)), lambda _: {}
    if options["skip"] == "second voltage":
        earlier = None if off else solve(sink, Request())
        twice = replace(sink, voltage=2 * sink.voltage)
        return lambda: solve(twice, Request(), earlier=earlier), lambda _: {}
    scene = sink.scene()
    part = symmetry.uncut(scene, [box.name for box in scene.boxes]) if off else symmetry.reduce(scene)
    return lambda: adapt.solve(sink_quantities.study(sink, part), True), lambda _: {}


def _command(arguments: list[str]) -> float:
    """The seconds of a command with its results in a folder that is removed."""
    with tempfile.TemporaryDirectory() as folder:
        return measure.waited(sys.executable, "-m", "validate", *arguments, "--quiet", "--out", folder + "/run")
