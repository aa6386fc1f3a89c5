"""Properties that follow the temperature: conduction and heat storage by laws.

The linear problem has the conductivity k0 of the initial temperature. `Conduction` adds the integral of (k(T) - k0)
grad u . grad v, by a quadrature of its own, and the two parts of its tangent: the matrix of k(T) - k0, symmetric, and
the integral of k'(T) w grad u . grad v, which is not. A term of another kind has the methods of `Term` and joins
`HeatProblem.terms`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, Protocol

import numpy as np
from scipy.sparse import csc_array

from fem3d.spaces.domain import Domain
from fem3d.spaces.integrals import CellIntegrals, FaceIntegrals
from fem3d.spaces.sparse import sum_entries, sum_pairs
from scenes import laws, physics
from scenes.faces import COLDEST
from scenes.laws import Property

# A choice: on 24 bars of random tables four save a third of the unknowns at 1.05 times the time, six 5 % more at 1.14.
TABLE_POINTS = 4


class Term(Protocol):
    """A nonlinear term of the heat problem: at a field u (functions,), a rise in K."""

    def outflow(self, u: np.ndarray) -> np.ndarray:
        """(functions,): its residual beside K u, in W."""

    def tangent(self, u: np.ndarray) -> tuple[csc_array, csc_array | None]:
        """(functions, functions) twice, in W/K: a symmetric part of its derivative, with which K stays positive
        definite, and the rest where there is one."""


class CellProperty:
    """A property (by its key) on some cells, as a function of the temperature at points (cells, points): (cells,
    points), or (3, cells, points) where it differs along the axes."""

    def __init__(self, domain: Domain, key: str, cells: np.ndarray) -> None:
        given = [m.law(key) for m in domain.materials]
        bodies = domain.body[cells]
        self._start = domain.scene.initial_temperature
        # Polynomials swing below the coldest temperature beside steep rises, and a law that is followed there makes
        # equations of a coarse mesh that have no solution. A field with an error below one half is nowhere so cold.
        self._coldest = max(COLDEST, 0.5 * physics.coldest(domain.scene))
        self._axes = any(isinstance(given[b], tuple) for b in np.unique(bodies))
        self._parts = [(np.flatnonzero(bodies == b), given[b]) for b in np.unique(bodies).tolist()]

    def value(self, rise: np.ndarray) -> np.ndarray:
        """The property at a rise (K)."""
        return self._made(rise, lambda law, t: law(t) if callable(law) else np.full_like(t, law))

    def slope(self, rise: np.ndarray) -> np.ndarray:
        """Its derivative (per K): zero below the coldest temperature."""
        slopes = self._made(rise, lambda law, t: law.slope(t) if callable(law) else np.zeros_like(t))
        return np.asarray(np.where(self._start + rise < self._coldest, 0.0, slopes))

    def integral(self, rise: np.ndarray) -> np.ndarray:
        """Its integral over the temperature, from the initial one to a rise (K) above."""
        start = np.full_like(rise, self._start)
        return self._made(rise, lambda law, t: law.integral(t) - law.integral(start[: len(t)]) if callable(law) else
                          law * (t - self._start))  # fmt: skip

    def _made(self, rise: np.ndarray, evaluate: Callable[[Property, np.ndarray], np.ndarray]) -> np.ndarray:
        temperature = np.maximum(self._start + rise, self._coldest)
        values = np.empty((*((3,) if self._axes else ()), *rise.shape))
        for at, given in self._parts:
            if self._axes:
                for d, law in enumerate(laws.along(given)):
                    values[d, at] = evaluate(law, temperature[at])
            else:
                values[at] = evaluate(given, temperature[at])
        return values


def cells_with_law(domain: Domain, key: str) -> np.ndarray:
    """The cells whose property of a key follows the temperature."""
    follows = np.array([laws.varies(getattr(m, key)) for m in domain.materials])
    return np.flatnonzero(follows[domain.body])


def table_points(domain: Domain, key: str) -> int:
    """How many more points along each axis a property takes: some at rest where a table's slope jumps."""
    given = (getattr(law, "table", law) for material in domain.materials for law in laws.of(getattr(material, key)))
    return TABLE_POINTS * (domain.scene.steady and any(isinstance(law, laws.Table) for law in given))


class LawCells(NamedTuple):
    """Cells whose property follows the temperature: their quadrature, the law, its value at the initial temperature
    (cells, 1) or with axes in front, and their numbers."""

    on: CellIntegrals
    law: CellProperty
    cold: np.ndarray
    cells: np.ndarray


def cells_by_law(domain: Domain, key: str, more: int) -> list[LawCells]:
    """Return the parts whose property of a key follows the temperature, with ``more`` points along each axis."""
    found = []
    for alike in domain.space.alike(cells_with_law(domain, key)):
        law = CellProperty(domain, key, alike)
        found.append(LawCells(domain.space.on(alike, more), law, law.value(np.zeros((len(alike), 1))), alike))
    return found


def coupled_by_laws(domain: Domain) -> csc_array:
    """(functions, functions): zeros where laws may couple functions, all of a cell; constants couple fewer."""
    entries = []
    for key in ("thermal_conductivity", "specific_heat"):
        for on, *_ in cells_by_law(domain, key, 0):
            rows, columns = np.broadcast_arrays(on.dofs[:, :, None], on.dofs[:, None])
            entries.append((np.zeros(rows.size), rows.ravel(), columns.ravel()))
    return sum_entries(entries, domain.space.size)


