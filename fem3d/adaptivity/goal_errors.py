"""A level of the search for an accuracy: the solutions on one mesh in three nested spaces, and the errors they tell.

The space of the own degree of each interval or cell holds those of degrees lower by one and by two, whose matrices are
leading parts of its own. `fem3d.adaptivity.estimate` makes errors of what each takes away from the next lower one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np

from fem3d.adaptivity import cellwise, estimate, later
from fem3d.adaptivity.estimate import Estimator, Parts, Spread
from fem3d.adaptivity.nested import Problems, Solution, free_functions, parts_of, solution
from fem3d.problems.heat import HeatProblem
from fem3d.results import outputs
from fem3d.results.outputs import ROUNDING
from fem3d.results.probes import extreme, reading
from fem3d.results.study import Study
from fem3d.solution.steady import SteadyState
from meshes.symmetry import Symmetry
from scenes import physics
from scenes.errors import BeyondLawError, NumericsError

# Every temperature's stated error is at least this fraction of the worst one, relative to their scales: what is far
# smaller is so by chance (`validate stress`: "constants").
OF_WORST = 0.1

Duals = dict[str, list[np.ndarray]]
"""For each thermal goal the dual solutions (functions,) in the two upper spaces, zero at fixed nodes."""


@dataclass(frozen=True, eq=False)
class Level:
    """What is known of a mesh: its problems, the fine and the low solution, the quantities' scales and errors, and what
    each interval or cell misses for the power, and for each goal with it, relative to the scales; ``falls``: by
    which factors each degree takes away less than the one before (`estimate.falling`)."""

    problems: Problems
    fine: Solution
    low: Solution
    scales: dict[str, float]
    errors: dict[str, float]
    goals: dict[str, Spread]
    falls: Spread
    least: dict[str, float] = field(default_factory=dict)
    """On cells of any shape no error is smaller, whatever other meshes say: what isn't known of the change by degrees
    after the last (`fem3d.adaptivity.later`), and what the coupled iteration leaves."""
    extrapolated: bool = False
    """Whether the quantities of the fine solution have what is known of that change."""

    @property
    def relative(self) -> dict[str, float]:
        """The errors over their scales."""
        return {q: e / self.scales[q] for q, e in self.errors.items()}

    @property
    def worst(self) -> float:
        """The largest relative error."""
        return max(self.relative.values(), default=0.0)

    @property
    def unsettled(self) -> float:
        """What of each relative error is no mesh's, but that of iterations and of the quadrature of laws."""
        return self.fine.state.unsettled + self.low.state.unsettled


def examined(study: Study, given: Problems, fine: Solution, judge: Estimator) -> Level | None:
    """The level of a fine solution, of whose mesh ``judge`` knows how errors fall; None where a lower space has no
    steady state although the fine one has."""
    given = given.about(fine.state.heat)
    # Low degrees follow a current's pattern badly: only where the fine solution does is there an error in that.
    try:
        low = solution(study, given, 1, fine.state.follows_pattern)
    except BeyondLawError:
        raise
    except NumericsError:
        return None
    judge = judge.bending(given.bent())
    scales = study.steady_scales(fine.out)
    part_scales = of_part(study.part, study.goals, scales)
    duals = duals_of(study.goals, given, fine.state.rise, None)
    parts = steady_parts(study, given, fine, low, part_scales, duals)
    goals = {name: judge.remains(each) for name, each in parts.items()}
    rest = tail(goals, parts, judge.most)
    torn = at_contradictions(study.goals, given, fine.state.rise, part_scales, None, duals, judge)
    goals = summed(goals, torn)
    power = judge.remains(given.electric_parts)
    joule = joule_parts(study.goals, given, _warmed(given, fine.state), part_scales, duals)
    electric = given.electric_parts
    told = {n: estimate.total(each.last) + estimate.total(joule.get(n, electric).last) for n, each in parts.items()}
    goals = with_current(goals, {name: judge.remains(each) for name, each in joule.items()}, power)
    goals = {"power": power} | goals
    falls = how_fast(given, goals, parts, joule)
    unsettled = fine.state.unsettled + low.state.unsettled + ROUNDING
    errors = _errors(study, fine, low, scales, goals, told, estimate.total(power), unsettled, rest)
    if not given.domain.space.by_cells:
        return Level(given, fine, low, scales, errors, goals, falls)
    thermal = {name: each for name, each in parts.items() if name in duals}
    current = joule | {name: each for name, each in parts.items() if name not in duals}
    fine, doubts = later.extrapolated(study, given, fine, low, scales, thermal, current, judge)
    doubts |= {name: doubts[name] + estimate.total(spread) * scales[name] for name, spread in torn.items()}
    least = _with_others(study, fine, scales, doubts, unsettled)
    return Level(given, fine, low, scales, errors, goals, falls, least, later.known(study, given))


