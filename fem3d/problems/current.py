"""The electric problem: div(sigma(T) grad phi) = 0 in the conductors that carry current, between electrodes.

Potentials are functions of the whole space, zero where no current flows. An electrode with a given current, or behind
a resistance, is a terminal: its potential U is one number, the coefficient of its unit function e, which is 1 on the
electrode. With the bilinear form a of the conductor the potential phi = given + P x satisfies

    a(phi, v) = 0  for all v that vanish on electrodes,  a(phi, e) + U / R = I,

where P takes the unknowns x, the coefficients of the free functions and the potentials U, to functions, and I is the
given current into the solid, or V / R for a voltage V behind the resistance R. A given current is the limit of an
infinite R. Voltages and currents come as channels (`statespace.channels`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy.sparse import csc_array, csr_array, diags_array, eye_array, hstack

from fem3d.problems.cholesky import Factors, Ordering, Solver
from fem3d.problems.gmres import solve_by_gmres
from fem3d.problems.heat import Cache, HeatProblem
from fem3d.problems.material_laws import CellProperty, at_faces
from fem3d.problems.paths import CurrentField, Label, RowIntegrals, Section, Terminal
from fem3d.spaces.integrals import FaceIntegrals, Space
from fem3d.spaces.sparse import add, congruent, submatrix
from scenes.errors import NumericsError

SOLVED = 1e-12  # relative error of a potential, unless a looser bound is given


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
    voltages : (channels, functions + terminals), given potentials, and the currents I into the terminals
    electrodes : for each its share (functions,) of the entering currents
    sections : the facets of the current probes inside
    matrix : (functions, functions), at the initial temperature
    labels : (rows,), the `Label` of each row
    elimination : the elimination order of the factorization
    solved : the allowed residual of a potential, relative
    terminals : electrodes of unknown potential
    law : the resistivity (ohm m) of rows with a law, which ``cold`` and ``warm`` leave out
    more : points of the quadrature along each axis beyond the default of the space
    cache : computed so far: "solve_cold", "near", "cold_potentials", and the last "resistivity" with its rise
    """

    heat: HeatProblem
    cells: np.ndarray
    on: RowIntegrals
    free: np.ndarray
    cold: np.ndarray
    warm: np.ndarray
    voltages: np.ndarray
    electrodes: dict[str, np.ndarray]
    sections: dict[str, Section]
    matrix: csc_array
    labels: np.ndarray
    elimination: Ordering
    solved: float = SOLVED
    terminals: tuple[Terminal, ...] = ()
    law: CellProperty | None = None
    more: int = 0
    cache: Cache = field(init=False, default_factory=Cache)

    def lower(self, number: int, heat: HeatProblem) -> Conductor:
        """The problem in a lower space, for the heat problem there."""
        return replace(self, heat=heat, free=self.free[self.space.nested[number][self.free]])

    @property
    def space(self) -> Space:
        """The space of the potential."""
        return self.heat.domain.electric.space

    def resistivity(self, rise: np.ndarray) -> np.ndarray:
        """(rows, points) in ohm m at a rise (all dofs of the heat problem)."""
        if not self.warms:
            return np.broadcast_to(self.cold, self.on.weights.shape)
        # The resistivity of the last rise serves its current, its heat and the test of conduction.
        last, known = self.cache.get("resistivity", (None, None))
        if not np.array_equal(last, rise):
            at = self.on.value(self.heat.field(rise))
            known = self._by_law(self.law.value, at, self.cold) if self.law else self.cold + self.warm * at
            self.cache["resistivity"] = rise.copy(), known
        return np.asarray(known)

    def steepness(self, rise: np.ndarray) -> np.ndarray:
        """(rows, points): the derivative of the resistivity's logarithm (1/K) at a rise (all dofs)."""
        if self.law is None:
            return self.warm / self.resistivity(rise)
        at = self.on.value(self.heat.field(rise))
        slope = self._by_law(self.law.slope, at, np.zeros_like(self.cold))
        return slope / self.resistivity(rise)

    def _by_law(self, law: Callable[[np.ndarray], np.ndarray], rise: np.ndarray, others: np.ndarray) -> np.ndarray:
        """(rows, points): a law of the cells at a rise, and behind them ``others`` (rows, 1), which follow nothing."""
        n = len(self.cells)
        return np.concatenate([law(rise[:n]), np.broadcast_to(others[n:], rise[n:].shape)])

    def finer(self, points: int) -> Conductor:
        """By a quadrature of so many more points along each axis, where the resistivity is a law; else itself."""
        if self.law is None:
            return self
        more = self.more + points
        on = self.on.finer(self.heat.domain.space.on(self.cells, more), self.space.on(self.cells, more))
        finer = replace(self, on=on, more=more)
        finer.cache.update(near=self.near, cold_potentials=self.cold_potentials)
        return finer

    def share_of_drive(self, density: np.ndarray, dissipated: float) -> float:
        """Return the share of the drive that falls in the conductor, which ``dissipated`` a power (W): the rest falls
        in the resistances of terminals, and a given current does not depend on the conductor."""
        if self.current_driven:
            return 0.0
        charge = self.on.flow(density)
        outside = sum(float(t.unit @ charge) ** 2 * t.resistance for t in self.terminals if t.conductance)
        return dissipated / (dissipated + outside) if dissipated > 0 else 1.0

    @property
    def draws_current(self) -> bool:
        """Whether the current of any electrode is given."""
        return any(np.isinf(t.resistance) for t in self.terminals)

    @property
    def current_driven(self) -> bool:
        """Whether given currents alone drive it."""
        fed = [len(self.free) + i for i, t in enumerate(self.terminals) if t.conductance]
        return self.draws_current and not self.given(self.voltages).any() and not self.load(self.voltages)[:, fed].any()

    @property
    def warms(self) -> bool:
        """Whether any resistivity depends on the temperature."""
        return self.law is not None or bool(self.warm.any())

    @cached_property
    def _basis(self) -> tuple[csc_array, csr_array]:
        """P: (functions, unknowns), and its transpose, by which currents are tested."""
        units = np.array([t.unit for t in self.terminals]).reshape(-1, self.space.size)
        basis = csc_array(hstack([eye_array(self.space.size, format="csc")[:, self.free], csc_array(units.T)]))
        return basis, basis.T

    @cached_property
    def _leak(self) -> np.ndarray:
        """(unknowns,): the conductances (S) of the resistances of terminals."""
        return np.concatenate([np.zeros(len(self.free)), [t.conductance for t in self.terminals]])

    def given(self, voltage: np.ndarray) -> np.ndarray:
        """The potentials (..., functions) among given values, with terminals at zero."""
        return voltage[..., : self.space.size]

    def load(self, voltage: np.ndarray) -> np.ndarray:
        """(..., unknowns): the currents among given values."""
        return np.concatenate([np.zeros((*voltage.shape[:-1], len(self.free))), voltage[..., self.space.size :]], -1)

    def unknowns(self, potential: np.ndarray) -> np.ndarray:
        """The unknowns of a potential (functions,)."""
        return potential[[*self.free, *(t.at for t in self.terminals)]]

    def expanded(self, unknowns: np.ndarray) -> np.ndarray:
        """The potential (..., functions) of unknowns, zero where a voltage is given."""
        return (self._basis[0] @ unknowns.T).T

    def packed(self, charge: np.ndarray, unknowns: np.ndarray) -> np.ndarray:
        """(unknowns,): the currents of charges (functions,), and by the resistances of terminals."""
        return self._basis[1] @ charge + self._leak * unknowns

    def system(self, matrix: csc_array) -> csc_array:
        """(unknowns, unknowns): a matrix (functions, functions) with the terminals and their resistances."""
        if not self.terminals:
            return submatrix(matrix, self.free)
        return add(congruent(matrix, self._basis[0]), diags_array(self._leak, format="csc"))

    def _solver(self, matrix: csc_array) -> Solver:
        entities = self.space.entity[self.free]
        groups = np.concatenate([entities, len(self.space.places) + np.arange(len(self.terminals))])
        return Factors(self.system(matrix), groups, self.elimination).solve

    @property
    def solve_cold(self) -> Solver:
        """Solver of the unknowns of the cold conductor for currents (..., unknowns)."""
        return self.cache.get_or_make("solve_cold", lambda: self._solver(self.matrix))

    @property
    def near(self) -> tuple[np.ndarray, Solver]:
        """The resistivity (rows, 1) of the conductor that preconditions, and its solver."""
        return self.cache.get_or_make("near", lambda: (self.cold, self.solve_cold))

    def preconditioner(self, resistivity: np.ndarray) -> Solver:
        """Return the solver of the last conductor with one resistivity in each row, or of a new one with the mean
        conductivities at a ``resistivity`` (rows, points) if that has a far smaller condition number."""
        inside = self.on.weights > 0
        weights = np.where(inside, self.on.weights, 0.0)
        mean = weights.sum(axis=1, keepdims=True) / (weights / resistivity).sum(axis=1, keepdims=True)

        def condition(base: np.ndarray) -> float:
            ratio = (resistivity / base)[inside]
            return float(ratio.max() / ratio.min())

        # Steps of GMRES grow with the root of the condition number, and a factorization takes as long as some 10.
        if condition(self.near[0]) > 10 * condition(mean):
            change = self.on.conductivity(mean) - self.on.conductivity(self.cold)
            matrix = csc_array(self.matrix + self.space.stiffness(change, self.cells))
            self.cache["near"] = mean, self._solver(matrix)
        return self.near[1]

    def respond(self, charge: np.ndarray) -> np.ndarray:
        """(..., functions): the potentials of the cold conductor for charges (..., functions), all given voltages and
        currents being zero. Terminals get the charges tested with their unit functions."""
        return self.expanded(self.solve_cold((self._basis[1] @ charge.T).T))

    @property
    def cold_potentials(self) -> np.ndarray:
        """(channels, functions): the potentials at the initial temperature, per unit of each channel."""

        def solved(voltage: np.ndarray) -> np.ndarray:
            given = self.given(voltage)
            currents = self.load(voltage) - self._basis[1] @ (self.matrix @ given)
            return given + self.expanded(self.solve_cold(currents)) if voltage.any() else given

        return self.cache.get_or_make("cold_potentials", lambda: np.array([*map(solved, self.voltages)]))

    @cached_property
    def _supplied_at(self) -> np.ndarray:
        """(channels, functions): the potentials at which currents are supplied: the cold potentials, the voltages
        behind the resistances of terminals, and nothing where the current is given."""
        potentials = self.cold_potentials.copy()
        for t, current in zip(self.terminals, self.voltages[:, self.space.size :].T, strict=True):
            source = current * t.resistance if t.conductance else 0.0 * current
            potentials += np.outer(source - potentials[:, t.at], t.unit)
        return potentials

    def influence(self, row: np.ndarray) -> tuple[np.ndarray, np.ndarray, dict[str, float]]:
        """Return weights that evaluate a functional ``row`` (functions,) of the potential for any current density J.

        Let w be the solution in the cold conductor between earthed electrodes with the row as source, D = sigma grad w,
        and I_e the current into each terminal behind a resistance. No further solve is needed, by reciprocity:
        row @ phi = shares @ g - integral rho J . D - sum_e w_e I_e. Returns shares (channels,), D, and w_e by name.
        """
        w = self.respond(row)
        density = self.on.gradient(w) / self.cold
        # The current of a source flows through its resistance too.
        at_sources = [w[t.at] if t.conductance else 0.0 for t in self.terminals]
        shares = self.voltages @ np.concatenate([row - self.on.flow(density), at_sources])
        return shares, density, {t.name: float(w[t.at]) for t in self.terminals if t.conductance}

    @cached_property
    def influences(self) -> dict[str, tuple[np.ndarray, np.ndarray, dict[str, float]]]:
        """`influence` of each probe of a mean potential that lies in the conductor."""
        domain, known = self.heat.domain.electric, {}
        mine = domain.space.functions_of(self.cells)
        for probe in domain.scene.probes:
            if probe.quantity == "potential" and probe.reduce == "mean":
                row = domain.mean(probe, domain.live)
                if abs(row @ domain.space.unit - 1.0) < 1e-9 and not row[~mine].any():
                    known[probe.name] = self.influence(row)
        return known

    def solve(self, rise: np.ndarray, voltage: np.ndarray, guess: np.ndarray | None = None) -> CurrentField:
        """Return the potential at a rise and given values, by GMRES to a fraction `solved`, from a ``guess`` if given.

        Raises NumericsError where the resistivity is not positive, or where the iteration does not converge.
        """
        resistivity, given = self.resistivity(rise), self.given(voltage)
        if not (resistivity > 0).all():
            raise NumericsError("the resistivity is not positive at the temperatures that are reached")
        precondition = self.preconditioner(resistivity)

        def product(x: np.ndarray) -> np.ndarray:
            return precondition(self.packed(self.on.flow(self.on.gradient(self.expanded(x)) / resistivity), x))

        if guess is None or not voltage.any():
            unknowns = precondition(self.load(voltage) - self._basis[1] @ (self.matrix @ given))
        else:
            unknowns = self.unknowns(guess)
        potential = given + self.expanded(unknowns)
        change = precondition(self.residual(potential, resistivity, voltage))
        size = float(np.linalg.norm(change)) / (float(np.linalg.norm(potential)) or 1.0)
        if size > self.solved:
            change, _ = solve_by_gmres(product, change, self.solved / size)
        return self.current(potential + self.expanded(change), resistivity, rise)

    def residual(self, potential: np.ndarray, resistivity: np.ndarray, voltage: np.ndarray) -> np.ndarray:
        """(unknowns,): the current (A) that is missing at each unknown, at given values."""
        charge = self.on.flow(self.on.gradient(potential) / resistivity)
        return self.load(voltage) - self.packed(charge, self.unknowns(potential))

    def crossing_row(self, name: str, rise: np.ndarray | None = None) -> np.ndarray:
        """(functions,): the current along the normals of a probe (A) per volt of each, the mean of both sides, at
        contacts by the jump; at a rise, or at the initial temperature."""
        domain = self.heat.domain
        at = domain.space.unit * 0.0 if rise is None else self.heat.field(rise)

        def conductivity(faces: FaceIntegrals) -> np.ndarray:
            roots = self.on.roots[:, np.searchsorted(self.cells, faces.cells)]
            return 1 / (roots**2 * at_faces(domain, "resistivity", at, faces))

        return self.sections[name].row(conductivity)

    def current(self, potential: np.ndarray, resistivity: np.ndarray, rise: np.ndarray) -> CurrentField:
        """Return the current field of a potential (functions,) at a rise and the ``resistivity`` there.

        The residual of the potential makes small currents enter inside the conductor: at the cold potential.
        """
        density = -self.on.gradient(potential) / resistivity
        reaction = -self.on.flow(density)
        supply = self._supplied_at @ reaction
        reaction[self.free] = 0.0
        currents = {name: float(row @ reaction) for name, row in self.electrodes.items()}
        currents |= {f"through:{name}": float(self.crossing_row(name, rise) @ potential) for name in self.sections}
        return CurrentField(potential, density, supply, currents)

    def product(self, a: np.ndarray, b: np.ndarray) -> float:
        """The integral of rho Ja . Jb at the initial temperature (W)."""
        return float((self.on.weights * self.cold * (a * b).sum(axis=0)).sum())

    def heating(self, a: np.ndarray, b: np.ndarray, rise: np.ndarray) -> np.ndarray:
        """(rows, points): rho Ja . Jb (W/m3)."""
        return self.resistivity(rise) * (a * b).sum(axis=0)

    def joule_load(self, a: np.ndarray, rise: np.ndarray, b: np.ndarray | None = None) -> np.ndarray:
        """(all dofs of the heat problem,): integral of rho Ja . Jb v, or of rho |Ja|^2 v, in W."""
        return self.heat.take(self.on.load(self.heating(a, a if b is None else b, rise)))

    def joule(self, density: np.ndarray, rise: np.ndarray) -> dict[Label, float]:
        """The Joule heat (W) of the rows with each label."""
        per_cell = (self.on.weights * self.heating(density, density, rise)).sum(axis=1)
        return {label: float(per_cell[self.labels == label].sum()) for label in dict.fromkeys(self.labels.tolist())}
