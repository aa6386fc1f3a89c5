"""This toolkit's models of the sink as their users call them: in 3D, and its reductions."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.sink_programs import QUANTITIES, TIMES
from scenes.loading import load
from scenes.result import Result
from scenes.sink import Sink


def prepare(options: dict[str, Any]) -> tuple[Callable[[], Any], Callable[[Any], dict[str, Any]]]:
    """Return the timed part of a model and the reading of its numbers."""
    sink = load("sink", [f"accuracy={options['accuracy']}"] if "accuracy" in options else [])
    name, transient = options["model"], options["transient"]
    if name == "3d":
        from fem3d.runs.sink import solve

        return lambda: solve(sink, transient), lambda result: _read(sink, result)
    from reduced1d import ladder

    return lambda: ladder.solve(sink, name, steady_only=not transient), lambda result: _read(sink, result)


def _read(sink: Sink, result: Result) -> dict[str, Any]:
    """The quantities at each of `TIMES`, linear between the rows of traces, or in the steady state, with the largest
    error bound that the model states, relative to the steady value."""
    values = {q: [result.steady[q].value] for q in QUANTITIES}
    bounds = {q: result.steady[q].error or 0.0 for q in QUANTITIES}
    steady = {q: each[0] for q, each in values.items()}
    if result.traces is not None:
        for q in QUANTITIES:
            name = q.replace("_rise", "")
            start = sink.room_temperature if name != q else 0.0
            values[q] = (np.interp(TIMES, result.traces.time, result.traces.values[name]) - start).tolist()
            bounds[q] = result.traces.errors.get(name, 0.0)
    size = result.details.get("unknowns", result.details.get("states"))
    bound = max(bounds[q] / abs(steady[q]) for q in QUANTITIES)
    return {"values": values, "unknowns": size, "bound": bound}
