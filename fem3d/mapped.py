"""The space of degree 2 on the cells of a mesh file, tetrahedra or hexahedra, straight or curved, through scikit-fem.

The vertex functions are those of degree 1, and those of edges (of hexahedra of facets and cells too) scikit-fem's of
degree 2: together they span its space of degree 2, and the first ones alone that of degree 1.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from scipy.sparse import csc_array
from skfem import CellBasis, ElementHex1, ElementHex2, ElementTetP1, ElementTetP2
from skfem.assembly.dofs import Dofs
from skfem.element import ElementH1
from skfem.quadrature import get_quadrature

from fem3d import forms
from fem3d.factorization import entities

ORDER = 5  # of the quadrature: twice the degree for the mass matrix, and one more for a coefficient


class ElementNested(ElementH1):
    """An element of degree 2 with the vertex functions of degree 1."""

    def __init__(self, high: Any, low: Any) -> None:
        self._high, self._low = high, low
        for name in ("refdom", "nodal_dofs", "edge_dofs", "facet_dofs", "interior_dofs", "maxdeg", "doflocs"):
            setattr(self, name, getattr(high, name))
        self.dofnames = high.dofnames

    def lbasis(self, X: np.ndarray, i: int) -> tuple[np.ndarray, np.ndarray]:
        """Value and gradient of basis function ``i`` at reference points."""
        found: tuple[np.ndarray, np.ndarray] = (self._low if i < self.refdom.nnodes else self._high).lbasis(X, i)
        return found


class MappedSpace:
    """The space of degree 2 on scikit-fem's ``mesh``, and that of degree 1 within.

    A function is a vector of coefficients (functions,); a field is known at the points of a quadrature, as (cells,
    points), or (3, cells, points) for a vector. ``dofs`` (functions of a cell, cells) and ``size`` are scikit-fem's
    numbering; ``entity`` (functions,) numbers the vertex, edge, facet or cell that each function belongs to, and
    ``places`` (entities, 3) says where these are. ``nested``: which functions are in the lower spaces that this one
    holds, the lowest first, and last in itself.
    """

    p = 2

    def __init__(self, mesh: Any) -> None:
        self.mesh = mesh
        simplex = len(mesh.t) == 4
        self.element = ElementNested(*((ElementTetP2(), ElementTetP1()) if simplex else (ElementHex2(), ElementHex1())))
        self.numbering = Dofs(mesh, self.element)
        self.dofs, self.size = self.numbering.element_dofs, int(self.numbering.N)
        self.entity, self.places = entities(mesh, self.numbering, mesh.doflocs[:, : mesh.nvertices])

    @cached_property
    def nested(self) -> tuple[np.ndarray, ...]:
        """(functions,) twice."""
        vertices = np.zeros(self.size, bool)
        vertices[self.numbering.nodal_dofs] = True
        return vertices, np.ones(self.size, bool)

    @cached_property
    def unit(self) -> np.ndarray:
        """(functions,): the coefficients of the constant 1."""
        return self.nested[0].astype(float)

    def basis(self, cells: np.ndarray, rule: tuple[np.ndarray, np.ndarray] | None = None) -> CellBasis:
        """scikit-fem's basis on some cells, with the points and weights of a rule or of the one for cells."""
        rule = rule or get_quadrature(self.mesh.refdom, ORDER)
        own = np.asarray(cells, np.int32)
        return CellBasis(
            self.mesh, self.element, quadrature=rule, elements=own, dofs=self.numbering, disable_doflocs=True
        )

    def matrices(self, k: np.ndarray, c: np.ndarray) -> tuple[csc_array, csc_array]:
        """The integrals of k grad u . grad v and of c u v, for k and c (cells,)."""
        basis = self.basis(np.arange(len(k)))
        return (
            csc_array(forms.conduction.assemble(basis, conductivity=_spread(k, basis))),
            csc_array(forms.capacity.assemble(basis, heat_capacity=_spread(c, basis))),
        )

    def stiffness(self, k: np.ndarray, cells: np.ndarray) -> csc_array:
        """The integral of k grad u . grad v over some cells, for k (of them,)."""
        basis = self.basis(cells)
        return csc_array(forms.conduction.assemble(basis, conductivity=_spread(k, basis)))

    def on(self, cells: np.ndarray) -> MappedCells:
        """Integrals over some cells."""
        return MappedCells(self.basis(cells))

    def faces(self, facets: np.ndarray, cells: np.ndarray) -> MappedFaces:
        """Integrals over some facets of the mesh, each seen from one of its cells."""
        return MappedFaces(self, facets, cells)

    def at(self, X: np.ndarray) -> np.ndarray:
        """(points, functions of a cell): their values at reference points (3, points)."""
        return _monomials(X) @ self._coefficients

    @cached_property
    def _coefficients(self) -> np.ndarray:
        """(monomials, functions of a cell), from the values on a lattice: scikit-fem's own formulas take a millisecond
        for every few points."""
        X = np.stack(np.meshgrid(*3 * [[0.0, 0.5, 1.0]])).reshape(3, -1)
        values = [self.element.lbasis(X, i)[0] * np.ones(X.shape[1]) for i in range(len(self.dofs))]
        return np.linalg.solve(_monomials(X), np.array(values).T)


