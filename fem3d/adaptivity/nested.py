"""The problems of a domain in its nested spaces, their steady solutions, contributions and extrapolated readings.

The space of degree p of each interval contains the spaces of degrees p - 1 and p - 2; their matrices are leading parts
of its matrix. The space of degree 3 on tetrahedra has the same structure.

Readings are extrapolated in the polynomial degree. On one mesh the error beside an edge of exponent s falls like p^-4s
with the degree p (Gui and Babuska, Numer. Math. 49, 1986), with a factor that keeps its sign. So later degrees move a
reading further in the same direction. The exponent s gives the ratio to its last change; energies are extrapolated
likewise (Szabo and Babuska, Finite Element Analysis, Wiley 1991, section 4.3). Each cell has its own exponent, and its
own dual-weighted contribution to the change.

On bricks contributions are separated by function, because the functions of one interval are nearly orthogonal. On flat
tetrahedra they are not, and contributions cancel. There the energy product of the difference of two spaces' fields with
a dual solution is integrated over each cell, which is independent of the basis.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np

from fem3d.adaptivity.estimator import Contributions, Estimator, degree_products, every_second
from fem3d.problems import conductors
from fem3d.problems.assembly import assemble, film
from fem3d.problems.current import Conductor
from fem3d.problems.heat import HeatProblem
from fem3d.problems.paths import Paths
from fem3d.results.outputs import Outputs, Quantities, Study, of_steady
from fem3d.solution.steady import SteadyState, solve_steady
from fem3d.spaces.bricks import BrickSpace
from fem3d.spaces.domain import Domain
from fem3d.spaces.mapped import Interface
from scenes import physics
from scenes.model import bends

Tested = Callable[[np.ndarray], np.ndarray]
"""From a dual solution (functions,) to the product of each cell, in parts of its sign for the three axes (3, cells)."""
SOLVED = 1e-8  # potentials are solved to this fraction of the accuracy; powers see the square of it


def _parts(products: np.ndarray, besides: np.ndarray | float = 0.0) -> np.ndarray:
    """Split the sum of the products (3, cells) of slopes and of other products ``besides`` into (3, cells) parts, in
    proportion to the absolute products of slopes."""
    sizes = np.abs(products)
    total = np.maximum(sizes.sum(axis=0), 1e-300)
    parts: np.ndarray = (products.sum(axis=0) + besides) * np.where(total > 1e-300, sizes / total, 1 / 3)
    return parts


def heat(problem: HeatProblem, change: np.ndarray, time: float | None) -> Tested:
    """Integrate k grad u . grad v over each cell for a ``change`` u (functions,) of the rise, with films and, half on
    each side, contacts; for a step of ``time`` (s) plus rho c u v / time."""
    domain = problem.domain
    on = domain.space.on(np.arange(len(domain.body)))
    flux = domain.per_cell("thermal_conductivity")[..., None] * on.weights * on.gradient(change)
    stored = 0.0
    if time is not None:
        stored = domain.per_cell("heat_capacity")[:, None] * on.weights * on.value(change) / time
    passing = []
    for b in domain.scene.boundaries:
        h = film(domain, b)[0] if bends(b) else b.value if b.kind == "convection" else 0.0
        if h:
            faces = domain.faces(b)
            passing.append((faces.value, h * faces.areas * faces.value(change), faces.cells[None]))
    for joint in domain.contacts:
        if joint.contact.thermal_resistance:
            face, pairs = Interface.inside(domain.space, joint.facets), domain.space.mesh.f2t[:, joint.facets]
            crossing = face.one.areas * face.jump(change) / joint.contact.thermal_resistance
            passing.append((face.jump, crossing, pairs))

    def tested(dual: np.ndarray) -> np.ndarray:
        besides = np.zeros(len(domain.body))
        if time is not None:
            besides += (stored * on.value(dual)).sum(axis=1)
        for value, heat, sides in passing:
            for cells in sides:
                besides += np.bincount(cells, (heat * value(dual)).sum(axis=1) / len(sides), len(besides))
        return _parts((flux * on.gradient(dual)).sum(axis=2), besides)

    return tested


def current(conductor: Conductor, change: np.ndarray) -> Tested:
    """Integrate sigma grad u . grad v over each cell of the cold conductor for a ``change`` u (functions,) of the
    potential, with contacts, half on each side."""
    on: Any = conductor.on
    count = len(conductor.heat.domain.body)
    flux = on.weights * on.gradient(change) / conductor.cold

    def tested(dual: np.ndarray) -> np.ndarray:
        products, rows = np.zeros((3, count)), (flux * on.gradient(dual)).sum(axis=2)
        products[:, conductor.cells] = rows[:, : len(conductor.cells)]
        return _parts(products, on.beside(rows[0], count) if isinstance(on, Paths) else 0.0)

    return tested


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
    def follows(self) -> bool:
        """Whether a property follows the temperature by a law."""
        return self.heat.follows or (self.conductor is not None and self.conductor.following is not None)

    @property
    def bricks(self) -> BrickSpace:
        """The space on a grid of bricks; each function belongs to one interval per axis."""
        assert isinstance(self.domain.space, BrickSpace)
        return self.domain.space

    def driven(self, factor: float) -> Problems:
        """Scale the voltages by a factor, or all heat loads and given values if there is no conductor."""
        conductors = tuple(c and replace(c, voltages=factor * c.voltages) for c in self.conductors)
        heats = self.heats
        if self.conductor is None:
            heats = tuple(replace(h, loads=factor * h.loads, given=factor * h.given) for h in heats)
        else:
            conductors = tuple(c and replace(c, heat=h) for c, h in zip(conductors, heats, strict=True))
        return replace(self, heats=heats, conductors=conductors, states={})

    def about(self, heat: HeatProblem) -> Problems:
        """Linearize the problems about the state of ``heat``, if the latter is linearized."""
        if heat.about is None:
            return self
        return replace(self, heats=(*(heat.lower(k) for k in range(len(self.heats) - 1)), heat))

    def lifted(self, rise: np.ndarray, level: int) -> np.ndarray:
        """(..., all nodes of the highest space): fields of a lower one."""
        return self.heat.take(self.heats[level].field(rise))

    def let_go(self) -> None:
        """Free the factors of the lower spaces, which a response about a steady state does not need."""
        for heat, conductor in zip(self.heats[:-1], self.conductors[:-1], strict=True):
            heat.let_go(steady=True)
            if conductor is not None:
                conductor.kept.let_go("solve_cold", "near")

    @property
    def cold_potentials(self) -> list[np.ndarray]:
        """(channels, functions) in each space: the potentials at the initial temperature, per unit of each channel."""
        return [conductor.cold_potentials for conductor in self.conductors if conductor is not None]

    @cached_property
    def electric_parts(self) -> Contributions:
        """Relative contributions of degrees p - 1 and p to the power of the cold conductor."""
        space, conductor = self.domain.electric.space, self.conductor
        if conductor is None:
            none = space.spread(np.empty(0, int), np.empty(0))
            return Contributions(none, none, space.pooled(none))
        potentials = self.cold_potentials
        powers = [max(float(np.einsum("cn,cn->", phi, (conductor.matrix @ phi.T).T)), 1e-300) for phi in potentials[1:]]
        if space.by_cells:
            # The power changes by the square of the change of the potential.
            return signed_parts([
                np.abs(np.sum([current(conductor, c)(c) for c in phi - lower], axis=0) / power)
                for (lower, phi), power in zip(pairwise(potentials), powers, strict=True)
            ])  # fmt: skip
        products = [
            (phi * (conductor.matrix @ lower.T).T).sum(axis=0) / power
            for (lower, phi), power in zip(pairwise(potentials), powers, strict=True)
        ]
        sizes = sum(
            (v * degree_products(conductor.matrix, v, space.depth) for v in potentials[-1]), np.zeros(space.size)
        )
        # The power changes by the square of the potential's change: no terms cancel.
        return parts_of(space, free_functions(self), [np.ones_like(p) for p in products], products, sizes)


def problems(domain: Domain, accuracy: float) -> Problems:
    """Return the problems of a domain, to be solved for a relative accuracy."""
    heat = assemble(domain)
    conductor = conductors.find(heat, SOLVED * accuracy)
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


def solution(study: Study, given: Problems, level: int = -1, start: np.ndarray | None = None) -> Solution:
    """Solve the steady state in one of the nested spaces, by default the highest.

    Newton's method begins at the fine state, else at ``start`` (functions,), a rise (K), if given.
    """
    level = range(len(given.heats))[level]
    if level not in given.states:
        heat, conductor = given.heats[level], given.conductors[level]
        fine = given.states.get(len(given.heats) - 1)
        if fine is not None:
            start = fine.heat.field(fine.rise)
            if heat.exact is not None:
                # Use the quadrature of laws of the fine state.
                conductor = fine.conductor and fine.conductor.lower(level, heat.exact)
        at = None if start is None else heat.take(start)
        thermal = physics.heat(given.domain.scene)
        given.states[level] = solve_steady(heat, conductor, study.voltage, study.accuracy, at, thermal)
    state = given.states[level]
    out = of_steady(state, study.part)
    return Solution(state, out, study.steady(out))


def free_functions(given: Problems) -> list[np.ndarray]:
    """Return the free functions of the potential in each space."""
    return [conductor.free for conductor in given.conductors if conductor is not None]


def parts_of(
    space: Any,
    free: Sequence[np.ndarray],
    duals: Sequence[np.ndarray],
    residuals: Sequence[np.ndarray],
    sizes: np.ndarray,
    tested: Sequence[Tested] = (),
) -> Contributions:
    """Return the contributions to one goal, from the ``free`` functions of each space, lowest first; ``duals`` and
    ``residuals`` of the space below (functions,) are of the two upper spaces, on cells replaced by changes to be
    ``tested``; ``sizes`` is the fine dual solution times `estimator.degree_products`."""
    new = [upper[np.isin(upper, lower, invert=True, kind="table")] for lower, upper in pairwise(free)]
    if not tested:
        products = [(dual * residual)[at] for dual, residual, at in zip(duals, residuals, new, strict=True)]
        *lower, last = (space.spread(at, product) for at, product in zip(new, products, strict=True))
        before = lower[-1] if lower else [np.zeros_like(x) for x in last]
        ratios = every_second(space, free[-1], sizes[free[-1]])
        return Contributions(before, last, ratios)
    products = []
    for at, dual, of_change in zip(new, duals, tested, strict=True):
        added = np.zeros(len(dual))
        added[at] = dual[at]
        products.append(of_change(added))
    return signed_parts(products)


def signed_parts(products: Sequence[np.ndarray]) -> Contributions:
    """Return the contributions on cells, from products (3, cells) of each degree; zero for the degree before if the
    spaces are only of degrees 1 and 2."""
    last = [*np.abs(products[-1])]
    nothing = [np.zeros_like(x) for x in last]
    before = [*np.abs(products[-2])] if len(products) > 1 else nothing
    return Contributions(before, last, nothing, products[-1].sum(axis=0))


def extrapolated(
    study: Study,
    given: Problems,
    fine: Solution,
    low: Solution,
    scales: Mapping[str, float],
    heat: Mapping[str, Contributions],
    current: Mapping[str, Contributions],
    estimator: Estimator,
) -> tuple[Solution, dict[str, float]]:
    """Return the fine solution with quantities extrapolated to later degrees, and the largest deviation of each.

    Quantities are not extrapolated where a study wants the fields' own values, nor where a law of the temperature
    causes errors away from edges: then return the solution as it is, and the largest change by later degrees, at least
    the change by the last one. ``heat`` and ``current`` are the contributions of the last degree to the goals on each
    cell, relative to the scales. The rest of a change comes by way of other quantities, and continues like all
    contributions together, including the contributions to the power.
    """
    known = study.extrapolated and not given.follows and given.heat.about is None
    kinds, power = ((heat, False), (current, True)), given.electric_parts
    every = [(parts.last, electric) for goals, electric in kinds for parts in goals.values()] + [(power.last, True)]
    sizes = [(np.sum(last, axis=0), electric) for last, electric in every]
    together = np.sum([[*estimator.later(size, electric), size.sum()] for size, electric in sizes], axis=0)
    mean, mean_doubt = together[:2] / max(together[2], 1e-300)
    quantities, doubts = dict(fine.quantities), dict[str, float]()
    for name, value in fine.quantities.items():
        last = other = float(value - low.quantities[name])
        expected = doubt = 0.0
        for goals, electric in kinds:
            if name in goals:
                signed = goals[name].signed * scales[name]
                other -= float(signed.sum())
                by_goal = estimator.later(signed, electric)
                expected, doubt = expected + by_goal[0], doubt + by_goal[1]
        expected, doubt = expected + mean * other, doubt + mean_doubt * abs(other)
        quantities[name] = value + expected
        doubts[name] = doubt if known else max(doubt + abs(expected), abs(last))
    return replace(fine, quantities=quantities) if known else fine, doubts
