"""Traces over time with their errors: of space, of the reduced space, of time stepping and of the rows."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from fem3d import outputs, rows, sink_quantities, transient
from fem3d.reduced import Reduced
from fem3d.sink_quantities import Quantities
from fem3d.steady import SteadyState, reduced_problem
from fem3d.transient import EARLIEST, Krylov, Transient
from meshes.symmetry import Symmetry
from scenes.sink import Sink

IN_PLANE, IN_DEPTH, NEGLIGIBLE = 1.0, 1.5, 0.2  # as for the steady state, with room for more than one instant
ROW_SHARE = 0.25  # part of the accuracy left to linear interpolation between rows
TIME_SHARE = 0.01  # part of the accuracy for time stepping
SPACE_SHARE = 0.1  # part of the accuracy for the reduced space
ROUNDING = 1e-10  # of the scale: nothing is known better
FIELDS, DROPPED, MOST_FIELDS = 6, 2, 60


@dataclass(frozen=True, eq=False)
class Response:
    """Traces and their errors (in their units), the heat balance, and what refinement needs if they are too large."""

    times: np.ndarray
    traces: Quantities
    errors: dict[str, float]
    accepted: bool  # whether the errors are within the accuracy
    imbalance: float  # stored + lost - supplied heat over the supplied, the largest over time
    transient: Transient
    reduced: Reduced
    snapshots: list[np.ndarray]
    deep: bool  # whether degrees in z matter
    relative: dict[str, float] = field(default_factory=dict)  # errors without the rows' own, over their scales


def respond(
    sink: Sink,
    symmetry: Symmetry,
    fine: SteadyState,
    coarse: SteadyState,
    in_z: tuple[SteadyState, SteadyState] | None,
    steady_values: Quantities,
) -> Response:
    """The response of the fine mesh, its error estimated from the coarse one and, where z matters, from two that differ
    by their degrees in z."""
    accuracy, end = sink.accuracy, sink.end_time
    scales = sink_quantities.trace_scales(sink, steady_values)
    checked = np.unique(np.concatenate([np.geomspace(min(EARLIEST, end), end, 40), np.linspace(0, end, 21)[1:]]))

    def traces(response: Transient, times: np.ndarray) -> Quantities:
        return sink_quantities.traces(sink, outputs.of_transient(response, symmetry, times))

    def distance(a: Quantities, b: Quantities) -> dict[str, float]:
        return {name: float(np.abs(a[name] - b[name]).max()) for name in a}

    space = Krylov(fine, transient.shift(fine))
    count = FIELDS + int(max(0.0, -np.log10(accuracy) - 3) * 2)
    while True:
        reduced = reduced_problem(fine, space.fields(count))
        answer = transient.march(fine, reduced, end, TIME_SHARE * accuracy)
        there = traces(answer, checked)
        # One comparison for two errors: fewer fields and a looser step.
        fewer = transient.march(fine, reduced, end, 10 * TIME_SHARE * accuracy, DROPPED)
        lost = distance(there, traces(fewer, checked))
        if max(lost[name] / scales[name] for name in lost) <= SPACE_SHARE * accuracy or count >= MOST_FIELDS:
            break
        count += 4

    def below(state: SteadyState) -> Quantities:
        space = reduced_problem(state, Krylov(state, transient.shift(fine)).fields(count))
        return traces(transient.march(state, space, end, TIME_SHARE * accuracy), checked)

    lesser = below(coarse)
    in_plane = distance(there, lesser)
    in_depth = dict.fromkeys(in_plane, 0.0) if in_z is None else distance(below(in_z[0]), below(in_z[1]))
    errors = {name: IN_PLANE * in_plane[name] + IN_DEPTH * in_depth[name] + lost[name] for name in scales}
    worst = max(errors[name] / scales[name] for name in errors)
    if worst > (1 - ROW_SHARE) * accuracy:
        # Refine for the instants at which the meshes differ most.
        at = {int(np.abs(there[name] - lesser[name]).argmax()) for name in ("peak_K", "end_K", "mean_K")}
        snapshots = list(answer.rises(checked[sorted(at)]))
        deep = max(IN_DEPTH * in_depth[name] / scales[name] for name in scales) > NEGLIGIBLE * accuracy
        return Response(checked, there, errors, False, np.nan, answer, reduced, snapshots, deep)
    return _with_rows(sink, symmetry, answer, reduced, errors, scales)


def repeat(
    sink: Sink, symmetry: Symmetry, fine: SteadyState, reduced: Reduced, steady_values: Quantities, before: Response
) -> Response:
    """The response at another voltage, in the reduced problem of an earlier one, which has the same relative errors."""
    scales = sink_quantities.trace_scales(sink, steady_values)
    answer = transient.march(fine, reduced, sink.end_time, TIME_SHARE * sink.accuracy)
    errors = {name: before.relative[name] * scale for name, scale in scales.items()}
    return _with_rows(sink, symmetry, answer, reduced, errors, scales)


def _with_rows(
    sink: Sink,
    symmetry: Symmetry,
    answer: Transient,
    reduced: Reduced,
    errors: dict[str, float],
    scales: dict[str, float],
) -> Response:
    """The response at as many rows as the accuracy takes; ``errors`` are those at any time without the rows' own."""

    def traces(times: np.ndarray) -> Quantities:
        return sink_quantities.traces(sink, outputs.of_transient(answer, symmetry, times))

    allowed = {name: ROW_SHARE * sink.accuracy * scale for name, scale in scales.items()}
    times, found, between = rows.choose(answer.trajectory.steps, traces, allowed)
    relative = {name: errors[name] / scales[name] for name in errors}
    errors = {name: errors[name] + between[name] + ROUNDING * scales[name] for name in errors}
    imbalance = _imbalance(answer, symmetry)
    return Response(times, found, errors, True, imbalance, answer, reduced, [], False, relative)


def _imbalance(answer: Transient, symmetry: Symmetry) -> float:
    """Largest |stored + lost - supplied| over the heat supplied until then, from the earliest time of interest on.

    The integrals over time run over the steps by Gauss's rule, apart from how the steps were made; what is lost comes
    from the reactions of the full equations, so the figure sees the error of the reduced space too.
    """
    points, weights = np.polynomial.legendre.leggauss(12)
    steps = answer.trajectory.steps
    # The loss starts like a power of t below any step: halve the first step's interval a few times.
    edges = np.concatenate([steps[0].length * 0.25 ** np.arange(8, 0, -1), [s.start + s.length for s in steps]])
    edges = np.concatenate([[0.0], edges])
    times = (edges[:-1, None] + np.diff(edges)[:, None] * (points + 1) / 2).ravel()
    out = outputs.of_transient(answer, symmetry, times)
    entered = out["power"] + sum(v for name, v in out.items() if name.startswith("flow:"))
    per_step = np.diff(edges) / 2

    def until(rate: np.ndarray) -> np.ndarray:
        return np.cumsum(per_step * (rate.reshape(-1, len(points)) @ weights))

    supplied = until(np.abs(out["power"]))
    gap = np.abs(outputs.stored_heat(answer, symmetry, edges[1:]) - until(entered))
    late = edges[1:] >= min(EARLIEST, edges[-1])
    return float((gap / np.maximum(supplied, 1e-300))[late].max())
