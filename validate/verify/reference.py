"""The second, independent path: the same problem assembled by scikit-fem and solved in the plainest way.

On a grid of degree 1 or 2 everywhere the element of this package spans the space of scikit-fem's own ElementHex1 or
ElementHexS2, and one Gauss point more than the degree along each axis makes its quadrature of order 3 or 5.
So both must agree to the tolerance of their solvers. Here are no numbering, ordering, acceleration, reduced fields or
exact exponentials: the forms of `fem3d.spaces.forms`, scipy's splu with an ordering for symmetric matrices, and
`methods`. For verification: slow."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import splu
from skfem import Basis, ElementH1, ElementHex1, ElementHexS2, FacetBasis, LinearForm, MeshHex, condense
from skfem import solve as solve_linear

from fem3d.spaces import forms
from meshes.grid import Grid
from scenes.model import Boundary, Probe, Scene, Schedule, Value
from validate.verify import methods

CONVERGED, STEPPED = 3e-12, 1e-11  # of the rise: the tolerances of the iterations
ORDER = 3  # of the method in time


def corners(grid: Grid, offsets: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points (3, points) that are corners of the solid's cells, each cell's by their numbers (cells, ...) in the order
    of ``offsets`` (..., 3) of 0 and 1, and the box (cells,) that owns each."""
    cells = np.argwhere(grid.solid)
    shape = tuple(len(b) for b in grid.breaks)
    at = np.expand_dims(cells, tuple(range(1, offsets.ndim))) + offsets
    used, local = np.unique(np.ravel_multi_index(tuple(np.moveaxis(at, -1, 0)), shape), return_inverse=True)
    points = np.array([b[i] for b, i in zip(grid.breaks, np.unravel_index(used, shape), strict=True)])
    return points, local.reshape(at.shape[:-1]), grid.owner[tuple(cells.T)]


def hexahedra(grid: Grid) -> tuple[MeshHex, np.ndarray]:
    """The cells of the solid as scikit-fem's mesh, and the box (cells,) that owns each."""
    points, local, owner = corners(grid, MeshHex().p.T.astype(int))  # one cell: scikit-fem's order of the corners
    return MeshHex(points, local.T), owner


