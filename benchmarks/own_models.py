"""This toolkit's models as their users call them: the sink in 3D, its reductions, and the whole sensor in 1D."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks.sink_programs import QUANTITIES, TIMES
from scenes.loading import load
from scenes.result import Result
from scenes.sink import Sink

Prepared = tuple[Callable[[], Any], Callable[[Any], dict[str, Any]]]


def prepare(options: dict[str, Any]) -> Prepared:
    """Return the timed part of a model and the reading of its numbers."""
    if options["model"] == "device":
        return _device(options)
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


def _device(options: dict[str, Any]) -> Prepared:
    """The device to an ``end_time``, by the accurate scheme at an ``accuracy`` or by the paper's ``scheme``."""
    from reduced1d.device.schemes import PaperScheme, paper_traces, solve_accurate
    from scenes.keys import DEVICE

    device = replace(load("device", [], scene_type=DEVICE), end_time=options["end_time"])

    def solve() -> np.ndarray:
        if "scheme" in options:
            return np.asarray(paper_traces(device, PaperScheme(*options["scheme"]))[0][:, :2].T)
        traces = solve_accurate(replace(device, accuracy=options["accuracy"]))
        return np.array([traces.sink_K, traces.sensor_K]) - device.sink.room_temperature

    return solve, lambda rises: {"values": (rises / device.set_rise).tolist()}
