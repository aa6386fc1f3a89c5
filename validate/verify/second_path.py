"""The second path: Newton's method on scikit-fem's own hexahedra, for temperature T (K) and potential phi (V) at once.

For all functions v and w

    int rho c(T) dT/dt v + k(T) grad T . grad v - sigma(T) |grad phi|^2 v + q_face(T) v = int heat source v,
    int sigma(T) grad phi . grad w = 0,

with jumps of both across contacts, where half the heat of the current enters either side. Nothing of `fem3d` is used.
Nodes are doubled at contacts, where a temperature or a potential jumps.

A scene with all features of both paths, beam.toml, is solved by both. The second path's own error is bounded by its
change when its intervals are halved: next to an edge it falls by 2^(4/3) from one mesh to the next, so that 0.7 of the
change is left.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.constants import Stefan_Boltzmann
from scipy.sparse import bmat, coo_matrix, csr_matrix, diags
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import spsolve
from scipy.spatial import cKDTree
from skfem import Basis, BilinearForm, ElementHex1, ElementHexS2, FacetBasis, LinearForm, MeshHex

from benchmarks.rows import Row
from meshes.grid import Grid, graph
from scenes import laws
from scenes.errors import NumericsError
from scenes.laws import Property
from scenes.loading import load
from scenes.model import Boundary, Probe, Scene
from scenes.model import Contact as Given
from validate.verify.expected import Expected
from validate.verify.expected import rows as solved

Pair = frozenset[int]
"""The numbers of two boxes."""
State = np.ndarray
"""(2, nodes): temperature (K) and potential (V)."""
FAMILY, CASE = "second paths", "silicon on a foot: laws, contact, radiation, given current"
BEAM = Path(__file__).with_name("beam.toml")
# Of the length between two planes: along x and z intervals next to edges are short.
GRADED, EVEN = np.array([0.0, 0.12, 0.88, 1.0]), np.array([0.0, 1.0])
SETTLED = 1e-12  # of the largest rise: the change that ends Newton's iterations
MOST = 60  # iterations


@BilinearForm
def tangent(u: Any, v: Any, w: Any) -> Any:
    """Integrand c u v + (flow u + k grad u) . grad v."""
    return w.c * u * v + ((w.flow * u + w.k * u.grad) * v.grad).sum(axis=0)


@LinearForm
def load_vector(v: Any, w: Any) -> Any:
    """Integrand c v + flow . grad v."""
    return w.c * v + (w.flow * v.grad).sum(axis=0)


def along_axes(given: Property, T: np.ndarray, coefficient: float = 0.0, at: float = 0.0) -> tuple[Any, Any]:
    """Return a property along x, y and z at temperatures (K), and its derivatives; one that is given as a number has
    a temperature coefficient (1/K)."""
    pairs = [
        (each(T), each.slope(T)) if laws.varies(each)
        else (each * (1 + coefficient * (T - at)), np.full_like(T, each * coefficient))
        for each in laws.along(given)
    ]  # fmt: skip
    values, slopes = (np.stack(each) for each in zip(*pairs, strict=True))
    return values, slopes


def leaving(boundary: Boundary, T: np.ndarray) -> tuple[Any, Any]:
    """Return the flux (W/m2) out of a face at temperatures (K), and its derivative."""
    value: Any = boundary.value
    ambient: Any = boundary.ambient
    if boundary.kind == "heat_flux":
        return -value + 0 * T, 0 * T
    if boundary.kind == "convection":
        return value * (T - ambient), value + 0 * T
    factor = value * Stefan_Boltzmann
    return factor * (T**4 - ambient**4), 4 * factor * T**3


class Electrode(NamedTuple):
    """``nodes`` of one potential: a given ``voltage`` (V), or ``None`` where a ``source`` (A) beside a ``conductance``
    (S) drives the current source - conductance potential into the solid."""

    nodes: np.ndarray
    voltage: float | None
    source: float
    conductance: float


class Contact(NamedTuple):
    """A jump on a ``face``, with resistances of heat (m2 K/W) and of current (ohm m2; 0 where an insulator is on one
    side). The matrices (nodes, nodes) give on the face's nodes the difference of the values on both sides (``less``),
    and their sum (``plus``)."""

    face: FacetBasis
    less: csr_matrix
    plus: csr_matrix
    thermal: float
    electrical: float


class SecondPath:
    """A scene with constant values on the cells of a grid of one degree, 1 or 2.

    The quadrature has one Gauss point more than the degree along each axis, as the bricks have, or ``finer`` by so
    much.

    Attributes
    ----------
    basis : functions on the cells
    parts : functions on the cells of each box, and the box
    held : nodes and their given temperature (K)
    faces : functions on facets, and the boundary whose flux leaves there
    electrodes, contacts : as in the scene
    free : the nodes whose temperature isn't given
    unknown : (2 nodes, unknowns), the entries of a state that each unknown sets: free temperatures, then the potentials
        of floating electrodes and of other nodes that conduct
    """

    def __init__(self, scene: Scene, grid: Grid, finer: int = 0) -> None:
        (degree,) = set(np.concatenate(grid.degrees).tolist())
        mesh = MeshHex.init_tensor(*grid.breaks)
        middles = mesh.p[:, mesh.t].mean(axis=1)
        at = tuple(np.searchsorted(b, middle) - 1 for b, middle in zip(grid.breaks, middles, strict=True))
        solid = np.flatnonzero(grid.solid[at])
        mesh, owner = mesh.restrict(solid), grid.owner[at][solid]
        names = [box.name for box in scene.boxes]
        pairs = [frozenset(map(names.index, contact.between)) for contact in scene.contacts]
        if pairs:
            mesh = split_contacts(mesh, owner, pairs)
        self.scene, self.order = scene, 2 * degree + 1 + finer
        self.basis = basis = Basis(mesh, {1: ElementHex1, 2: ElementHexS2}[degree](), intorder=self.order)
        self.size = basis.N
        cells = [np.flatnonzero(owner == number) for number in range(len(names))]
        self.parts = [(basis.with_elements(c), box) for c, box in zip(cells, scene.boxes, strict=True) if len(c)]
        kinds = {kind: [b for b in scene.boundaries if b.kind == kind] for kind in ("temperature", "voltage")}
        self.held: list[tuple[np.ndarray, Any]] = [(self._nodes(b), b.value) for b in kinds["temperature"]]
        self.faces = [(self._exposed(b), b) for b in scene.boundaries if b.kind not in kinds]
        self.electrodes = [self._electrode(b) for b in kinds["voltage"]]
        self.contacts = [self._contact(c, owner, pair) for c, pair in zip(scene.contacts, pairs, strict=True)]
        none = np.empty(0, int)
        self.free = np.setdiff1d(np.arange(self.size), np.concatenate([none, *(nodes for nodes, _ in self.held)]))
        live = [p.element_dofs.ravel() for p, box in self.parts if box.material.resistivity and self.electrodes]
        inner = np.setdiff1d(np.concatenate([none, *live]), np.concatenate([none, *(e.nodes for e in self.electrodes)]))
        groups = [*self.free[:, None], *(self.size + e.nodes for e in self.electrodes if e.voltage is None)]
        groups += [*(self.size + inner)[:, None]]
        columns = np.repeat(np.arange(len(groups)), [len(group) for group in groups])
        ones = np.ones(len(columns))
        self.unknown = csr_matrix((ones, (np.concatenate(groups), columns)), (2 * self.size, len(groups)))

    def _facets(self, where: Boundary | Probe) -> np.ndarray:
        """The facets in a flat box."""
        mesh = self.basis.mesh
        middle, small = mesh.p[:, mesh.facets].mean(axis=1).T, 1e-9 * np.ptp(mesh.p)
        inside = (middle > np.array(where.lower) - small) & (middle < np.array(where.upper) + small)
        return np.flatnonzero(inside.all(axis=1))

    def _nodes(self, where: Boundary) -> np.ndarray:
        return np.asarray(self.basis.get_dofs(facets=self._facets(where)).flatten())

    def _exposed(self, boundary: Boundary) -> FacetBasis:
        """The functions on the part of a flat box that is surface."""
        mesh = self.basis.mesh
        outer = np.intersect1d(self._facets(boundary), mesh.boundary_facets())
        return FacetBasis(mesh, self.basis.elem, facets=outer, intorder=self.order)

    def _electrode(self, boundary: Boundary) -> Electrode:
        value: Any = boundary.value
        series = boundary.series_resistance
        if series == 0:
            return Electrode(self._nodes(boundary), value, 0.0, 0.0)
        return Electrode(self._nodes(boundary), None, value if series == math.inf else value / series, 1 / series)

    def _contact(self, given: Given, owner: np.ndarray, pair: Pair) -> Contact:
        basis, mesh = self.basis, self.basis.mesh

        def same(a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            """The numbers of the points a (3, points) and b that are in the same place."""
            distances, nearest = cKDTree(b.T).query(a.T)
            near = np.flatnonzero(distances < 1e-9 * np.ptp(mesh.p))
            return near, nearest[near]

        # Facets of the two sides lie on each other, and so do their nodes.
        outer = mesh.boundary_facets()
        sides = [outer[owner[mesh.f2t[0, outer]] == number] for number in sorted(pair)]
        both = same(*(mesh.p[:, mesh.facets[:, side]].mean(axis=1) for side in sides))
        one, other = (basis.get_dofs(facets=side[at]).flatten() for side, at in zip(sides, both, strict=True))
        here, there = same(basis.doflocs[:, one], basis.doflocs[:, other])
        a, b = np.array([one[here], other[there]])[:, one[here] != other[there]]
        ones = np.ones(len(a))
        less, plus = (
            csr_matrix((np.r_[ones, sign * ones], (np.r_[a, a], np.r_[a, b])), (self.size,) * 2) for sign in (-1, 1)
        )
        face = FacetBasis(mesh, basis.elem, facets=sides[0][both[0]], intorder=self.order)
        return Contact(face, less, plus, given.thermal_resistance, given.electrical_resistance)

    @property
    def rest(self) -> State:
        """The state at rest, without a drive."""
        return np.stack([np.full(self.size, self.scene.initial_temperature), np.zeros(self.size)])

    def assembled(self, state: State, rate: np.ndarray | float = 0.0, by_rate: float = 0.0) -> tuple[State, Any]:
        """Return the residuals of heat (W) and current (A), (2, nodes), at a state and a rate (K/s), which changes by
        ``by_rate`` (1/s) times the temperature; and the four matrices of their derivatives."""
        size, (temperature, potential) = self.size, state
        rate = rate * np.ones(size)
        heat, current = np.zeros(size), np.zeros(size)
        tt, tp, pt, pp = (csr_matrix((size, size)) for _ in range(4))
        for on, box in self.parts:
            m, T, dT = box.material, on.interpolate(temperature), np.asarray(on.interpolate(rate))
            at, slope = np.asarray(T), np.asarray(T.grad)
            k, dk = along_axes(m.thermal_conductivity, at)
            c, dc = (m.density * each[0] for each in along_axes(m.specific_heat, at))
            source, by_T = c * dT - box.heat_source, c * by_rate + dc * dT
            if m.resistivity:
                field = np.asarray(on.interpolate(potential).grad)
                rho, drho = along_axes(m.resistivity, at, m.temperature_coefficient, m.reference_temperature)
                sigma, dsigma = 1 / rho, -drho / rho**2
                source, by_T = source - (sigma * field**2).sum(axis=0), by_T - (dsigma * field**2).sum(axis=0)
                current += load_vector.assemble(on, c=0.0, flow=sigma * field)
                pp = pp + tangent.assemble(on, c=0.0, flow=0.0, k=sigma)
                pt = pt + tangent.assemble(on, c=0.0, flow=dsigma * field, k=0.0)
                tp = tp - 2 * tangent.assemble(on, c=0.0, flow=sigma * field, k=0.0).T
            heat += load_vector.assemble(on, c=source, flow=k * slope)
            tt = tt + tangent.assemble(on, c=by_T, flow=dk * slope, k=k)
        for face, boundary in self.faces:
            flux, by_T = leaving(boundary, np.asarray(face.interpolate(temperature)))
            heat += load_vector.assemble(face, c=flux, flow=0.0)
            tt = tt + tangent.assemble(face, c=by_T, flow=0.0, k=0.0)
        for face, less, plus, thermal, electrical in self.contacts:
            area = less.T @ tangent.assemble(face, c=1.0, flow=0.0, k=0.0) @ less
            heat += area @ temperature / thermal
            tt = tt + area / thermal
            if electrical:
                jump = np.asarray(face.interpolate(less @ potential))
                current += area @ potential / electrical
                pp = pp + area / electrical
                heat -= plus.T @ load_vector.assemble(face, c=jump**2 / electrical / 2, flow=0.0)
                tp = tp - plus.T @ tangent.assemble(face, c=jump / electrical, flow=0.0, k=0.0) @ less
        return np.stack([heat, current]), [[tt, tp], [pt, pp]]

    def solve(self, guess: State, before: np.ndarray | None = None, by_rate: float = 0.0) -> State:
        """Return the state at which the residuals vanish; the rate is ``by_rate`` times the temperature less the
        temperature ``before``. Raises NumericsError where Newton's iterations don't settle."""
        state = guess.copy()
        temperature, potential = state
        for nodes, value in self.held:
            temperature[nodes] = value
        floating = [electrode for electrode in self.electrodes if electrode.voltage is None]
        for electrode in self.electrodes:
            if electrode.voltage is not None:
                potential[electrode.nodes] = electrode.voltage
        before = temperature.copy() if before is None else before
        for iteration in range(MOST + 1):
            # The first solution is of the potential alone, at the temperature that is guessed.
            unknown = self.unknown if iteration else self.unknown[:, len(self.free) :]
            residual, blocks = self.assembled(state, by_rate * (temperature - before), by_rate)
            leads = np.zeros(2 * self.size)
            for nodes, _, source, conductance in floating:
                residual[1, nodes[0]] -= source - conductance * potential[nodes[0]]
                leads[self.size + nodes[0]] = conductance
            jacobian = unknown.T @ (bmat(blocks, "csr") + diags(leads)) @ unknown
            change = -(unknown @ spsolve(jacobian.tocsc(), unknown.T @ residual.ravel())).reshape(state.shape)
            if not np.isfinite(change).all():
                break
            state += change
            rise = float(np.abs(temperature - self.scene.initial_temperature).max())
            settled = max(SETTLED * rise, 4 * np.finfo(float).eps * float(np.abs(temperature).max()))
            if iteration and np.abs(change[0]).max() <= settled:
                return state
        raise NumericsError("Newton's iterations of the second path don't settle")

    def steady(self) -> State:
        """Return the steady state. Raises NumericsError."""
        return self.solve(self.rest)

    def mean(self, probe: Probe) -> np.ndarray:
        """Return the weights (nodes,) of the mean over a point, a flat box or a volume."""
        basis, mesh = self.basis, self.basis.mesh
        if probe.lower == probe.upper:
            return np.asarray(basis.probes(np.array(probe.lower)[:, None]).todense())[0]
        if any(a == b for a, b in zip(probe.lower, probe.upper, strict=True)):
            part = FacetBasis(mesh, basis.elem, facets=self._facets(probe), intorder=5)
        else:
            middle = mesh.p[:, mesh.t].mean(axis=1).T
            part = basis.with_elements(np.flatnonzero(((middle > probe.lower) & (middle < probe.upper)).all(axis=1)))
        return np.asarray(load_vector.assemble(part, c=1.0, flow=0.0)) / float(part.dx.sum())

    def readings(self, state: State) -> dict[str, float]:
        """Return the means that probes read: temperatures (K) and potentials (V)."""
        fields = dict(zip(("temperature", "potential"), state, strict=True))
        return {p.name: float(self.mean(p) @ fields[p.quantity]) for p in self.scene.probes if p.quantity in fields}


def split_contacts(mesh: MeshHex, owner: np.ndarray, contacts: Collection[Pair]) -> MeshHex:
    """Return the mesh with a point of its own on each side of every face between two boxes that have a contact;
    ``owner`` (cells,) is the box of each cell. Boxes keep a point in common where a third one joins them, as at the
    edge of a crack."""
    (points, boxes), number = np.unique(
        [mesh.t.ravel(), np.broadcast_to(owner, mesh.t.shape).ravel()], axis=1, return_inverse=True
    )
    joined = []
    for step in range(1, 8):  # The boxes at a point stand next to each other; a corner has eight at most.
        first = np.flatnonzero(points[step:] == points[:-step])
        pairs = zip(boxes[first].tolist(), boxes[first + step].tolist(), strict=True)
        first = first[np.array([frozenset(pair) not in contacts for pair in pairs], bool)]
        joined.append([first, first + step])
    rows, columns = np.hstack(joined)
    graph = coo_matrix((np.ones(len(rows)), (rows, columns)), shape=(len(points),) * 2)
    count, component = connected_components(graph, directed=False)
    places = np.empty((3, count))
    places[:, component] = mesh.p[:, points]
    return MeshHex(places, component[number].reshape(mesh.t.shape))


def rows() -> Iterator[Row]:
    """Compare the readings of both solvers."""
    scene: Scene = load(BEAM)
    coarse, fine = (halved_readings(scene, halvings) for halvings in (0, 1))
    rise = max(abs(fine[p.name] - scene.initial_temperature) for p in scene.probes if p.quantity == "temperature")
    expected = []
    for probe in scene.probes:
        value, unsure = fine[probe.name], abs(fine[probe.name] - coarse[probe.name])
        scale = rise if probe.quantity == "temperature" else None
        expected.append(Expected(probe.name, value, scale, unsure, settled=scene.accuracy))
    yield from solved(FAMILY, CASE, scene, expected, "Newton's method on scikit-fem's hexahedra")


def halved_readings(scene: Scene, halvings: int) -> dict[str, float]:
    """Return the readings of the second path, its intervals halved some times."""
    breaks = []
    for axis, parts in enumerate((GRADED, EVEN, GRADED)):
        for _ in range(halvings):
            parts = np.sort(np.concatenate([parts, (parts[1:] + parts[:-1]) / 2]))
        planes = pairwise(graph(scene).planes[axis].tolist())
        breaks.append(np.unique(np.concatenate([a + (b - a) * parts for a, b in planes])))
    path = SecondPath(scene, Grid(tuple(breaks), tuple(np.full(len(b) - 1, 2) for b in breaks), scene.boxes))
    return path.readings(path.steady())
