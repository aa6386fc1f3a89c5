"""What each skip of the plan saves: the default sink with it and without it, in turns.

What is switched is the input of the solver (the part that is solved, the request, the scene), never a flag made for
this. Whole `validate` commands are timed from cold, on the wall as their user waits for them.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
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
COMMANDS = {
    "figures (`--no-figures`), whole command from cold": (["sink", "--no-figures"], ["sink"]),
    "3D model (`--only 1d --no-figures`), whole command from cold": (
        ["sink", "--only", "1d", "--no-figures"], ["sink", "--no-figures"],
    ),
    "fields: not written without `--fields`, whole command from cold": (
        ["sink", "--no-figures"], ["sink", "--no-figures", "--fields"],
    ),
}  # fmt: skip


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
    measured = measure.in_turns(entries, count, progress, not quick)
    return [
        {"skip": name, "failure": on.failure or off.failure, "on_s": on.median_s, "off_s": off.median_s}
        for name, on, off in zip(pairs, measured[::2], measured[1::2], strict=True)
    ]


def prepare(options: dict[str, Any]) -> tuple[Callable[[], Any], Callable[[Any], dict[str, Any]]]:
    """The job with the skip on, or without it; or a command."""
    if "arguments" in options:
        return lambda: _command(options["arguments"]), lambda seconds: {"seconds": [seconds]}
    from fem3d import adapt, sink_quantities
    from fem3d.run import solve
    from meshes import symmetry
    from meshes.symmetry import Flow, Symmetry
    from scenes.loading import load
    from scenes.plan import Request

    sink, off = load("sink", [f"accuracy={options['accuracy']}"]), options["off"]
    if options["skip"] == "transient":
        return lambda: solve(sink, Request(transient=off)), lambda _: {}
    if options["skip"] == "second voltage":
        earlier = None if off else solve(sink, Request())
        twice = replace(sink, voltage=2 * sink.voltage)
        return lambda: solve(twice, Request(), earlier=earlier), lambda _: {}
    scene, part = sink.scene(), symmetry.reduce(sink.scene())
    if off:
        flows = {b.name: Flow(b.name, 1.0, 1.0) for b in scene.boundaries}
        probes: dict[str, Any] = {p.name: (1.0, ()) for p in scene.probes}
        part = Symmetry(scene, (), 1, flows, {b.name: 1.0 for b in scene.boxes}, probes)
    return lambda: adapt.solve(sink_quantities.study(sink, part), True), lambda _: {}


def _command(arguments: list[str]) -> float:
    """The seconds of a command with its results in a folder that is removed."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "validate", *arguments, "--quiet", "--out", folder + "/run"]
        started = time.perf_counter()
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        return time.perf_counter() - started
