"""Functions on the cells of any mesh, and integrals over cells and facets by quadrature."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from copy import copy
from functools import cached_property
from types import MappingProxyType
from typing import Self

import numpy as np
from scipy.sparse import csc_array
from skfem import Dofs, Mesh

from fem3d.spaces.element import Rule, Side
from fem3d.spaces.sparse import Entries, sum_entries, sum_pairs

AT_ONCE = 4_000_000  # numbers at points that are made together, which bounds the memory: 32 MB


def entities(mesh: Mesh, dofs: Dofs, vertices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(functions,): a number for each vertex, edge, facet and cell of scikit-fem's numbering that has functions; and
    where each is (entities, 3), the mean of its ``vertices`` (3, vertices)."""
    numbers, places = np.empty(int(dofs.N), int), [np.empty((0, 3))]
    parts = dofs.nodal_dofs, dofs.edge_dofs, dofs.facet_dofs, dofs.interior_dofs
    corners = np.arange(vertices.shape[1])[None], mesh.edges, mesh.facets, mesh.t
    for part, its_corners in zip(parts, corners, strict=True):
        if part is not None and part.size:
            numbers[part] = sum(map(len, places)) + np.arange(part.shape[1])
            places.append(vertices[:, its_corners].mean(axis=1).T)
    return numbers, np.concatenate(places)


