"""Bound the errors of the steady quantities by dual-weighted residuals in nested spaces (`bound_errors`).

With the dual solution z of a goal and the residual r of the solution in the next lower space, a degree changes the goal
by the sum of z_i r_i over the functions i that it adds (`fem3d.adaptivity.estimator`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from fem3d.adaptivity import nested
from fem3d.adaptivity.estimator import Contributions, Estimator, tail
from fem3d.adaptivity.nested import Problems, Solution, solve_space
from fem3d.problems.heat import HeatProblem
from fem3d.problems.linearized import LinearizedHeat
from fem3d.results import outputs
from fem3d.results.outputs import SOLVE_ROUNDING, Study
from fem3d.results.probes import extreme, reading
from fem3d.solution.newton import CoarseMeshError
from fem3d.solution.steady import SteadyState, Tangent
from meshes.symmetry import Symmetry
from scenes import physics
from scenes.errors import BeyondLawError, NumericsError
from scenes.model import AnyProbe

BY_TEMPERATURE = "by temperature "  # begins the names of rows
Rows = dict[str, np.ndarray]
Errors = dict[str, float]


class Duals:
    """The dual solutions a(v, z) = J(v) of the thermal ``goals`` J (a probe by name), linearized about a ``rise`` (all
    dofs, K), of the steady problem or of a step of ``time`` (s) from rest. Extremes are located in the rise.

    Attributes
    ----------
    rows : by goal the load vector J (all dofs,) divided by its scale; and the rows of ``others`` as they are
    fields : in each of the upper spaces z (goals, functions), zero at fixed dofs
    """

    def __init__(
        self, goals: Mapping[str, str], problems: Problems, rise: np.ndarray, scales: Mapping[str, float],
        time: float | None = None, others: Mapping[str, np.ndarray] | None = None,
    ) -> None:  # fmt: skip
        self.problems, self.rise, self.time = problems, rise, time
        self.scales = scales
        self.probes = {name: problems.domain.probes[probe] for name, probe in goals.items()}
        rows = {name: goal_row(problems.heat, probe, rise) for name, probe in self.probes.items()}
        self.rows = {name: row / scales[name] for name, row in rows.items() if row is not None} | dict(others or {})
        loads = (time or 1.0) * np.array([*self.rows.values()])
        uppers = problems.heats[1:] if self.rows else ()
        self.fields = [heat.field(heat.solve_dual(loads[:, : heat.free], time)) for heat in uppers]

    def by_heat(self) -> dict[str, Contributions]:
        """Return the contributions of degrees p - 1 and p to each goal by the heat."""
        if not self.rows:
            return {}
        return dict(zip(self.rows, self.problems.by_heat(self.rise, self.fields, self.time), strict=True))

    def by_joule_heat(self, potentials: Sequence[np.ndarray]) -> dict[str, Contributions]:
        """Return the contributions of degrees p - 1 and p to each goal by way of the Joule heat.

        ``potentials`` (functions,), one in each space, are of the cold conductor. A goal with dual solution z contains
        int z sigma |grad phi|^2. From phi to psi in the next higher space it changes by

            int z sigma grad(phi + psi) . grad(psi - phi) = r(w),

        the residual r of phi tested with w, which solves int sigma grad w . grad v = int z sigma grad(phi + psi) .
        grad v for all v of the higher space. The power, z = 1, changes by the square of the change of the potential
        (`Problems.power_contributions`).
        """
        problems, conductor = self.problems, self.problems.conductor
        if conductor is None or not self.rows or not any(phi.any() for phi in potentials):
            return {}
        densities = [conductor.on.gradient(a + b) / conductor.cold for a, b in pairwise(potentials)]
        seen = []
        for upper, density, duals in zip(problems.conductors[1:], densities, self.fields, strict=True):
            assert upper is not None
            flows = [conductor.on.flow(conductor.on.value(z) * density) for z in duals - self._reactions]
            seen.append(upper.respond(np.array(flows)))
        return dict(zip(self.rows, problems.by_current(seen, potentials), strict=True))

    def by_power(self, state: SteadyState, resistance: Contributions | None) -> dict[str, Contributions]:
        """Return the contributions to each goal by the power, which changes at most as the ``resistance`` does by the
        temperature: a goal with dual solution z contains int z rho |J|^2."""
        if resistance is None or state.conductor is None:
            return {}
        load = self.problems.heat.field(state.conductor.joule_load(state.density, state.rise))
        parts = zip(self.rows, (self.fields[-1] - self._reactions) @ load, strict=True)
        return {name: Contributions(*(part * each for each in resistance)) for name, part in parts}

    @cached_property
    def _reactions(self) -> np.ndarray:
        """(goals, functions): the values at fixed dofs that make a goal the reaction there, over the scales."""
        heat, reactions = self.problems.heat, []
        for name in self.rows:
            boundaries = reading(heat, self.probes[name]).boundaries if name in self.probes else ()
            reaction = sum((heat.field(heat.shares[b]) for b in boundaries), np.zeros(heat.domain.space.size))
            reactions.append(reaction / self.scales.get(name, 1.0))
        return np.array(reactions)

    def contradictions(self, estimator: Estimator) -> dict[str, np.ndarray]:
        """Return indicators of each goal at edges where given temperatures contradict each other; empty without them.

        At any degree the jump is spread over the first interval or cell beside the edge. The error is the jump times
        the residual of the dual problem at its dof, whose functions carry the dual heat of both sides: in equal parts
        to the intervals that end there, or to the cells around it.
        """
        heat, indicators = self.problems.heat, {}
        jumps = np.flatnonzero(heat.contradiction)
        for i, (name, row) in enumerate(self.rows.items() if len(jumps) else ()):
            dual = heat.take(self.fields[-1][i])
            stored = 0.0 if self.time is None else heat.mass @ dual / self.time
            parts = (heat.contradiction * (row - heat.apply_transposed(dual) - stored))[jumps]
            indicators[name] = estimator.at_vertices(self.problems.domain.space, heat.order[jumps], parts)
        return indicators


def potentials_at_power(problems: Problems, state: SteadyState) -> list[np.ndarray]:
    """Scale the cold potential (functions,) in each space to the power of a state; none without a heat problem."""
    if state.conductor is None or not physics.heat(problems.domain.scene):
        return []
    potentials = [phi[0] for phi in problems.cold_potentials]
    power = float(potentials[-1] @ (state.conductor.matrix @ potentials[-1]))
    return [phi * np.sqrt(max(state.power, 0.0) / max(power, 1e-300)) for phi in potentials]


def goal_row(heat: HeatProblem, probe: AnyProbe, rise: np.ndarray) -> np.ndarray | None:
    """Return the load vector (all dofs,) of a thermal probe, at an extreme's point; None for an electric probe."""
    if probe.quantity not in ("temperature", "heat_flow"):
        return None
    how = reading(heat, probe)
    if how.extreme is None:
        # Tested with the dual solution minus its values at fixed dofs, whose heat is the reaction itself.
        return sum((heat.reaction_rows[name][0] for name in how.boundaries), how.row)
    return heat.take(how.extreme.where(heat.field(rise)).row(heat.domain.space))


