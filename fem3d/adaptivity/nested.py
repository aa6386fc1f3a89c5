"""The problems of a domain in its nested spaces V(p-2) < V(p-1) < V(p), their steady solutions, the contributions of
degrees to goals, and extrapolated readings.

The basis is hierarchical: the matrices of lower spaces are leading parts of the matrix of V(p). Degree q contributes
a(u_q - u_(q-1), w_q) to a goal: the docstring of `fem3d.adaptivity.estimator` has the notation.

On one mesh the error beside an edge of exponent s falls like p^-4s with the degree p (Gui and Babuska, Numer. Math. 49,
1986), with a factor that keeps its sign. So later degrees move a reading further in the same direction, and s gives the
ratio to its last change; energies are extrapolated likewise (Szabo and Babuska, Finite Element Analysis, Wiley 1991,
section 4.3). Each cell has its own exponent and its own contribution.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from fem3d.adaptivity.estimator import Contributions, Estimator
from fem3d.problems import conductors
from fem3d.problems.assembly import assemble
from fem3d.problems.current import Conductor
from fem3d.problems.heat import HeatProblem
from fem3d.problems.linearized import LinearizedHeat, nonlinear
from fem3d.results.outputs import Outputs, Quantities, Study, of_steady
from fem3d.solution.newton import CoarseMeshError
from fem3d.solution.steady import SteadyState, solve_currents, solve_steady
from fem3d.spaces.domain import Domain
from fem3d.spaces.integrals import Space
from scenes import physics


@dataclass(frozen=True, eq=False)
class Problems:
    """The heat problem and the conductor of a domain in its nested spaces, the lowest first."""

    domain: Domain
    heats: tuple[HeatProblem, ...]
    conductors: tuple[Conductor | None, ...]
    states: dict[int, SteadyState] = field(default_factory=dict)
    """The steady states solved so far, by the number of the space."""

    @property
    def heat(self) -> HeatProblem:
        """The heat problem in the highest space."""
        return self.heats[-1]

    @property
    def conductor(self) -> Conductor | None:
        """The conductor in the highest space."""
        return self.conductors[-1]

    @property
    def nonlinear(self) -> bool:
        """Whether a law of the temperature makes the steady equations nonlinear."""
        return nonlinear(self.heat, self.conductor)

    def driven(self, factor: float, by_heat: bool) -> Problems:
        """Scale the voltages by a factor; or ``by_heat`` all heat loads and given values, without voltages."""
        heats, volts = self.heats, factor
        if by_heat:
            heats = tuple(replace(h, loads=factor * h.loads, given=factor * h.given) for h in heats)
            volts = 0.0
        conductors = tuple(
            c and replace(c, heat=h, voltages=volts * c.voltages) for c, h in zip(self.conductors, heats, strict=True)
        )
        return replace(self, heats=heats, conductors=conductors, states={})

    def linearized_about(self, heat: HeatProblem) -> Problems:
        """Linearize the problems about the state of ``heat``, if the latter is linearized."""
        if not isinstance(heat, LinearizedHeat):
            return self
        return replace(self, heats=(*(heat.lower(k) for k in range(len(self.heats) - 1)), heat))

    @property
    def cold_potentials(self) -> list[np.ndarray]:
        """(channels, functions) in each space: the potentials at the initial temperature, per unit of each channel."""
        return [conductor.cold_potentials for conductor in self.conductors if conductor is not None]

    def increments(self, rise: np.ndarray, time: float | None) -> list[np.ndarray]:
        """Split a ``rise`` u = u_(p-2) + d_(p-1) + d_p, each (all dofs,), and return the increments d, lowest first.

        a(d_q, v) = 0 for all v of V(q-1), with a of the steady problem, or of a step of ``time`` (s).
        """
        heat, increments = self.heat, list[np.ndarray]()
        for lower in self.heats[-2::-1]:
            increment = rise.copy()
            increment[np.isin(heat.order, lower.order, kind="table")] = 0.0
            load = lower.take(heat.field(self.apply(increment, time)))[: lower.free]
            solved = lower.solve_steady(load) if time is None else lower.solve_shifted(time)(time * load)
            increment = increment - heat.take(lower.field(solved))
            increments.insert(0, increment)
            rise = rise - increment
        return increments

    def apply(self, rise: np.ndarray, time: float | None) -> np.ndarray:
        """(all dofs,): a(u, .) of a ``rise`` u (all dofs,): K u, or for a step of ``time`` (s) K u + M u / time."""
        load: np.ndarray = self.heat.stiffness @ rise
        return load if time is None else load + self.heat.mass @ rise / time

    def by_heat(self, rise: np.ndarray, duals: Sequence[np.ndarray], time: float | None) -> list[Contributions]:
        """Return the contributions to goals by conduction at the initial temperature, and for a step of ``time`` (s) by
        the stored heat, of a ``rise`` (all dofs,) in the highest space; ``duals`` as for `in_added_functions`."""
        heat, domain, parts = self.heat, self.domain, self.increments(rise, time)
        weights = in_added_functions([h.order[: h.free] for h in self.heats], duals)
        capacity = np.zeros(len(domain.body)) if time is None else domain.per_cell("heat_capacity") / time
        properties = domain.per_cell("thermal_conductivity"), capacity
        residuals = [heat.field(self.apply(part, time)) for part in parts]
        return contributions(domain.space, properties, [heat.field(part) for part in parts], weights, residuals)

    def by_current(
        self, duals: Sequence[np.ndarray], potentials: Sequence[np.ndarray], whole: bool = False
    ) -> list[Contributions]:
        """Return the contributions to goals by the current of the cold conductor, for ``potentials`` (functions,) in
        each space; ``whole`` takes the dual solutions in all functions."""
        domain, conductor = self.domain, self.conductor
        assert conductor is not None
        weights = duals if whole else in_added_functions([c.free for c in self.conductors if c is not None], duals)
        conductivity = 1 / np.where(domain.live, domain.per_cell("resistivity"), np.inf)
        changes = [upper - lower for lower, upper in pairwise(potentials)]
        residuals = [-(conductor.matrix @ lower) for lower in potentials[:-1]]
        properties = conductivity, np.zeros(len(domain.body))
        return contributions(domain.electric.space, properties, changes, weights, residuals)

    @cached_property
    def power_contributions(self) -> Contributions:
        """Relative contributions of degrees p - 1 and p to the power of the cold conductor."""
        conductor, total = self.conductor, np.zeros((2, 3, len(self.domain.body)))
        if conductor is not None:
            powers = [max(float(np.sum(phi * (conductor.matrix @ phi.T).T)), 1e-300) for phi in self.cold_potentials]
            for channel in zip(*self.cold_potentials, strict=True):
                # The power changes by the square of the change of the potential: no terms cancel.
                pairs = zip(pairwise(channel), powers[1:], strict=True)
                changes = [(b - a)[None] / power for (a, b), power in pairs]
                total += self.by_current(changes, channel, whole=True)[0]
        return Contributions(*total)


def in_added_functions(free: Sequence[np.ndarray], duals: Sequence[np.ndarray]) -> list[np.ndarray]:
    """Return w_q (goals, functions) in each upper space: the dual solutions ``duals`` there, zero in the functions of
    the next lower space. ``free`` are the numbers of the free functions of all spaces, the lowest first."""
    weights = [np.zeros_like(dual) for dual in duals]
    for weight, dual, (lower, upper) in zip(weights, duals, pairwise(free), strict=True):
        new = upper[np.isin(upper, lower, invert=True, kind="table")]
        weight[:, new] = dual[:, new]
    return weights


def contributions(
    space: Space,
    properties: tuple[np.ndarray, np.ndarray],
    changes: Sequence[np.ndarray],
    weights: Sequence[np.ndarray],
    residuals: Sequence[np.ndarray],
) -> list[Contributions]:
    """Return the contributions of degrees p - 1 and p to each goal, zero for p - 1 if there are two spaces only.

    A cell contributes its part of int k grad d . grad w + c d w, with the change d of the solution and the dual weight
    w. The rest of the residual r(w), by convection, contacts and laws, enlarges the parts of all cells in proportion.

    Parameters
    ----------
    properties: conductivity (cells,) or (3, cells), and capacity (cells,).
    changes, residuals: (functions,) from each space to the next, and of each space but the highest.
    weights: (goals, functions) parts of the dual solutions in each space but the lowest.
    """
    parts = []
    for change, weight, residual in zip(changes, weights, residuals, strict=True):
        energies = space.energies(*properties, change, weight)
        rest, sizes = np.abs(weight @ residual - energies.sum(axis=(1, 2))), np.abs(energies).sum(axis=(1, 2))
        parts.append((1 + rest / np.maximum(sizes, 1e-300))[:, None, None] * energies)
    before, last = parts if len(parts) > 1 else (np.zeros_like(parts[0]), parts[0])
    return [Contributions(*each) for each in zip(before, last, strict=True)]


def discretize(domain: Domain, accuracy: float) -> Problems:
    """Return the problems of a domain, to be solved for a relative accuracy.

    Raises CoarseMeshError where a heated part has no free dof but on facets: no equation then sees inside its cells.
    """
    heat, space = assemble(domain), domain.space
    # Powers see the square of the error of potentials.
    conductor = conductors.assemble_conductor(heat, 1e-8 * accuracy)
    heated, free = [*(cells for _, cells in domain.sources), np.flatnonzero(domain.live)], heat.order[: heat.free]
    ends = np.cumsum([each.shape[1] for each in (space.mesh.p, space.mesh.edges, space.mesh.facets)])
    free = free[np.searchsorted(ends, space.entity[space.origin[free]], side="right") != 2]  # 2: on facets
    if physics.heat(domain.scene) and not all(space.functions_of(cells)[free].any() for cells in heated if len(cells)):
        raise CoarseMeshError("all nodes of a heated part have given temperatures")
    lower = [heat.lower(k) for k in range(len(domain.space.nested) - 1)]
    return Problems(
        domain, (*lower, heat), (*(conductor and conductor.lower(k, h) for k, h in enumerate(lower)), conductor)
    )


@dataclass(frozen=True, eq=False)
class Solution:
    """A steady state, its outputs and its quantities."""

    state: SteadyState
    out: Outputs
    quantities: Quantities


def solve_space(study: Study, problems: Problems, number: int = -1, start: np.ndarray | None = None) -> Solution:
    """Solve the steady state in one of the nested spaces, by default the highest.

    Newton's method begins at the fine state, else at ``start`` (functions,), a rise (K), if given.
    """
    number = range(len(problems.heats))[number]
    if number not in problems.states:
        heat, conductor = problems.heats[number], problems.conductors[number]
        fine = problems.states.get(len(problems.heats) - 1)
        start = start if fine is None else fine.heat.field(fine.rise)
        at = None if start is None else heat.take(start)
        potential = None if fine is None else fine.potential
        if physics.heat(problems.domain.scene):
            problems.states[number] = solve_steady(heat, conductor, study.drive, study.accuracy, at, potential)
        else:
            problems.states[number] = solve_currents(heat, conductor)
    state = problems.states[number]
    out = of_steady(state, study.part)
    return Solution(state, out, study.steady(out))


def extrapolate(
    study: Study,
    problems: Problems,
    fine: Solution,
    low: Solution,
    scales: Mapping[str, float],
    heat: Mapping[str, Contributions],
    current: Mapping[str, Contributions],
    estimator: Estimator,
) -> tuple[Solution, dict[str, float]]:
    """Return the fine solution with quantities extrapolated to later degrees, and the largest deviation of each.

    The last degree changes a quantity by d = J_p - J_(p-1), with contributions d_i of the cells i by ``heat`` and by
    ``current`` (relative to the scales). Theory gives the factors c_i of all later degrees (`Estimator.later`):

        J = J_p + sum_i c_i d_i + c (d - sum_i d_i).

    The rest comes by way of other quantities: c is the mean of the factors, also of the power. Where a study
    wants the fields' own values, or a law causes errors away from edges, return the solution as it is, and the largest
    change by later degrees, at least the change by the last one.
    """
    ways = (heat, False), (current, True)
    later = {name: [estimator.later(each[name], on) for each, on in ways if name in each] for name in fine.quantities}
    every = estimator.later(problems.power_contributions, True), *(part for parts in later.values() for part in parts)
    factors = np.abs(every).sum(axis=(0, 2))
    factors /= max(factors[0], 1e-300)
    quantities, doubts = dict(fine.quantities), dict[str, float]()
    known = study.extrapolated and not problems.nonlinear
    for name, value in fine.quantities.items():
        last = float(value - low.quantities[name])
        parts = scales[name] * sum((part.sum(axis=1) for part in later[name]), np.zeros(3))
        rest = last - float(parts[0])
        _, expected, doubt = (parts + factors * [rest, rest, abs(rest)]).tolist()
        quantities[name] = value + expected
        doubts[name] = doubt if known else max(doubt + abs(expected), abs(last))
    return replace(fine, quantities=quantities) if known else fine, doubts