class Space(ABC):
    """Functions on the cells of scikit-fem's ``mesh``.

    A function is a vector of coefficients (functions,). Densities have values at quadrature points, as (cells, points),
    and fluxes as (3, cells, points).

    Attributes
    ----------
    p : highest degree
    dofs, size : (functions of a cell, cells), and the number of functions, in scikit-fem's numbering
    entity : (functions,), the number of the vertex, edge, facet or cell of each function
    places : (entities, 3), where these are
    torn : facets across which functions jump (`fem3d.spaces.mapped`)
    origin : (functions,), the number of each function before the split
    beyond : by the name of a face, its functions, and partners in the same order that belong to no cell
    """

    mesh: Mesh
    p: int
    dofs: np.ndarray
    size: int
    entity: np.ndarray
    places: np.ndarray
    torn: np.ndarray = np.empty(0, int)
    beyond: Mapping[str, tuple[np.ndarray, np.ndarray]] = MappingProxyType({})

    @cached_property
    def origin(self) -> np.ndarray:
        """(functions,): the number of each function before the split."""
        return np.arange(self.size)

    def enlarged(self, dofs: np.ndarray, copied: np.ndarray) -> Self:
        """The space with more functions, each a copy of one (copies,), and the numbers ``dofs`` of all in its cells."""
        space = copy(self)
        for name in [n for n in vars(space) if isinstance(getattr(type(self), n, None), cached_property)]:
            del vars(space)[name]
        space.dofs, space.size = dofs, self.size + len(copied)
        space.entity = np.append(self.entity, len(self.places) + np.arange(len(copied)))
        space.places = np.concatenate([self.places, self.places[self.entity[copied]]])
        vars(space)["origin"] = np.append(self.origin, self.origin[copied])
        return space

    @cached_property
    def nested(self) -> tuple[np.ndarray, ...]:
        """Which functions (functions,) are in each lower space that this one holds, the lowest first, and in itself."""
        return tuple(self.depth >= d for d in reversed(range(min(self.p, 3))))

    @cached_property
    def unit(self) -> np.ndarray:
        """(functions,): the coefficients of the constant 1, of the vertices' functions."""
        return (self.depth > self.p).astype(float)

    @property
    @abstractmethod
    def depth(self) -> np.ndarray:
        """(functions,): how far the degree can be lowered with each still in the space; more than any for vertices."""

    @abstractmethod
    def energies(self, k: np.ndarray, c: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """(n, 3, cells): the integral of k grad u . grad v + c u v over each cell, divided among the axes, for u
        (functions,) and v (n, functions), k (cells,) or (3, cells) along the axes, and c (cells,)."""

    @abstractmethod
    def _entries(self, cells: np.ndarray, k: np.ndarray, c: np.ndarray) -> list[Entries]:
        """The integrals of `matrices` over n cells, as entries of two matrices of one pattern. Half of each cell's
        symmetric matrix: a half of all, or its upper triangle with half of the diagonal."""

    def matrices(self, k: np.ndarray, c: np.ndarray, cells: np.ndarray | None = None) -> tuple[csc_array, csc_array]:
        """The integrals of k grad u . grad v and c u v over all or n cells, with k (n,), or (3, n) by axis, c (n,)."""
        entries = self._entries(np.arange(len(c)) if cells is None else cells, k, c)
        return sum_pairs(entries, self.size, mirrored=True)

    def stiffness(self, k: np.ndarray, cells: np.ndarray) -> csc_array:
        """The integral of k grad u . grad v over some cells, for k (n,), or (3, n) along the axes."""
        return self.matrices(k, np.zeros(len(cells)), cells)[0]

    @abstractmethod
    def at(self, X: np.ndarray, along: int | None = None) -> np.ndarray:
        """(points, functions of a cell): their values at reference points (3, points), or slopes along an axis."""

    @abstractmethod
    def rule(self, cells: np.ndarray, more: int) -> Rule:
        """The quadrature of some cells, with ``more`` additional points along each axis."""

    @abstractmethod
    def side(self, number: int, more: int) -> Side:
        """A side of the reference cell, with so many ``more`` points along each axis."""

    @abstractmethod
    def jacobian(self, cells: np.ndarray, X: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The inverse of the map's derivative, (3, 3, cells, points) or, where it is diagonal, (3, cells, 1); and the
        size of its determinant (cells, points or 1)."""

    def functions_of(self, cells: np.ndarray) -> np.ndarray:
        """(functions,): whether each belongs to some cells (numbers or a mask)."""
        mask = np.zeros(self.size, bool)
        mask[self.dofs[:, cells]] = True
        return mask

    def alike(self, cells: np.ndarray) -> list[np.ndarray]:
        """Group some cells by the set of their functions."""
        return [cells]

    def on(self, cells: np.ndarray, more: int = 0) -> CellIntegrals:
        """Integrals over some cells, with ``more`` points as of `rule`."""
        return CellIntegrals(self, cells, self.rule(cells, more))


class CellIntegrals:
    """Some cells of a space with the points of a quadrature and their ``weights`` (cells, points)."""

    def __init__(self, space: Space, cells: np.ndarray, rule: Rule, dofs: np.ndarray | None = None) -> None:
        self._space, self._cells, self._rule = space, cells, rule
        self.dofs = (space.dofs[np.ix_(rule.functions, cells)] if dofs is None else dofs[rule.functions]).T
        self._inverse, sizes = space.jacobian(cells, rule.points)
        self.weights = sizes * rule.weights

    @property
    def points(self) -> np.ndarray:
        """(3, cells, points): where the points are (m)."""
        return self._space.mesh.mapping().F(self._rule.points, tind=self._cells)

    def value(self, u: np.ndarray) -> np.ndarray:
        """(..., cells, points): functions (..., functions)."""
        return np.asarray(u[..., self.dofs] @ self._rule.values.T)

    def gradient(self, u: np.ndarray) -> np.ndarray:
        """(3, cells, points): its gradient."""
        return self.covariant(u[self.dofs] @ self._rule.slopes.swapaxes(1, 2))

    def covariant(self, slopes: np.ndarray) -> np.ndarray:
        """(3, cells, points): a gradient (3, cells or 1, points or 1) of the reference cell on the cells themselves."""
        if self._inverse.ndim == 3:
            return self._inverse * slopes
        return np.einsum("ijcp,icp->jcp", self._inverse, np.broadcast_to(slopes, self._inverse.shape[1:]))

    def load(self, density: np.ndarray) -> np.ndarray:
        """(functions,): the integral of a density (cells, 1 or points) times each function."""
        return self._scattered((density * self.weights) @ self._rule.values)

    def flow(self, flux: np.ndarray) -> np.ndarray:
        """(functions,): the integral of a flux (3, cells, points) times the gradient of each function."""
        within = self._inverse * flux if self._inverse.ndim == 3 else np.einsum("ijcp,jcp->icp", self._inverse, flux)
        return self._scattered((within * self.weights @ self._rule.slopes).sum(axis=0))

    def mass_of(self, density: np.ndarray) -> csc_array:
        """The integral of a density (cells, 1 or points) times u v."""
        return sum_entries([self.entries(density)], self._space.size)

    def entries(self, density: np.ndarray, other: CellIntegrals | None = None) -> Entries:
        """The entries of `mass_of`; columns by the functions of an ``other`` object with the same cells, if given."""
        present = self._rule.present
        values, count = self._rule.values[:, present], present.sum()
        # Cell by cell, as functions times weights at many points are large.
        blocks = np.array([(values.T * each) @ values for each in density * self.weights]).reshape(-1, count, count)
        nonzero = np.abs(blocks) > 1e-14 * np.abs(blocks).max(axis=(1, 2), keepdims=True)
        dofs = self.dofs[:, present][:, :, None], (other or self).dofs[:, present][:, None]
        rows, columns = (np.broadcast_to(d, blocks.shape)[nonzero] for d in dofs)
        return blocks[nonzero], rows, columns

    def tangent(self, k: np.ndarray, flux: np.ndarray) -> np.ndarray:
        """(2, cells, n, n): the integrals of k grad u . grad v and of u flux . grad v in each cell, for k (cells,
        points), or with axes in front, and a flux (3, cells, points); rows are v."""
        k, (cells, points), n = np.broadcast_to(k, flux.shape), self.weights.shape, len(self._rule.functions)
        both = np.zeros((2, cells, n, n))
        step = max(1, AT_ONCE // (points * n))
        for some in (slice(i, i + step) for i in range(0, cells, step)):
            for d, weights in enumerate(self.weights[some] * flux[:, some]):
                if self._inverse.ndim == 3:
                    slopes = self._inverse[d, some, :, None] * self._rule.slopes[d]
                else:
                    slopes = np.einsum("icp,ipn->cpn", self._inverse[:, d, some], self._rule.slopes)
                tested = slopes.swapaxes(1, 2)
                both[0, some] += tested @ ((self.weights[some] * k[d, some])[..., None] * slopes)
                both[1, some] += tested @ (weights[..., None] * self._rule.values)
        return both

    def _scattered(self, per_cell: np.ndarray) -> np.ndarray:
        return np.bincount(self.dofs.ravel(), per_cell.ravel(), self._space.size)

    @cached_property
    def functions(self) -> np.ndarray:
        """(functions,): which do not vanish at the points."""
        mask = np.zeros(self._space.size, bool)
        mask[self.dofs[:, self._rule.present]] = True
        return mask


class FaceIntegrals:
    """Some facets of a space, each seen from one of its cells, by the functions of this cell or by ``dofs`` (functions
    of a cell, facets) in place of these.

    Each side of a cell has its own `CellIntegrals`, with points on that side and the weights of the facet. This avoids
    a search for points in curved cells by scikit-fem's FacetBasis, which ends at an absolute 1e-12.
    """

    def __init__(
        self, space: Space, facets: np.ndarray, cells: np.ndarray, more: int = 0, dofs: np.ndarray | None = None
    ) -> None:
        self.space, self.facets, self.cells, self._more = space, facets, cells, more
        self._dofs = space.dofs[:, cells] if dofs is None else dofs
        self._local = (space.mesh.t2f[:, cells] == facets).argmax(axis=0)

    @cached_property
    def sides(self) -> list[tuple[np.ndarray, CellIntegrals, np.ndarray]]:
        """The facets of each side, their cells with points there, and outward normals (3, facets, points)."""
        sides = []
        for number in np.unique(self._local):
            at, (rule, normal) = np.flatnonzero(self._local == number), self.space.side(int(number), self._more)
            cells = CellIntegrals(self.space, self.cells[at], rule, self._dofs[:, at])
            outwards = cells.covariant(normal[:, None, None]) * cells.weights
            cells.weights = np.linalg.norm(outwards, axis=0)
            sides.append((at, cells, outwards / cells.weights))
        return sides

    def _filled(self, evaluate: Callable[[CellIntegrals], np.ndarray], shape: tuple[int, ...] = ()) -> np.ndarray:
        """(..., facets, points): the values on the facets of each side, in one array."""
        count = max((each.weights.shape[1] for _, each, _ in self.sides), default=0)
        values = np.empty((*shape, len(self.cells), count))
        for at, cells, _ in self.sides:
            values[..., at, :] = evaluate(cells)
        return values

    @cached_property
    def areas(self) -> np.ndarray:
        """(facets, points): the weights of the quadrature (m2)."""
        return self._filled(lambda cells: cells.weights)

    @cached_property
    def functions(self) -> np.ndarray:
        """(functions,): which do not vanish on the facets."""
        return np.any([np.zeros(self.space.size, bool), *(cells.functions for _, cells, _ in self.sides)], axis=0)

    def value(self, u: np.ndarray) -> np.ndarray:
        """(..., facets, points): functions (..., functions)."""
        return self._filled(lambda cells: cells.value(u), u.shape[:-1])

    def load(self, density: np.ndarray | float = 1.0) -> np.ndarray:
        """(functions,): the integral of a density (facets, 1 or points) times each function."""
        full = np.broadcast_to(density, self.areas.shape)
        return sum((cells.load(full[at]) for at, cells, _ in self.sides), np.zeros(self.space.size))

    def flux(self, conductivity: np.ndarray) -> np.ndarray:
        """(functions,): the integral of -conductivity (facets, 1 or points; with axes in front where it differs along
        them) du/dn, outwards, for each function u."""
        full = np.broadcast_to(conductivity, (*conductivity.shape[:-2], *self.areas.shape))
        loads = np.zeros(self.space.size)
        for at, cells, normal in self.sides:
            loads -= cells.flow(full[..., at, :] * normal)
        return loads

    def mass_of(self, density: np.ndarray | float = 1.0) -> csc_array:
        """The integral of a density (facets, 1 or points) times u v."""
        return sum_entries(self.entries(density), self.space.size)

    def entries(self, density: np.ndarray | float) -> list[Entries]:
        """The entries of `mass_of` for each side, as `CellIntegrals.entries`."""
        full = np.broadcast_to(density, self.areas.shape)
        return [cells.entries(full[at]) for at, cells, _ in self.sides]

    def normals(self) -> np.ndarray:
        """(functions, 3): the integral of the outward normal times the square of each function."""
        normals = np.zeros((self.space.size, 3))
        for _, cells, normal in self.sides:
            normals += np.stack([cells.mass_of(n).diagonal() for n in normal], axis=1)
        return normals