def of_part(part: Symmetry, goals: Mapping[str, str], scales: Mapping[str, float]) -> dict[str, float]:
    """What an error of each goal in the part that is solved is relative to: half the scale of a flow of which that is
    half."""
    return {name: scales[name] / max(abs(part.probes[probe][0]), 1e-300) for name, probe in goals.items()}


def with_current(goals: Mapping[str, Spread], joule: Mapping[str, Spread], power: Spread) -> dict[str, Spread]:
    """What goals miss, with what they miss of the Joule heat, or else of the power."""
    return summed(goals, {name: joule.get(name, power) for name in goals})


def how_fast(
    given: Problems, goals: Mapping[str, Spread], parts: Mapping[str, Parts], joule: Mapping[str, Parts]
) -> Spread:
    """`estimate.falling` of what ``goals`` miss, the power among them, by their parts and those of the Joule heat."""
    electric, pairs = given.electric_parts, []
    for name, spread in goals.items():
        if name not in parts:
            pairs.append((spread, electric.before, electric.last))
            continue
        thermal, current = parts[name], joule.get(name, electric)
        both = (thermal.before, current.before), (thermal.last, current.last)
        before, last = ([x + y for x, y in zip(*each, strict=True)] for each in both)
        pairs.append((spread, before, last))
    return estimate.falling(pairs)


def tail(goals: Mapping[str, Spread], parts: Mapping[str, Parts], most: float) -> float:
    """What is left over what the last degree took away, from 1 to ``most``, of all goals together, as if nothing
    cancelled."""
    took = sum(estimate.total(each.last) for each in parts.values())
    remains = sum(estimate.total(goals[n]) / each.seen for n, each in parts.items())
    return max(1.0, min(remains / took, most)) if took > 0 else 1.0


def _errors(
    study: Study,
    fine: Solution,
    low: Solution,
    scales: dict[str, float],
    goals: dict[str, Spread],
    told: Mapping[str, float],
    electric: float,
    unsettled: float,
    rest: float,
) -> dict[str, float]:
    """Estimated error of each quantity of the fine solution, in its unit. ``told`` and ``rest`` as of `_by_goals`."""
    changed = {name: abs(float(value - low.quantities[name])) for name, value in fine.quantities.items()}
    space = _by_goals(changed, scales, goals, told, rest) | _by_difference(changed, scales, goals, electric, rest)
    return _with_others(study, fine, scales, space, unsettled)


def _with_others(
    study: Study, fine: Solution, scales: dict[str, float], space: Mapping[str, float], unsettled: float
) -> dict[str, float]:
    """The errors of what ``space`` leaves of each quantity, ``unsettled`` (relative) of the coupled iteration, and the
    doubt of an extreme's place; and what quantities say of one another."""
    doubts = {name: float(fine.out.get(f"doubt:{study.goals.get(name)}", 0.0)) for name in space}
    errors = {name: space[name] + unsettled * scales[name] + doubts[name] for name in fine.quantities}
    errors |= _no_rise_far_better(study, errors, scales)
    errors = as_balanced(study, errors, fine, scales)
    return errors | _ratios_as_their_goals(study, errors, fine)


def as_balanced(
    study: Study, errors: Mapping[str, float], fine: Solution, scales: Mapping[str, float]
) -> dict[str, float]:
    """The errors, each at least what the heat balance leaves: of a heat flow that heat itself, of all else its part of
    what passes."""
    gap, part = outputs.unbalanced(fine.out)
    probes = fine.state.heat.domain.probes
    flows = {name for name, probe in study.goals.items() if probes[probe].quantity == "heat_flow"}
    return {name: max(e, part * scales[name], gap * (name in flows)) for name, e in errors.items()}


