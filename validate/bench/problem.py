"""What every entry is given: cells, steps in time and methods; and the numbers that entries are compared by.

The cells are those that this toolkit starts with for an accuracy, cut further: graded towards the singular edges with
its knowledge of the exponents, which a user of another program would have to work out or find by trial; all entries
share them so that a comparison is of solvers, not of patience.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from meshes import grading, symmetry
from meshes.grid import Grid
from scenes.model import Scene
from scenes.result import Result
from scenes.sink import Sink
from validate.verify import methods

QUANTITIES = ("peak_rise_K", "end_rise_K", "mean_rise_K", "current_A")
END = 0.02  # s, of the default sink
# Octaves from 10 us on; tools that step in time have them among their steps, so that none pays for interpolation
# but those that report traces to be interpolated.
TIMES = (*(1e-5 * 2.0**k for k in range(11)), END)
# Intervals within which steps are equal: each four times as long as the one before, one factorization each.
EDGES = (0.0, *(1e-5 * 4.0**k for k in range(6)), END)

Values = Mapping[str, Sequence[float]]
Answer = tuple[int, list[list[float]]]  # unknowns, and the quantities of each instant


def step_times(per_interval: int) -> np.ndarray:
    """Times (s) of equal steps within each of EDGES; three times ``per_interval`` where TIMES lie at the thirds."""
    times = [np.zeros(1)]
    for i, (a, b) in enumerate(pairwise(EDGES)):
        n = per_interval * (3 if 0 < i < len(EDGES) - 2 else 1)
        times.append(a + (b - a) * np.arange(1, n + 1) / n)
    return np.concatenate(times)


def at_times(times: np.ndarray) -> list[int]:
    """Where TIMES are among some times; ValueError where one is not."""
    indices = [int(np.abs(times - t).argmin()) for t in TIMES]
    if any(abs(times[i] - t) > 1e-9 * t for i, t in zip(indices, TIMES, strict=True)):
        raise ValueError("an instant of the comparison is not among the steps")
    return indices


def stepped(
    options: Mapping[str, Any], assemble: Callable[[], Any]
) -> tuple[Callable[[], Answer], Callable[[Answer], dict[str, Any]]]:  # fmt: skip
    """``prepare`` of a program whose matrices `verify.methods` step or settle: ``assemble`` makes its problem, which
    has the ``quantities`` of a state too."""

    def solve() -> Answer:
        problem, tolerance = assemble(), options["tolerance"]
        if not options["transient"]:
            return problem.unknowns, [problem.quantities(methods.settle(problem, tolerance))]
        times = step_times(options["steps"])
        states, wanted = methods.march(problem, times, options["method"], tolerance), at_times(times)
        return problem.unknowns, [problem.quantities(rise) for i, (rise, _) in enumerate(states) if i in wanted]

    return solve, lambda answer: numbers(options, *answer)


def numbers(options: Mapping[str, Any], unknowns: int, rows: Sequence[Sequence[float]] | np.ndarray) -> dict[str, Any]:
    """What a tool reads out of its answer: the quantities of each instant, or of the steady state, in a row."""
    steps = len(step_times(options["steps"])) - 1 if options["transient"] else 0
    values = dict(zip(QUANTITIES, np.array(rows).T.tolist(), strict=True))
    return {"values": values, "unknowns": unknowns, "steps": steps}


def read(result: Result, sink: Sink) -> dict[str, Any]:
    """The quantities of one of this toolkit's models at each of TIMES, interpolated linearly between its rows as users
    do, or its steady state's; the steady ones anyway; and the largest error that it claims of one, relative to that."""
    steady = {q: [result.steady[q].value] for q in QUANTITIES}
    values, traces = steady, result.traces
    claimed = {q: result.steady[q].error for q in QUANTITIES}
    if traces is not None:
        names = {q: q.replace("_rise", "") for q in QUANTITIES}
        room = {q: 0.0 if q == name else sink.room_temperature for q, name in names.items()}
        values = {q: list(np.interp(TIMES, traces.time, traces.values[name] - room[q])) for q, name in names.items()}
        claimed = {q: traces.errors[name] for q, name in names.items()}
    return {"values": values, "steady": steady, "claimed": max(claimed[q] / abs(steady[q][0]) for q in QUANTITIES)}


def errors(values: Values, reference: Values, steady: Values) -> dict[str, float]:
    """The largest error of each quantity at all instants, or in the steady state, relative to its ``steady`` value."""
    return {q: float(np.abs(np.subtract(values[q], reference[q])).max()) / abs(steady[q][-1]) for q in QUANTITIES}


def quarter(sink: Sink) -> Scene:
    return symmetry.reduce(sink.scene()).scene


def graded(scene: Scene, accuracy: float, cuts: int, degree: int, layers: int | None = None) -> Grid:
    """The first grid for an accuracy, each interval in ``cuts`` equal pieces but for those across thin layers, which
    stay whole; of one degree everywhere, or of another one (``layers``) across those."""
    breaks, degrees = [], []
    first = grading.first_grid(scene, accuracy, grading.features(scene))
    for old, axis_degrees in zip(first.breaks, first.degrees, strict=True):
        thin = axis_degrees < grading.LEAST_AT_EDGE
        count = np.where(thin, 1, cuts)
        inner = [np.linspace(a, b, n, endpoint=False) for a, b, n in zip(old, old[1:], count, strict=False)]
        breaks.append(np.append(np.concatenate(inner), old[-1]))
        degrees.append(np.repeat(np.where(thin, degree if layers is None else layers, degree), count))
    return first.with_axes(breaks, degrees)