@dataclass(frozen=True, eq=False)
class FullOrder:
    """The matrices (nodes, nodes) of a scene in W/K and J/K and the load (nodes,) in W without Joule heat.

    ``owner`` is the box of each element; ``resistivity`` (elements, 1), NaN in insulators, that at the initial
    temperature, and what each kelvin adds.
    """

    scene: Scene
    basis: Basis
    owner: np.ndarray
    stiffness: Any
    mass: Any
    load: np.ndarray
    resistivity: tuple[np.ndarray, np.ndarray]

    @cached_property
    def held(self) -> dict[str, tuple[np.ndarray, float]]:
        """The nodes of each boundary of given temperature or voltage, and its value (K or V)."""
        mesh, held = self.basis.mesh, [b for b in self.scene.boundaries if b.kind in ("temperature", "voltage")]
        return {b.name: (self.basis.get_dofs(facets=facets(mesh, b)).flatten(), constant(b.value)) for b in held}

    def names(self, kind: str) -> list[str]:
        return [b.name for b in self.scene.boundaries if b.kind == kind]

    @cached_property
    def free(self) -> np.ndarray:
        fixed = [self.held[name][0] for name in self.names("temperature")]
        return np.setdiff1d(np.arange(self.basis.N), np.concatenate([*fixed, np.empty(0, int)]))

    @cached_property
    def conductors(self) -> tuple[np.ndarray, Basis, np.ndarray]:
        """The elements that conduct, the basis on them, and its nodes without those of electrodes."""
        elements = np.flatnonzero(~np.isnan(self.resistivity[0][:, 0]))
        held = np.concatenate([self.held[name][0] for name in self.names("voltage")])
        nodes = self.basis.get_dofs(elements=elements).flatten()
        return elements, self.basis.with_elements(elements), np.setdiff1d(nodes, held)

    def heated(self, rise: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(nodes,) each at a rise (nodes,): the Joule load (W), the potential (V) and the current that enters (A)."""
        elements, part, inside = self.conductors
        rho = (self.resistivity[0] + self.resistivity[1] * np.asarray(self.basis.interpolate(rise)))[elements]
        matrix = forms.conduction.assemble(part, conductivity=1 / rho)
        phi = np.zeros(self.basis.N)
        for name in self.names("voltage"):
            phi[self.held[name][0]] = self.held[name][1]
        phi = solve_linear(*condense(csc_matrix(matrix), np.zeros(len(phi)), x=phi, I=inside))
        load = forms.joule_heat.assemble(part, conductivity=1 / rho, potential=part.interpolate(phi))
        return load, phi, matrix @ phi


def assemble(scene: Scene, grid: Grid) -> FullOrder:
    """A scene of one or more materials on a grid of degree 1 or 2 everywhere (ValueError for other degrees)."""
    degrees = set(np.concatenate(grid.degrees).tolist())
    if degrees not in ({1}, {2}):
        raise ValueError(f"the second path takes one degree, 1 or 2, everywhere, not {sorted(degrees)}")
    return on_mesh(scene, *hexahedra(grid), *((ElementHex1(), 3) if degrees == {1} else (ElementHexS2(), 5)))


def on_mesh(scene: Scene, cells: MeshHex, owner: np.ndarray, element: ElementH1, order: int) -> FullOrder:
    """A scene on hexahedra, each of which a box of it owns, of any element, integrated to an order."""
    basis = Basis(cells, element, intorder=order)

    def per_element(values: list[float]) -> np.ndarray:
        return np.array(values)[owner][:, None] * np.ones(basis.dx.shape)

    materials = [box.material for box in scene.boxes]
    stiffness = forms.conduction.assemble(basis, conductivity=per_element([m.thermal_conductivity for m in materials]))
    mass = forms.capacity.assemble(basis, heat_capacity=per_element([m.heat_capacity for m in materials]))
    sources = [constant(box.heat_source) for box in scene.boxes]
    load = np.asarray(integral.assemble(basis, density=per_element(sources))) if any(sources) else np.zeros(basis.N)
    room = scene.initial_temperature
    for boundary in scene.boundaries:
        if boundary.kind in ("convection", "heat_flux"):
            matrix, entering = film(basis, boundary, room)
            stiffness, load = stiffness + matrix, load + entering
    cold = np.array([np.nan if m.resistivity is None else m.resistivity for m in materials])
    slope = cold * [m.temperature_coefficient for m in materials]
    at_room = cold + slope * [room - m.reference_temperature for m in materials]
    return FullOrder(scene, basis, owner, stiffness, mass, load, (at_room[owner, None], slope[owner, None]))


def film(basis: Basis, boundary: Boundary, room: float) -> tuple[Any, np.ndarray]:
    """Matrix (nodes, nodes) and load (nodes,) of a face with convection or a given flux."""
    exposed = np.intersect1d(facets(basis.mesh, boundary), basis.mesh.boundary_facets())
    face, value = FacetBasis(basis.mesh, basis.elem, facets=exposed, intorder=5), constant(boundary.value)
    h, flux = (value, value * (constant(boundary.ambient) - room)) if boundary.kind == "convection" else (0.0, value)
    return forms.film.assemble(face, coefficient=h), integral.assemble(face, density=flux)


def constant(value: Value) -> float:
    """A value that doesn't vary; ValueError for one that does, which this path doesn't take."""
    if isinstance(value, Schedule):
        raise ValueError("the second path takes values that don't vary in time")
    return value


class Inner:
    """The free nodes' part of the matrices, as `methods` takes it."""

    def __init__(self, full: FullOrder) -> None:
        self.full, self.free, self.size = full, full.free, len(full.free)
        self.mass, self.stiffness = (self.part(m) for m in (full.mass, full.stiffness))

    def part(self, matrix: Any) -> csc_matrix:
        return csc_matrix(matrix[self.free][:, self.free])

    def load(self, rise: np.ndarray) -> np.ndarray:
        return np.asarray((self.full.load + self.full.heated(self.whole(rise))[0])[self.free])

    def factors(self, mass: float, stiffness: float) -> Callable[[np.ndarray], np.ndarray]:
        matrix = mass * self.mass + stiffness * self.stiffness if mass else self.stiffness
        options = {"SymmetricMode": True}
        solve: Any = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options).solve
        return solve  # type: ignore[no-any-return]

    def whole(self, values: np.ndarray) -> np.ndarray:
        """(nodes,) of (free nodes,): zero where the temperature is given."""
        nodal = np.zeros(self.full.basis.N)
        nodal[self.free] = values
        return nodal


def steady(full: FullOrder) -> np.ndarray:
    """(nodes,): the coupled steady rise (K); NumericsError where the iteration doesn't converge."""
    inner = Inner(full)
    return inner.whole(methods.settle(inner, CONVERGED))


def transient(full: FullOrder, times: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """Rise (K) and its rate (K/s), (nodes,) each, at each of some times (s, from 0), each interval being one
    step; the rate at 0 is left out as zero."""
    inner = Inner(full)
    states = methods.march(inner, times, ORDER, STEPPED)
    return [(inner.whole(rise), inner.whole(rate)) for rise, rate in states]


def facets(mesh: MeshHex, where: Boundary | Probe) -> np.ndarray:
    middle, small = mesh.p[:, mesh.facets].mean(axis=1).T, 1e-9 * np.ptp(mesh.p)
    return np.flatnonzero(
        ((middle > np.array(where.lower) - small) & (middle < np.array(where.upper) + small)).all(axis=1)
    )


@LinearForm
def integral(v: Any, w: Any) -> Any:
    """Of a ``density`` on points with each function."""
    return w.density * v


def mean(basis: Basis, probe: Probe) -> np.ndarray:
    """(nodes,): what each adds to the mean over a point, a flat box or a volume (not a line)."""
    if probe.lower == probe.upper:
        return np.asarray(basis.probes(np.array(probe.lower)[:, None]).todense())[0]
    part = within(basis, probe)
    return np.asarray(integral.assemble(part, density=1.0)) / float(part.dx.sum())


def within(basis: Basis, probe: Probe) -> Any:
    """The basis on a flat box or a volume."""
    if any(a == b for a, b in zip(probe.lower, probe.upper, strict=True)):
        return FacetBasis(basis.mesh, basis.elem, facets=facets(basis.mesh, probe), intorder=5)
    middle = basis.mesh.p[:, basis.mesh.t].mean(axis=1).T
    return basis.with_elements(np.flatnonzero(((middle > probe.lower) & (middle < probe.upper)).all(axis=1)))