@dataclass(frozen=True, eq=False)
class Conduction:
    """The conductivity less its value at the initial temperature, on the cells where it follows, by a quadrature with
    ``more`` points along each axis than the linear problem has."""

    domain: Domain
    more: int

    @cached_property
    def groups(self) -> list[LawCells]:
        return cells_by_law(self.domain, "thermal_conductivity", self.more)

    def outflow(self, u: np.ndarray) -> np.ndarray:
        """(functions,): int (k - k0) grad u . grad v, in W."""
        flow = np.zeros(self.domain.space.size)
        for on, law, cold, _ in self.groups:
            if u[on.dofs].any():
                flow += on.flow((law.value(on.value(u)) - cold) * on.gradient(u))
        return flow

    def tangent(self, u: np.ndarray) -> tuple[csc_array, csc_array]:
        """(functions, functions) twice: the integrals of (k - k0) grad w . grad v and of k' w grad u . grad v."""
        entries = []
        for on, law, cold, _ in self.groups:
            rise, dofs = on.value(u), on.dofs.astype(np.int32)
            both = on.tangent(law.value(rise) - cold, law.slope(rise) * on.gradient(u))
            rows, columns = (np.broadcast_to(d, both.shape[1:]).ravel() for d in (dofs[:, :, None], dofs[:, None]))
            entries.append((both.reshape(2, -1), rows, columns))
        return sum_pairs(entries, self.domain.space.size)


@dataclass(frozen=True, eq=False)
class Storage:
    """The heat capacity less its value at the initial temperature, on the cells where it follows the temperature."""

    domain: Domain
    more: int = 1

    @cached_property
    def groups(self) -> list[tuple[CellIntegrals, CellProperty, np.ndarray, np.ndarray]]:
        """`cells_by_law` of the specific heat, with the density (cells, 1) of their cells."""
        density = self.domain.per_cell("density")
        return [(*p[:3], density[p.cells][:, None]) for p in cells_by_law(self.domain, "specific_heat", self.more)]

    def power(self, u: np.ndarray, w: np.ndarray) -> np.ndarray:
        """(functions,): int rho (c - c0) w v with the specific heat at a field u: of w a rate, in W."""
        heat = np.zeros(self.domain.space.size)
        for on, law, cold, density in self.groups:
            if w[on.dofs].any():
                heat += on.load(density * (law.value(on.value(u)) - cold) * on.value(w))
        return heat

    def tangent(self, u: np.ndarray, w: np.ndarray) -> tuple[csc_array, csc_array]:
        """(functions, functions) twice: the derivative of `power` by the rate w, and by u."""
        capacity = steepness = csc_array((self.domain.space.size,) * 2)
        for on, law, cold, density in self.groups:
            rise = on.value(u)
            capacity = capacity + on.mass_of(density * (law.value(rise) - cold))
            steepness = steepness + on.mass_of(density * law.slope(rise) * on.value(w))
        return csc_array(capacity), csc_array(steepness)

    def heat(self, u: np.ndarray) -> float:
        """The heat stored at a field u beyond c0 u (J)."""
        heat = 0.0
        for on, law, cold, density in self.groups:
            rise = on.value(u)
            heat += float((on.weights * density * (law.integral(rise) - cold * rise)).sum())
        return heat


def missed_by_quadrature(domain: Domain, law: CellProperty, cells: np.ndarray, at: np.ndarray, u: np.ndarray) -> float:
    """Return what a quadrature may miss of a law's integral over the temperatures of a cell, relative to it.

    A thin layer beside a vertex may lie between the points, whose temperatures ``at`` (cells, points) at a field u
    (functions,) then leave out those of the layer. A law that the points see varies there about as among the points:
    its mean is within their range, extended on both sides by the ratio of the largest value to the smallest one.
    """
    space = domain.space
    of_vertices = (space.unit[space.dofs[:, cells]] == 1.0).all(axis=1)
    vertices, off = u[space.dofs[np.ix_(of_vertices, cells)]].T, 0.0
    coldest, hottest = at.min(axis=1, keepdims=True), at.max(axis=1, keepdims=True)
    values, beyond = law.value(at), vertices - np.clip(vertices, coldest, hottest)
    low, high = values.min(axis=-1, keepdims=True), values.max(axis=-1, keepdims=True)
    parts = np.append(0.0, np.geomspace(1e-6, 1.0, 41))  # of the way from a vertex
    for vertex, width in zip(vertices.T[..., None], beyond.T[..., None], strict=True):
        mean = np.trapezoid(law.value(vertex - parts * width), parts, axis=-1)[..., None]
        excess = abs(width) * np.maximum(mean - high**2 / low, low**2 / high - mean)
        off = max(off, float((excess / np.maximum(abs(width) * mean + (hottest - coldest) * low, 1e-300)).max()))
    return off


def at_faces(domain: Domain, key: str, u: np.ndarray, faces: FaceIntegrals) -> np.ndarray:
    """(facets, points), or with axes in front: a property on the side of the cells of some faces, at a field u."""
    seen = faces if faces.space is domain.space else FaceIntegrals(domain.space, faces.facets, faces.cells)
    return CellProperty(domain, key, faces.cells).value(seen.value(u))
