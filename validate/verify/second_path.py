"""Scenes on the second path: the problem that `newton` solves, on hexahedra of degree 1 or 2, and its readings."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from skfem import Basis, ElementHex1, ElementHexS2, FacetBasis, LinearForm, MeshHex

from meshes.grid import Grid
from scenes import laws
from scenes.laws import Property
from scenes.model import Boundary, Contact, Material, Probe, Scene, Schedule, Value
from validate.verify import newton, split
from validate.verify.newton import Electrode, Law, On, Part, Problem, State


def hexahedra(grid: Grid) -> tuple[MeshHex, np.ndarray]:
    """Return the cells of the solid as scikit-fem's mesh, and the number of the box (cells,) that owns each."""
    cells, shape = np.argwhere(grid.solid), tuple(len(b) for b in grid.breaks)
    corners = cells[:, None] + MeshHex().p.T.astype(int)  # one cell: scikit-fem's order of the corners
    used, local = np.unique(np.ravel_multi_index(tuple(np.moveaxis(corners, -1, 0)), shape), return_inverse=True)
    points = np.array([b[i] for b, i in zip(grid.breaks, np.unravel_index(used, shape), strict=True)])
    return MeshHex(points, local.reshape(corners.shape[:-1]).T), grid.owner[tuple(cells.T)]


def base(scene: Scene, grid: Grid, finer: int = 0) -> tuple[Basis, np.ndarray, int]:
    """Return the functions on the cells of a grid, the box that owns each cell, and the order of the quadrature: one
    Gauss point more than the degree along each axis, as the bricks have, or ``finer`` by so much. Nodes of contacts
    are there twice. Raises ValueError for a grid of several degrees, or of one above 2."""
    degrees = set(np.concatenate(grid.degrees).tolist())
    if degrees not in ({1}, {2}):
        raise ValueError(f"the second path takes one degree, 1 or 2, everywhere, not {sorted(degrees)}")
    mesh, owner = hexahedra(grid)
    if scene.contacts:
        mesh = split.split(mesh, owner, [_pair(scene, contact) for contact in scene.contacts])
    (degree,) = degrees
    order = 2 * degree + 1 + finer
    return Basis(mesh, (ElementHex1(), ElementHexS2())[degree - 1], intorder=order), owner, order


def problem(scene: Scene, basis: Basis, owner: np.ndarray, order: int) -> Problem:
    """Return the problem of a scene with constant values (else ValueError) on a `base`."""
    parts = []
    for number, box in enumerate(scene.boxes):
        cells = np.flatnonzero(owner == number)
        if len(cells):
            m = box.material
            conductivity = _along(m.thermal_conductivity)
            on, source = On(basis.with_elements(cells)), constant(box.heat_source)
            parts.append(Part(on, conductivity, newton.law(m.specific_heat, m.density), resistivity(m), source))
    held, faces, electrodes = [], [], []
    for boundary in scene.boundaries:
        value = constant(boundary.value)
        if boundary.kind == "temperature":
            held.append((nodes(basis, boundary), value))
        elif boundary.kind == "voltage":
            series, where = boundary.series_resistance, nodes(basis, boundary)
            given = Electrode(where, current=value) if series == math.inf else Electrode(where, value, series)
            electrodes.append(given)
        else:
            leaving = {
                "heat_flux": lambda value, _: newton.law(-value), "convection": newton.cooled,
                "radiation": newton.radiating,
            }[boundary.kind]  # fmt: skip
            faces.append((exposed(basis, boundary, order), leaving(value, constant(boundary.ambient))))
    contacts = tuple(
        split.contact(basis, owner, _pair(scene, c), order, c.thermal_resistance, c.electrical_resistance or None)
        for c in scene.contacts
    )
    return Problem(
        basis.N, scene.initial_temperature, tuple(parts), tuple(held), tuple(faces), tuple(electrodes), contacts
    )


def _pair(scene: Scene, contact: Contact) -> split.Pair:
    names = [box.name for box in scene.boxes]
    return frozenset(names.index(name) for name in contact.between)


def _along(given: Property) -> tuple[Law, Law, Law]:
    x, y, z = (newton.law(each) for each in laws.along(given))
    return x, y, z


def resistivity(material: Material) -> tuple[Law, Law, Law] | None:
    """Return the resistivity along x, y and z; None for an insulator."""
    if material.resistivity is None:
        return None
    a, at = material.temperature_coefficient, material.reference_temperature
    x, y, z = (
        newton.law(each) if laws.varies(each) else newton.linear(each, a, at)
        for each in laws.along(material.resistivity)
    )
    return x, y, z


def constant(value: Value) -> float:
    """Return a value that doesn't vary in time; raise ValueError for one that does."""
    if isinstance(value, Schedule):
        raise ValueError("the second path takes values that don't vary in time")
    return value


def facets(mesh: MeshHex, where: Boundary | Probe) -> np.ndarray:
    """Return the facets in a flat box."""
    middle, small = mesh.p[:, mesh.facets].mean(axis=1).T, 1e-9 * np.ptp(mesh.p)
    inside = (middle > np.array(where.lower) - small) & (middle < np.array(where.upper) + small)
    return np.flatnonzero(inside.all(axis=1))


def nodes(basis: Basis, where: Boundary) -> np.ndarray:
    """Return the nodes in a flat box."""
    return np.asarray(basis.get_dofs(facets=facets(basis.mesh, where)).flatten())


def exposed(basis: Basis, boundary: Boundary, order: int) -> On:
    """Return the functions on the part of a flat box that is surface."""
    outer = np.intersect1d(facets(basis.mesh, boundary), basis.mesh.boundary_facets())
    return On(FacetBasis(basis.mesh, basis.elem, facets=outer, intorder=order))


@LinearForm
def integral(v: Any, w: Any) -> Any:
    """Return the integrand of the integral of each function."""
    return v


def mean(basis: Basis, probe: Probe) -> np.ndarray:
    """Return the weights (nodes,) of the mean over a point, a flat box or a volume."""
    if probe.lower == probe.upper:
        return np.asarray(basis.probes(np.array(probe.lower)[:, None]).todense())[0]
    if any(a == b for a, b in zip(probe.lower, probe.upper, strict=True)):
        part = FacetBasis(basis.mesh, basis.elem, facets=facets(basis.mesh, probe), intorder=5)
    else:
        middle = basis.mesh.p[:, basis.mesh.t].mean(axis=1).T
        part = basis.with_elements(np.flatnonzero(((middle > probe.lower) & (middle < probe.upper)).all(axis=1)))
    return np.asarray(integral.assemble(part)) / float(part.dx.sum())


def readings(scene: Scene, basis: Basis, state: State) -> dict[str, float]:
    """Return the means that probes read: temperatures (K) and potentials (V)."""
    fields = {"temperature": state.temperature, "potential": state.potential}
    return {p.name: float(mean(basis, p) @ fields[p.quantity]) for p in scene.probes if p.quantity in fields}
