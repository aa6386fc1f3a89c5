"""The heat problem of a scene, term by term of its weak form, and its nonlinear boundaries.

For all v that vanish where temperatures are given,

  int k grad u . grad v  +  int_contacts [u] [v] / R  +  int rho c du/dt v
      =  int q v  +  int_faces (h (T_air - T_0 - u) + q_n) v,   u = g there,

with [u] the jump at a contact of resistance R, u the rise above the initial temperature T_0. Joule heat comes later,
from the current (`fem3d.solution`).

At a boundary that radiates, or whose h depends on its temperature (`scenes.faces`), the linear problem replaces the
outward flux q(T) by a Robin condition. Its coefficient h is q' at the higher of ambient and initial temperature T_0;
its constant is such that the flux at T_0 is exact. `Surface` adds the rest,

    int (q(T_0 + u) - q(T_0) - h u) v.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.sparse import csc_array

from fem3d.problems.cholesky import Ordering
from fem3d.problems.heat import Cache, FaceFlow, HeatProblem, as_rise
from fem3d.problems.material_laws import Conduction, Storage, Term, cells_with_law, coupled_by_laws, table_points
from fem3d.problems.reactions import share_reactions
from fem3d.spaces.domain import Domain
from fem3d.spaces.integrals import FaceIntegrals
from fem3d.spaces.mapped import Interface
from fem3d.spaces.sparse import Entries, add, submatrix, sum_entries
from scenes import faces
from scenes.model import AnyBoundary, Schedule, Value, bends, values


def assemble(domain: Domain) -> HeatProblem:
    """Assemble the heat problem of a domain."""
    space = domain.space
    sources, generated = _sources(domain)
    robin, cooled, loads, rows = _robin_and_fluxes(domain)
    given, values, (shares, edges), contradiction = _given_values(domain)
    order = _numbering(domain, given)
    capacities = domain.per_cell("density") * domain.per_cell("specific_heat")
    conduction, capacity = space.matrices(domain.per_cell("thermal_conductivity"), capacities)
    more = 1 + table_points(domain, "thermal_conductivity")
    terms: list[Term] = [Conduction(domain, more)] if len(cells_with_law(domain, "thermal_conductivity")) else []
    terms += [Surface(domain, b) for b in domain.scene.boundaries if bends(b) and len(domain.facets(b))]
    storage = Storage(domain) if len(cells_with_law(domain, "specific_heat")) else None
    # Stiffness and mass must have one pattern, and one order of elimination serves tangents too.
    stiffness = add(conduction, robin) if robin.nnz else conduction
    if terms or storage:
        stiffness = add(stiffness, coupled_by_laws(domain))
    stiffness, mass = submatrix(stiffness, order), submatrix(capacity, order)
    _conserve(stiffness, space.unit[order], cooled[order])
    free = int((~given[order]).sum())
    fixed = order[free:]
    return HeatProblem(
        domain=domain, free=free, order=order, elimination=Ordering(space.places), stiffness=stiffness, mass=mass,
        loads=(sources + loads)[:, order], given=values[:, fixed], generated=generated,
        shares={name: share[order] for name, share in shares.items()}, edges=submatrix(edges, fixed),
        face_flows={name: FaceFlow(entering, row[order]) for name, (entering, row) in rows.items()},
        contradiction=contradiction[order], terms=tuple(terms), storage=storage,
    )  # fmt: skip


def _sources(domain: Domain) -> tuple[np.ndarray, np.ndarray]:
    """int q v of the heat sources, (channels, functions) in W, and their heat (channels,) in W."""
    space, channels = domain.space, domain.inputs
    loads, generated = np.zeros((channels.count, space.size)), np.zeros(channels.count)
    for value, cells in domain.sources:
        heating, on = channels.split(value), space.on(cells)
        loads += np.outer(heating, on.load(np.ones((len(cells), 1))))
        generated += heating * on.weights.sum()
    return loads, generated


def _robin_and_fluxes(
    domain: Domain,
) -> tuple[csc_array, np.ndarray, np.ndarray, dict[str, tuple[np.ndarray, np.ndarray]]]:
    """Assemble the linear conditions on faces. Return

    - int h u v + int_contacts [u] [v] / R, (functions, functions) in W/K, and int h v, (functions,) in W/K,
    - int (h (T_air - T_0) + q_n) v, (channels, functions) in W,
    - by boundary the heat that enters at no rise, (channels,) in W, and per kelvin, (functions,) in W/K.
    """
    space, channels = domain.space, domain.inputs
    robin, cooled = list[Entries](), np.zeros(space.size)
    loads, rows = np.zeros((channels.count, space.size)), {}
    for b in domain.scene.boundaries:
        if b.kind not in ("convection", "radiation", "heat_flux"):
            continue
        face = domain.faces(b)
        area, h = face.load(), 0.0
        if bends(b):
            h, entering = robin_condition(domain, b)
            flux = channels.split(entering)
        elif b.kind == "convection":
            h = float(*values(b.value))
            flux = h * as_rise(channels, b.ambient, domain.scene.initial_temperature)
        else:
            flux = channels.split(b.value)
        if h:
            robin += face.entries(h)
            cooled += h * area
        loads += np.outer(flux, area)
        rows[b.name] = flux * float(face.areas.sum()), -h * area
    matrix = sum_entries(robin, space.size)
    for joint in domain.contacts:
        if joint.contact.thermal_resistance:
            jumps = Interface.inside(space, joint.facets).mass()
            matrix = csc_array(matrix + jumps / joint.contact.thermal_resistance)
    return matrix, cooled, loads, rows


def _given_values(domain: Domain) -> tuple[np.ndarray, np.ndarray, tuple[dict[str, np.ndarray], csc_array], np.ndarray]:
    """Assemble u = g. Return which functions are fixed (functions,), their rises (channels, functions) in K, the shares
    of boundaries in the reactions there (`share_reactions`), and `_contradiction`."""
    space, channels = domain.space, domain.inputs
    boundaries = [b for b in domain.scene.boundaries if b.kind == "temperature"]
    faces = [domain.faces(b) for b in boundaries]
    fixed, values = np.zeros(space.size, bool), np.zeros((channels.count, space.size))
    for b, face in zip(boundaries, faces, strict=True):
        on = face.functions
        values[:, on] = np.outer(as_rise(channels, b.value, domain.scene.initial_temperature), space.unit[on])
        fixed |= on
    temperatures: list[Value] = [b.value for b in boundaries]
    reactions = share_reactions([b.name for b in boundaries], temperatures, faces, space.unit)
    return fixed, values, reactions, _contradiction(temperatures, faces, space.unit)


def _numbering(domain: Domain, fixed: np.ndarray) -> np.ndarray:
    """(all dofs,): the functions of the highest space, free functions first, and among them lower spaces first, so
    that the matrices of lower spaces are leading parts."""
    space = domain.space
    level = np.sum([~nested for nested in space.nested], axis=0)
    order = np.lexsort((np.arange(space.size), level, fixed))
    return order[space.nested[-1][order]]


def _contradiction(values: Sequence[Value], faces: Sequence[FaceIntegrals], unit: np.ndarray) -> np.ndarray:
    """(functions,): the largest difference of the temperatures (K) that boundaries give a vertex."""
    highest, lowest = np.full(len(unit), -np.inf), np.full(len(unit), np.inf)
    for value, face in zip(values, faces, strict=True):
        given, on = value.values if isinstance(value, Schedule) else (value,), face.functions & (unit == 1.0)
        highest[on], lowest[on] = np.maximum(highest[on], max(given)), np.minimum(lowest[on], min(given))
    count = np.sum([face.functions for face in faces], axis=0) if len(set(values)) > 1 else np.zeros(len(unit))
    return np.where((count > 1) & (unit == 1.0), np.maximum(highest, lowest) - np.minimum(highest, lowest), 0.0)


def _conserve(stiffness: csc_array, unit: np.ndarray, cooled: np.ndarray) -> None:
    """Sets the diagonal such that a uniform rise drives no heat but to the air (``cooled``, W/K), to the last digit.

    Sums of large entries leave rounding there, which shows in the temperatures of layers in series.
    """
    stiffness.sort_indices()
    columns = np.repeat(np.arange(stiffness.shape[1]), np.diff(stiffness.indptr))
    on = np.flatnonzero((stiffness.indices == columns) & (unit[columns] == 1.0))
    # The matrix is symmetric: its columns serve as rows.
    sums, filled = np.zeros(len(unit), np.longdouble), np.flatnonzero(np.diff(stiffness.indptr))
    products = stiffness.data.astype(np.longdouble) * unit[stiffness.indices]
    sums[filled] = np.add.reduceat(products, stiffness.indptr[filled])
    stiffness.data[on] = (stiffness.data[on] - (sums - cooled)[columns[on]]).astype(float)


def robin_condition(domain: Domain, boundary: AnyBoundary) -> tuple[float, float]:
    """The coefficient h (W/(m2 K)) of the linear problem, and the flux (W/m2) that enters at no rise."""
    start = domain.scene.initial_temperature
    near = np.array(max(start, *values(boundary.ambient)))
    return float(faces.coefficient(boundary, near)), -float(faces.flux(boundary, np.array(start)))


@dataclass(frozen=True, eq=False)
class Surface:
    """A nonlinear heat flux beyond its Robin condition, by a quadrature with ``more`` points along each axis."""

    domain: Domain
    boundary: AnyBoundary
    more: int = 1
    _cache: Cache = field(init=False, default_factory=Cache)

    @property
    def on(self) -> FaceIntegrals:
        """The faces, with the points of the quadrature."""
        return self.on_some(self.domain.facets(self.boundary))

    def on_some(self, facets: np.ndarray) -> FaceIntegrals:
        """Some of the facets, with the points of the quadrature; kept, as their flux is read again and again."""
        return self._cache.get_or_make(facets.tobytes(), lambda: self.domain.seen(facets, more=self.more))

    def outflow(self, u: np.ndarray) -> np.ndarray:
        """(functions,): the heat that leaves beyond the Robin condition, in W."""
        rise, (h, entering) = self.on.value(u), robin_condition(self.domain, self.boundary)
        return self.on.load(faces.flux(self.boundary, self._start + rise) + entering - h * rise)

    def tangent(self, u: np.ndarray) -> tuple[csc_array, csc_array | None]:
        """(functions, functions) twice: the derivative in W/K, by the coefficient beyond Robin's, and the rest."""
        at = self._start + self.on.value(u)
        rest = faces.beyond(self.boundary, at)
        slope = faces.coefficient(self.boundary, at) - robin_condition(self.domain, self.boundary)[0]
        return self.on.mass_of(slope), None if rest is None else self.on.mass_of(rest)

    def entering(self, u: np.ndarray, facets: np.ndarray) -> float:
        """The heat (W) that enters by some facets at a field u."""
        seen = self.on_some(facets)
        return -float((seen.areas * faces.flux(self.boundary, self._start + seen.value(u))).sum())

    def entering_by_tangent(self, u: np.ndarray, facets: np.ndarray) -> tuple[float, np.ndarray]:
        """The same by the tangent at a field u: at no rise (W), and per kelvin (functions,) in W/K."""
        seen = self.on_some(facets)
        per_kelvin = -seen.load(faces.slope(self.boundary, self._start + seen.value(u)))
        return self.entering(u, facets) - float(per_kelvin @ u), per_kelvin

    @property
    def _start(self) -> float:
        return float(self.domain.scene.initial_temperature)
