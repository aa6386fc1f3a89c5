"""Traces over time with their errors: of space, of the reduced space, of time stepping and of the rows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from fem3d.adaptivity import estimate, goal_errors, law_response
from fem3d.adaptivity.estimate import Estimator, Parts, Spread
from fem3d.adaptivity.goal_errors import Level
from fem3d.adaptivity.law_response import SAME_TIME, Rounds
from fem3d.adaptivity.nested import Problems
from fem3d.problems.heat import HeatProblem
from fem3d.results import outputs, probes, trace_times
from fem3d.results.outputs import Outputs
from fem3d.results.study import Quantities, Study
from fem3d.solution import transient
from fem3d.solution.faces_over_time import Between
from fem3d.solution.reduced import Reduced
from fem3d.solution.transient import Base, Krylov, Transient
from fem3d.spaces.domain import Domain
from scenes.errors import RunawayInTimeError, UndershootError

ROW_SHARE = 0.25  # part of the accuracy left to linear interpolation between rows
TIME_SHARE = 0.01  # part of the accuracy for time stepping
SPACE_SHARE = 0.1  # part of the accuracy for the reduced space
ROUNDING = 1e-10  # relative error that rounding leaves in every trace
NOTHING = 1e-10  # less heat than this fraction of what would warm everything from 0 K counts as none
FIELDS, DROPPED, MOST_FIELDS = 6, 2, 60  # generations of Krylov fields: the first trial, how many fewer, the most
FACES = 3  # times that what faces are interpolated between is made better
MOST_GENERATIONS = 20  # where properties follow the temperature: rounds add corrections to them
ASKED = 200  # of the times that a user asks for, so many at most are compared: each costs a state of every space
BENDS = 12  # times at which the bends of a law are looked for
KNOTS = 12  # bends and jumps of the inputs, at most, after which errors are looked at closely


@dataclass(frozen=True, eq=False)
class Response:
    """Traces and their errors (in their units), the heat balance, and what refinement needs if they are too large: what
    the intervals miss for the power and for each of the ``goals`` with it, by which factors each degree takes away less
    of that than the one before (``falls``)."""

    times: np.ndarray
    traces: Quantities
    errors: dict[str, float]
    accepted: bool  # whether the errors are within the accuracy
    imbalance: float  # stored + lost - supplied heat over what passed, the largest over time
    transient: Transient
    reduced: Reduced
    generations: int  # of fields
    goals: list[Spread] = field(default_factory=list)
    falls: Spread = field(default_factory=list)
    relative: dict[str, float] = field(default_factory=dict)  # errors without the rows' own, over their scales
    scales: dict[str, float] = field(default_factory=dict)  # what they are relative to
    between: float = 0.0  # the largest relative error of straight lines between rows

    @property
    def slowest(self) -> float:
        """The time constant (s) of the slowest mode."""
        return float(1 / max(self.transient.trajectory.rates.min(), 1e-300))


@dataclass(frozen=True, eq=False)
class Marched:
    """A response in as many fields as the accuracy takes: the values of its traces at ``checked`` times (s), their
    scales, and what the reduced space and the steps lose of each."""

    answer: Transient
    reduced: Reduced
    generations: int
    checked: np.ndarray
    out: Outputs
    traces: Quantities
    scales: dict[str, float]
    gaps: dict[str, float]
    rounds: Rounds | None = None
    """What found it where properties follow the temperature by a law."""
    between: Between | None = None
    """What faces are interpolated between where these alone are nonlinear, and hardly are."""


def marched(study: Study, base: Base, shift: float, steady_out: Outputs | None, generations: int = 0) -> Marched:
    """The response of a base; arguments as of `respond`."""
    checked = instants(study, base.heat)
    if base.follows:
        return _by_laws(study, base, shift, steady_out, checked, generations)
    march = _linear(study, base, shift, steady_out, checked, generations)
    if march.between is None:
        return march
    better, lack = march.between.better(march.answer)
    for _ in range(FACES):
        if lack <= SPACE_SHARE * study.accuracy:
            break
        march = _linear(study, base, shift, steady_out, checked, generations, better)
        better, lack = better.better(march.answer)
    gaps = {name: value + lack * march.scales[name] for name, value in march.gaps.items()}
    return replace(march, gaps=gaps)


def _linear(
    study: Study,
    base: Base,
    shift: float,
    steady_out: Outputs | None,
    checked: np.ndarray,
    generations: int,
    between: Between | None = None,
) -> Marched:
    """As of `marched`, of a linear problem, or of one that faces make a little nonlinear."""
    accuracy, end = study.accuracy, study.end
    base = base if between is None else between.held(base)
    space = Krylov(base, shift)
    count = max(generations, FIELDS + int(max(0.0, -np.log10(accuracy) - 3) * 2))
    states, stopped = 0, np.inf
    while True:
        reduced = base.project(space.fields(count))
        if base.slight:
            between = between or Between.guessed(base, reduced, end, study.earliest, accuracy)
            reduced = between.beside(base, reduced)
        # One comparison for two errors: fewer fields and a looser step.
        dropped = space.dropped(count, DROPPED)
        # In so short a time hardly anything diffuses: all generations are one, and dropping some tells nothing.
        dropped = dropped if dropped < reduced.states else 0
        try:
            answer = transient.march(base, reduced, end, TIME_SHARE * accuracy)
            fewer = transient.march(base, reduced, end, 10 * TIME_SHARE * accuracy, dropped)
        except (RunawayInTimeError, UndershootError) as stop:
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
            return Marched(answer, reduced, count, checked, out, traces, scales, gaps, between=between)
        count, states = count + 4, reduced.states


def _by_laws(
    study: Study, base: Base, shift: float, steady_out: Outputs | None, checked: np.ndarray, generations: int
) -> Marched:
    """As of `marched`, of a problem whose properties follow the temperature by a law."""
    rounds = law_response.of(base, shift, study, generations)
    while True:
        answer, before = rounds.run()
        out = outputs.of_transient(answer, study.part, checked)
        traces, scales = study.traces(out), study.trace_scales(steady_out or out)
        gaps = distance(traces, study.traces(outputs.of_transient(before, study.part, checked)))
        enough = max(gaps[name] / scales[name] for name in gaps) <= SPACE_SHARE * study.accuracy
        if enough or rounds.generations >= MOST_GENERATIONS:
            gaps = {name: value + rounds.left * scales[name] for name, value in gaps.items()}
            return Marched(answer, answer.reduced, rounds.generations, checked, out, traces, scales, gaps, rounds)
        rounds.more()


def beside(study: Study, base: Base, shift: float, fine: Marched) -> Transient:
    """The response of a lower space in as many generations of fields as that of the fine one."""
    if fine.rounds is not None:
        return fine.rounds.beside(base)
    between = fine.between and fine.between.lower(fine.answer.base.heat, base.heat)
    base = base if between is None else between.held(base)
    reduced = base.project(Krylov(base, shift).fields(fine.generations))
    reduced = reduced if between is None else between.beside(base, reduced)
    base.heat.let_go()
    return transient.march(base, reduced, study.end, TIME_SHARE * study.accuracy)


def respond(
    study: Study,
    given: Problems,
    bases: Sequence[Base],
    shift: float,
    judge: Estimator,
    steady: Level | None,
    generations: int = 0,
    as_it_is: bool = False,
) -> Response:
    """The response of the first of ``bases``, with its error from those of the lower spaces: of degrees lower by one
    where the ``steady`` level is known, and by two where it isn't. Scales are taken from that level's outputs, or else
    from those of the response itself; ``generations`` of fields is where to start; ``judge`` as of
    `goal_errors.examined`, ``as_it_is`` as of `concluded`."""
    steady_errors: Mapping[str, float] = {}
    if steady is not None:
        steady_errors = steady.relative
        given.let_go()
    march = marched(study, bases[0], shift, None if steady is None else steady.fine.out, generations)
    if march.rounds is not None and march.rounds.hot is not None:
        given = given.about(march.rounds.hot)
        times = _spread(march.checked, BENDS)
        judge = judge.bending(given.bent(given.heat.field(march.answer.rises(march.checked[times]))))
    # One space's factors at a time: these have made all their fields.
    bases[0].heat.let_go()
    lesser = [beside(study, base, shift, march) for base in bases[1:]]
    low = study.traces(outputs.of_transient(lesser[0], study.part, march.checked))
    changed = distance(march.traces, low)
    goals, parts = dict[str, Spread](), dict[str, Parts]()
    largest = max((changed[n] / march.scales[n] for n in changed), default=0.0)
    if lesser[1:] or largest > (1 - ROW_SHARE) * study.accuracy:
        times = _when_worst(study, march, low, changed)
        goals, parts = _remains(study, given, judge, (march.answer, *lesser), march.scales, times)
    power = judge.remains(given.electric_parts)
    # Steady errors have what the current is off by in them.
    of_joule = {} if steady_errors else _of_joule_heat(study, given, march)
    joule = {name: judge.remains(each) for name, each in of_joule.items()}
    electric = {n: 0.0 if steady_errors else estimate.total(joule.get(n, power)) for n in march.scales}
    errors = _errors(study, march, changed, goals, electric, steady_errors)
    goals = {"power": power} | goal_errors.with_current(goals, joule, power)
    falls = goal_errors.how_fast(given, goals, parts, of_joule)
    return concluded(study, march, errors, [*goals.values()], falls, as_it_is)


def _when_worst(study: Study, march: Marched, low: Quantities, changed: Mapping[str, float]) -> np.ndarray:
    """Times (s) at which errors are looked at closely: the last, that at which the lower space changes each rise most,
    and that for the trace which it changes most of all, which after a jump may be the heat that enters."""
    worst = max(changed, key=lambda n: changed[n] / march.scales[n])
    at = [int(np.abs(march.traces[n] - low[n]).argmax()) for n in {*study.trace_rises, worst}]
    times: np.ndarray = march.checked[sorted({len(march.checked) - 1, *at})]
    return times


def _of_joule_heat(study: Study, given: Problems, march: Marched) -> dict[str, Parts]:
    """The parts of the Joule heat that each thermal trace sees, as if the largest voltages drove it from rest all the
    time."""
    if given.conductor is None:
        return {}
    potentials = [given.heat.inputs.largest(study.end) @ phi for phi in given.cold_potentials]
    (last,) = march.answer.rises(np.array([study.end]))
    scales = goal_errors.of_part(study.part, study.trace_goals, march.scales)
    duals = goal_errors.duals_of(study.trace_goals, given, last, study.end)
    return goal_errors.joule_parts(study.trace_goals, given, potentials, scales, duals)


def _errors(
    study: Study,
    march: Marched,
    changed: Mapping[str, float],
    goals: Mapping[str, Spread],
    electric: Mapping[str, float],
    steady_errors: Mapping[str, float],
) -> dict[str, float]:
    """The error of each trace in its unit: of space the largest of what the lower space ``changed``, what its goal
    misses and the relative error of its steady state; of the current (relative), of the fields, of an extreme's place.
    """
    errors = {}
    for name, scale in march.scales.items():
        goal = study.trace_goals.get(name, name)
        of_it = [e for q, e in steady_errors.items() if study.goals.get(q, q) == goal]
        at_rest = max(of_it or steady_errors.values(), default=0.0)
        of_space = max(changed[name], at_rest * scale, estimate.total(goals.get(name, [])) * scale)
        doubt = float(np.max(march.out.get(f"doubt:{study.trace_goals.get(name)}", 0.0)))
        errors[name] = of_space + electric[name] * scale + march.gaps[name] + doubt
    return errors


def concluded(
    study: Study,
    fine: Marched,
    errors: dict[str, float],
    goals: list[Spread],
    falls: Spread,
    as_it_is: bool = False,
) -> Response:
    """The response with its errors: at its rows, where the accuracy is reached or it is to be taken ``as_it_is``, else
    with what its ``goals`` miss, and by which factors that ``falls``."""
    answer, reduced, scales, count = fine.answer, fine.reduced, fine.scales, fine.generations
    relative = {name: errors[name] / scales[name] for name in errors}
    if max(relative.values()) > (1 - ROW_SHARE) * study.accuracy and not as_it_is:
        return Response(
            fine.checked, fine.traces, errors, False, np.nan, answer, reduced, count, goals, falls, relative
        )
    return with_rows(study, answer, reduced, errors, scales, count)


def _remains(
    study: Study,
    given: Problems,
    judge: Estimator,
    transients: Sequence[Transient],
    scales: Mapping[str, float],
    times: np.ndarray,
) -> tuple[dict[str, Spread], dict[str, Parts]]:
    """For each thermal trace the worst of what is left at some times (s), with its parts, each seen as that long after
    the last bend or jump of the inputs; ``transients`` are those of the spaces, the highest first."""
    heat, goals = given.heat, study.trace_goals
    own_scales = goal_errors.of_part(study.part, goals, scales)
    rises = [given.lifted(t.rises(times), -1 - k) for k, t in enumerate(transients)]
    spreads, worst = dict[str, Spread](), dict[str, Parts]()
    knots = np.append(0.0, heat.inputs.knots(study.end))
    for i, time in enumerate(t - knots[knots < t].max() for t in times.tolist()):
        fine, low = rises[0][i], rises[1][i]
        # Without the lowest space, as if each degree took away as much as the last.
        lowest = rises[2][i] if len(rises) > 2 else 2 * low - fine
        apart = [heat.stiffness @ u + heat.mass @ u / time for u in (low - lowest, fine - low)]
        duals = goal_errors.duals_of(goals, given, fine, time)
        parts = goal_errors.thermal_parts(given, fine, tuple(apart), own_scales, time, duals)
        smooth = {name: judge.remains(each) for name, each in parts.items()}
        at_edges = goal_errors.at_contradictions(goals, given, fine, own_scales, time, duals, judge)
        for name, remains in goal_errors.summed(smooth, at_edges).items():
            if name not in spreads or estimate.total(remains) > estimate.total(spreads[name]):
                spreads[name], worst[name] = remains, parts[name]
    return spreads, worst


def instants(study: Study, heat: HeatProblem) -> np.ndarray:
    """Times (s) at which meshes and spaces are compared: early and late, and after bends and jumps of the inputs; after
    a jump from the earliest time of interest on, as after the start."""
    end, first = study.end, min(study.earliest, study.end)
    knots = heat.inputs.knots(end)
    groups = [np.geomspace(first, end, 40), np.linspace(0, end, 21)[1:]]
    wanted = np.array([t for t in study.instants if first <= t <= end])
    groups.append(wanted[_spread(wanted, ASKED)])
    for knot in knots[_spread(knots, KNOTS)]:
        following = knots[knots > knot]
        gap = (following[0] if len(following) else end) - knot
        groups.append(knot + np.geomspace(min(first, gap / 2), gap * (1 - 1e-9), 6))
    times = np.unique(np.concatenate(groups))
    jumps = knots[np.any(heat.inputs.jumps(knots), axis=1)]
    for jump, gap in zip(jumps, np.diff(np.append(jumps, end)), strict=True):
        times = times[(times < jump) | (times >= jump + min(first, gap / 2) * (1 - 1e-9))]
    return times


def _spread(times: np.ndarray, most: int) -> np.ndarray:
    """Which of some times to take: all, or where there are more, so many that are spread over them."""
    return np.unique(np.linspace(0, len(times) - 1, min(len(times), most)).astype(int))


def repeat(study: Study, fine: Base, reduced: Reduced, steady_out: Outputs, before: Response) -> Response:
    """The response at another voltage, in the reduced problem of an earlier one, which has the same relative errors."""
    scales = study.trace_scales(steady_out)
    answer = transient.march(fine, reduced, study.end, TIME_SHARE * study.accuracy)
    errors = {name: before.relative[name] * scale for name, scale in scales.items()}
    return with_rows(study, answer, reduced, errors, scales, before.generations)


def distance(a: Quantities, b: Quantities) -> dict[str, float]:
    """The largest difference of each quantity."""
    return {name: float(np.abs(a[name] - b[name]).max()) for name in a}


def with_rows(
    study: Study,
    answer: Transient,
    reduced: Reduced,
    errors: dict[str, float],
    scales: dict[str, float],
    generations: int,
) -> Response:
    """The response at as many rows as the accuracy takes; ``errors`` are those at any time without the rows' own."""

    def traces(times: np.ndarray) -> Quantities:
        return study.traces(outputs.of_transient(answer, study.part, times))

    allowed = {name: ROW_SHARE * study.accuracy * scale for name, scale in scales.items()}
    drive = answer.base.heat.inputs
    knots = drive.knots(study.end)
    jumps = knots[np.any(drive.jumps(knots), axis=1)].tolist()
    times, rows, between = trace_times.choose(answer.trajectory.steps, traces, allowed, jumps, study.instants)
    if answer.base.heat.lifts.any():
        _start(answer.base.heat.domain, rows)
    relative = {name: errors[name] / scales[name] for name in errors}
    errors = {name: errors[name] + between[name] + ROUNDING * scales[name] for name in errors}
    imbalance, widest = _imbalance(study, answer), max(between[name] / scales[name] for name in errors)
    return Response(
        times, rows, errors, True, imbalance, answer, reduced, generations, relative=relative, scales=scales,
        between=widest,
    )  # fmt: skip