def _by_goals(
    changed: Mapping[str, float],
    scales: Mapping[str, float],
    goals: Mapping[str, Spread],
    told: Mapping[str, float],
    rest: float,
) -> dict[str, float]:
    """What goals miss, at least what the last degree ``changed`` (in the quantity's unit). What of that change goes
    beyond the parts that are ``told`` of it (relative) comes by way of other quantities, as from a temperature by the
    power to a heat flow: it leaves the ``rest`` of the goals too."""
    missed = {n: estimate.total(goals[n]) * scales[n] for n in changed if n in goals}
    beyond = {n: max(changed[n] - told.get(n, 0.0) * scales[n], 0.0) for n in missed}
    return {n: max(changed[n], missed[n] + rest * beyond[n]) for n in missed}


def _by_difference(
    changed: Mapping[str, float],
    scales: Mapping[str, float],
    goals: Mapping[str, Spread],
    electric: float,
    rest: float,
) -> dict[str, float]:
    """Of quantities without a goal of their own: what the last degree ``changed``, times what is left over it for the
    ``rest`` of the goals, and the relative error of the ``electric`` power."""
    return {n: rest * changed[n] + electric * scales[n] for n in changed if n not in goals}


def _no_rise_far_better(study: Study, errors: Mapping[str, float], scales: Mapping[str, float]) -> dict[str, float]:
    """Every rise's error is at least `OF_WORST` of the largest relative one of any rise."""
    worst = max((errors[name] / scales[name] for name in study.rises), default=0.0)
    return {name: max(errors[name], OF_WORST * worst * scales[name]) for name in study.rises}


def _ratios_as_their_goals(study: Study, errors: Mapping[str, float], fine: Solution) -> dict[str, float]:
    """A ratio's relative error is at least that of the goal that it divides."""
    values = {name: abs(float(value)) for name, value in fine.quantities.items()}
    return {name: max(errors[name], errors[goal] / values[goal] * values[name]) for name, goal in study.ratios.items()}


def steady_parts(
    study: Study, given: Problems, fine: Solution, low: Solution, scales: dict[str, float], duals: Duals
) -> dict[str, Parts]:
    """For each goal what the degrees p - 1 and p take away, relative to its scale; ``duals`` are of the fine rise."""
    heat, state = given.heat, low.state
    if not physics.heat(given.domain.scene):
        return _potentials(study, given, scales)
    source = heat.loads[0].copy()
    if state.conductor is not None:
        source += heat.take(state.conductor.on.load(state.conductor.heating(state.density, state.density, state.rise)))
    # Two degrees lower only the rate is asked for, which the heat of the low solution gives, at the conductivity of the
    # fine one.
    lowest = given.heats[0]
    nonlinear = heat.about is not None
    balanced = source + (heat.stiffness @ fine.state.rise - heat.outflow(fine.state.rise) if nonlinear else 0.0)
    to_lowest = lowest.take(heat.field(balanced))
    rise = lowest.lifts[0] + lowest.whole(lowest.solve_steady(to_lowest[: lowest.free]))
    residuals = (
        balanced - heat.stiffness @ given.lifted(rise, 0), source - heat.outflow(given.lifted(state.rise, 1))
    )  # fmt: skip
    thermal = thermal_parts(given, fine.state.rise, residuals, scales, None, duals)
    return thermal | _potentials(study, given, scales)


