"""This toolkit's models of the sink as their users call them: in 3D, and its reductions."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from benchmarks.sink_programs import QUANTITIES, TIMES, Prepared
from fem3d.runs import sink as sinks
from reduced1d import ladder
from scenes.loading import load
from scenes.result import Result
from scenes.sink import Sink


def prepare(options: dict[str, Any]) -> Prepared:
    """Return the timed part of a model and the reading of its numbers."""
    sink = load("sink", [f"accuracy={options['accuracy']}"] if "accuracy" in options else [])
    name, transient = options["model"], options["transient"]

    def solve() -> Result:
        return sinks.solve(sink, transient) if name == "3d" else ladder.solve(sink, name, steady_only=not transient)

    return solve, partial(_read, sink)


def _read(sink: Sink, result: Result) -> dict[str, Any]:
    """The quantities at each of `TIMES`, linear between the rows of traces, or in the steady state, with the largest
    error bound that the model states, relative to the steady value."""
    steady = {q: result.steady[q] for q in QUANTITIES}
    values, bounds = {q: [e.value] for q, e in steady.items()}, {q: e.error for q, e in steady.items()}
    if result.traces is not None:
        for q in QUANTITIES:
            name = q.replace("_rise", "")
            start = sink.room_temperature if name != q else 0.0
            values[q] = (np.interp(TIMES, result.traces.time, result.traces.values[name]) - start).tolist()
            bounds[q] = result.traces.errors.get(name, 0.0)
    size = result.details.get("unknowns", result.details.get("states"))
    bound = max(bounds[q] / abs(steady[q].value) for q in QUANTITIES)
    return {"values": values, "unknowns": size, "bound": bound}
