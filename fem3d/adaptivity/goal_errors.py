"""Solve a mesh in its nested spaces and bound the errors of the steady quantities."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from fem3d.adaptivity import goal_parts, later
from fem3d.adaptivity.estimator import Contributions, Estimator, Spread, total
from fem3d.adaptivity.nested import Problems, Solution, solution
from fem3d.results import outputs
from fem3d.results.outputs import ROUNDING
from fem3d.results.study import Study
from meshes.symmetry import Symmetry
from scenes.errors import BeyondLawError, NumericsError

# Least error bound of a rise over the largest one, both relative: without it the mean rise of the Joule-heated bar of
# `validate verify` was off by 280 times its bound.
OF_WORST = 0.1

Errors = dict[str, float]


class Record(NamedTuple):
    """Values, estimated errors, scales and least errors of the quantities on one mesh, in their units."""

    values: Errors
    errors: Errors
    scales: Errors
    least: Errors


@dataclass(frozen=True, eq=False)
class Level:
    """The solution on one mesh with its error bounds.

    Attributes
    ----------
    problems: the problems in nested spaces.
    fine, low: the solutions in the highest space and in the next lower one.
    scales, errors: of each quantity, in its unit.
    goals: indicators of the power and of each goal with the power, relative to the scales.
    least: lower limit of the errors on cells, independent of other meshes: the deviation of the extrapolated change
        (`fem3d.adaptivity.later`) and the error of the coupled iteration.
    extrapolated: whether the fine quantities contain the expected change by later degrees.
    record: the estimates before a correction by earlier meshes (`fem3d.adaptivity.effectivity`), on cells.
    """

    problems: Problems
    fine: Solution
    low: Solution
    scales: Errors
    errors: Errors
    goals: dict[str, Spread]
    least: Errors = field(default_factory=dict)
    extrapolated: bool = False
    record: Record | None = None

    @property
    def relative(self) -> Errors:
        """The errors over their scales."""
        return {q: e / self.scales[q] for q, e in self.errors.items()}

    @property
    def worst(self) -> float:
        """The largest relative error."""
        return max(self.relative.values(), default=0.0)


def examined(study: Study, given: Problems, fine: Solution, estimator: Estimator) -> Level | None:
    """Bound the errors of a fine solution; None where a lower space has no steady state although the fine one has."""
    given = given.about(fine.state.heat)
    try:
        low = solution(study, given, -2)
    except BeyondLawError:
        raise
    except NumericsError:
        return None
    scales = study.steady_scales(fine.out)
    part_scales = of_part(study.part, study.goals, scales)
    duals = goal_parts.duals_of(study.goals, given, fine.state.rise, None)
    parts = goal_parts.steady_parts(study, given, fine, low, part_scales, duals)
    goals = {name: estimator.indicators(each) for name, each in parts.items()}
    factor = _factor(goals, parts, estimator)
    torn = goal_parts.at_contradictions(study.goals, given, fine.state.rise, part_scales, None, duals, estimator)
    electric, power = given.electric_parts, estimator.indicators(given.electric_parts)
    joule = goal_parts.joule_parts(study.goals, given, goal_parts.warmed(given, fine.state), part_scales, duals)
    by_current = {name: estimator.indicators(each) for name, each in joule.items()}
    goals = {"power": power} | with_current(goal_parts.summed(goals, torn), by_current, power)
    unsettled = fine.state.unsettled + low.state.unsettled + ROUNDING
    if given.domain.space.by_cells and estimator.extrapolates:
        thermal = {name: each for name, each in parts.items() if name in duals}
        current = joule | {name: each for name, each in parts.items() if name not in duals}
        better, doubts = later.extrapolated(study, given, fine, low, scales, thermal, current, estimator)
        doubts |= {name: doubts[name] + Estimator.bound(spread) * scales[name] for name, spread in torn.items()}
    else:
        better, doubts = fine, {}
    changed = {name: abs(float(value - low.quantities[name])) for name, value in fine.quantities.items()}
    errors = {}
    for name, change in changed.items():
        scale = scales[name]
        if name not in parts:
            errors[name] = factor * change + Estimator.bound(power) * scale
            continue
        # A change beyond the goal's own contributions comes from other goals, as from the power to a heat flow.
        own = total(parts[name].last) + total(joule.get(name, electric).last)
        errors[name] = max(change, Estimator.bound(goals[name]) * scale + factor * max(change - own * scale, 0.0))
    # An error far below the largest error of any rise is chance, as where odd degrees contribute nothing.
    largest = max((errors[name] / scales[name] for name in study.rises), default=0.0)
    errors |= {name: max(errors[name], OF_WORST * largest * scales[name]) for name in study.rises}
    errors = _with_others(study, fine, scales, errors, unsettled)
    least = _with_others(study, better, scales, doubts, unsettled) if doubts else {}
    return Level(given, better, low, scales, errors, goals, least, better is not fine)


def of_part(part: Symmetry, goals: Mapping[str, str], scales: Mapping[str, float]) -> Errors:
    """Return the scale of each goal in the solved part: a flow that symmetry halves has half its scale."""
    return {name: scales[name] / max(abs(part.probes[probe][0]), 1e-300) for name, probe in goals.items()}


def with_current(goals: Mapping[str, Spread], joule: Mapping[str, Spread], power: Spread) -> dict[str, Spread]:
    """Add to the indicators of goals the indicators of their Joule heat, or else of the power."""
    return goal_parts.summed(goals, {name: joule.get(name, power) for name in goals})


def _factor(goals: Mapping[str, Spread], parts: Mapping[str, Contributions], estimator: Estimator) -> float:
    """Return the error of all goals together over the contributions of the last degree, at least 1."""
    last = sum(total(each.last) for each in parts.values())
    error = sum(map(Estimator.bound, goals.values()))
    return max(1.0, min(error / last, estimator.largest_factor)) if last > 0 else 1.0


def _with_others(study: Study, fine: Solution, scales: Errors, space: Mapping[str, float], unsettled: float) -> Errors:
    """Add to errors of space the ``unsettled`` (relative) error of the coupled iteration and the doubt of an extreme's
    place; a ratio's relative error is at least the relative error of its divided goal."""
    doubts = {name: float(fine.out.get(f"doubt:{study.goals.get(name)}", 0.0)) for name in space}
    errors = {name: space[name] + unsettled * scales[name] + doubts[name] for name in fine.quantities}
    errors = as_balanced(study, errors, fine, scales)
    values = {name: abs(float(value)) for name, value in fine.quantities.items()}
    ratios = {
        name: max(errors[name], errors[goal] / values[goal] * values[name]) for name, goal in study.ratios.items()
    }
    return errors | ratios


def as_balanced(study: Study, errors: Mapping[str, float], fine: Solution, scales: Mapping[str, float]) -> Errors:
    """Raise each error to the imbalance of heat: in watts for a heat flow, else relative to the passing heat."""
    gap, part = outputs.unbalanced(fine.out)
    probes = fine.state.heat.domain.probes
    flows = {name for name, probe in study.goals.items() if probes[probe].quantity == "heat_flow"}
    return {name: max(e, part * scales[name], gap * (name in flows)) for name, e in errors.items()}
