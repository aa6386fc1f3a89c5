"""The space of degree 2 on the cells of a mesh file, tetrahedra or hexahedra, straight or curved, through scikit-fem.

The vertex functions are those of degree 1, and those of edges (of hexahedra of facets and cells too) scikit-fem's of
degree 2: together they span its space of degree 2, and the first ones alone that of degree 1.
"""

from __future__ import annotations

from functools import cached_property, lru_cache, partial
from typing import Any

import numpy as np
from scipy.sparse import csc_array
from skfem import CellBasis, ElementHex1, ElementHex2, ElementTetP1, ElementTetP2
from skfem.assembly.dofs import Dofs
from skfem.element import ElementH1
from skfem.quadrature import get_quadrature

from fem3d.spaces import forms
from fem3d.spaces.entities import entities
from fem3d.spaces.integrals import Rule, Side, Space, halves, rule, side

ORDER = 5  # order of the quadrature: twice the degree for the mass matrix, and one more for a coefficient


class ElementNested(ElementH1):
    """An element of degree 2 with the vertex functions of degree 1."""

    def __init__(self, high: Any, low: Any) -> None:
        self._high, self._low = high, low
        for name in ("refdom", "nodal_dofs", "edge_dofs", "facet_dofs", "interior_dofs", "maxdeg", "doflocs"):
            setattr(self, name, getattr(high, name))
        self.dofnames = high.dofnames

    def lbasis(self, X: np.ndarray, i: int) -> tuple[np.ndarray, np.ndarray]:
        """Value and gradient of basis function ``i`` at reference points."""
        return (self._low if i < self.refdom.nnodes else self._high).lbasis(X, i)


class MappedSpace(Space):
    """The space of degree 2 on scikit-fem's ``mesh``, and that of degree 1 within."""

    p = 2

    def __init__(self, mesh: Any) -> None:
        self.mesh, self._simplex = mesh, len(mesh.t) == 4
        self.element = _element(self._simplex)
        self.numbering = Dofs(mesh, self.element)
        self.dofs, self.size = self.numbering.element_dofs, int(self.numbering.N)
        self.entity, self.places = entities(mesh, self.numbering, mesh.doflocs[:, : mesh.nvertices])

    @cached_property
    def nested(self) -> tuple[np.ndarray, ...]:
        vertices = np.zeros(self.size, bool)
        vertices[self.numbering.nodal_dofs] = True
        return vertices, np.ones(self.size, bool)

    @cached_property
    def unit(self) -> np.ndarray:
        return self.nested[0].astype(float)

    def matrices(self, k: np.ndarray, c: np.ndarray) -> tuple[csc_array, csc_array]:
        basis = self._basis(np.arange(len(c)))
        capacity = forms.capacity.assemble(basis, heat_capacity=np.outer(c, np.ones(basis.dx.shape[1])))
        # Of one pattern, which one order of elimination suits: scikit-fem leaves out what is zero in each.
        return halves(csc_array(self.stiffness(k, np.arange(len(c))) + 1j * capacity))

    def stiffness(self, k: np.ndarray, cells: np.ndarray) -> csc_array:
        basis = self._basis(cells)
        along = np.multiply.outer(k, np.ones(basis.dx.shape[1]))
        return csc_array(forms.conduction.assemble(basis, conductivity=along))

    def _basis(self, cells: np.ndarray) -> CellBasis:
        rule, own = get_quadrature(self.mesh.refdom, ORDER), np.asarray(cells, np.int32)
        return CellBasis(
            self.mesh, self.element, quadrature=rule, elements=own, dofs=self.numbering, disable_doflocs=True
        )

    def rule(self, cells: np.ndarray, more: int) -> Rule:
        """scikit-fem's, of `ORDER` and two more for each point."""
        return _rule(self._simplex, ORDER + 2 * more)

    def side(self, number: int) -> Side:
        return _side(self._simplex, number)

    def jacobian(self, cells: np.ndarray, X: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        mapping = self.mesh.mapping()
        return mapping.invDF(X, tind=cells), np.abs(mapping.detDF(X, tind=cells))

    def at(self, X: np.ndarray) -> np.ndarray:
        return _values(self._simplex, X)


@lru_cache
def _element(simplex: bool) -> ElementNested:
    return ElementNested(*((ElementTetP2(), ElementTetP1()) if simplex else (ElementHex2(), ElementHex1())))


@lru_cache
def _coefficients(simplex: bool) -> np.ndarray:
    """(monomials, functions of a cell), from the values on a lattice: scikit-fem's own formulas take a millisecond for
    every few points."""
    X, element = np.stack(np.meshgrid(*3 * [[0.0, 0.5, 1.0]])).reshape(3, -1), _element(simplex)
    values = [element.lbasis(X, i)[0] * np.ones(X.shape[1]) for i in range(len(element.doflocs))]
    return np.linalg.solve(_monomials(X), np.array(values).T)


def _monomials(X: np.ndarray, along: int | None = None) -> np.ndarray:
    """(points, 27): products of powers of the three coordinates up to the second, or their slopes ``along`` an axis."""
    powers = [x[:, None] ** np.arange(3) for x in X]
    if along is not None:
        powers[along] = np.stack([0 * X[along], 1 + 0 * X[along], 2 * X[along]], axis=1)
    return np.einsum("pi,pj,pk->pijk", *powers).reshape(X.shape[1], -1)


def _values(simplex: bool, X: np.ndarray, along: int | None = None) -> np.ndarray:
    return _monomials(X, along) @ _coefficients(simplex)


@lru_cache
def _rule(simplex: bool, order: int) -> Rule:
    points, weights = get_quadrature(_element(simplex).refdom, order)
    return rule(points, weights, partial(_values, simplex))


@lru_cache
def _side(simplex: bool, number: int) -> Side:
    reference = _element(simplex).refdom
    return side(reference, number, get_quadrature(reference.brefdom, ORDER), partial(_values, simplex))
