"""The default sink with one skip of the plan on or off: ``options`` are the ``skip``, whether it is ``off`` and the
``accuracy``, or the ``arguments`` of a whole `validate` command from cold, timed on the wall as its user waits for it.

What is switched is the input of the solver (the part that is solved, the request, the scene), never a flag made for
this.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from fem3d import adapt, run, sink_quantities
from meshes import symmetry
from meshes.symmetry import Flow, Symmetry
from scenes.loading import load
from scenes.plan import Request
from scenes.sink import Sink

Job = Callable[[], object]


def prepare(options: dict[str, Any]) -> tuple[Job, Callable[[object], dict[str, Any]]]:
    """The job with the skip on, or without it."""
    if "arguments" in options:
        return lambda: _command(options["arguments"]), lambda seconds: {"seconds": [seconds]}
    job = SKIPS[options["skip"]](load("sink", [f"accuracy={options['accuracy']}"]), bool(options["off"]))
    return job, lambda _: {}


def _command(arguments: list[str]) -> float:
    """The seconds of a command with its results in a folder that is removed."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "validate", *arguments, "--quiet", "--out", folder + "/run"]
        started = time.perf_counter()
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        return time.perf_counter() - started


def _symmetry(sink: Sink, off: bool) -> Job:
    part = _whole(sink) if off else symmetry.reduce(sink.scene())
    return lambda: adapt.solve(sink_quantities.study(sink, part), True)


def _whole(sink: Sink) -> Symmetry:
    scene = sink.scene()
    flows = {b.name: Flow(b.name, 1.0, 1.0) for b in scene.boundaries}
    return Symmetry(scene, (), 1, flows, {b.name: 1.0 for b in scene.boxes}, {p.name: (1.0, ()) for p in scene.probes})


def _transient(sink: Sink, off: bool) -> Job:
    return lambda: run.solve(sink, Request(transient=off))


def _second_voltage(sink: Sink, off: bool) -> Job:
    earlier = None if off else run.solve(sink, Request())
    return lambda: run.solve(replace(sink, voltage=2 * sink.voltage), Request(), earlier=earlier)


SKIPS: dict[str, Callable[[Sink, bool], Job]] = {
    "symmetry": _symmetry,
    "transient": _transient,
    "second voltage": _second_voltage,
}
