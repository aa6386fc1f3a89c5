"""The second path: Newton's method on scikit-fem's own hexahedra, for temperature T (K) and potential phi (V) at once.

For all functions v and w

    int rho c(T) dT/dt v + k(T) grad T . grad v - sigma(T) |grad phi|^2 v + q_face(T) v = int heat source v,
    int sigma(T) grad phi . grad w = 0,

with jumps of both across contacts, where half the heat of the current enters either side. Nothing of `fem3d` is used.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.constants import Stefan_Boltzmann
from scipy.sparse import bmat, coo_matrix, csc_matrix, csr_matrix, diags
from scipy.sparse.linalg import splu

from benchmarks import sdirk
from scenes import laws
from scenes.errors import NumericsError
from scenes.laws import Property

Law = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]
"""A property or a flux at temperatures (K), and its derivative (per K)."""
SETTLED = 1e-12  # of the largest rise: the change that ends Newton's iterations
LONGEST = 0.5  # largest relative change of a temperature in one iteration
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


class On:
    """scikit-fem's functions on some cells or facets: values (cells, functions, points), slopes (axes, cells,
    functions, points), quadrature weights (cells, points) and places (axes, cells, points)."""

    def __init__(self, basis: Any) -> None:
        self.weights, self.nodes, self.places = basis.dx, basis.element_dofs.T, np.asarray(basis.global_coordinates())
        shape = self.weights.shape
        self.values = np.stack([np.broadcast_to(np.asarray(f), shape) for (f,) in basis.basis], axis=1)
        self.slopes = np.stack([np.broadcast_to(f.grad, (3, *shape)) for (f,) in basis.basis], axis=2)

    def value(self, nodal: np.ndarray) -> np.ndarray:
        """(cells, points) of nodal values."""
        return (nodal[self.nodes][:, None] @ self.values)[:, 0]

    def slope(self, nodal: np.ndarray) -> np.ndarray:
        """(axes, cells, points) of nodal values."""
        return (nodal[self.nodes][:, None] @ self.slopes)[:, :, 0]

    def load(self, size: int, value: np.ndarray | None = None, flow: np.ndarray | None = None) -> np.ndarray:
        """(size,): the integrals of value v + flow . grad v."""
        local = np.zeros(self.nodes.shape)
        if value is not None:
            local += np.einsum("cfq,cq->cf", self.values, value * self.weights)
        if flow is not None:
            local += np.einsum("acfq,acq->cf", self.slopes, flow * self.weights)
        return np.bincount(self.nodes.ravel(), local.ravel(), size)

    def matrix(
        self, size: int, value: np.ndarray | None = None, flow: np.ndarray | None = None,
        along: np.ndarray | None = None,
    ) -> csr_matrix:  # fmt: skip
        """(size, size): the integrals of value u v + u flow . grad v + along grad u . grad v."""
        right = np.zeros(self.values.shape)
        if value is not None:
            right += self.values * (value * self.weights)[:, None]
        if flow is not None:
            right += np.einsum("acfq,acq->cfq", self.slopes, flow * self.weights)
        blocks = right @ self.values.transpose(0, 2, 1)
        if along is not None:
            along_each = (self.slopes * (along * self.weights)[:, :, None]) @ self.slopes.transpose(0, 1, 3, 2)
            blocks += along_each.sum(axis=0)
        rows, columns = np.broadcast_arrays(self.nodes[:, :, None], self.nodes[:, None])
        return coo_matrix((blocks.ravel(), (rows.ravel(), columns.ravel())), shape=(size, size)).tocsr()


@dataclass(frozen=True, eq=False)
class Part:
    """Cells of one material: ``conductivity`` along x, y and z (W/(m K)), ``capacity`` (J/(m3 K)), ``resistivity``
    along x, y and z (ohm m; ``None``: an insulator) and ``heat_source`` (W/m3)."""

    on: On
    conductivity: tuple[Law, Law, Law]
    capacity: Law
    resistivity: tuple[Law, Law, Law] | None = None
    heat_source: float = 0.0


@dataclass(frozen=True, eq=False)
class Contact:
    """A jump on a ``face``, with resistances of heat (m2 K/W) and of current (ohm m2; ``None`` where an insulator is on
    one side). The matrices (nodes, nodes) give on the face's nodes the difference of the values on both sides
    (``less``), and their sum (``plus``)."""

    face: On
    less: csr_matrix
    plus: csr_matrix
    thermal: float
    electrical: float | None = None


@dataclass(frozen=True, eq=False)
class Electrode:
    """``nodes`` of one potential: a ``voltage`` (V, one for all or each) behind ``series`` (ohm), or a ``current``
    (A) into the solid."""

    nodes: np.ndarray
    voltage: Any = 0.0
    series: float = 0.0
    current: float | None = None


@dataclass(frozen=True, eq=False)
class State:
    """Temperature (K) and potential (V) of all nodes."""

    temperature: np.ndarray
    potential: np.ndarray


@dataclass(frozen=True, eq=False)
class Blocks:
    """Residuals of heat (W) and current (A), (nodes,) each, and their derivatives by temperature and potential."""

    heat: np.ndarray
    current: np.ndarray
    heat_by_temperature: csr_matrix
    heat_by_potential: csr_matrix
    current_by_temperature: csr_matrix
    current_by_potential: csr_matrix


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
    load : (nodes,) further heat (W), or 0
    """

    size: int
    start: float
    parts: tuple[Part, ...]
    held: tuple[tuple[np.ndarray, float], ...] = ()
    faces: tuple[tuple[On, Law], ...] = ()
    electrodes: tuple[Electrode, ...] = ()
    contacts: tuple[Contact, ...] = ()
    load: Any = 0.0

    @cached_property
    def free(self) -> np.ndarray:
        """The nodes whose temperature isn't given."""
        fixed = [nodes for nodes, _ in self.held]
        return np.setdiff1d(np.arange(self.size), np.concatenate([*fixed, np.empty(0, int)]))

    @cached_property
    def unknown(self) -> csr_matrix:
        """(nodes, unknowns): the nodes of each unknown potential: floating electrodes, then nodes that conduct."""
        electrodes = np.concatenate([e.nodes for e in self.electrodes] or [np.empty(0, int)])
        conducting = [np.unique(p.on.nodes) for p in self.parts if p.resistivity and self.electrodes]
        inner = np.setdiff1d(np.concatenate(conducting or [np.empty(0, int)]), electrodes)
        groups = [e.nodes for e in self.floating] + [np.array([node]) for node in inner]
        rows = np.concatenate(groups or [np.empty(0, int)])
        columns = np.repeat(np.arange(len(groups)), [len(nodes) for nodes in groups])
        return csr_matrix((np.ones(len(rows)), (rows, columns)), shape=(self.size, len(groups)))

    @cached_property
    def floating(self) -> list[Electrode]:
        """The electrodes whose potential is unknown."""
        return [e for e in self.electrodes if e.current is not None or e.series]

    def given(self, drive: float) -> np.ndarray:
        """(nodes,): the given potentials at a part of the drive."""
        potentials = np.zeros(self.size)
        for electrode in self.electrodes:
            if electrode not in self.floating:
                potentials[electrode.nodes] = drive * electrode.voltage
        return potentials

    def assembled(self, state: State, rate: np.ndarray, by_rate: float) -> Blocks:
        """The residuals at a state and a rate (K/s), which changes by ``by_rate`` (1/s) times the temperature."""
        size = self.size
        heat, current = np.zeros(size) - self.load, np.zeros(size)
        tt, tp, pt, pp = (csr_matrix((size, size)) for _ in range(4))
        for part in self.parts:
            on, at = part.on, part.on.value(state.temperature)
            slope, dT = on.slope(state.temperature), on.value(rate)
            k, dk = (np.stack(each) for each in zip(*(law(at) for law in part.conductivity), strict=True))
            c, dc = part.capacity(at)
            source, by_T = c * dT - part.heat_source, c * by_rate + dc * dT
            if part.resistivity:
                field = on.slope(state.potential)
                rho, drho = (np.stack(each) for each in zip(*(law(at) for law in part.resistivity), strict=True))
                sigma, dsigma = 1 / rho, -drho / rho**2
                source, by_T = source - (sigma * field**2).sum(axis=0), by_T - (dsigma * field**2).sum(axis=0)
                current += on.load(size, flow=sigma * field)
                pp, pt = pp + on.matrix(size, along=sigma), pt + on.matrix(size, flow=dsigma * field)
                tp = tp - 2 * on.matrix(size, flow=sigma * field).T
            heat += on.load(size, source, k * slope)
            tt = tt + on.matrix(size, by_T, dk * slope, k)
        for face, law in self.faces:
            leaving, by_T = law(face.value(state.temperature))
            heat += face.load(size, leaving)
            tt = tt + face.matrix(size, by_T)
        for contact in self.contacts:
            face, less, plus = contact.face, contact.less, contact.plus
            area = less.T @ face.matrix(size, np.ones(face.weights.shape)) @ less
            heat += area @ state.temperature / contact.thermal
            tt = tt + area / contact.thermal
            if contact.electrical is not None:
                jump = face.value(less @ state.potential)
                current += area @ state.potential / contact.electrical
                pp = pp + area / contact.electrical
                heat -= plus.T @ face.load(size, jump**2 / contact.electrical / 2)
                tp = tp - plus.T @ face.matrix(size, jump / contact.electrical) @ less
        return Blocks(heat, current, tt, tp.tocsr(), pt, pp)

    def solve(
        self, guess: State, drive: float = 1.0, before: np.ndarray | None = None, by_rate: float = 0.0,
        tolerance: float = SETTLED,
    ) -> State:  # fmt: skip
        """The state at which the residuals vanish, at a part of the drive; the rate is ``by_rate`` times the
        temperature less the temperature ``before``. NumericsError where Newton's iterations don't settle."""
        T, P, given = guess.temperature.copy(), self.unknown, self.given(drive)
        for nodes, value in self.held:
            T[nodes] = value
        members = np.asarray(P.sum(axis=0)).ravel()
        y = (P.T @ guess.potential) / np.maximum(members, 1)
        before = T if before is None else before
        for iteration in range(-1, MOST):
            system = self.assembled(State(T, given + P @ y), by_rate * (T - before), by_rate)
            current, matrix = P.T @ system.current, (P.T @ system.current_by_potential @ P).tolil()
            for i, electrode in enumerate(self.floating):
                if electrode.current is not None:
                    current[i] -= drive * electrode.current
                else:
                    current[i] += (y[i] - drive * electrode.voltage) / electrode.series
                    matrix[i, i] += 1 / electrode.series
            if iteration < 0:  # the potential at the temperature that is guessed
                y = y - _solved(csc_matrix(matrix), current) if len(y) else y
                continue
            free = self.free
            whole = bmat(
                [[system.heat_by_temperature[free][:, free], system.heat_by_potential[free] @ P],
                 [P.T @ system.current_by_temperature[:, free], matrix]], format="csc",
            )  # fmt: skip
            change = -_solved(whole, np.r_[system.heat[free], current])
            dT, dy = change[: len(free)], change[len(free) :]
            if not np.isfinite(change).all():
                break
            step = min(1.0, LONGEST / float(np.abs(dT / T[free]).max(initial=1e-300)))
            T[free] += step * dT
            y = y + step * dy
            rise = float(np.abs(T - self.start).max())
            rounding = 4 * np.finfo(float).eps * float(np.abs(T).max())
            if step == 1 and np.abs(dT).max(initial=0.0) <= max(tolerance * rise, rounding):
                return State(T, given + P @ y)
        raise NumericsError("Newton's iterations of the second path don't settle")

    @property
    def rest(self) -> State:
        return State(np.full(self.size, self.start), np.zeros(self.size))