def warming_rows(
    study: Study, problems: Problems, state: SteadyState, scales: Mapping[str, float], electric: Rows
) -> Rows:
    """Return load vectors (all dofs,) by which a change v of the temperature changes electric quantities.

    The resistance changes by int (drho/dT) |J|^2 v over the power. A potential changes by -int (drho/dT) J . D v, where
    D is the current of its influence in the cold conductor (`Conductor.influence`), which is near that in the hot one.
    """
    conductor, density = state.conductor, state.density
    if conductor is None or not conductor.warms or not state.power or not physics.heat(problems.domain.scene):
        return {}
    steep = conductor.steepness(state.rise) * conductor.resistivity(state.rise)

    def row(other: np.ndarray) -> np.ndarray:
        return conductor.heat.take(conductor.on.load(steep * (density * other).sum(axis=0)))

    power = float((conductor.on.weights * conductor.heating(density, density, state.rise)).sum())
    rows = {BY_TEMPERATURE: row(density) / power}
    for name, at in electric.items():
        if problems.domain.electric.probes[study.goals[name]].quantity == "potential":
            rows[BY_TEMPERATURE + name] = -row(conductor.influence(at)[1]) / scales[name]
    return rows


def _potentials(problems: Problems, scales: Mapping[str, float], rows: Rows) -> dict[str, Contributions]:
    """Return the contributions to potentials in the cold conductor, and to currents across its contacts."""
    if not rows:
        return {}
    potentials, loads = [phi.sum(axis=0) for phi in problems.cold_potentials], [r / scales[n] for n, r in rows.items()]
    duals = [upper.respond(np.array(loads)) for upper in problems.conductors[1:] if upper is not None]
    return dict(zip(rows, problems.by_current(duals, potentials), strict=True))


