"""Scenes on the second path: the problem that `newton` solves, on hexahedra of degree 1 or 2, and its readings.

Nodes are doubled at contacts, where a temperature or a potential jumps. A scene with all features of both paths,
beam.toml, is solved by Newton's method on scikit-fem's own hexahedra too. The second path's own error is bounded by its
change when its intervals are halved: next to an edge it falls by 2^(4/3) from one mesh to the next, so that 0.7 of the
change is left.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree
from skfem import Basis, ElementHex1, ElementHexS2, FacetBasis, LinearForm, MeshHex

from benchmarks.rows import Row
from meshes.grid import Grid, graph
from scenes import laws
from scenes.laws import Property
from scenes.loading import load
from scenes.model import Boundary, Contact, Material, Probe, Scene, Schedule, Value
from validate.verify import newton
from validate.verify.expected import Expected
from validate.verify.expected import rows as solved
from validate.verify.newton import Electrode, Law, Part, Problem, State

Pair = frozenset[int]
"""The numbers of two boxes."""
FAMILY, CASE = "second paths", "silicon on a foot: laws, contact, radiation, given current"
BEAM = Path(__file__).with_name("beam.toml")
# Of the length between two planes: along x and z intervals next to edges are short.
GRADED, EVEN = np.array([0.0, 0.12, 0.88, 1.0]), np.array([0.0, 1.0])


def split_contacts(mesh: MeshHex, owner: np.ndarray, contacts: Collection[Pair]) -> MeshHex:
    """The mesh with a point of its own on each side of every face between two boxes that have a contact; ``owner``
    (cells,) is the box of each cell. Boxes keep a point in common where a third one joins them, as at the edge of a
    crack.

    Raises ValueError where a face keeps all its points, so that nothing could jump across it.
    """
    (points, boxes), number = np.unique(
        [mesh.t.ravel(), np.broadcast_to(owner, mesh.t.shape).ravel()], axis=1, return_inverse=True
    )
    joined = []
    for step in range(1, 8):  # The boxes at a point stand next to each other; a corner has eight at most.
        first = np.flatnonzero(points[step:] == points[:-step])
        first = first[~_apart(boxes[first], boxes[first + step], contacts)]
        joined.append([first, first + step])
    rows, columns = np.hstack(joined)
    graph = coo_matrix((np.ones(len(rows)), (rows, columns)), shape=(len(points),) * 2)
    count, component = connected_components(graph, directed=False)
    places = np.empty((3, count))
    places[:, component] = mesh.p[:, points]
    split = MeshHex(places, component[number].reshape(mesh.t.shape))
    first, second = owner[split.f2t[:, split.f2t[1] >= 0]]
    if _apart(first, second, contacts).any():
        raise ValueError("a contact is one face wide and open on no side: its nodes cannot be doubled")
    return split


def _apart(first: np.ndarray, second: np.ndarray, contacts: Collection[Pair]) -> np.ndarray:
    """Which pairs of boxes have a contact."""
    return np.array([frozenset(pair) in contacts for pair in zip(first.tolist(), second.tolist(), strict=True)], bool)


def contact(
    basis: Basis, owner: np.ndarray, pair: Pair, order: int, thermal: float, electrical: float | None
) -> newton.Contact:
    """The contact of two boxes on a mesh that was split there. Raises ValueError where they don't touch."""
    mesh, outer = basis.mesh, basis.mesh.boundary_facets()
    sides = [outer[owner[mesh.f2t[0, outer]] == number] for number in sorted(pair)]
    # Facets of the two sides lie on each other, and so do their nodes.
    middles = [mesh.p[:, mesh.facets[:, side]].mean(axis=1) for side in sides]
    first, second = _same(middles[0], middles[1], mesh)
    if not len(first):
        raise ValueError("two boxes with a contact don't touch")
    one, other = (basis.get_dofs(facets=side[at]).flatten() for side, at in zip(sides, (first, second), strict=True))
    here_nodes, there_nodes = _same(basis.doflocs[:, one], basis.doflocs[:, other], mesh)
    a, b = one[here_nodes], other[there_nodes]
    double = a != b
    a, b, ones = a[double], b[double], np.ones(int(double.sum()))
    less, plus = (
        csr_matrix((np.r_[ones, sign * ones], (np.r_[a, a], np.r_[a, b])), shape=(basis.N,) * 2) for sign in (-1, 1)
    )
    face = FacetBasis(mesh, basis.elem, facets=sides[0][first], intorder=order)
    return newton.Contact(face, less, plus, thermal, electrical)


def _same(a: np.ndarray, b: np.ndarray, mesh: MeshHex) -> tuple[np.ndarray, np.ndarray]:
    """The numbers of the points a (3, points) and b that are in the same place."""
    distances, nearest = cKDTree(b.T).query(a.T)
    near = np.flatnonzero(distances < 1e-9 * np.ptp(mesh.p))
    return near, nearest[near]


