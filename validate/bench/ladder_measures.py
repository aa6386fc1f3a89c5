"""What the table of the reductions measures: distances from 3D, and times."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from compare.verdict import FIRST_TIME

if TYPE_CHECKING:
    from reduced1d.ladder.levels import Levels
    from scenes.result import Result
    from scenes.sink import Sink

REPEATS = 7
"""Runs of which a time is the smallest, for what else the machine does only adds to it."""


def scales(fem3d: Result) -> dict[str, float]:
    """What differences are relative to, by trace."""
    assert fem3d.traces is not None
    cold = float(fem3d.traces.values["current_A"][0])
    return {
        "peak_K": fem3d.steady["peak_rise_K"].value,
        "end_K": fem3d.steady["end_rise_K"].value,
        "current_A": abs(fem3d.steady["current_A"].value - cold),
    }


def errors(found: Result, fem3d: Result) -> list[float]:
    """The largest distances of peak, end and current, relative."""
    assert found.traces is not None
    assert fem3d.traces is not None
    late = fem3d.traces.time >= FIRST_TIME
    return [
        float(np.abs(found.traces.values[key] - fem3d.traces.values[key])[late].max()) / scale
        for key, scale in scales(fem3d).items()
    ]


def times_of(sink: Sink, name: str) -> tuple[float | None, float]:
    """Seconds to build a reduction (``None`` for the paper's, which has nothing to build) and to evaluate it."""
    from reduced1d import ladder
    from reduced1d.ladder.answer import over_time
    from reduced1d.ladder.levels import Levels

    times = grid(sink.end_time)
    if name == "paper":
        return None, timed(lambda: ladder.solve(sink, name, times=times))

    def build(levels: Levels) -> object:
        return ladder.build(levels.fine, name)

    model = ladder.build(Levels(sink).fine, name)
    return timed(lambda: build(Levels(sink))), timed(lambda: over_time(model, times))


def timed(call: Callable[[], object]) -> float:
    """The processor time of a call, the shortest of some (s)."""
    found = []
    for _ in range(REPEATS):
        started = time.process_time()
        call()
        found.append(time.process_time() - started)
    return min(found)


def grid(end: float) -> np.ndarray:
    """The times (s) of a transient whose evaluation is timed."""
    return np.concatenate([[0.0], np.geomspace(FIRST_TIME / 10, end, 200)])
