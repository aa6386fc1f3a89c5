"""The response of one space over time: in as many fields as the accuracy takes, or in rounds where properties follow
the temperature."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fem3d.adaptivity import law_response
from fem3d.adaptivity.law_response import SAME_TIME, Rounds
from fem3d.problems.heat import HeatProblem
from fem3d.results import outputs
from fem3d.results.outputs import Outputs
from fem3d.results.study import Quantities, Study
from fem3d.solution import transient
from fem3d.solution.reduced import Reduced
from fem3d.solution.transient import Base, Krylov, Transient
from scenes.errors import BeyondLawError, RunawayInTimeError

TIME_SHARE = 0.01  # part of the accuracy for time stepping
SPACE_SHARE = 0.1  # part of the accuracy for the reduced space
FIELDS, DROPPED, MOST_FIELDS = 6, 2, 60  # generations of Krylov fields: the first trial, how many fewer, the most
MOST_GENERATIONS = 20  # where properties follow the temperature: rounds add corrections to them
ASKED = 200  # of the times that a user asks for, so many at most are compared: each costs a state of every space
KNOTS = 12  # bends and jumps of the inputs, at most, after which errors are looked at closely
SOONEST = 1e-3  # of the first time asked for: so soon after a jump nobody asks for more than what it was before
FALLEN = 0.5  # factor by which more fields have to leave less


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


def marched(
    study: Study,
    base: Base,
    shift: float,
    steady_out: Outputs | None,
    generations: int = 0,
    accuracy: float | None = None,
) -> Marched:
    """The response of a base; arguments as of `respond`. Where properties follow the temperature by a law, to an
    ``accuracy`` that may be larger than the study's."""
    checked = instants(study, base.heat)
    if base.follows:
        rounds = law_response.of(base, shift, study, generations, accuracy)
        return by_laws(study, rounds, steady_out, checked)
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
            return Marched(answer, reduced, count, checked, out, traces, scales, gaps)
        count, states = count + 4, reduced.states


def by_laws(study: Study, rounds: Rounds, steady_out: Outputs | None, checked: np.ndarray) -> Marched:
    """As of `marched`, of a problem whose properties follow the temperature by a law, to the accuracy of the rounds."""
    known = np.inf, np.inf
    while True:
        answer, before = rounds.run()
        out = outputs.of_transient(answer, study.part, checked)
        traces, scales = study.traces(out), study.trace_scales(steady_out or out)
        gaps = distance(traces, study.traces(outputs.of_transient(before, study.part, checked)))
        now = max(gaps[name] / scales[name] for name in gaps), rounds.left
        enough = now[0] <= SPACE_SHARE * rounds.accuracy
        # More fields that leave as much are of no use.
        stuck, known = all(x > FALLEN * before for x, before in zip(now, known, strict=True)), now
        if enough or stuck or rounds.generations >= MOST_GENERATIONS:
            gaps = {name: value + rounds.left * scales[name] for name, value in gaps.items()}
            return Marched(answer, answer.reduced, rounds.generations, checked, out, traces, scales, gaps, rounds)
        rounds.more()


def beside(study: Study, base: Base, shift: float, fine: Marched, corrected: bool = False) -> Transient:
    """The response of a lower space in as many generations of fields as that of the fine one; where that was found in
    rounds ``corrected`` as of these."""
    if fine.rounds is not None:
        return fine.rounds.beside(base, corrected)
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
