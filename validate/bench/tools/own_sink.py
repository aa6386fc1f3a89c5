"""This toolkit's 3D model of the sink, as its users call it: ``options`` are ``transient`` and the ``accuracy``."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from fem3d.runs import sink as sink_run
from scenes.loading import load
from scenes.result import Result
from validate.bench.problem import read


def prepare(options: dict[str, Any]) -> tuple[Callable[[], Result], Callable[[Result], dict[str, Any]]]:
    """Solve, and read the numbers."""
    sink = load("sink", [f"accuracy={options['accuracy']}"])
    kept = ("unknowns", "steps")
    return lambda: sink_run.solve(
        sink, options["transient"]
    ), lambda result: read(result, sink) | {n: result.details[n] for n in kept}