def hexahedra(grid: Grid) -> tuple[MeshHex, np.ndarray]:
    """Return the cells of the solid as scikit-fem's mesh, and the number of the box (cells,) that owns each."""
    mesh = MeshHex.init_tensor(*grid.breaks)
    middles = mesh.p[:, mesh.t].mean(axis=1)
    at = tuple(np.searchsorted(b, middle) - 1 for b, middle in zip(grid.breaks, middles, strict=True))
    solid = np.flatnonzero(grid.solid[at])
    return mesh.restrict(solid), grid.owner[at][solid]


def base(scene: Scene, grid: Grid, finer: int = 0) -> tuple[Basis, np.ndarray, int]:
    """Return the functions on the cells of a grid, the box that owns each cell, and the order of the quadrature: one
    Gauss point more than the degree along each axis, as the bricks have, or ``finer`` by so much. Nodes of contacts
    are there twice. Raises ValueError for a grid of several degrees, or of one above 2."""
    degrees = set(np.concatenate(grid.degrees).tolist())
    if degrees not in ({1}, {2}):
        raise ValueError(f"the second path takes one degree, 1 or 2, everywhere, not {sorted(degrees)}")
    mesh, owner = hexahedra(grid)
    if scene.contacts:
        mesh = split_contacts(mesh, owner, [_pair(scene, contact) for contact in scene.contacts])
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
            on, source = basis.with_elements(cells), constant(box.heat_source)
            parts.append(Part(on, conductivity, newton.law(m.specific_heat, m.density), resistivity(m), source))
    held, faces, electrodes = [], [], []
    for boundary in scene.boundaries:
        value = constant(boundary.value)
        if boundary.kind == "temperature":
            held.append((nodes(basis, boundary), value))
        elif boundary.kind == "voltage":
            series, where = boundary.series_resistance, nodes(basis, boundary)
            if series == 0:
                electrodes.append(Electrode(where, value))
            elif series == math.inf:
                electrodes.append(Electrode(where, source=value))
            else:
                electrodes.append(Electrode(where, source=value / series, conductance=1 / series))
        else:
            leaving = {
                "heat_flux": lambda value, _: newton.law(-value), "convection": newton.cooled,
                "radiation": newton.radiating,
            }[boundary.kind]  # fmt: skip
            faces.append((exposed(basis, boundary, order), leaving(value, constant(boundary.ambient))))
    contacts = tuple(
        contact(basis, owner, _pair(scene, c), order, c.thermal_resistance, c.electrical_resistance or None)
        for c in scene.contacts
    )
    return Problem(
        basis.N, scene.initial_temperature, tuple(parts), tuple(held), tuple(faces), tuple(electrodes), contacts
    )


def _pair(scene: Scene, contact: Contact) -> Pair:
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


def exposed(basis: Basis, boundary: Boundary, order: int) -> FacetBasis:
    """Return the functions on the part of a flat box that is surface."""
    outer = np.intersect1d(facets(basis.mesh, boundary), basis.mesh.boundary_facets())
    return FacetBasis(basis.mesh, basis.elem, facets=outer, intorder=order)


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
    fields = dict(zip(("temperature", "potential"), state, strict=True))
    return {p.name: float(mean(basis, p) @ fields[p.quantity]) for p in scene.probes if p.quantity in fields}


def rows() -> Iterator[Row]:
    """Compare the readings of both solvers."""
    scene: Scene = load(BEAM)
    coarse, fine = (halved_readings(scene, halvings) for halvings in (0, 1))
    rise = max(abs(fine[p.name] - scene.initial_temperature) for p in scene.probes if p.quantity == "temperature")
    expected = []
    for probe in scene.probes:
        value, unsure = fine[probe.name], abs(fine[probe.name] - coarse[probe.name])
        unit, scale = ("K", rise) if probe.quantity == "temperature" else ("V", value)
        expected.append(Expected(probe.name, unit, value, scale, unsure, settled=scene.accuracy))
    yield from solved(FAMILY, CASE, scene, expected, "Newton's method on scikit-fem's hexahedra")


def halved_readings(scene: Scene, halvings: int) -> dict[str, float]:
    """Return the readings of the second path, its intervals halved some times."""
    breaks = []
    for axis, parts in enumerate((GRADED, EVEN, GRADED)):
        for _ in range(halvings):
            parts = np.sort(np.concatenate([parts, (parts[1:] + parts[:-1]) / 2]))
        planes = pairwise(graph(scene).planes[axis].tolist())
        breaks.append(np.unique(np.concatenate([a + (b - a) * parts for a, b in planes])))
    grid = Grid(tuple(breaks), tuple(np.full(len(b) - 1, 2) for b in breaks), scene.boxes)
    basis, owner, order = base(scene, grid)
    state = newton.steady(problem(scene, basis, owner, order))
    return readings(scene, basis, state)
