"""This toolkit's 3D solver: ``options`` are the accuracy that is asked for, and whether the transient is."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from fem3d import run
from scenes.loading import load
from scenes.plan import Request
from scenes.result import Result
from validate.bench.sample import QUANTITIES, TIMES


def prepare(options: dict[str, Any]) -> tuple[Callable[[], Result], Callable[[Result], dict[str, Any]]]:
    """Solve, and read the numbers; traces are interpolated linearly between rows, as their users do."""
    sink = load("sink", [f"accuracy={options['accuracy']}"])
    request = Request(transient=options["transient"], figures=False)

    def read(result: Result) -> dict[str, Any]:
        steady = {q: [result.steady[q].value] for q in QUANTITIES}
        claimed = max(result.steady[q].error / abs(steady[q][0]) for q in QUANTITIES)
        values, traces = steady, result.traces
        if traces is not None:
            values = {"current_A": list(np.interp(TIMES, traces.time, traces.values["current_A"]))}
            claimed = traces.errors["current_A"] / abs(steady["current_A"][0])
            for q in QUANTITIES[:3]:
                trace = q.replace("_rise", "")
                values[q] = list(np.interp(TIMES, traces.time, traces.values[trace] - sink.room_temperature))
                claimed = max(claimed, traces.errors[trace] / abs(steady[q][0]))
        details = {"unknowns": result.details["unknowns"], "steps": result.details["steps"], "claimed": claimed}
        return {"values": values, "steady": steady, **details}

    return lambda: run.solve(sink, request), read
