"""The default sink with one skip of the plan on or off: ``options`` are its name and whether it is ``off``.

What is switched is the input of the solver (the part that is solved, the request, the scene) or the threshold from
which a step counts as needed, never a flag made for this.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from fem3d import adapt, level, run, sink_quantities, steady, time_response
from meshes import connected, symmetry
from meshes.symmetry import Flow, Symmetry
from scenes.loading import load
from scenes.model import Scene
from scenes.plan import Request
from scenes.sink import Sink

Job = Callable[[], object]


def prepare(options: dict[str, Any]) -> tuple[Job, Callable[[object], dict[str, Any]]]:
    """The job with the skip on, or without it."""
    job = SKIPS[options["skip"]](load("sink", [f"accuracy={options['accuracy']}"]), bool(options["off"]))
    return job, lambda _: {}


def _symmetry(sink: Sink, off: bool) -> Job:
    part = _whole(sink) if off else symmetry.reduce(sink.scene())
    return lambda: adapt.solve(sink_quantities.study(sink, part), True)


def _whole(sink: Sink) -> Symmetry:
    scene = sink.scene()
    flows = {b.name: Flow(b.name, 1.0, 1.0) for b in scene.boundaries}
    return Symmetry(scene, (), 1, flows, {b.name: 1.0 for b in scene.boxes}, {p.name: (1.0, ()) for p in scene.probes})


def _pattern(sink: Sink, off: bool) -> Job:
    if off:
        steady.UNIFORM = 0.0
    return lambda: run.solve(sink, Request())


def _dead_parts(sink: Sink, off: bool) -> Job:
    if off:
        connected.live = _conducting  # type: ignore[assignment]
    return lambda: run.solve(sink, Request())


def _conducting(scene: Scene) -> np.ndarray:
    """All cells that conduct, as `connected.live` gives those that carry current."""
    return np.isin(connected.coarsest(scene).owner, sorted(connected.conducting(scene)))


def _depth(sink: Sink, off: bool) -> Job:
    if off:
        level.NEGLIGIBLE = time_response.NEGLIGIBLE = 0.0
    return lambda: run.solve(sink, Request())


def _transient(sink: Sink, off: bool) -> Job:
    return lambda: run.solve(sink, Request(transient=off))


def _second_voltage(sink: Sink, off: bool) -> Job:
    earlier = None if off else run.solve(sink, Request())
    return lambda: run.solve(replace(sink, voltage=2 * sink.voltage), Request(), earlier=earlier)


SKIPS: dict[str, Callable[[Sink, bool], Job]] = {
    "symmetry": _symmetry,
    "pattern": _pattern,
    "dead parts": _dead_parts,
    "depth": _depth,
    "transient": _transient,
    "second voltage": _second_voltage,
}