def thermal_parts(
    given: Problems,
    rise: np.ndarray,
    residuals: tuple[np.ndarray, ...],
    scales: Mapping[str, float],
    time: float | None,
    duals: Duals,
) -> dict[str, Parts]:
    """For each thermal goal the parts that residuals (all nodes) of the two lower spaces tell, over its scale;
    ``rise``, ``time`` and ``duals`` as of `duals_of`."""
    heat, space, parts = given.heat, given.domain.space, dict[str, Parts]()
    depth, residual_fields = space.depth[heat.order], heat.field(np.array(residuals))
    sizes = estimate.weights(heat.stiffness, rise, depth)
    if time is not None:
        sizes += estimate.weights(heat.mass, rise, depth) / time
    free = [h.order[: h.free] for h in given.heats]
    tested = []
    # Where a law makes the tangent, its heat is known of functions alone.
    if space.by_cells and heat.about is None and duals:
        for upper, residual in zip(given.heats[1:], residual_fields, strict=True):
            solve = upper.solve_steady if time is None else upper.solve_shifted(time)
            change = solve((time or 1.0) * upper.take(residual)[: upper.free])
            tested.append(cellwise.heat(heat, upper.field(change), time))
    for name, dual in duals.items():
        scaled = [z / scales[name] for z in dual]
        parts[name] = parts_of(space, free, scaled, [*residual_fields], dual[-1] * heat.field(sizes), tested)
    return parts


def duals_of(goals: Mapping[str, str], given: Problems, rise: np.ndarray, time: float | None) -> Duals:
    """The dual solutions of the steady problem, or of a step of ``time`` (s) from rest; ``rise`` is the fine solution,
    where extremes are looked for."""
    rows = {name: goal_row(given.heat, given.domain.probes[probe], rise) for name, probe in goals.items()}
    thermal = {name: row * (time or 1.0) for name, row in rows.items() if row is not None}
    if not thermal:
        return {}
    loads, fields = np.array(list(thermal.values())), []
    for heat in given.heats[1:]:
        fields.append(heat.field(heat.solve_dual(loads[:, : heat.free], time)))
    return {name: [each[i] for each in fields] for i, name in enumerate(thermal)}


def joule_parts(
    goals: Mapping[str, str],
    given: Problems,
    potentials: Sequence[np.ndarray],
    scales: Mapping[str, float],
    duals: Duals,
) -> dict[str, Parts]:
    """For each thermal goal what the degrees p - 1 and p take away of it because they change the Joule heat of some
    ``potentials`` (functions,), one in each space, of the cold conductor, over its scale.

    With the dual solution z of the goal, the goal sees the integral of z sigma |grad phi|^2. From phi to psi, that of
    the next higher space, it changes by that of z sigma grad(phi + psi) . grad(psi - phi), which is the residual of phi
    tested with w, where the integral of sigma grad w . grad v is that of z sigma grad(phi + psi) . grad v for all v of
    the higher space. The power, z = 1, changes by the square of what the potential does, as `electric_parts` has it;
    where the heat is seen away from what the potential lacks, by the whole of what the current does.
    """
    conductor = given.conductor
    if conductor is None or not duals or not any(phi.any() for phi in potentials):
        return {}
    heat, space = given.heat, given.domain.electric.space
    densities = [
        conductor.on.gradient(a + b) / (conductor.cold * conductor.stands_for) for a, b in pairwise(potentials)
    ]
    residuals = [-(conductor.matrix @ phi) for phi in potentials[:-1]]
    weights = estimate.weights(conductor.matrix, potentials[-1], space.depth)
    stills = []
    for name in duals:
        held = reading(heat, given.domain.probes[goals[name]]).boundaries
        stills.append(sum((heat.field(heat.held_fields[b]) for b in held), np.zeros(given.domain.space.size)))
    seen = []
    for k, (upper, density) in enumerate(zip(given.conductors[1:], densities, strict=True)):
        assert upper is not None
        pairs = zip(duals.values(), stills, strict=True)
        flows = np.array([conductor.on.flow(conductor.on.value(dual[k] - still) * density) for dual, still in pairs])
        seen.append(upper.respond(flows))
    tested = [cellwise.current(conductor, b - a) for a, b in pairwise(potentials)] if space.by_cells else []
    parts = {}
    for i, name in enumerate(duals):
        ws = [w[i] / scales[name] for w in seen]
        parts[name] = parts_of(space, free_functions(given), ws, residuals, seen[-1][i] * weights, tested)
    return parts