def _electric_rows(study: Study, problems: Problems) -> Rows:
    """Return the functionals (functions,) of the potential for potentials and for currents across contacts."""
    domain, conductor, rows = problems.domain.electric, problems.conductor, dict[str, np.ndarray]()
    if conductor is None:
        return rows
    crossing = {p for p, section in conductor.sections.items() if section.jumps.any()}
    for name, at in study.goals.items():
        probe = domain.probes[at]
        if at in crossing:
            rows[name] = conductor.crossing_row(at)
        elif probe.quantity == "potential" and probe.reduce == "mean":
            rows[name] = domain.mean(probe, domain.live)
        elif probe.quantity == "potential":
            potential = problems.cold_potentials[-1].sum(axis=0)
            rows[name] = extreme(domain, probe, domain.live).where(potential).row(domain.space)
    return rows


class Record(NamedTuple):
    """Values, estimated errors, scales and sums of indicators of the quantities on one mesh, in their units."""

    values: Errors
    errors: Errors
    scales: Errors
    indicated: Errors


@dataclass(frozen=True, eq=False)
class Level:
    """The solution on one mesh with its error bounds.

    Attributes
    ----------
    problems: the problems in nested spaces.
    fine, low: the solutions in the highest space and in the next lower one.
    scales, errors: of each quantity, in its unit.
    goals: indicators of the power and of each goal with the power, relative to the scales.
    least: lower limit of the errors, independent of other meshes: the deviation of the extrapolated change
        (`fem3d.adaptivity.nested`), the imbalance of heat and the error of the coupled iteration.
    extrapolated: the fine quantities to which the expected change by later degrees is added.
    record: the estimates before a correction by earlier meshes (`fem3d.adaptivity.cell_mesh`), on cells.
    """

    problems: Problems
    fine: Solution
    low: Solution
    scales: Errors
    errors: Errors
    goals: dict[str, np.ndarray]
    least: Errors
    extrapolated: frozenset[str] = frozenset()
    record: Record | None = None

    @property
    def relative(self) -> Errors:
        """The errors over their scales."""
        return {q: e / self.scales[q] for q, e in self.errors.items()}

    @property
    def worst(self) -> float:
        """The largest relative error."""
        return max(self.relative.values(), default=0.0)


