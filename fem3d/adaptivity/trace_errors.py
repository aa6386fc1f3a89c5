"""Traces over time with their errors: by the mesh, the reduced space, the time steps and the rows."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from fem3d.adaptivity import goal_errors, responses
from fem3d.adaptivity.estimator import Estimator
from fem3d.adaptivity.goal_errors import Level
from fem3d.adaptivity.nested import Problems
from fem3d.adaptivity.responses import FineResponse, jump_times, largest_differences, thin_out
from fem3d.results import outputs, probes
from fem3d.results.outputs import Quantities, Response, Study
from fem3d.solution import transient
from fem3d.solution.march import FullResponse
from fem3d.solution.transient import Base, Krylov

ROW_SHARE = 0.25  # part of the accuracy left to linear interpolation between rows
MOST_ROWS = 20_000  # of traces


@dataclass(frozen=True, eq=False)
class BoundedResponse:
    """Traces with errors (in their units) and heat balance; ``goals`` are the indicators of the power and of each goal
    with the power."""

    times: np.ndarray
    traces: Quantities
    errors: dict[str, float]
    accepted: bool  # whether the errors are within the accuracy
    transient: Response
    generations: int  # of fields
    goals: list[np.ndarray]
    relative: dict[str, float]  # errors but between rows, over their scales
    scales: dict[str, float]  # of the relative errors, in the traces' units
    imbalance: float = np.nan  # stored + lost - supplied heat over what passed, the largest over time
    between: float = 0.0  # the largest relative error of straight lines between rows
    early: dict[str, float] = field(default_factory=dict)  # errors before the earliest time of interest, if wanted


def bound_response(
    study: Study,
    problems: Problems,
    bases: Sequence[Base],
    shift: float,
    estimator: Estimator,
    steady: Level | None,
    as_it_is: bool,
) -> BoundedResponse:
    """Return the response of the first of two ``bases``, with errors by comparison with the lower space of the second.

    Scales come from the outputs of the ``steady`` level, else of the response. Krylov fields have the ``shift`` (s).
    ``as_it_is`` accepts the response in any case."""
    steady_errors, steady_out = ({}, None) if steady is None else (steady.relative, steady.fine.out)
    if steady is not None:
        # A response about a steady state does not need the factors of the lower spaces.
        for heat, conductor in zip(problems.heats[:-1], problems.conductors[:-1], strict=True):
            heat.let_go(steady=True)
            if conductor is not None:
                conductor.cache.pop("solve_cold", None)
                conductor.cache.pop("near", None)
    if bases[0].nonlinear:
        fine, low = responses.march_nonlinear(study, bases[0], bases[1], steady_out)
        problems = problems.linearized_about(responses.linearize(bases[0], fine.answer, fine.times))
    else:
        fine = responses.march_linear(study, bases[0], shift, steady_out)
        # One space's factors at a time: these have made all their fields.
        bases[0].heat.let_go()
        reduced = bases[1].project(Krylov(bases[1], shift).fields(fine.generations))
        bases[1].heat.let_go()
        low = transient.march(bases[1], reduced, study.end, responses.TIME_SHARE * study.accuracy)
    errors, goals = _errors(study, problems, estimator, fine, low, steady_errors)
    answer, scales, most = fine.answer, fine.scales, np.inf if as_it_is else (1 - ROW_SHARE) * study.accuracy
    fits = all(error <= most * scales[name] for name, error in errors.items())  # else a finer mesh follows
    if fits and isinstance(answer, FullResponse):
        missed = responses.by_quadratures(study, answer)
        errors = {name: error + missed[name] for name, error in errors.items()}
    relative = {name: error / scales[name] for name, error in errors.items()}
    accepted = max(relative.values()) <= most
    made = BoundedResponse(fine.times, fine.traces, errors, accepted, answer, fine.generations, goals, relative, scales)
    if not accepted:
        return made
    times, rows, between = _rows(study, answer, scales)
    everywhere = outputs.SOLVE_ROUNDING + bases[1].unseen
    errors = {name: error + between[name] + everywhere * scales[name] for name, error in errors.items()}
    early = {n: errors[n] + e for n, e in _early(study, fine, low, times).items()} if study.from_start else {}
    imbalance, lines = _imbalance(study, answer), max(between[name] / scales[name] for name in errors)
    return replace(made, times=times, traces=rows, errors=errors, imbalance=imbalance, between=lines, early=early)


def _early(study: Study, fine: FineResponse, low: Response, rows: np.ndarray) -> dict[str, float]:
    """Estimate the errors of traces at the ``rows`` (s) soon after the start and after jumps: twice the changes by the
    last degree and by the last Krylov fields, for want of a measured rate, and jumps of the mesh (`_jumps`)."""
    soon = rows[~responses.sure(study, fine.answer.heat, rows)]
    times, compared = thin_out(soon, 200), (fine.answer, low, fine.worse)
    traces, *others = (study.traces(outputs.of_transient(each, study.part, times)) for each in compared)
    apart, jumps = [largest_differences(traces, other) for other in others], _jumps(study, fine.answer)
    return {name: 2 * sum(each[name] for each in apart) + jumps.get(name, 0.0) for name in traces}


def _jumps(study: Study, answer: Response) -> dict[str, float]:
    """Return the jump with a drive of each trace that is continuous in truth: mean temperatures off the faces of given
    temperature, heat flows through these (infinite where it jumps), electric readings where it jumps alone."""
    heat, domain, at = answer.heat, answer.heat.domain, jump_times(answer.heat.inputs, study.end)
    alone = ~heat.inputs.jumps(at)[:, ~heat.lifts.any(axis=1)].any(axis=1)
    sudden = (np.vstack([heat.inputs.at(np.zeros(1)), heat.inputs.jumps(at)]) @ heat.given).any(axis=0)
    traces = study.traces(outputs.of_transient(answer, study.part, np.concatenate([at * (1 - 1e-12), [0.0], at])))
    sizes, start = dict[str, float](), domain.scene.initial_temperature
    for name, probe in ((name, domain.probes[probe]) for name, probe in study.trace_goals.items()):
        before, after = np.split(traces[name], [len(at)])
        jump = float(np.abs(after - np.append(start * (probe.quantity == "temperature"), before)).max())
        if probe.quantity == "heat_flow":
            on = domain.locate(probe).numbers
            passed = [b for b in domain.scene.boundaries if b.kind != "voltage" and np.isin(domain.facets(b), on).any()]
            given = [heat.shares[b.name][heat.free :] for b in passed if b.name in heat.shares]
            sizes[name] = np.inf if any(share @ sudden for share in given) else jump * (len(given) == len(passed))
        elif probe.quantity == "temperature" and probe.reduce == "mean" and probes.starts_free(domain, probe):
            sizes[name] = jump
        elif probe.quantity in ("current", "potential"):
            sizes[name] = float(np.abs(after[1:] - before)[alone].max(initial=0.0))
    return sizes


def _errors(
    study: Study, problems: Problems, estimator: Estimator, fine: FineResponse, low: Response, steady: dict[str, float]
) -> tuple[dict[str, float], list[np.ndarray]]:
    """Return the error of each trace in its unit, and the indicators of the power and of all goals. The error is

        max(|y_p - y_(p-1)|, sum eta, ``steady`` error) + by current + by fields and steps + by an extreme's place,

    with the ``fine`` response y_p, the response ``low`` y_(p-1) of the next lower space and the indicators eta. Where a
    steady level exists, eta serves the refinement alone, and steady errors include the error of the current.
    """
    lower = study.traces(outputs.of_transient(low, study.part, fine.times))
    changes, goals = largest_differences(fine.traces, lower), dict[str, np.ndarray]()
    power = estimator.indicators(problems.power_contributions)
    current, errors = dict[str, np.ndarray](), dict[str, float]()
    largest = max(change / fine.scales[name] for name, change in changes.items())
    if not steady or largest > (1 - ROW_SHARE) * study.accuracy:
        goals = _indicators(study, problems, estimator, fine, lower)
    if not steady:
        # The Joule heat is as if the largest voltages acted always.
        potentials = [problems.heat.inputs.largest(study.end) @ phi for phi in problems.cold_potentials]
        joule = _duals(study, problems, fine, study.end, study.end).by_joule_heat(potentials)
        current = {name: estimator.indicators(joule.get(name, problems.power_contributions)) for name in fine.scales}
    for name, scale in fine.scales.items():
        goal = study.trace_goals.get(name, name)
        of_it = [e for q, e in steady.items() if study.goals.get(q, q) == goal]
        at_rest = max(of_it or steady.values(), default=0.0)
        of_space = max(changes[name], scale * max(at_rest, float(np.sum(goals.get(name, 0.0)))))
        of_current = scale * float(np.sum(current.get(name, 0.0)))
        doubt = float(np.max(fine.out.get(f"doubt:{study.trace_goals.get(name)}", 0.0)))
        errors[name] = of_space + of_current + fine.gaps[name] + doubt
    return errors, [power, *(goal + current.get(name, power) for name, goal in goals.items())]


def _duals(study: Study, problems: Problems, fine: FineResponse, at: float, since: float) -> goal_errors.Duals:
    """Return the dual problems of the traces at a time (s), of a step of the time ``since`` the last knot."""
    scales = goal_errors.scales_of_part(study.part, study.trace_goals, fine.scales)
    return goal_errors.Duals(study.trace_goals, problems, fine.answer.rises(np.array([at]))[0], scales, since)


def _indicators(
    study: Study, problems: Problems, estimator: Estimator, fine: FineResponse, lower: Quantities
) -> dict[str, np.ndarray]:
    """Return for each thermal trace its largest indicators at some times (s), each counted from the last bend or jump
    of the inputs: the first and the last time, and the times of the largest change of each rise and of the trace that
    changes most (after a jump perhaps the entering heat).

    The dual solution is of a single step from rest, which is too small where heat has passed a singular edge for long.
    So indicators are scaled by the ratio, at least 1, of the lower space's change to the contributions of either
    degree: one of two degrees does not change an even solution.
    """
    probes, changes = problems.domain.probes, largest_differences(fine.traces, lower)
    rises = [name for name, probe in study.trace_goals.items() if probes[probe].quantity == "temperature"]
    worst = max(changes, key=lambda n: changes[n] / fine.scales[n])
    at = {int(np.abs(fine.traces[n] - lower[n]).argmax()) for n in (*rises, worst)}
    knots, goals = np.append(0.0, problems.heat.inputs.knots(study.end)), dict[str, np.ndarray]()
    for time in fine.times[sorted({0, *at, len(fine.times) - 1})].tolist():
        duals = _duals(study, problems, fine, time, time - float(knots[knots < time].max()))
        at_jumps = duals.contradictions(estimator)
        for name, parts in duals.by_heat().items():
            remains = estimator.indicators(parts) + at_jumps.get(name, 0.0)
            size = max(float(np.abs(part).sum()) for part in parts) * fine.scales[name]
            remains *= max(changes[name] / max(size, 1e-300), 1.0)
            goals[name] = max(goals.get(name, remains), remains, key=np.sum)
    return goals


def _rows(study: Study, answer: Response, scales: dict[str, float]) -> tuple[np.ndarray, Quantities, dict[str, float]]:
    """Return the times of rows, also where errors begin to hold, the traces there, and the errors of lines between."""
    times, rows, between = choose_rows(
        [*(step.start for step in answer.steps), answer.end],
        lambda times: study.traces(outputs.of_transient(answer, study.part, times)),
        {name: ROW_SHARE * study.accuracy * scale for name, scale in scales.items()},
        jump_times(answer.heat.inputs, study.end).tolist(),
        (*study.instants, study.earliest, *map(sum, responses.waits(answer.heat, study.earliest, study.end))),
    )
    for probe in study.part.scene.probes if answer.heat.lifts.any() else ():
        # No mesh resolves the layer at the instant of a jump of a given temperature at t = 0.
        mean = probe.name in rows and probe.quantity == "temperature" and probe.reduce == "mean"
        if mean and probes.starts_free(answer.heat.domain, probe):
            rows[probe.name][0] = study.part.scene.initial_temperature
    return times, rows, between


def choose_rows(
    ends: Sequence[float],
    evaluate: Callable[[np.ndarray], dict[str, np.ndarray]],
    allowed: dict[str, float],
    jumps: Sequence[float] = (),
    instants: Sequence[float] = (),
) -> tuple[np.ndarray, dict[str, np.ndarray], dict[str, float]]:
    """Return times (s) from 0 on between which linear interpolation errs by at most ``allowed`` in each trace, the
    traces there, and the interpolation errors.

    The steps of the response, between their ``ends`` (s), are halved until a line is close enough at quarters and just
    after the start, where heat flows may jump with a bend of a drive. Traces may jump at ``jumps``: there are rows just
    before and at each. ``instants`` are rows too.
    """
    before = [b - 1e-9 * (b - a) for a, b in pairwise([0.0, *jumps])]
    within = [t for t in instants if 0.0 <= t <= ends[-1]]
    times = np.unique(np.array([*ends, *before, *jumps, *within]))
    rows, new = evaluate(times), np.flatnonzero(~np.isin(times[1:], jumps))
    worst, parts = dict.fromkeys(allowed, 0.0), np.array([0.01, 0.25, 0.5, 0.75])
    # A shorter interval is a jump.
    while len(new := new[times[new + 1] - times[new] > 1e-12 * times[-1]]):
        inner = times[new, None] * (1 - parts) + times[new + 1, None] * parts
        between = {name: y.reshape(inner.shape) for name, y in evaluate(inner.ravel()).items()}
        lines = {name: y[new, None] * (1 - parts) + y[new + 1, None] * parts for name, y in rows.items()}
        off = {name: np.abs(between[name] - lines[name]).max(axis=1) for name in allowed}
        coarse = np.any([off[name] > allowed[name] for name in allowed], axis=0)
        coarse &= len(times) + coarse.sum() <= MOST_ROWS
        worst = {name: max(worst[name], float(off[name][~coarse].max(initial=0.0))) for name in allowed}
        at = new[coarse]
        times = np.insert(times, at + 1, inner[coarse, 2])
        rows = {name: np.insert(y, at + 1, between[name][coarse, 2]) for name, y in rows.items()}
        first = at + np.arange(len(at))
        new = np.sort(np.concatenate([first, first + 1]))
    return times, rows, worst


def _imbalance(study: Study, answer: Response) -> float:
    """Return the largest |stored + lost - supplied| from the earliest time of interest on, over the larger of the heats
    that entered and left until then.

    Gauss's rule integrates over the steps independently of the time stepping. Lost heat comes from the reactions of the
    full equations, so the figure includes the error of the reduced space. At a jump of a given temperature the heat
    that its dofs store enters at that instant. Less heat than the rounding of temperatures counts as none.
    """
    heat, sudden = answer.heat, [0.0, *jump_times(answer.heat.inputs, study.end)]
    points, weights = np.polynomial.legendre.leggauss(12)
    edges = np.array([*(step.start for step in answer.steps), answer.end])
    # After a jump the loss starts like a power of t below any step: such a step is graded towards its start.
    at = np.flatnonzero(np.isin(edges[:-1], sudden))
    graded = edges[at, None] + np.diff(edges)[at, None] * 0.25 ** np.arange(8, 0, -1)
    edges = np.union1d(edges, graded)
    halves = np.diff(edges)[:, None] / 2
    times = edges[:-1, None] + halves * (points + 1)
    rates = outputs.heat_in_and_out(outputs.of_transient(answer, replace(study.part, probes={}), times.ravel()))
    entered, left = (np.cumsum((halves * rate.reshape(times.shape)) @ weights) for rate in rates)
    just_before = np.maximum(edges[1:] * (1 - 1e-12), edges[:-1])
    stored, after = np.split(outputs.stored_heat(answer, study.part, np.append(just_before, edges[:-1])), 2)
    jumped = np.where(np.isin(edges[:-1], sudden), after - np.append(0.0, stored[:-1]), 0.0)
    gap = np.abs(stored + left - entered - np.cumsum(jumped))
    rounding = outputs.SOLVE_ROUNDING * study.part.copies * max(heat.domain.scene.initial_temperature, 1.0)
    none = rounding * float(heat.unit @ (heat.mass @ heat.unit))
    late = edges[1:] >= min(study.earliest, edges[-1])
    passed = np.maximum(entered, left) + np.cumsum(np.abs(jumped))
    return float((gap / np.maximum(passed, none))[late].max())