def _start(domain: Domain, traces: Quantities) -> None:
    """Sets the first row of the mean temperatures that a jump of a given one at t = 0 leaves as they were.

    No mesh resolves the layer at that instant, and the fields of the transient hold it from later on only.
    """
    scene = domain.scene
    for probe in scene.probes:
        mean = probe.quantity == "temperature" and probe.reduce == "mean"
        if mean and probe.name in traces and probes.starts_free(domain, probe):
            traces[probe.name][0] = scene.initial_temperature


def _imbalance(study: Study, answer: Transient) -> float:
    """Largest |stored + lost - supplied| over the heat that came or went until then, whichever is more, from the
    earliest time of interest on.

    The integrals over time run over the steps by Gauss's rule, apart from how the steps were made; what is lost comes
    from the reactions of the full equations, so the figure sees the error of the reduced space too. Where a given
    temperature jumps, what its nodes store at that instant has entered there.
    Less heat than the rounding of the temperatures themselves counts as none.
    """
    points, weights = np.polynomial.legendre.leggauss(12)
    steps = answer.trajectory.steps
    # After a jump the loss starts like a power of t below any step: such a step is graded towards its start.
    starts = np.array([s.start for s in steps])
    early = np.array([s.length for s in steps])[_jumps(answer, starts)]
    graded = starts[_jumps(answer, starts), None] + early[:, None] * 0.25 ** np.arange(8, 0, -1)
    edges = np.union1d(np.append(starts, steps[-1].start + steps[-1].length), graded)
    times = (edges[:-1, None] + np.diff(edges)[:, None] * (points + 1) / 2).ravel()
    out = outputs.of_transient(answer, study.part, times)
    flows = [v for name, v in out.items() if name.startswith("flow:")]
    entered = out["power"] + out["generated"] + sum(flows, np.zeros(len(times)))
    entering, leaving = outputs.passing(out)
    per_step = np.diff(edges) / 2

    def until(rate: np.ndarray) -> np.ndarray:
        return np.cumsum(per_step * (rate.reshape(-1, len(points)) @ weights))

    passed = np.maximum(until(entering), until(leaving))
    just_before = np.maximum(edges[1:] * (1 - 1e-12), edges[:-1])
    stored, after = np.split(outputs.stored_heat(answer, study.part, np.append(just_before, edges[:-1])), 2)
    jumped = after - np.concatenate([[0.0], stored[:-1]])
    gap = np.abs(stored - until(entered) - np.cumsum(jumped * _jumps(answer, edges[:-1])))
    late = edges[1:] >= min(study.earliest, edges[-1])
    heat = answer.base.heat
    none = (
        NOTHING
        * study.part.copies
        * float(heat.unit @ (heat.mass @ heat.unit))
        * max(heat.domain.scene.initial_temperature, 1.0)
    )
    return float((gap / np.maximum(passed + np.cumsum(np.abs(jumped)), none))[late].max())


def _jumps(answer: Transient, edges: np.ndarray) -> np.ndarray:
    """Which edges an input jumps at, the start among them."""
    drive = answer.base.heat.inputs
    return np.any(drive.jumps(edges), axis=1) | (np.arange(len(edges)) == 0)
