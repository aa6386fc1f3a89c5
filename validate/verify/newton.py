"""The second path: Newton's method on scikit-fem's own hexahedra, for temperature T (K) and potential phi (V) at once.

For all functions v and w

    int rho c(T) dT/dt v + k(T) grad T . grad v - sigma(T) |grad phi|^2 v + q_face(T) v = int heat source v,
    int sigma(T) grad phi . grad w = 0,

with jumps of both across contacts, where half the heat of the current enters either side. Nothing of `fem3d` is used.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.constants import Stefan_Boltzmann
from scipy.sparse import bmat, csr_matrix, diags
from scipy.sparse.linalg import spsolve
from skfem import Basis, BilinearForm, FacetBasis, LinearForm

from scenes import laws
from scenes.errors import NumericsError
from scenes.laws import Property

Law = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]
"""A property or a flux at temperatures (K), and its derivative (per K)."""
State = np.ndarray
"""(2, nodes): temperature (K) and potential (V)."""
SETTLED = 1e-12  # of the largest rise: the change that ends Newton's iterations
MOST = 60  # iterations


def law(given: Property, factor: float = 1.0) -> Law:
    """Return a property along one axis as a function of the temperature, times a number."""
    if laws.varies(given):
        return lambda T: (factor * given(T), factor * given.slope(T))
    return lambda T: (np.full_like(T, factor * given), np.zeros_like(T))


def linear(value: float, coefficient: float, at: float) -> Law:
    """Return value (1 + coefficient (T - at))."""
    return lambda T: (value * (1 + coefficient * (T - at)), np.full_like(T, value * coefficient))


def cooled(coefficient: float, ambient: float) -> Law:
    """Return the flux (W/m2) out of a face with a film."""
    return lambda T: (coefficient * (T - ambient), np.full_like(T, coefficient))


def radiating(emissivity: float, ambient: float) -> Law:
    """Return the flux (W/m2) that a grey face radiates into a large room."""
    factor = emissivity * Stefan_Boltzmann
    return lambda T: (factor * (T**4 - ambient**4), 4 * factor * T**3)


@BilinearForm
def tangent(u: Any, v: Any, w: Any) -> Any:
    """Integrand c u v + (flow u + k grad u) . grad v."""
    return w.c * u * v + ((w.flow * u + w.k * u.grad) * v.grad).sum(axis=0)


@LinearForm
def load_vector(v: Any, w: Any) -> Any:
    """Integrand c v + flow . grad v."""
    return w.c * v + (w.flow * v.grad).sum(axis=0)


def _at(basis: Basis, nodal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The values (cells, points) and slopes (axes, cells, points) of nodal values."""
    field = basis.interpolate(nodal)
    return np.asarray(field), np.asarray(field.grad)


@dataclass(frozen=True, eq=False)
class Part:
    """Cells of one material: ``conductivity`` along x, y and z (W/(m K)), ``capacity`` (J/(m3 K)), ``resistivity``
    along x, y and z (ohm m; ``None``: an insulator) and ``heat_source`` (W/m3)."""

    on: Basis
    conductivity: tuple[Law, Law, Law]
    capacity: Law
    resistivity: tuple[Law, Law, Law] | None = None
    heat_source: float = 0.0


@dataclass(frozen=True, eq=False)
class Contact:
    """A jump on a ``face``, with resistances of heat (m2 K/W) and of current (ohm m2; ``None`` where an insulator is on
    one side). The matrices (nodes, nodes) give on the face's nodes the difference of the values on both sides
    (``less``), and their sum (``plus``)."""

    face: FacetBasis
    less: csr_matrix
    plus: csr_matrix
    thermal: float
    electrical: float | None = None


@dataclass(frozen=True, eq=False)
class Electrode:
    """``nodes`` of one potential: a given ``voltage`` (V), or ``None`` where a ``source`` (A) beside a ``conductance``
    (S) drives the current source - conductance potential into the solid."""

    nodes: np.ndarray
    voltage: float | None = None
    source: float = 0.0
    conductance: float = 0.0


