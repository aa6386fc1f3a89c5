"""Response over time of one space: in a Krylov space as large as the accuracy requires, also for a resistivity that is
linear in the temperature; with all unknowns where a property follows the temperature by a law or table.

Without a solved steady state the Krylov space begins with a basis of currents and loads. It starts from the currents at
the initial temperature and from every load of the scene. If the resistivity depends on temperature, a rough response
shows how far heating changes the Joule heat; the currents at its hottest instants and their Joule loads join the basis.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from scipy.linalg import orth

from fem3d.problems.current import Conductor
from fem3d.problems.heat import HeatProblem
from fem3d.problems.linearized import LinearizedHeat, linearized
from fem3d.results import outputs
from fem3d.results.outputs import Outputs, Quantities, Response, Study
from fem3d.solution import transient
from fem3d.solution.march import FullResponse, March, by_finer_quadratures
from fem3d.solution.newton import CoarseMeshError
from fem3d.solution.reduced import combined_density, independent_currents
from fem3d.solution.steady import NEGLIGIBLE
from fem3d.solution.transient import Base, Krylov
from scenes.errors import BeyondLawError, NumericsError, RunawayInTimeError
from scenes.result import Traces
from statespace.channels import Inputs

# Part of the accuracy for time stepping, and for iterations within a step. A choice: a response with `LOOSER` times the
# tolerance, whose distance is the error, may miss a tenth of the accuracy; it takes two thirds of the steps (order 6).
TIME_SHARE = 0.01
LOOSER = 10.0  # ratio of the tolerances of two responses that are compared
FIELDS, DROPPED, MOST_FIELDS = 6, 2, 60  # generations of Krylov fields: the first trial, how many fewer, the most
KNOTS = 12  # bends and jumps, at most, with 6 times of comparison each: a choice, as many as the run has without them
# On 18 random scenes true errors sooner are up to 2.4 times (from 0.03 on) and 100 times (from 0.001 on) the bounds.
SOON = 0.1  # part of the first time of interest for which errors do not hold after a jump of a drive but a temperature
ROUNDS = 5  # of searches for hot instants, and of shorter steps
# A response is kept up to this fraction of the time t at which the heating runs away. The rise approaches its last
# value like (1 - time / t)^(1/2), so that its error there is about three times the error of t.
BEFORE = 0.95
HotState = tuple[np.ndarray, np.ndarray]  # where heating changes the Joule heat: rise (functions,), inputs (channels,)


def make_base(heat: HeatProblem, conductor: Conductor | None, hot: Sequence[HotState]) -> Base:
    """Return the base with the currents at the initial temperature and in ``hot`` states, where the accuracy of the
    scene needs them, and their loads."""
    loads, lifts = transient.heat_loads(heat), transient.jumping_lifts(heat)
    if conductor is None:
        return Base(heat, None, [], lifts, loads)
    rises = [heat.inputs.at(0.0) @ heat.lifts, *(heat.take(field) for field, _ in hot)]
    driven = np.flatnonzero(conductor.voltages.any(axis=1))
    potentials = [[conductor.solve(rise, v) for v in conductor.voltages[driven]] for rise in rises]
    patterns = independent_currents(conductor, potentials[0])
    pairs = [(a, b) for i, a in enumerate(patterns) for b in patterns[: i + 1]]
    loads += [conductor.joule_load(a.density, rises[0], b.density) for a, b in pairs]
    for rise, each, (_, drive) in zip(rises[1:], potentials[1:], hot, strict=True):
        loads.append(conductor.joule_load(combined_density(each, drive[driven]), rise))
    least, every = NEGLIGIBLE * heat.domain.scene.accuracy, [p for each in potentials for p in each]
    return Base(heat, conductor, independent_currents(conductor, every, least), lifts, loads)


def search_hot_states(
    heat: HeatProblem, conductor: Conductor | None, shift: float, earliest: float, end: float, accuracy: float
) -> tuple[Base, list[HotState]]:
    """Return the base with the currents and loads that heating brings, and their hot states.

    They are of a few instants of a rough response: just before changes of the inputs, and when errors hold again. A
    round adds the worst, until the loads of all its instants are spanned as well as its response is right. Rounds end
    when currents and loads span the Joule heat of all; a load that is missing changes flows at given temperatures most.
    """
    hot: list[HotState] = []
    base = make_base(heat, conductor, hot)
    if conductor is None or not conductor.warms or not conductor.voltages.any():
        return base, hot
    knots, soon = heat.inputs.knots(end), np.array([earliest, *(at + wait for at, wait in waits(heat, earliest, end))])
    before = thin_out(knots, 4) * (1 - 1e-9)
    times = np.unique(np.concatenate([np.geomspace(end / 100, end, 4), before, thin_out(soon, KNOTS)]))
    for _ in range(ROUNDS):
        reduced = base.project(Krylov(base, shift).fields(FIELDS))
        try:
            answer = transient.march(base, reduced, end, accuracy)
        except (BeyondLawError, RunawayInTimeError) as stop:  # only the accurate response decides about a runaway
            answer = transient.march(base, reduced, BEFORE * stop.time, accuracy)
        times = np.unique(np.minimum(times, answer.end))
        inputs = heat.inputs.at(times)
        currents = answer.reduced.currents(answer.trajectory(times)[0], inputs)
        states, loads, missing = list[HotState](), list[np.ndarray](), list[np.ndarray]()
        for rise, g, c in zip(answer.rises(times), inputs, currents, strict=True):
            voltage = g @ conductor.voltages
            if voltage.any() and (conductor.resistivity(rise) > 0).all():
                states.append((heat.field(rise), g))
                loads.append(conductor.joule_load(conductor.solve(rise, voltage).density, rise))
                missing.append(loads[-1] - conductor.joule_load(combined_density(base.patterns, c), rise))
        if not states:
            break
        every, off = np.array(loads).T, np.array(missing).T
        power = np.maximum(heat.unit @ every, 1e-300)
        unseen = float((np.abs(heat.unit @ off) / np.sqrt(power)).max() / np.sqrt(power.max()))
        spanned = orth(np.array([load / (np.abs(load).max() or 1.0) for load in base.loads]).T)
        lacking, size = every - spanned @ (spanned.T @ every), max(float(np.abs(every).sum(axis=0).max()), 1e-300)
        change, count = np.maximum(np.abs(off).sum(axis=0), np.abs(lacking).sum(axis=0)) / size, len(hot)
        least = max(NEGLIGIBLE * accuracy, float(change.max()) ** 2)  # the rough response is wrong by the square
        while change.max() > least:
            worst = int(change.argmax())
            hot.append(states[worst])
            along = lacking[:, worst] / max(float(np.linalg.norm(lacking[:, worst])), 1e-300)
            lacking = lacking - np.outer(along, along @ lacking)
            lacking[:, worst] = 0.0
            change = np.abs(lacking).sum(axis=0) / size
        base = replace(base if len(hot) == count else make_base(heat, conductor, hot), unseen=unseen)
        if len(hot) == count:
            break
    return base, hot


@dataclass(frozen=True, eq=False)
class FineResponse:
    """A response with its errors by the reduced space and the time steps.

    Attributes
    ----------
    answer, worse: the response, and the response in fewer fields or looser steps.
    generations: how many generations of Krylov fields the answer has; 0 at full order.
    times: (s) of the ``traces``, the outputs ``out`` and the comparison.
    scales, gaps: of each trace its scale, and the error by fields and steps.
    """

    answer: Response
    worse: Response
    generations: int
    times: np.ndarray
    out: Outputs
    traces: Quantities
    scales: dict[str, float]
    gaps: dict[str, float]

    @staticmethod
    def compared(
        study: Study, answer: Response, worse: Response, steady_out: Outputs | None, part: float, generations: int = 0
    ) -> FineResponse:
        """Return a response with this ``part`` of its distance from a worse one as its errors."""
        times = comparison_times(study, answer)
        out, other = (outputs.of_transient(each, study.part, times) for each in (answer, worse))
        traces, scales = study.traces(out), study.trace_scales(steady_out or out)
        gaps = {name: part * gap for name, gap in largest_differences(traces, study.traces(other)).items()}
        return FineResponse(answer, worse, generations, times, out, traces, scales, gaps)

    def converged(self, accuracy: float) -> bool:
        """Return whether fields and steps cause a small part of the allowed error."""
        return max(self.gaps[name] / self.scales[name] for name in self.gaps) <= LOOSER * TIME_SHARE * accuracy


def march_linear(study: Study, base: Base, shift: float, steady_out: Outputs | None) -> FineResponse:
    """Solve a linear problem in as many fields and steps as the accuracy needs; arguments as of `bound_response`."""
    accuracy, end, space, stopped = study.accuracy, study.end, Krylov(base, shift), np.inf
    count, tolerance = FIELDS + int(max(0.0, -np.log10(accuracy) - 3) * 4), TIME_SHARE * accuracy
    project = lru_cache(1)(lambda count: base.project(space.fields(count)))
    while True:
        reduced = project(count)
        # One comparison for two errors: fewer fields and a looser step.
        dropped = space.dropped(count, DROPPED)
        # In so short a time diffusion is negligible: all generations coincide, and dropping some shows no error.
        dropped = dropped if dropped < reduced.states else 0
        try:
            answer = transient.march(base, reduced, end, tolerance)
            worse = transient.march(base, reduced, end, LOOSER * tolerance, dropped)
            response = FineResponse.compared(study, answer, worse, steady_out, 1.0, count)
            if response.converged(accuracy):
                return response
            worse = transient.march(base, reduced, end, LOOSER * tolerance)
            by_steps = FineResponse.compared(study, answer, worse, steady_out, 1.0)
        except (BeyondLawError, RunawayInTimeError) as stop:
            # A true runaway happens at the same time in more fields.
            same = isinstance(stop, RunawayInTimeError) and abs(stop.time - stopped) <= (1 - BEFORE) * stop.time
            if same or count >= MOST_FIELDS:
                raise
            count, stopped = count + 4, stop.time
            continue
        if not by_steps.converged(accuracy) and tolerance > TIME_SHARE * accuracy / LOOSER**ROUNDS:
            tolerance /= LOOSER
        elif count >= MOST_FIELDS or not dropped:
            return response
        else:
            count += 4


def march_nonlinear(study: Study, base: Base, lower: Base, steady_out: Outputs | None) -> tuple[FineResponse, Response]:
    """Solve a problem with temperature-dependent properties in two spaces. Steps are chosen in the ``lower`` one, whose
    response is the second; their halves show their error.

    The error is 1 / (2^order - 1) of the change. The order is 4, but may fall in stiff problems to the stages' order 2
    (Hairer and Wanner, Solving ODEs II, section IV.15): a third of the change is stated. An error estimated within a
    step may vanish by chance; the change is zero only if the error is.

    Raises CoarseMeshError where the lower space alone has no response.
    """
    part, strict = 1 / 3, 3 * TIME_SHARE * study.accuracy

    def march(space: Base, tolerance: float, ends: Sequence[float] = ()) -> FullResponse:
        return March(space.heat, space.conductor, tolerance).run(study.end, study.earliest, ends)

    try:
        for tolerance in (strict / LOOSER ** np.arange(ROUNDS)).tolist():
            try:
                whole = march(lower, LOOSER * tolerance)
            except (BeyondLawError, RunawayInTimeError):  # loose steps may run away alone
                whole = march(lower, tolerance)
            low = march(lower, tolerance, whole.ends(2))
            by_steps = FineResponse.compared(study, low, whole, steady_out, part)
            if by_steps.converged(study.accuracy):
                break
    except NumericsError as failure:
        march(base, strict)  # whose own failure counts
        raise CoarseMeshError("the mesh is too coarse for a response in each of its spaces") from failure
    answer = march(base, tolerance, low.ends())
    return replace(FineResponse.compared(study, answer, whole, steady_out, part), gaps=by_steps.gaps), low


def by_quadratures(study: Study, answer: FullResponse) -> dict[str, float]:
    """Estimate the errors of traces by quadratures of laws: the sums of their changes by three finer ones, as in
    `goal_errors.bound_errors`, at a few times."""
    times = thin_out(np.array(answer.ends()), KNOTS)
    finer = by_finer_quadratures(answer, times)
    own, *others = (study.traces(outputs.of_step(each, study.part, times)) for each in (answer, *finer))
    apart = [largest_differences(own, other) for other in others]
    return {name: sum(each[name] for each in apart) for name in own}


def linearize(base: Base, response: Response, times: np.ndarray) -> HeatProblem:
    """Return the problem linearized about its steady state, else about the hottest state at some times (s)."""
    if base.steady is not None and isinstance(base.steady.heat, LinearizedHeat):
        return base.steady.heat
    heat, conductor, density = base.heat, base.conductor, np.empty(0)
    rises = response.rises(times)
    hottest = int(np.abs(rises).max(axis=1).argmax())
    if conductor is not None:
        voltage = heat.inputs.at(times[hottest : hottest + 1])[0] @ conductor.voltages
        density = conductor.solve(rises[hottest], voltage).density
    return linearized(heat, conductor, rises[hottest], density)


def comparison_times(study: Study, answer: Response) -> np.ndarray:
    """Return the times (s) at which meshes and spaces are compared: early and late, after bends and jumps of the
    inputs, as soon as errors hold again, up to 200 requested times, and at full order the quarters of all steps."""
    heat, end, first = answer.heat, study.end, min(study.earliest, study.end)
    knots, ends = heat.inputs.knots(end), answer.ends(4) if isinstance(answer, FullResponse) else []
    wanted, after = np.array([t for t in study.instants if first <= t <= end]), dict(waits(heat, first, end))
    again = np.array([min(at + wait, end) for at, wait in after.items()])  # perhaps after another knot
    groups = [np.geomspace(first, end, 40), np.linspace(0, end, 21)[1:]]
    groups += [thin_out(wanted, 200), thin_out(again, KNOTS), np.minimum(ends, end)]
    for knot in thin_out(knots, KNOTS).tolist():
        gap = min(knots[knots > knot], default=end) - knot
        groups.append(knot + np.geomspace(min(after.get(knot, first), gap / 2), gap * (1 - 1e-9), 6))
    times = np.unique(np.concatenate(groups))
    return np.asarray(times[sure(study, heat, times)])


def sure(study: Study, heat: HeatProblem, times: np.ndarray) -> np.ndarray:
    """Return at which times (s) the errors of traces are to hold."""
    return Traces(times, {}, {}, min(study.earliest, study.end), waits(heat, study.earliest, study.end)).sure(times)


def waits(heat: HeatProblem, earliest: float, end: float) -> tuple[tuple[float, float], ...]:
    """Return the time (s) of each jump of an input, and for how long (s) errors do not hold after it."""
    at = jump_times(heat.inputs, end)
    given = (heat.inputs.jumps(at) * heat.lifts.any(axis=1)).any(axis=-1)
    return tuple(zip(at.tolist(), (np.where(given, 1.0, SOON) * earliest).tolist(), strict=True))


def jump_times(inputs: Inputs, end: float) -> np.ndarray:
    """Return the times (s) before an end at which inputs jump."""
    knots = inputs.knots(end)
    return np.asarray(knots[np.any(inputs.jumps(knots), axis=1)])


def thin_out(times: np.ndarray, most: int) -> np.ndarray:
    """Return at most ``most`` of some times, spread over all."""
    return times[np.unique(np.linspace(0, len(times) - 1, min(len(times), most)).astype(int))]


def largest_differences(a: Quantities, b: Quantities) -> dict[str, float]:
    """Return the largest difference of each quantity."""
    return {name: float(np.abs(a[name] - b[name]).max()) for name in a}
