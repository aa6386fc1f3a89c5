"""The electric problem: div(sigma(T) grad phi) = 0 in the conductors that carry current, between electrodes.

Potentials are functions of the whole space, zero where no current flows. Voltages come as channels
(`statespace.channels`)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.sparse import csc_array

from fem3d.problems.cholesky import Factors, Kept, Ordering, part
from fem3d.problems.following import MOST_GMRES, OfCells, solve_by_gmres
from fem3d.problems.heat import HeatProblem
from fem3d.problems.paths import Paths, Pattern, Potential, Terminal
from fem3d.spaces.integrals import Faces
from scenes.errors import NumericsError

SOLVED = 1e-12  # relative error of a potential, unless a looser bound is given
# Factor on the condition number above which a preconditioner is made anew: steps grow with its root, and a
# factorization takes as long as some 10 steps.
WORSE = 10.0
Resistivity = Callable[[np.ndarray], np.ndarray]
"""The resistivity (ohm m) at a rise (K)."""
Section = list[tuple[Faces, Faces, float, Resistivity]]
"""Faces inside a conductor by the functions of the potential and by those of the temperature, half the sign of their
normal, and the resistivity there."""


@dataclass(frozen=True, eq=False)
class Conductor:
    """The cells that carry current, their resistivity and their electrodes: div(grad phi / rho(T)) = 0.

    Rows are the ``cells`` and, after these, the facets of contacts that the current crosses (`fem3d.problems.paths`).
    Resistivities are along x; current densities (3, rows, points) match them there.

    Attributes
    ----------
    heat : the problem of the temperature
    cells : (n,), numbers of the cells
    on : quadrature on the rows
    free : (m,), the functions of the unknown potential
    cold, warm : (rows, 1), resistivity at the initial temperature (ohm m) and its change per kelvin
    voltages : (channels, functions), given potentials; for a terminal the voltage behind its resistance, or its current
    electrodes : for each its share (functions,) of the entering currents
    sections : facets of the current probes inside
    jumps : for each current probe the row (functions,) of its part on contacts
    matrix : (functions, functions), at the initial temperature
    names : (rows,), bodies and contacts
    ordering : of the factorization
    solved : the allowed residual of a potential, relative
    terminals : electrodes of unknown potential
    following : the resistivity (ohm m) of rows with a law, which ``cold`` and ``warm`` leave out
    more : points of the quadrature along each axis beyond the default of the space
    """

    heat: HeatProblem
    cells: np.ndarray
    on: Any
    free: np.ndarray
    cold: np.ndarray
    warm: np.ndarray
    voltages: np.ndarray
    electrodes: dict[str, np.ndarray]
    sections: dict[str, Section]
    jumps: dict[str, np.ndarray]
    matrix: csc_array
    names: np.ndarray
    ordering: Ordering
    solved: float = SOLVED
    terminals: tuple[Terminal, ...] = ()
    following: OfCells | None = None
    more: int = 0
    kept: Kept = field(init=False, default_factory=Kept)

    def lower(self, level: int, heat: HeatProblem) -> Conductor:
        """The problem in a lower space, for the heat problem there."""
        return replace(self, heat=heat, free=self.free[self.space.nested[level][self.free]])

    @property
    def space(self) -> Any:
        """The space of the potential."""
        return self.heat.domain.electric.space

    def resistivity(self, rise: np.ndarray) -> np.ndarray:
        """(cells, points) in ohm m at a rise (all nodes of the heat problem)."""
        if not self.warms:
            return np.broadcast_to(self.cold, self.on.weights.shape)
        # The resistivity of the last rise serves its current, its heat and the test of conduction.
        last, known = self.kept.get("resistivity", lambda: (None, None))
        if last is None or not np.array_equal(last, rise):
            at = self.on.value(self.heat.field(rise))
            law = self.following
            known = self.cold + self.warm * at if law is None else self._by_law(law.value, at, self.cold)
            self.kept.tell(resistivity=(rise.copy(), known))
        return np.asarray(known)

    def steepness(self, rise: np.ndarray) -> np.ndarray:
        """(cells, points): the derivative of the resistivity's logarithm (1/K) at a rise (all nodes)."""
        if self.following is None:
            return self.warm / self.resistivity(rise)
        at = self.on.value(self.heat.field(rise))
        slope = self._by_law(self.following.slope, at, np.zeros_like(self.cold))
        return slope / self.resistivity(rise)

    def _by_law(self, law: Resistivity, rise: np.ndarray, others: np.ndarray) -> np.ndarray:
        """(rows, points): a law of the cells at a rise, and behind them ``others`` (rows, 1), which follow nothing."""
        n = len(self.cells)
        in_cells = law(rise[:n])
        return np.concatenate([in_cells, np.broadcast_to(others[n:], rise[n:].shape)]) if len(rise) > n else in_cells

    def finer(self, points: int) -> Conductor:
        """By a quadrature of so many more points along each axis, where the resistivity is a law; else itself."""
        if self.following is None:
            return self
        more = self.more + points
        on: Any = self.heat.domain.space.on(self.cells, more)
        if isinstance(self.on, Paths):
            on = self.on.finer(on, self.space.on(self.cells, more))
        finer = replace(self, on=on, more=more)
        finer.kept.tell(near=self.kept.get("near", lambda: None))
        return finer

    def near(self, resistivity: np.ndarray) -> Conductor:
        """Return a conductor with one conductivity in each cell, as a preconditioner at a ``resistivity`` (rows,
        points): the last one, or the mean conductivities where these have a far smaller condition number."""
        near: Conductor = self.kept.get("near", lambda: None) or self
        inside = self.on.weights > 0
        weights = np.where(inside, self.on.weights, 0.0)
        mean = weights.sum(axis=1, keepdims=True) / (weights / resistivity).sum(axis=1, keepdims=True)

        def condition(base: np.ndarray) -> float:
            ratio = (resistivity / base)[inside]
            return float(ratio.max() / ratio.min())

        if condition(near.cold) > WORSE * condition(mean):
            near = replace(self, cold=mean)
            change = near.conductivity - self.conductivity
            near = replace(near, matrix=csc_array(self.matrix + self.space.stiffness(change, self.cells)))
            self.kept.tell(near=near)
        return near

    @property
    def conductivity(self) -> np.ndarray:
        """(3, cells), or (cells,) where it is the same along all axes: at the initial temperature (S/m)."""
        conductivity: np.ndarray = 1 / self.cold[: len(self.cells), 0]
        return conductivity / self.on.roots[..., 0] ** 2 if isinstance(self.on, Paths) else conductivity

    def taken(self, density: np.ndarray, dissipated: float) -> float:
        """Return the share of the drive that falls in the conductor, which ``dissipated`` a power (W): the rest falls
        in the resistances of terminals, and a given current does not depend on the conductor."""
        if self.by_current:
            return 0.0
        charge = self.on.flow(density)
        outside = sum(float(t.unit @ charge) ** 2 * t.resistance for t in self.terminals if t.conductance)
        return dissipated / (dissipated + outside) if dissipated > 0 else 1.0

    @property
    def draws_current(self) -> bool:
        """Whether the current of any electrode is given."""
        return any(np.isinf(t.resistance) for t in self.terminals)

    @property
    def warms(self) -> bool:
        """Whether any resistivity depends on the temperature."""
        return self.following is not None or bool(self.warm.any())

    def conducts(self, rise: np.ndarray) -> bool:
        """Whether the resistivity is positive everywhere."""
        return bool((self.resistivity(rise) > 0).all())

    @property
    def solve_cold(self) -> Callable[[np.ndarray], np.ndarray]:
        """Solver of the potential (free,) of the cold conductor for charges (free,) between earthed electrodes."""
        groups = self.space.entity[self.free]
        solve: Callable[[np.ndarray], np.ndarray]
        solve = self.kept.get("solve_cold", lambda: Factors(part(self.matrix, self.free), groups, self.ordering).solve)
        return solve

    def respond(self, charge: np.ndarray) -> np.ndarray:
        """(..., functions): the potentials of the cold conductor for charges (..., functions), all given voltages and
        currents being zero. Terminals get the charges tested with their unit functions."""
        potentials = np.zeros_like(charge)
        potentials[..., self.free] = self.solve_cold(charge[..., self.free])
        if not self.terminals:
            return potentials
        shapes, inverse = self._floating
        # A row of the whole problem, tested with a shape: the free functions drop out.
        seen = np.zeros_like(charge)
        seen[..., self.free] = charge[..., self.free]
        entering = np.stack([charge @ t.unit for t in self.terminals], axis=-1)
        return potentials + (seen @ shapes.T + entering) @ inverse @ shapes

    @property
    def _floating(self) -> tuple[np.ndarray, np.ndarray]:
        """The potentials (terminals, functions) of the cold conductor with one terminal at 1 V and all else earthed,
        and the inverse of the matrix of currents (A/V) that enter the terminals then and pass their resistances."""

        def solved() -> tuple[np.ndarray, np.ndarray]:
            shapes = np.array([t.unit for t in self.terminals])
            charge = (self.matrix @ shapes.T).T
            shapes[:, self.free] = -self.solve_cold(charge[:, self.free])
            matrix = shapes @ (self.matrix @ shapes.T) + np.diag([t.conductance for t in self.terminals])
            return shapes, np.linalg.inv(matrix)

        known: tuple[np.ndarray, np.ndarray] = self.kept.get("floating", solved)
        return known

    def given(self, voltage: np.ndarray) -> np.ndarray:
        """Given voltages (functions,) with terminals at zero."""
        earthed = voltage.copy()
        for t in self.terminals:
            earthed[t.unit > 0] = 0.0
        return earthed

    def _charge(self, voltage: np.ndarray) -> np.ndarray:
        """(functions,): the reactions of the cold conductor to given values."""
        charge = -(self.matrix @ self.given(voltage))
        for t in self.terminals:
            charge[t.at] += float(t.load(voltage))
        return charge

    @property
    def cold_potentials(self) -> np.ndarray:
        """(channels, functions): the potentials at the initial temperature, per unit of each channel."""

        def solved() -> np.ndarray:
            return np.array([self.given(v) + self.respond(self._charge(v)) if v.any() else v for v in self.voltages])

        potentials: np.ndarray = self.kept.get("cold_potentials", solved)
        return potentials

    @cached_property
    def supplied_at(self) -> np.ndarray:
        """(channels, functions): the potentials at which currents are supplied: the cold potentials, the voltages
        behind the resistances of terminals, and nothing where the current is given."""
        potentials = self.cold_potentials.copy()
        for t in self.terminals:
            source = np.where(np.isinf(t.resistance), 0.0, self.voltages[:, t.at])
            potentials += np.outer(source - potentials[:, t.at], t.unit)
        return potentials

    @property
    def by_current(self) -> bool:
        """Whether given currents alone drive it."""
        given = [t for t in self.terminals if np.isinf(t.resistance)]
        on = np.any([t.unit > 0 for t in given], axis=0) if given else np.zeros(self.voltages.shape[1], bool)
        return bool(given) and not self.voltages[:, ~on].any()

    def influence(self, row: np.ndarray) -> tuple[np.ndarray, np.ndarray, dict[str, float]]:
        """Return weights that evaluate a functional ``row`` (functions,) of the potential for any current density J.

        Let w be the solution in the cold conductor between earthed electrodes with the row as source, D = sigma grad w,
        and I_e the current into each terminal behind a resistance. No further solve is needed, by reciprocity:
        row @ phi = shares @ g - integral rho J . D - sum_e w_e I_e. Returns shares (channels,), D, and w_e by name.
        """
        w = self.respond(row)
        density = self.on.gradient(w) / self.cold
        charges = row - self.on.flow(density)
        charges[self.free] = 0.0
        for t in self.terminals:
            # The rest flows through the resistance: its share of the voltage behind it.
            charges[t.unit > 0] = 0.0
            charges[t.at] = w[t.at] * t.conductance
        return self.voltages @ charges, density, {t.name: float(w[t.at]) for t in self.terminals if t.conductance}

    @cached_property
    def influences(self) -> dict[str, tuple[np.ndarray, np.ndarray, dict[str, float]]]:
        """`influence` of each probe of a mean potential that lies in the conductor."""
        domain, known = self.heat.domain.electric, {}
        mine = domain.space.of(self.cells)
        for probe in domain.scene.probes:
            if probe.quantity == "potential" and probe.reduce == "mean":
                row = domain.mean(probe, domain.live)
                if abs(row @ domain.space.unit - 1.0) < 1e-9 and not row[~mine].any():
                    known[probe.name] = self.influence(row)
        return known

    def solve(self, rise: np.ndarray, voltage: np.ndarray, guess: np.ndarray | None = None) -> Potential:
        """Return the potential at a rise and given voltages (functions,), perhaps from a similar state, by GMRES,
        preconditioned with a conductor `near` it.

        Raises NumericsError where the resistivity is not positive, or where the iteration does not converge.
        """
        resistivity = self.resistivity(rise)
        if not (resistivity > 0).all():
            raise NumericsError("the resistivity is not positive at the temperatures that are reached")
        first = self.near(resistivity).respond(self._charge(voltage)) if guess is None else guess
        start = self.given(voltage) + self.expanded(self.unknowns(first))
        start += self.expanded(self._change(resistivity, start, voltage))
        density = -self.on.gradient(start) / resistivity
        through = {name: self.through(name, start, rise) for name in self.sections}
        return Potential(start, density, -self.on.flow(density), through)

    def _change(self, resistivity: np.ndarray, start: np.ndarray, voltage: np.ndarray) -> np.ndarray:
        """(unknowns,): the change of a potential ``start`` (functions,) that balances the currents, to a fraction
        `solved` of the potential."""
        precondition = self.near(resistivity).precondition
        change = precondition(self.unbalanced(start, resistivity, voltage))
        size = float(np.linalg.norm(change)) / (float(np.linalg.norm(start)) or 1.0)
        if size <= self.solved:
            return change

        def product(x: np.ndarray) -> np.ndarray:
            return precondition(self.entering(self.expanded(x), resistivity))

        solution, _ = solve_by_gmres(product, change, self.solved / size, MOST_GMRES)
        if solution is None:
            raise NumericsError(
                f"the potential is not found in {MOST_GMRES} steps of GMRES, as the resistivity varies too much with "
                "the temperature"
            )
        return solution

    def unknowns(self, potential: np.ndarray) -> np.ndarray:
        """The unknowns of a potential (functions,): of the free functions, then of the terminals."""
        return np.concatenate([potential[self.free], [potential[t.at] for t in self.terminals]])

    def expanded(self, unknowns: np.ndarray) -> np.ndarray:
        """The potential (functions,) of unknowns, zero where a voltage is given."""
        potentials = np.zeros(self.voltages.shape[1])
        potentials[self.free] = unknowns[: len(self.free)]
        for t, potential in zip(self.terminals, unknowns[len(self.free) :], strict=True):
            potentials += potential * t.unit
        return potentials

    def entering(self, potential: np.ndarray, resistivity: np.ndarray) -> np.ndarray:
        """(unknowns,): the current (A) that a potential (functions,) makes leave each unknown, by the conductor and by
        the resistances of terminals."""
        return self.packed(self.on.flow(self.on.gradient(potential) / resistivity), self.unknowns(potential))

    def packed(self, charge: np.ndarray, unknowns: np.ndarray) -> np.ndarray:
        """(unknowns,): the currents of charges (functions,), including the resistances of terminals."""
        leak = [t.conductance for t in self.terminals] * unknowns[len(self.free) :]
        return np.concatenate([charge[self.free], [t.unit @ charge for t in self.terminals] + leak])

    def unbalanced(self, potential: np.ndarray, resistivity: np.ndarray, voltage: np.ndarray) -> np.ndarray:
        """(unknowns,): the current (A) that is missing at each unknown, at given voltages (functions,)."""
        loads = np.concatenate([np.zeros(len(self.free)), [t.load(voltage) for t in self.terminals]])
        return loads - self.entering(potential, resistivity)

    def precondition(self, currents: np.ndarray) -> np.ndarray:
        """(unknowns,): approximate potentials that balance some currents (unknowns,), by `matrix`."""
        if not self.terminals:
            return self.solve_cold(currents)
        charges = np.zeros(self.voltages.shape[1])
        charges[self.free] = currents[: len(self.free)]
        for t, value in zip(self.terminals, currents[len(self.free) :], strict=True):
            charges[t.at] = value
        return self.unknowns(self.respond(charges))

    def through(self, name: str, phi: np.ndarray, rise: np.ndarray) -> float:
        """The current along the normals of a probe (A), the mean of both sides, at contacts by the jump."""
        at = self.heat.field(rise)
        beside = sum(
            sign * float(faces.flux(1 / resistivity(warmed.value(at))) @ phi)
            for faces, warmed, sign, resistivity in self.sections[name]
        )
        return beside + float(self.jumps[name] @ phi)

    def crossing_row(self, name: str) -> np.ndarray:
        """(functions,): the current along the normals of a probe (A) per volt of each, at the initial temperature."""
        row: np.ndarray = self.jumps[name]
        for faces, _, sign, resistivity in self.sections[name]:
            row = row + sign * faces.flux(1 / resistivity(np.zeros((len(faces.cells), 1))))
        return row

    def pattern(self, potential: Potential) -> Pattern:
        """The current field of a potential.

        The small currents that enter inside the conductor, by the residual of the potential, are supplied at the cold
        potential.
        """
        supply = self.supplied_at @ potential.reaction
        reaction = potential.reaction.copy()
        reaction[self.free] = 0.0
        currents = {name: float(row @ reaction) for name, row in self.electrodes.items()}
        currents |= {f"through:{name}": current for name, current in potential.through.items()}
        return Pattern(potential.density, supply, currents)

    def product(self, a: np.ndarray, b: np.ndarray) -> float:
        """The integral of rho Ja . Jb at the initial temperature (W)."""
        return float((self.on.weights * self.cold * (a * b).sum(axis=0)).sum())

    def heating(self, a: np.ndarray, b: np.ndarray, rise: np.ndarray) -> np.ndarray:
        """(cells, points): rho Ja . Jb (W/m3)."""
        return self.resistivity(rise) * (a * b).sum(axis=0)

    def joule_load(self, a: np.ndarray, rise: np.ndarray, b: np.ndarray | None = None) -> np.ndarray:
        """(all nodes of the heat problem,): integral of rho Ja . Jb v, or of rho |Ja|^2 v, in W."""
        return self.heat.take(self.on.load(self.heating(a, a if b is None else b, rise)))

    def joule(self, density: np.ndarray, rise: np.ndarray) -> dict[str, float]:
        """The Joule heat of each conducting body by its name (W)."""
        per_cell = (self.on.weights * self.heating(density, density, rise)).sum(axis=1)
        return {name: float(per_cell[self.names == name].sum()) for name in dict.fromkeys(self.names.tolist())}
