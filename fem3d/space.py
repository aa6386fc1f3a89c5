"""What the discrete problems need of a finite-element space: bricks (`fem3d.bricks`), or the cells of a mesh file.

A function is a vector of coefficients (functions,); a field is known at the points of a quadrature, as (cells, points),
or (3, cells, points) for a vector.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from scipy.sparse import csc_array


class Cells(Protocol):
    """Some cells with the points of their quadrature; ``weights`` (cells, points) in m3."""

    weights: np.ndarray

    def value(self, u: np.ndarray) -> np.ndarray:
        """(cells, points): a function."""

    def gradient(self, u: np.ndarray) -> np.ndarray:
        """(3, cells, points): its gradient."""

    def load(self, density: np.ndarray) -> np.ndarray:
        """(functions,): the integral of a density (cells, points) times each function."""

    def flow(self, field: np.ndarray) -> np.ndarray:
        """(functions,): the integral of a field (3, cells, points) times the gradient of each function."""


class Faces(Protocol):
    """Some facets, each seen from one of its cells; ``areas`` (facets, points) in m2."""

    @property
    def areas(self) -> np.ndarray:
        """(facets, points): the weights of the quadrature."""

    @property
    def functions(self) -> np.ndarray:
        """(functions,): which do not vanish on the facets."""

    def value(self, u: np.ndarray) -> np.ndarray:
        """(facets, points): a function."""

    def load(self, density: np.ndarray | float = 1.0) -> np.ndarray:
        """(functions,): the integral of a density times each function."""

    def flux(self, conductivity: np.ndarray) -> np.ndarray:
        """(functions,): the integral of -conductivity (facets, 1 or points) du/dn, outwards, for each function u."""

    def mass(self) -> csc_array:
        """The integral of u v."""

    def normals(self) -> np.ndarray:
        """(functions, 3): the integral of the outward normal times the square of each function."""


class Space(Protocol):
    """A finite-element space. ``mesh`` is scikit-fem's, ``dofs`` (functions of a cell, cells) its numbering, ``entity``
    (functions,) numbers the vertex, edge, facet or cell that each function belongs to, and ``places`` (entities, 3) says
    where these are.

    ``nested``: which functions (functions,) are in the lower spaces that this one holds, the lowest first, and last in
    itself. ``unit``: the coefficients of the constant 1.
    """

    mesh: Any
    dofs: np.ndarray
    size: int
    entity: np.ndarray
    places: np.ndarray

    @property
    def nested(self) -> tuple[np.ndarray, ...]:
        """(functions,) each."""

    @property
    def unit(self) -> np.ndarray:
        """(functions,)."""

    def matrices(self, k: np.ndarray, c: np.ndarray) -> tuple[csc_array, csc_array]:
        """The integrals of k grad u . grad v and of c u v, for k and c (cells,)."""

    def stiffness(self, k: np.ndarray, cells: np.ndarray) -> csc_array:
        """The integral of k grad u . grad v over some cells, for k (of them,)."""

    def on(self, cells: np.ndarray) -> Cells:
        """Integrals over some cells."""

    def faces(self, facets: np.ndarray, cells: np.ndarray) -> Faces:
        """Integrals over some facets of the mesh, each seen from one of its cells."""

    def at(self, X: np.ndarray) -> np.ndarray:
        """(points, functions of a cell): their values at reference points (3, points)."""


def entities(mesh: Any, dofs: Any, vertices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(functions,): a number for each vertex, edge, facet and cell of scikit-fem's numbering that has functions; and
    where each is (entities, 3), the mean of its ``vertices`` (3, vertices)."""
    found, places = np.empty(int(dofs.N), int), [np.empty((0, 3))]
    kinds = (
        (dofs.nodal_dofs, lambda: np.arange(vertices.shape[1])[None]), (dofs.edge_dofs, lambda: mesh.edges),
        (dofs.facet_dofs, lambda: mesh.facets), (dofs.interior_dofs, lambda: mesh.t),
    )  # fmt: skip
    for part, corners in kinds:
        if part is not None and part.size:
            found[part] = sum(map(len, places)) + np.arange(part.shape[1])
            places.append(vertices[:, corners()].mean(axis=1).T)
    return found, np.concatenate(places)
