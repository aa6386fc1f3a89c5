"""The response of one space over time: in as many fields as the accuracy takes, or at full order where properties
follow the temperature."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from fem3d.problems.heat import HeatProblem
from fem3d.problems.linearized import at_films, linearized
from fem3d.results import outputs
from fem3d.results.outputs import Outputs, Response
from fem3d.results.study import Quantities, Study
from fem3d.solution import transient
from fem3d.solution.march import FullResponse, march_full, refine_quadratures
from fem3d.solution.transient import Base, Krylov
from scenes.errors import BeyondLawError, RunawayInTimeError

TIME_SHARE = 0.01  # part of the accuracy for time stepping
SPACE_SHARE = 0.1  # part of the accuracy for the reduced space
FIELDS, DROPPED, MOST_FIELDS = 6, 2, 60  # generations of Krylov fields: the first trial, how many fewer, the most
SAME_TIME = 0.05  # relative change of the time of a runaway with more fields, which counts as none
LOOSER = 10.0  # factor between the tolerances of steps that tell the error of space and of an answer's
# Global errors are in proportion to the tolerance (Hairer, Norsett and Wanner, Solving ODEs I, section II.4): of what a
# smaller tolerance changes that part is left, of which three times as much is stated.
LEFT = 3.0 / (LOOSER - 1.0)
FINEST = 1e-9  # tolerance, of the largest rise
QUADRATURE, LOOKED_AT = 0.1, 6  # of the accuracy: what finer quadratures of laws may change, at so many instants
MOST_FINER = 4  # times that quadratures are refined
ASKED = 200  # of the times that a user asks for, so many at most are compared: each costs a state of every space
KNOTS = 12  # bends and jumps of the inputs, at most, after which errors are looked at closely
SOONEST = 1e-3  # of the first time asked for: so soon after a jump nobody asks for more than what it was before


@dataclass(frozen=True, eq=False)
class Marched:
    """A response in as many fields as the accuracy takes, or at full order: the values of its traces at ``checked``
    times (s), their scales, and what the reduced space and the steps lose of each; a ``worse`` one by fewer fields and
    looser steps."""

    answer: Response
    worse: Response
    generations: int
    checked: np.ndarray
    out: Outputs
    traces: Quantities
    scales: dict[str, float]
    gaps: dict[str, float]
    tolerance: float = 0.0
    """At full order that of the answer."""


def marched(study: Study, base: Base, shift: float, steady_out: Outputs | None, generations: int = 0) -> Marched:
    """The response of a base; arguments as of `respond`."""
    checked = instants(study, base.heat)
    if base.follows:
        return _full(study, base, steady_out, checked)
    return _linear(study, base, shift, steady_out, checked, generations)


def _linear(
    study: Study,
    base: Base,
    shift: float,
    steady_out: Outputs | None,
    checked: np.ndarray,
    generations: int,
) -> Marched:
    """As of `marched`, of a linear problem."""
    accuracy, end = study.accuracy, study.end
    space = Krylov(base, shift)
    count = max(generations, FIELDS + int(max(0.0, -np.log10(accuracy) - 3) * 2))
    states, stopped = 0, np.inf
    while True:
        reduced = base.project(space.fields(count))
        # One comparison for two errors: fewer fields and a looser step.
        dropped = space.dropped(count, DROPPED)
        # In so short a time hardly anything diffuses: all generations are one, and dropping some tells nothing.
        dropped = dropped if dropped < reduced.states else 0
        try:
            answer = transient.march(base, reduced, end, TIME_SHARE * accuracy)
            fewer = transient.march(base, reduced, end, 10 * TIME_SHARE * accuracy, dropped)
        except (BeyondLawError, RunawayInTimeError) as stop:
            # In more fields a runaway is one at the same time.
            same = isinstance(stop, RunawayInTimeError) and abs(stop.time - stopped) <= SAME_TIME * stop.time
            if same or count >= MOST_FIELDS:
                raise
            count, stopped = count + 4, stop.time
            continue
        out = outputs.of_transient(answer, study.part, checked)
        traces, scales = study.traces(out), study.trace_scales(steady_out or out)
        gaps = distance(traces, study.traces(outputs.of_transient(fewer, study.part, checked)))
        enough = max(gaps[name] / scales[name] for name in gaps) <= SPACE_SHARE * accuracy
        # More generations that add no states are all but sums of those before.
        if enough or count >= MOST_FIELDS or not dropped or reduced.states <= states:
            return Marched(answer, fewer, count, checked, out, traces, scales, gaps)
        count, states = count + 4, reduced.states


def _full(study: Study, base: Base, steady_out: Outputs | None, checked: np.ndarray) -> Marched:
    """As of `marched`, of a problem whose properties follow the temperature: by steps that are short enough to tell the
    error of the mesh, without that of the steps."""
    tolerance = TIME_SHARE * study.accuracy
    for points in range(0, 2 * MOST_FINER, 2):
        answer = march_full(base.heat, base.conductor, study.end, tolerance, study.earliest, points)
        off = _by_quadrature(answer)
        if base.steady is not None or off <= QUADRATURE * study.accuracy:
            break
    out = outputs.of_transient(answer, study.part, checked)
    scales = study.trace_scales(steady_out or out)
    gaps = {name: off * scale for name, scale in scales.items()}
    return Marched(answer, answer, 0, checked, out, study.traces(out), scales, gaps, tolerance)


def in_shorter_steps(study: Study, base: Base, march: Marched, room: Mapping[str, float]) -> Marched:
    """The response at full order by steps whose error is a small part of the accuracy, or within the ``room`` that
    other errors leave (in the unit of each trace), with that error."""
    assert isinstance(march.answer, FullResponse)
    points = march.answer.points
    while True:
        tolerance = max(march.tolerance / LOOSER, FINEST)
        answer = march_full(base.heat, base.conductor, study.end, tolerance, study.earliest, points)
        out = outputs.of_transient(answer, study.part, march.checked)
        traces = study.traces(out)
        left = {name: LEFT * change for name, change in distance(traces, march.traces).items()}
        finer = replace(march, answer=answer, worse=march.answer, out=out, traces=traces, tolerance=tolerance)
        small = {name: SPACE_SHARE * study.accuracy * scale for name, scale in march.scales.items()}
        if all(left[name] <= max(small[name], room[name]) for name in left) or tolerance <= FINEST:
            return replace(finer, gaps={name: gap + left[name] for name, gap in march.gaps.items()})
        march = finer


def _by_quadrature(response: FullResponse) -> float:
    """What finer quadratures change of the rise, over the largest: at some instants the response at rest to the heat
    that they change, which is larger than that of any mode over time."""
    heat, conductor = response.heat, response.conductor
    if not heat.terms and (conductor is None or conductor.following is None):
        return 0.0
    finer, finer_conductor = refine_quadratures(heat, conductor, 2)
    rises = response.rises(response.end * np.geomspace(1e-3, 1.0, LOOKED_AT))
    loads = np.array([heat.outflow(rise) - finer.outflow(rise) for rise in rises])
    if conductor is not None and finer_conductor is not None and conductor.following is not None:
        drives = heat.inputs.at(response.end * np.geomspace(1e-3, 1.0, LOOKED_AT)) @ conductor.voltages
        for load, rise, voltage in zip(loads, rises, drives, strict=True):
            potential = conductor.solve(rise, voltage)
            for sign, c in ((1, finer_conductor), (-1, conductor)):
                density = -c.on.gradient(potential.potential) / c.resistivity(rise)
                load += sign * c.joule_load(density, rise)
    changes = heat.solve_steady(loads[:, : heat.free])
    vertices, largest = heat.unit[: heat.free] == 1.0, float(np.abs(rises[:, heat.unit == 1.0]).max(initial=1e-300))
    return float(np.abs(changes[:, vertices]).max(initial=0.0)) / largest


def tangent(base: Base, march: Marched) -> HeatProblem:
    """The problem linearized about its steady state where that is known, else about the hottest state of a response."""
    if base.steady is not None and base.steady.heat.about is not None:
        return base.steady.heat
    heat, conductor, density = base.heat, base.conductor, np.empty(0)
    rises = march.answer.rises(march.checked)
    hottest = int(np.abs(rises).max(axis=1).argmax())
    if conductor is not None:
        voltage = heat.inputs.at(march.checked[hottest : hottest + 1])[0] @ conductor.voltages
        density = conductor.solve(rises[hottest], voltage).density
    return at_films(linearized(heat, conductor, rises[hottest], density), heat.field(rises[hottest]))


def beside(study: Study, base: Base, shift: float, fine: Marched) -> Response:
    """The response of a lower space in as many generations of fields as that of the fine one, or by the same steps and
    quadratures."""
    if isinstance(fine.answer, FullResponse):
        like = fine.answer
        return march_full(base.heat, base.conductor, study.end, fine.tolerance, study.earliest, like.points, like)
    reduced = base.project(Krylov(base, shift).fields(fine.generations))
    base.heat.let_go()
    return transient.march(base, reduced, study.end, TIME_SHARE * study.accuracy)


def instants(study: Study, heat: HeatProblem) -> np.ndarray:
    """Times (s) at which meshes and spaces are compared: early and late, and after bends and jumps of the inputs; after
    a jump from the earliest time of interest on, as after the start, and at what is asked for sooner."""
    end, first = study.end, min(study.earliest, study.end)
    knots = heat.inputs.knots(end)
    groups = [np.geomspace(first, end, 40), np.linspace(0, end, 21)[1:]]
    wanted = np.array([t for t in study.instants if first <= t <= end])
    groups.append(wanted[spread(wanted, ASKED)])
    for knot in knots[spread(knots, KNOTS)]:
        following = knots[knots > knot]
        gap = (following[0] if len(following) else end) - knot
        groups.append(knot + np.geomspace(min(first, gap / 2), gap * (1 - 1e-9), 6))
    times = np.unique(np.concatenate(groups))
    jumps = knots[np.any(heat.inputs.jumps(knots), axis=1)]
    for jump, gap in zip(jumps, np.diff(np.append(jumps, end)), strict=True):
        times = times[(times < jump) | (times >= jump + min(first, gap / 2) * (1 - 1e-9))]
        sooner = wanted[(wanted >= jump + SOONEST * first) & (wanted < jump + min(first, gap / 2))]
        times = np.union1d(times, sooner[:1])
    return times


def spread(times: np.ndarray, most: int) -> np.ndarray:
    """Which of some times to take: all, or where there are more, so many that are spread over them."""
    return np.unique(np.linspace(0, len(times) - 1, min(len(times), most)).astype(int))


def distance(a: Quantities, b: Quantities) -> dict[str, float]:
    """The largest difference of each quantity."""
    return {name: float(np.abs(a[name] - b[name]).max()) for name in a}