def _warmed(given: Problems, state: SteadyState) -> list[np.ndarray]:
    """(functions,) in each space: the potential of the cold conductor, at so many volts that the power is the state's;
    nothing where no heat is asked for."""
    conductor = state.conductor
    if conductor is None or not physics.heat(given.domain.scene):
        return []
    potentials = [phi[0] for phi in given.cold_potentials]
    power = float(potentials[-1] @ (conductor.matrix @ potentials[-1]))
    hot = float((conductor.on.weights * conductor.resistivity(state.rise) * (state.density**2).sum(axis=0)).sum())
    return [phi * np.sqrt(hot / max(power, 1e-300)) for phi in potentials]


def at_contradictions(
    goals: Mapping[str, str],
    given: Problems,
    rise: np.ndarray,
    scales: Mapping[str, float],
    time: float | None,
    duals: Duals,
    judge: Estimator,
) -> dict[str, Spread]:
    """For each thermal goal, over its scale, what edges take where given temperatures contradict each other; nothing
    without such edges. ``rise``, ``time`` and ``duals`` as of `duals_of`.

    The jump is spread over the first interval or cell beside the edge, and no degree changes that. What is wrong there
    enters with the heat of the dual solution, of which the functions of the edge have that of both sides: the jump
    times the residual of the dual problem at its node, in equal parts to the intervals that end there, or to the cells
    around it.
    """
    heat, space = given.heat, given.domain.space
    nodes = np.flatnonzero(heat.torn)
    if not len(nodes):
        return {}
    spreads = {}
    for name, of_spaces in duals.items():
        row = goal_row(heat, given.domain.probes[goals[name]], rise)
        assert row is not None
        dual = heat.take(of_spaces[-1])
        residual = row - heat.turned(dual) - (0.0 if time is None else heat.mass @ dual / time)
        spreads[name] = judge.at_vertices(space, heat.order[nodes], (heat.torn * residual)[nodes] / scales[name])
    return spreads


def summed(a: Mapping[str, Spread], b: Mapping[str, Spread]) -> dict[str, Spread]:
    """The spreads of ``a`` with those of ``b`` of the same names added."""
    return {n: [x + y for x, y in zip(spread, b[n], strict=True)] if n in b else spread for n, spread in a.items()}


def goal_row(heat: HeatProblem, probe: Any, rise: np.ndarray) -> np.ndarray | None:
    """(all nodes,): how a thermal probe follows the rise, at the point of an extreme; None for an electric one."""
    if probe.quantity not in ("temperature", "heat_flow"):
        return None
    how = reading(heat, probe)
    if how.extreme is None:
        # Tested with the dual solution minus its values at fixed nodes, whose heat is the reaction itself.
        return how.whole_row(heat)
    return heat.take(how.extreme.where(heat.field(rise)).row(heat.domain.space))


def _potentials(study: Study, given: Problems, scales: Mapping[str, float]) -> dict[str, Parts]:
    """For each potential that is read inside the conductor, and each current that crosses a contact there, the parts of
    its error, at the initial temperature."""
    domain, conductor, space = given.domain.electric, given.conductor, given.domain.electric.space
    if conductor is None:
        return {}
    crossing = {p for p, row in conductor.jumps.items() if row.any()}
    names = [n for n, p in study.goals.items() if p in crossing or domain.probes[p].quantity == "potential"]
    if not names:
        return {}
    *lower, fine = given.cold_potentials
    sizes, parts = estimate.weights(conductor.matrix, fine.sum(axis=0), space.depth), {}
    residuals = [(conductor.matrix @ phi.T).T.sum(axis=0) for phi in lower]
    pairs = pairwise([*lower, fine]) if space.by_cells else ()
    tested = [cellwise.current(conductor, (b - a).sum(axis=0)) for a, b in pairs]
    for name in names:
        probe = domain.probes[study.goals[name]]
        if probe.name in crossing:
            row = conductor.crossing_row(probe.name)
        elif probe.reduce == "mean":
            row = domain.mean(probe, domain.live)
        else:
            row = extreme(domain, probe, domain.live).where(fine.sum(axis=0)).row(space)
        duals = [upper.respond(row) / scales[name] for upper in given.conductors[1:] if upper is not None]
        parts[name] = parts_of(space, free_functions(given), duals, residuals, duals[-1] * scales[name] * sizes, tested)
    return parts
