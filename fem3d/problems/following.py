"""Heat conduction whose conductivity follows the temperature, as a term beside the linear problem.

The linear problem has the conductivity k0 of the initial temperature. `Conduction` adds int (k(T) - k0) grad u . grad v,
by a quadrature of its own, and what its tangent is made of: the matrix of k(T) - k0, symmetric, and int k'(T) w grad u .
grad v, which is not. A term of another kind (radiation, say) has the same three methods, and joins `HeatProblem.terms`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Protocol

import numpy as np
from scipy.sparse import csc_array

from fem3d.spaces.domain import Domain
from fem3d.spaces.integrals import Cells, Faces
from scenes import laws
from scenes.laws import Property

COLDEST = 1.0  # K: a state on the way to the solution may lie below, where no law says anything
MORE = 1  # points along each axis beyond those of the linear problem: see `fem3d.solution.newton` for what they leave


class Term(Protocol):
    """What makes the heat problem nonlinear: at a field u (functions,), a rise in K."""

    def outflow(self, u: np.ndarray) -> np.ndarray:
        """(functions,): what it adds to K u, in W."""

    def tangent(self, u: np.ndarray) -> tuple[csc_array, csc_array | None]:
        """(functions, functions) twice, in W/K: a symmetric part of its derivative, with which K stays positive
        definite, and the rest where there is one."""

    def finer(self) -> Term:
        """The same by a finer quadrature, which tells the error of its own."""


class OfCells:
    """A property (by its key) on some cells, as a function of the temperature at points (cells, points): (cells,
    points), or (3, cells, points) where it differs along the axes."""

    def __init__(self, domain: Domain, key: str, cells: np.ndarray) -> None:
        given = [getattr(m, key) for m in domain.materials]
        bodies = domain.body[cells]
        self._start = domain.scene.initial_temperature
        self._axes = any(isinstance(given[b], tuple) for b in np.unique(bodies))
        of = {b: given[b] for b in np.unique(bodies).tolist()}
        self._parts = [(np.flatnonzero(bodies == b), each) for b, each in of.items()]

    def value(self, rise: np.ndarray) -> np.ndarray:
        """The property at a rise (K)."""
        return self._made(rise, lambda law, t: law(t) if callable(law) else np.full_like(t, law))

    def slope(self, rise: np.ndarray) -> np.ndarray:
        """Its derivative (per K)."""
        return self._made(rise, lambda law, t: law.slope(t) if callable(law) else np.zeros_like(t))

    def _made(self, rise: np.ndarray, of: Callable[[Property, np.ndarray], np.ndarray]) -> np.ndarray:
        temperature = np.maximum(self._start + rise, COLDEST)
        found = np.empty((*((3,) if self._axes else ()), *rise.shape))
        for at, given in self._parts:
            if self._axes:
                for d, law in enumerate(laws.along(given)):
                    found[d, at] = of(law, temperature[at])
            else:
                found[at] = of(given, temperature[at])
        return found


def following(domain: Domain, key: str) -> np.ndarray:
    """The cells whose property of a key follows the temperature."""
    follows = np.array([laws.varies(getattr(m, key)) for m in domain.materials])
    return np.flatnonzero(follows[domain.body])


@dataclass(frozen=True, eq=False)
class Conduction:
    """The conductivity beyond that of the initial temperature, on the cells where it follows; ``more`` points along
    each axis than is their due."""

    domain: Domain
    more: int = MORE
    parts: list[tuple[Cells, OfCells, np.ndarray]] = field(init=False)

    def __post_init__(self) -> None:
        parts = []
        for cells in self.domain.space.alike(following(self.domain, "thermal_conductivity")):
            on = self.domain.space.on(cells, self.more)
            law = OfCells(self.domain, "thermal_conductivity", cells)
            parts.append((on, law, law.value(np.zeros((len(cells), 1)))))
        object.__setattr__(self, "parts", parts)

    def outflow(self, u: np.ndarray) -> np.ndarray:
        """(functions,): int (k - k0) grad u . grad v, in W."""
        found = np.zeros(self.domain.space.size)
        for on, law, cold in self.parts:
            found += on.flow((law.value(on.value(u)) - cold) * on.gradient(u))
        return found

    def tangent(self, u: np.ndarray) -> tuple[csc_array, csc_array]:
        """(functions, functions) twice: the integrals of (k - k0) grad w . grad v and of k' w grad u . grad v."""
        both = []
        for on, law, cold in self.parts:
            rise = on.value(u)
            one, other = on.tangent(law.value(rise) - cold, law.slope(rise) * on.gradient(u))
            both.append((one.ravel(), other.ravel()))
        pattern, places = self._pattern
        matrices = (np.bincount(places, np.concatenate(data), pattern.nnz) for data in zip(*both, strict=True))
        symmetric, rest = (csc_array((d, pattern.indices, pattern.indptr), pattern.shape) for d in matrices)
        return symmetric, rest

    @cached_property
    def _pattern(self) -> tuple[csc_array, np.ndarray]:
        """The pattern of the matrices, and which of its entries each entry of a cell's block adds to."""
        size, keys = self.domain.space.size, []
        for on, _, _ in self.parts:
            numbers = on.numbers.astype(np.int64)
            keys.append((numbers[:, None, :] * size + numbers[:, :, None]).ravel())
        every, places = np.unique(np.concatenate(keys), return_inverse=True)
        starts = np.searchsorted(every, np.arange(size + 1, dtype=np.int64) * size)
        return csc_array((np.zeros(len(every)), every % size, starts), (size, size)), places

    def finer(self) -> Conduction:
        """By two more points along each axis."""
        return Conduction(self.domain, self.more + 2)


def at_faces(domain: Domain, u: np.ndarray, faces: Faces, cells: np.ndarray) -> np.ndarray:
    """(facets, points), or with axes in front: the conductivity at a field u of facets seen from some cells."""
    return OfCells(domain, "thermal_conductivity", cells).value(faces.value(u))


def terms(domain: Domain) -> tuple[Term, ...]:
    """What makes the heat problem of a domain nonlinear."""
    return (Conduction(domain),) if len(following(domain, "thermal_conductivity")) else ()
