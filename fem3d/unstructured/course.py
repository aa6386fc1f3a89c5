"""The transient of a scene on a mesh, level by level, with the errors of space, of the reduced space, of time stepping
and of the rows."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fem3d import rows, start, transient
from fem3d.outputs import passing
from fem3d.probe_quantities import CAUTION
from fem3d.study import Quantities, Study
from fem3d.time_response import (
    DROPPED,
    FIELDS,
    MOST_FIELDS,
    NOTHING,
    ROUNDING,
    ROW_SHARE,
    SPACE_SHARE,
    TIME_SHARE,
    instants,
)
from fem3d.transient import Krylov, shift
from fem3d.unstructured import errors
from fem3d.unstructured.level import Level, finest
from fem3d.unstructured.outputs import Response
from meshes.grouped.place import Placed


@dataclass(frozen=True, eq=False)
class Course:
    """Traces over time (s) and their errors, in their units and relative to their scales, of the last level."""

    level: Level
    response: Response
    times: np.ndarray
    traces: Quantities
    errors: dict[str, float]
    relative: dict[str, float]
    imbalance: float
    levels: int


@dataclass(frozen=True, eq=False)
class _Answer:
    level: Level
    response: Response
    there: Quantities
    lost: dict[str, float]
    scales: dict[str, float]


def solve(placed: Placed, study: Study, say: Callable[[str], None]) -> Course:
    """The transient on as many levels as the accuracy takes and the mesh allows."""
    slowest, count = study.end, 0
    before: _Answer | None = None
    found: dict[str, float] | None = None
    for level in finest(placed):
        say(f"{level.words}: {level.heat.free} unknowns")
        answer, count = _respond(level, study, shift(slowest, study.earliest)), count + 1
        rates = answer.response.transient.trajectory.rates
        slowest = min(study.end, float(1 / max(rates.min(), 1e-300)))
        if before is not None:
            found = _errors(study, answer, before)
            if max((e / answer.scales[n] for n, e in found.items()), default=0.0) <= (1 - ROW_SHARE) * study.accuracy:
                break
        before = answer
    assert found is not None, "there are two levels at least"
    return _with_rows(study, answer, found, count)


def _respond(level: Level, study: Study, g: float) -> _Answer:
    """The response of a level at the instants where levels are compared."""
    accuracy, end = study.accuracy, study.end
    base = start.of(level.heat, level.conductor, g, end, accuracy)
    checked = instants(study, level.heat)
    space = Krylov(base, g)
    generations = FIELDS + int(max(0.0, -np.log10(accuracy) - 3) * 2)
    while True:
        reduced = base.project(space.fields(generations))
        response = Response(transient.march(base, reduced, end, TIME_SHARE * accuracy))
        out = response(checked)
        there, scales = study.traces(out), study.trace_scales(out)
        dropped = space.dropped(generations, DROPPED)
        fewer = Response(transient.march(base, reduced, end, 10 * TIME_SHARE * accuracy, dropped), response)
        lost = _distance(there, study.traces(fewer(checked)))
        enough = max((lost[n] / scales[n] for n in lost), default=0.0) <= SPACE_SHARE * accuracy
        if enough or generations >= MOST_FIELDS or not dropped:
            return _Answer(level, response, there, lost, scales)
        generations += 4


def _errors(study: Study, fine: _Answer, coarse: _Answer) -> dict[str, float]:
    times = np.array([0.1, 1.0]) * study.end
    pairs = list(zip(fine.response.transient.rises(times), coarse.response.transient.rises(times), strict=True))
    least = errors.LEAST * errors.apart(fine.level, coarse.level, pairs)
    apart = _distance(fine.there, coarse.there)
    caution = {n: CAUTION * errors.factor(fine.level) * study.caution.get(n, 1.0) for n in apart}
    return {n: caution[n] * d + least * fine.scales[n] + fine.lost[n] for n, d in apart.items()}


def _with_rows(study: Study, answer: _Answer, found: dict[str, float], levels: int) -> Course:
    response, scales = answer.response, answer.scales
    allowed = {name: ROW_SHARE * study.accuracy * scale for name, scale in scales.items()}
    drive = answer.level.heat.inputs
    jumps = [float(t) for t in drive.knots(study.end) if drive.jump(float(t)).any()]
    times, traces, between = rows.choose(
        response.transient.trajectory.steps, lambda t: study.traces(response(t)), allowed, jumps, study.instants
    )
    total = {name: found[name] + between[name] + ROUNDING * scales[name] for name in found}
    relative = {name: e / scales[name] for name, e in total.items()}
    return Course(answer.level, response, times, traces, total, relative, _imbalance(study, response), levels)


def _distance(a: Quantities, b: Quantities) -> dict[str, float]:
    return {name: float(np.abs(a[name] - b[name]).max()) for name in a}


def _imbalance(study: Study, response: Response) -> float:
    """|stored - entered| over what came or went, at the ends of steps: the largest from the earliest time of interest.

    Gauss's rule over each step, the first cut finer where the flow starts like a power of t; as in
    `fem3d.time_response`.
    """
    points, weights = np.polynomial.legendre.leggauss(12)
    steps = response.transient.trajectory.steps
    edges = np.concatenate([steps[0].length * 0.25 ** np.arange(8, 0, -1), [s.start + s.length for s in steps]])
    edges = np.concatenate([[0.0], edges])
    half = np.diff(edges) / 2
    out = response((edges[:-1, None] + half[:, None] * (points + 1)).ravel())
    flows = [v for name, v in out.items() if name.startswith("flow:")]
    none = np.zeros_like(out["power"])

    def until(rate: np.ndarray) -> np.ndarray:
        found: np.ndarray = np.cumsum(half * (rate.reshape(-1, len(points)) @ weights))
        return found

    entered = until(out["power"] + out["generated"] + sum(flows, none))
    passed = np.maximum(*(until(part) for part in passing(out)))
    drive = response.base.heat.inputs
    stored = response.stored(np.maximum(edges[1:] * (1 - 1e-12), edges[:-1]))
    jumps = np.array([i == 0 or bool(drive.jump(float(t)).any()) for i, t in enumerate(edges[:-1])])
    # Where a given temperature jumps, what its nodes store at that instant has entered there.
    jumped = np.where(jumps, response.stored(edges[:-1]) - np.concatenate([[0.0], stored[:-1]]), 0.0)
    gap = np.abs(stored - entered - np.cumsum(jumped))
    late = edges[1:] >= min(study.earliest, edges[-1])
    heat = response.base.heat
    least = NOTHING * float(heat.mass.sum()) * max(heat.placed.scene.initial_temperature, 1.0)
    return float((gap / np.maximum(passed + np.cumsum(np.abs(jumped)), least))[late].max())
