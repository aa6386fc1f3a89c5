"""A level of the search for an accuracy: the solutions on one mesh in three nested spaces, and the errors they tell.

The space of the own degree of each interval or cell holds those of degrees lower by one and by two, whose matrices are
leading parts of its own. `fem3d.adaptivity.estimate` makes errors of what each takes away from the next lower one.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from fem3d.adaptivity import estimate, goal_parts, later
from fem3d.adaptivity.estimate import Estimator, Parts, Spread
from fem3d.adaptivity.nested import Problems, Solution, solution
from fem3d.results import outputs
from fem3d.results.outputs import ROUNDING
from fem3d.results.study import Study
from meshes.symmetry import Symmetry
from scenes.errors import BeyondLawError, NumericsError

# Every temperature's stated error is at least this fraction of the worst one, relative to their scales: what is far
# smaller is so by chance (`validate stress`: "constants").
OF_WORST = 0.1


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
    duals = goal_parts.duals_of(study.goals, given, fine.state.rise, None)
    parts = goal_parts.steady_parts(study, given, fine, low, part_scales, duals)
    goals = {name: judge.remains(each) for name, each in parts.items()}
    rest = tail(goals, parts, judge.most)
    torn = goal_parts.at_contradictions(study.goals, given, fine.state.rise, part_scales, None, duals, judge)
    goals = goal_parts.summed(goals, torn)
    power = judge.remains(given.electric_parts)
    joule = goal_parts.joule_parts(study.goals, given, goal_parts.warmed(given, fine.state), part_scales, duals)
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
    return goal_parts.summed(goals, {name: joule.get(name, power) for name in goals})


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