def _solved(matrix: Any, right: np.ndarray) -> np.ndarray:
    """The solution of a system whose two kinds of rows differ by orders of magnitude: scaled by the diagonal."""
    scale = diags(1 / np.sqrt(np.abs(matrix.diagonal())))
    factors = splu(csc_matrix(scale @ matrix @ scale), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0,
                   options={"SymmetricMode": True})  # fmt: skip
    return scale @ factors.solve(scale @ right)


def steady(problem: Problem, pieces: int = 1) -> State:
    """The steady state, the drive raised in equal pieces. Raises NumericsError."""
    state = problem.rest
    for piece in range(1, pieces + 1):
        state = problem.solve(state, (piece / pieces) ** 0.5)
    return state


def transient(problem: Problem, times: np.ndarray) -> Iterator[tuple[State, np.ndarray]]:
    """Yield the state and its rate (nodes,) (K/s) at each of some times (s, from 0), each interval being one step of
    the diagonally implicit method of `sdirk`. Raises NumericsError."""
    state, rate = problem.rest, np.zeros(problem.size)
    for nodes, value in problem.held:
        state.temperature[nodes] = value
    yield state, rate
    for length in np.diff(times):
        begin, by_rate = state.temperature, 1 / (sdirk.GAMMA * length)
        rates: list[np.ndarray] = []
        for weights in sdirk.TABLEAU:
            start = begin + length * sum((w * r for w, r in zip(weights, rates, strict=False)), 0 * begin)
            state = problem.solve(state, before=start, by_rate=by_rate)
            rate = np.zeros(problem.size)
            rate[problem.free] = by_rate * (state.temperature - start)[problem.free]
            rates.append(rate)
        yield state, rate


def current(problem: Problem, state: State, electrode: Electrode) -> float:
    """The current (A) that enters by an electrode."""
    currents = problem.assembled(state, np.zeros(problem.size), 0.0).current
    return float(currents[electrode.nodes].sum())