def bound_errors(study: Study, problems: Problems, fine: Solution, estimator: Estimator) -> Level:
    """Bound the errors of a fine solution; raise CoarseMeshError where a lower space has no steady state.

    With indicators eta of a quantity J by heat and by current, from contributions d_i of the last degree, the bound is

        max(d, sum eta + r) + other errors (`_add_others`),    d = |J_p - J_(p-1)|,    r = max(d - sum |d_i|, 0).

    The indicators by heat are of its probe, or for an electric quantity of the temperature's effect on it; by current
    of the Joule heat or the potential, or else of the power. A thermal quantity also has indicators by the
    temperature's effect on the power.
    """
    problems = problems.linearized_about(fine.state.heat)
    try:
        low = solve_space(study, problems, -2)
    except BeyondLawError:
        raise
    except NumericsError as error:
        raise CoarseMeshError("the mesh is too coarse for a steady state in each of its spaces") from error
    scales = study.steady_scales(fine.out)
    rows, part_scales = _electric_rows(study, problems), scales_of_part(study.part, study.goals, scales)
    others = warming_rows(study, problems, fine.state, scales, rows)
    duals = Duals(study.goals, problems, fine.state.rise, part_scales, others=others)
    thermal, electric = duals.by_heat(), _potentials(problems, scales, rows)
    heat = {name: each for name, each in thermal.items() if name not in others}
    current = duals.by_joule_heat(potentials_at_power(problems, fine.state)) | electric
    power, at_jumps = problems.power_contributions, duals.contradictions(estimator)
    goals, errors = {"power": estimator.indicators(power)}, dict[str, float]()
    by_power = duals.by_power(fine.state, thermal.get(BY_TEMPERATURE))
    with_dual, slowest = {*heat, *electric, *study.ratios}, float(tail(estimator.degrees, estimator.slowest).max())
    for name, value in fine.quantities.items():
        # A given current does not follow the resistance.
        given = name not in electric and problems.conductor is not None and problems.conductor.current_driven
        by_warming = None if given else thermal.get(BY_TEMPERATURE + name, thermal.get(BY_TEMPERATURE))
        of_name = heat.get(name, by_warming), current.get(name, power), by_power.get(name)
        parts = [each for each in of_name if each is not None]
        goals[name] = sum((estimator.indicators(each) for each in parts), at_jumps.get(name, np.zeros_like(power.last)))
        # The rest of a change comes from other goals. Without a dual solution it may continue as slowly as beside the
        # sharpest edge.
        change = abs(float(value - low.quantities[name])) / scales[name]
        rest = max(change - np.abs([each.last for each in parts]).sum(), 0.0)
        rest *= 1.0 if name in with_dual else slowest
        errors[name] = scales[name] * max(change, float(goals[name].sum()) + rest)
    better, doubts = fine, dict.fromkeys(errors, 0.0)
    if estimator.later_factors is not None:
        better, doubts = nested.extrapolate(study, problems, fine, low, scales, heat, current, estimator)
        doubts = {name: doubt + scales[name] * float(np.sum(at_jumps.get(name, 0.0))) for name, doubt in doubts.items()}
    missed = [_by_quadratures(study, solution) for solution in (fine, low)]
    unsettled = fine.state.unsettled + low.state.unsettled + SOLVE_ROUNDING
    beside = {name: sum(each[name] for each in missed) + unsettled * scales[name] for name in errors}
    errors, least = (_add_others(study, fine, scales, each, beside) for each in (errors, doubts))
    moved = frozenset(name for name, value in fine.quantities.items() if better.quantities[name] != value)
    return Level(problems, better, low, scales, errors, goals, least, moved)


def scales_of_part(part: Symmetry, goals: Mapping[str, str], scales: Mapping[str, float]) -> Errors:
    """Return the scale of each goal in the solved part: a flow that symmetry halves has half its scale."""
    return {name: scales[name] / max(abs(part.probes[probe][0]), 1e-300) for name, probe in goals.items()}


def _by_quadratures(study: Study, solution: Solution) -> Errors:
    """Estimate the errors by quadratures of laws: the sums of the changes by finer ones."""
    others = []
    if isinstance(solution.state.heat, LinearizedHeat):
        states = Tangent(solution.state, study.accuracy).by_finer_quadratures()
        others = [study.steady(outputs.of_steady(state, study.part)) for state in states]
    own = solution.quantities
    return {name: float(sum(abs(each[name] - own[name]) for each in others)) for name in own}


def _add_others(study: Study, fine: Solution, scales: Errors, space: Mapping[str, float], beside: Errors) -> Errors:
    """Add to errors of space the errors ``beside`` and the doubt of an extreme's place. An error is at least the
    imbalance of heat, in watts for a heat flow, else relative to the passing heat; a ratio's relative error is at least
    the relative error of its divided goal."""
    gap, part = outputs.heat_imbalance(fine.out)
    probes, errors = fine.state.heat.domain.probes, dict[str, float]()
    for name, error in space.items():
        probe = study.goals.get(name)
        imbalance = gap if probe is not None and probes[probe].quantity == "heat_flow" else 0.0
        doubt = float(fine.out.get(f"doubt:{probe}", 0.0))
        errors[name] = max(error + beside[name] + doubt, part * scales[name], imbalance)
    values = {name: abs(float(value)) for name, value in fine.quantities.items()}
    ratios = {
        name: max(errors[name], errors[goal] / values[goal] * values[name]) for name, goal in study.ratios.items()
    }
    return errors | ratios