def _monomials(X: np.ndarray) -> np.ndarray:
    """(points, 27): products of powers of the three coordinates up to the second."""
    x, y, z = (each[:, None] ** np.arange(3) for each in X)
    return np.einsum("pi,pj,pk->pijk", x, y, z).reshape(X.shape[1], -1)


def _spread(values: np.ndarray, basis: CellBasis) -> np.ndarray:
    """(cells, points) of (cells,) or (cells, 1 or points)."""
    return np.ascontiguousarray(np.broadcast_to(values.reshape(len(values), -1), basis.dx.shape))


class MappedCells:
    """Some cells of a `MappedSpace` with the points of their quadrature."""

    def __init__(self, basis: CellBasis) -> None:
        self._basis, self.weights = basis, basis.dx

    def value(self, u: np.ndarray) -> np.ndarray:
        """(cells, points): a function (functions,)."""
        return np.asarray(self._basis.interpolate(u))

    def gradient(self, u: np.ndarray) -> np.ndarray:
        """(3, cells, points): its gradient."""
        found: np.ndarray = self._basis.interpolate(u).grad
        return found

    def load(self, density: np.ndarray) -> np.ndarray:
        """(functions,): the integral of a density (cells, 1 or points) times each function."""
        found: np.ndarray = forms.source.assemble(self._basis, density=_spread(density, self._basis))
        return found

    def flow(self, field: np.ndarray) -> np.ndarray:
        """(functions,): the integral of a field (3, cells, points) times the gradient of each function."""
        found: np.ndarray = forms.flow.assemble(self._basis, field=field)
        return found


class MappedFaces:
    """Some facets of a `MappedSpace`, each seen from one of its cells.

    Each of a cell's sides has a basis of its own, of cells with points on that side and the weights of the facet: no
    point is looked for in a curved cell as by scikit-fem's FacetBasis, whose search ends at an absolute 1e-12.
    """

    def __init__(self, space: MappedSpace, facets: np.ndarray, cells: np.ndarray) -> None:
        self._space, self._facets = space, facets
        mesh, reference = space.mesh, space.mesh.refdom
        flat, weights = get_quadrature(mesh.brefdom, ORDER)
        self.areas, self._sides = np.empty((len(facets), len(weights))), []
        local = (mesh.t2f[:, cells] == facets).argmax(axis=0)
        for side in np.unique(local):
            at = np.flatnonzero(local == side)
            corners = reference.p[:, reference.facets[side]]
            along = np.stack([corners[:, 1] - corners[:, 0], corners[:, -1] - corners[:, 0]], axis=1)
            normal = np.cross(along[:, 0], along[:, 1])
            normal *= np.sign(normal @ (corners[:, 0] - reference.p.mean(axis=1)))
            points = corners[:, :1] + along @ flat
            basis = space.basis(cells[at], (points, weights))
            inverse = mesh.mapping().invDF(points, tind=basis.tind)
            outwards = np.einsum("ijkl,i->jkl", inverse, normal) * basis.dx
            basis.dx = np.linalg.norm(outwards, axis=0)
            self.areas[at] = basis.dx
            self._sides.append((at, basis, outwards / basis.dx))

    @cached_property
    def functions(self) -> np.ndarray:
        """(functions,): which do not vanish on the facets."""
        found = np.zeros(self._space.size, bool)
        found[self._space.numbering.get_facet_dofs(self._facets).all()] = True
        return found

    def value(self, u: np.ndarray) -> np.ndarray:
        """(facets, points): a function (functions,)."""
        found = np.empty(self.areas.shape)
        for at, basis, _ in self._sides:
            found[at] = np.asarray(basis.interpolate(u))
        return found

    def slope(self, u: np.ndarray) -> np.ndarray:
        """(facets, points): its derivative along the outward normal."""
        found = np.empty(self.areas.shape)
        for at, basis, normal in self._sides:
            found[at] = (basis.interpolate(u).grad * normal).sum(axis=0)
        return found

    def load(self, density: np.ndarray | float = 1.0) -> np.ndarray:
        """(functions,): the integral of a density (facets, 1 or points) times each function."""
        full, found = np.broadcast_to(density, self.areas.shape), np.zeros(self._space.size)
        for at, basis, _ in self._sides:
            found += forms.source.assemble(basis, density=full[at])
        return np.where(self.functions, found, 0.0)

    def flux(self, conductivity: np.ndarray) -> np.ndarray:
        """(functions,): the integral of -conductivity (facets, 1 or points) du/dn, outwards, for each function u."""
        full, found = np.broadcast_to(conductivity, self.areas.shape), np.zeros(self._space.size)
        for at, basis, normal in self._sides:
            found -= forms.flow.assemble(basis, field=full[at] * normal)
        return found

    def mass(self) -> csc_array:
        """The integral of u v."""
        found = csc_array((self._space.size,) * 2)
        for _, basis, _ in self._sides:
            found = csc_array(found + forms.film.assemble(basis, coefficient=np.ones(basis.dx.shape)))
        return found

    def normals(self) -> np.ndarray:
        """(functions, 3): the integral of the outward normal times the square of each function."""
        found = np.zeros((self._space.size, 3))
        for _, basis, normal in self._sides:
            for d in range(3):
                found[:, d] += forms.squared.assemble(basis, density=normal[d])
        return found
