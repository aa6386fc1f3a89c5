"""A reduction: ``options`` are its name in ``reduction``, and whether the transient is wanted."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from reduced1d import ladder
from scenes.loading import load
from scenes.result import Result
from validate.bench.sample import QUANTITIES, TIMES


def prepare(options: dict[str, Any]) -> tuple[Callable[[], Result], Callable[[Result], dict[str, Any]]]:
    """Solve, and read the numbers, like those of the 3D model."""
    sink = load("sink", [])

    def solve() -> Result:
        return ladder.solve(sink, options["reduction"], steady_only=not options["transient"])

    def read(result: Result) -> dict[str, Any]:
        values = steady = {q: [result.steady[q].value] for q in QUANTITIES}
        if (traces := result.traces) is not None:
            values = {"current_A": list(np.interp(TIMES, traces.time, traces.values["current_A"]))}
            for q in QUANTITIES[:3]:
                rise = traces.values[q.replace("_rise", "")] - sink.room_temperature
                values[q] = list(np.interp(TIMES, traces.time, rise))
        # The plate's states are modes of its unknowns; the other models have no mesh, or only borrow from the plate's.
        unknowns = result.details["unknowns" if options["reduction"] == "plate" else "states"]
        return {"values": values, "steady": steady, "unknowns": unknowns, "steps": 0}

    return solve, read