@dataclass(frozen=True, eq=False)
class Problem:
    """The discrete problem of a scene.

    Attributes
    ----------
    size : number of nodes
    start : initial temperature (K)
    parts : cells by material
    held : nodes and their given temperature (K)
    faces : facets and the flux (W/m2) that leaves there
    electrodes, contacts : as in the scene
    """

    size: int
    start: float
    parts: tuple[Part, ...]
    held: tuple[tuple[np.ndarray, float], ...] = ()
    faces: tuple[tuple[FacetBasis, Law], ...] = ()
    electrodes: tuple[Electrode, ...] = ()
    contacts: tuple[Contact, ...] = ()

    @cached_property
    def free(self) -> np.ndarray:
        """The nodes whose temperature isn't given."""
        fixed = [nodes for nodes, _ in self.held]
        return np.setdiff1d(np.arange(self.size), np.concatenate([*fixed, np.empty(0, int)]))

    @cached_property
    def unknown(self) -> csr_matrix:
        """(2 nodes, unknowns): the entries of a state that each unknown sets: free temperatures, then the potentials
        of floating electrodes and of other nodes that conduct."""
        electrodes = np.concatenate([e.nodes for e in self.electrodes] or [np.empty(0, int)])
        conducting = [np.unique(p.on.element_dofs) for p in self.parts if p.resistivity and self.electrodes]
        inner = np.setdiff1d(np.concatenate(conducting or [np.empty(0, int)]), electrodes)
        groups = [*self.free[:, None], *(self.size + e.nodes for e in self.electrodes if e.voltage is None)]
        groups += [*(self.size + inner)[:, None]]
        columns = np.repeat(np.arange(len(groups)), [len(group) for group in groups])
        return csr_matrix((np.ones(len(columns)), (np.concatenate(groups), columns)), (2 * self.size, len(groups)))

    @property
    def rest(self) -> State:
        """The state at rest, without a drive."""
        return np.stack([np.full(self.size, self.start), np.zeros(self.size)])

    def assembled(self, state: State, rate: np.ndarray | float = 0.0, by_rate: float = 0.0) -> tuple[State, Any]:
        """The residuals of heat (W) and current (A), (2, nodes), at a state and a rate (K/s), which changes by
        ``by_rate`` (1/s) times the temperature; and the four matrices of their derivatives."""
        size, (temperature, potential) = self.size, state
        rate = rate * np.ones(size)
        heat, current = np.zeros(size), np.zeros(size)
        tt, tp, pt, pp = (csr_matrix((size, size)) for _ in range(4))
        for part in self.parts:
            on, (at, slope), dT = part.on, _at(part.on, temperature), _at(part.on, rate)[0]
            k, dk = (np.stack(each) for each in zip(*(law(at) for law in part.conductivity), strict=True))
            c, dc = part.capacity(at)
            source, by_T = c * dT - part.heat_source, c * by_rate + dc * dT
            if part.resistivity:
                field = _at(on, potential)[1]
                rho, drho = (np.stack(each) for each in zip(*(law(at) for law in part.resistivity), strict=True))
                sigma, dsigma = 1 / rho, -drho / rho**2
                source, by_T = source - (sigma * field**2).sum(axis=0), by_T - (dsigma * field**2).sum(axis=0)
                current += load_vector.assemble(on, c=0.0, flow=sigma * field)
                pp = pp + tangent.assemble(on, c=0.0, flow=0.0, k=sigma)
                pt = pt + tangent.assemble(on, c=0.0, flow=dsigma * field, k=0.0)
                tp = tp - 2 * tangent.assemble(on, c=0.0, flow=sigma * field, k=0.0).T
            heat += load_vector.assemble(on, c=source, flow=k * slope)
            tt = tt + tangent.assemble(on, c=by_T, flow=dk * slope, k=k)
        for face, law in self.faces:
            leaving, by_T = law(_at(face, temperature)[0])
            heat += load_vector.assemble(face, c=leaving, flow=0.0)
            tt = tt + tangent.assemble(face, c=by_T, flow=0.0, k=0.0)
        for contact in self.contacts:
            face, less, plus = contact.face, contact.less, contact.plus
            area = less.T @ tangent.assemble(face, c=1.0, flow=0.0, k=0.0) @ less
            heat += area @ temperature / contact.thermal
            tt = tt + area / contact.thermal
            if contact.electrical is not None:
                jump = _at(face, less @ potential)[0]
                current += area @ potential / contact.electrical
                pp = pp + area / contact.electrical
                heat -= plus.T @ load_vector.assemble(face, c=jump**2 / contact.electrical / 2, flow=0.0)
                tp = tp - plus.T @ tangent.assemble(face, c=jump / contact.electrical, flow=0.0, k=0.0) @ less
        return np.stack([heat, current]), [[tt, tp], [pt, pp]]

    def solve(self, guess: State, before: np.ndarray | None = None, by_rate: float = 0.0) -> State:
        """The state at which the residuals vanish; the rate is ``by_rate`` times the temperature less the temperature
        ``before``. NumericsError where Newton's iterations don't settle."""
        state = guess.copy()
        temperature, potential = state
        for nodes, value in self.held:
            temperature[nodes] = value
        for electrode in self.electrodes:
            if electrode.voltage is not None:
                potential[electrode.nodes] = electrode.voltage
        before = temperature.copy() if before is None else before
        for iteration in range(MOST + 1):
            # The first solution is of the potential alone, at the temperature that is guessed.
            unknown = self.unknown if iteration else self.unknown[:, len(self.free) :]
            residual, blocks = self.assembled(state, by_rate * (temperature - before), by_rate)
            leads = np.zeros(2 * self.size)
            for electrode in self.electrodes:
                if electrode.voltage is None:
                    node = electrode.nodes[0]
                    residual[1, node] -= electrode.source - electrode.conductance * potential[node]
                    leads[self.size + node] = electrode.conductance
            jacobian = unknown.T @ (bmat(blocks, "csr") + diags(leads)) @ unknown
            change = -(unknown @ spsolve(jacobian.tocsc(), unknown.T @ residual.ravel())).reshape(state.shape)
            if not np.isfinite(change).all():
                break
            state += change
            rise, hottest = (float(np.abs(temperature - least).max()) for least in (self.start, 0.0))
            settled = max(SETTLED * rise, 4 * np.finfo(float).eps * hottest)
            if iteration and np.abs(change[0]).max() <= settled:
                return state
        raise NumericsError("Newton's iterations of the second path don't settle")


def steady(problem: Problem) -> State:
    """The steady state. Raises NumericsError."""
    return problem.solve(problem.rest)
