"""This toolkit's models of the sink, as their users call them: ``options`` are ``transient`` and either the
``accuracy`` that is asked of the 3D model or the name of a ``reduction``."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from scenes.loading import load
from scenes.plan import Request
from scenes.result import Result
from validate.bench.problem import QUANTITIES, TIMES


def prepare(options: dict[str, Any]) -> tuple[Callable[[], Result], Callable[[Result], dict[str, Any]]]:
    """Solve, and read the numbers; traces are interpolated linearly between rows, as their users do."""
    reduction = options.get("reduction")
    sink = load("sink", [] if reduction else [f"accuracy={options['accuracy']}"])
    solve: Callable[[], Result]
    if reduction:
        from reduced1d import ladder

        def solve() -> Result:
            return ladder.solve(sink, reduction, steady_only=not options["transient"])
    else:
        from fem3d import run

        def solve() -> Result:
            return run.solve(sink, Request(transient=options["transient"], figures=False))

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
        found = {"values": values, "steady": steady}
        if reduction:
            # The plate's states are modes of its unknowns; the others have no mesh, or only borrow from the plate's.
            return found | {"unknowns": result.details["unknowns" if reduction == "plate" else "states"], "steps": 0}
        return found | {"unknowns": result.details["unknowns"], "steps": result.details["steps"], "claimed": claimed}

    return solve, read
