"""A scene as the Newton's method of the second path takes it, on a grid of degree 1 or 2 everywhere."""

from __future__ import annotations

import math

import numpy as np
from skfem import Basis, ElementHex1, ElementHexS2, FacetBasis, MeshHex

from meshes.grid import Grid
from scenes import laws
from scenes.laws import Inverse, PowerLaw, Property, Table
from scenes.model import Boundary, Contact, Material, Scene
from validate.verify import newton, split
from validate.verify.newton import Electrode, Law, On, Part, Problem, State
from validate.verify.reference import constant, facets, hexahedra, mean


def base(scene: Scene, grid: Grid, finer: int = 0) -> tuple[Basis, np.ndarray, int]:
    """The functions on the cells of a grid, which box owns each cell, and the order of integrals: as those of the
    bricks, by one Gauss point more than the degree along each axis, or ``finer`` by so much. Nodes of contacts are
    there twice."""
    mesh, owner = hexahedra(grid)
    if scene.contacts:
        mesh = split.split(mesh, owner, [_pair(scene, contact) for contact in scene.contacts])
    (degree,) = set(np.concatenate(grid.degrees).tolist())
    order = 2 * degree + 1 + finer
    return Basis(mesh, (ElementHex1(), ElementHexS2())[degree - 1], intorder=order), owner, order


def problem(scene: Scene, basis: Basis, owner: np.ndarray, order: int) -> Problem:
    """A scene with constant values (else ValueError) on a `base`; contacts of heat, between conductors also current."""
    parts = []
    for number, box in enumerate(scene.boxes):
        cells = np.flatnonzero(owner == number)
        if len(cells):
            m = box.material
            conductivity, capacity = axes(m.thermal_conductivity), law(m.specific_heat, m.density)
            on, source = On(basis.with_elements(cells)), constant(box.heat_source)
            parts.append(Part(on, conductivity, capacity, resistivity(m), source))
    held, faces, electrodes = [], [], []
    for boundary in scene.boundaries:
        value = constant(boundary.value)
        if boundary.kind == "temperature":
            held.append((_nodes(basis, boundary), value))
        elif boundary.kind == "voltage":
            nodes, series = _nodes(basis, boundary), boundary.series_resistance
            given = Electrode(nodes, current=value) if series == math.inf else Electrode(nodes, value, series)
            electrodes.append(given)
        elif boundary.kind == "heat_flux":
            faces.append((exposed(basis, boundary, order), newton.constant(-value)))
        else:
            leaving = {"convection": newton.cooled, "radiation": newton.radiating}[boundary.kind]
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


def law(given: Property, times: float = 1.0) -> Law:
    """A property as a function of the temperature, by its numbers alone, perhaps times a number."""
    if isinstance(given, PowerLaw):
        return newton.power(times * given.value, given.at, given.exponent)
    if isinstance(given, Inverse):
        return newton.inverse(newton.table(given.temperatures, np.array(given.values) / times))
    if isinstance(given, Table):
        return newton.table(given.temperatures, times * np.array(given.values))
    return newton.constant(times * float(given))


def axes(given: Property) -> tuple[Law, Law, Law]:
    """A property along x, y and z."""
    x, y, z = (law(each) for each in laws.along(given))
    return x, y, z


def resistivity(material: Material) -> tuple[Law, Law, Law] | None:
    if material.resistivity is None:
        return None
    a, at = material.temperature_coefficient, material.reference_temperature
    x, y, z = (
        law(each) if laws.varies(each) else newton.linear(each, a, at) for each in laws.along(material.resistivity)
    )
    return x, y, z


def _nodes(basis: Basis, boundary: Boundary) -> np.ndarray:
    return basis.get_dofs(facets=facets(basis.mesh, boundary)).flatten()


def exposed(basis: Basis, boundary: Boundary, order: int) -> On:
    """The part of a flat box where one side is solid and the other is not."""
    mesh: MeshHex = basis.mesh
    outer = np.intersect1d(facets(mesh, boundary), mesh.boundary_facets())
    return On(FacetBasis(mesh, basis.elem, facets=outer, intorder=order))


def readings(scene: Scene, basis: Basis, state: State) -> dict[str, float]:
    """The means that probes read: temperatures (K) and potentials (V)."""
    fields = {"temperature": state.temperature, "potential": state.potential}
    return {p.name: float(mean(basis, p) @ fields[p.quantity]) for p in scene.probes if p.quantity in fields}
