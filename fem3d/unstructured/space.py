"""Lagrange elements of degree 1 or 2 on a mesh with groups, isoparametric: curved cells are taken as they are.

The matrices are those of the forms in `fem3d.forms`, assembled for all cells at once.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from scipy.sparse import coo_array, csc_array

from meshes.grouped import shapes
from meshes.grouped.model import Faces, GroupedMesh
from meshes.grouped.refine import quadratic

_ORDER = {1: 3, 2: 5}  # of the quadrature: twice the degree for the mass matrix, and one more for a coefficient


class Space:
    """Nodes (n, 3) in m, the unknowns (cells, nodes of a cell) of each cell, and what integrals need.

    ``weights`` (cells, points) in m3, ``at`` (points, nodes of a cell) the shape functions, ``slopes`` (cells, points,
    3, nodes of a cell) their gradients in 1/m.
    """

    def __init__(self, mesh: GroupedMesh, degree: int) -> None:
        self.degree, self.kind = degree, mesh.kind
        self.mesh = quadratic(mesh) if degree == 2 else mesh
        own = self.mesh.cells if degree == 2 else mesh.corners
        used, local = np.unique(own, return_inverse=True)
        self.nodes, self.dofs = self.mesh.points[used], local.reshape(own.shape)
        # The file's point of each node is its number in ``used``; refined and raised meshes have their own.
        self.points = used
        x, weights = _quadrature(mesh.kind, _ORDER[degree])
        self.at = shapes.values(mesh.kind, degree, x)
        _, determinant, self.slopes = self._mapped(np.arange(len(own)), x[None])
        self.weights = weights * determinant

    @property
    def size(self) -> int:
        """How many nodes."""
        return len(self.nodes)

    def renumber(self, order: np.ndarray) -> None:
        """Gives node ``order[k]`` the number k."""
        number = np.empty(self.size, int)
        number[order] = np.arange(self.size)
        self.nodes, self.points, self.dofs = self.nodes[order], self.points[order], number[self.dofs]

    def _mapped(self, cells: np.ndarray, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Of cells at reference points (1 or cells, points, 3): Jacobian (cells, points, 3 of x, 3), its determinant,
        and the gradients (cells, points, 3, nodes)."""
        flat = x.reshape(-1, 3)

        def tabulated(order: int) -> np.ndarray:
            found = shapes.gradients(self.kind, order, flat)
            return np.moveaxis(found.reshape(3, *x.shape[:2], -1), 0, 2)

        corners = self.mesh.points[self.mesh.cells[cells]]
        jacobian = tabulated(self.mesh.order) @ corners[:, None]
        own = tabulated(self.degree)
        slopes = np.linalg.solve(jacobian, np.broadcast_to(own, (len(jacobian), *own.shape[1:])))
        return jacobian, np.linalg.det(jacobian), slopes

    def value(self, u: np.ndarray, cells: np.ndarray | slice = slice(None)) -> np.ndarray:
        """(cells, points): a field at the points of the quadrature."""
        found: np.ndarray = u[self.dofs[cells]] @ self.at.T
        return found

    def gradient(self, u: np.ndarray, cells: np.ndarray | slice = slice(None)) -> np.ndarray:
        """(cells, points, 3): its gradient."""
        found: np.ndarray = (self.slopes[cells] @ u[self.dofs[cells]][:, None, :, None])[..., 0]
        return found

    def load(self, density: np.ndarray, cells: np.ndarray | slice = slice(None)) -> np.ndarray:
        """(nodes,): the integral of a density (cells, 1 or points) times each shape function."""
        found = np.zeros(self.size)
        np.add.at(found, self.dofs[cells], (self.weights[cells] * density) @ self.at)
        return found

    def mass(self, density: np.ndarray, cells: np.ndarray | slice = slice(None)) -> csc_array:
        """(nodes, nodes): the integral of density u v."""
        weights = self.weights[cells] * density
        pairs = (self.at[:, :, None] * self.at[:, None, :]).reshape(len(self.at), -1)
        return self._matrix((weights @ pairs).reshape(len(weights), *self.dofs.shape[1:], -1), cells)

    def stiffness(self, conductivity: np.ndarray, cells: np.ndarray | slice = slice(None)) -> csc_array:
        """(nodes, nodes): the integral of conductivity grad u . grad v."""
        slopes = self.slopes[cells]
        weighted = slopes * (self.weights[cells] * conductivity)[..., None, None]
        flat = (len(slopes), -1, slopes.shape[-1])
        return self._matrix(np.swapaxes(slopes.reshape(flat), 1, 2) @ weighted.reshape(flat), cells)

    def _matrix(self, entries: np.ndarray, cells: np.ndarray | slice) -> csc_array:
        dofs = self.dofs[cells]
        rows = np.broadcast_to(dofs[:, :, None], entries.shape).ravel()
        columns = np.broadcast_to(dofs[:, None, :], entries.shape).ravel()
        return coo_array((entries.ravel(), (rows, columns)), shape=(self.size, self.size)).tocsc()

    def nodes_of(self, cells: np.ndarray) -> np.ndarray:
        """The nodes of some cells."""
        return np.unique(self.dofs[cells])


class FaceSpace:
    """The same on some faces: ``dofs`` (faces, nodes of a cell), ``at`` (faces, points, nodes of a cell), ``slopes``
    (faces, points, 3, nodes), and ``normals`` (faces, points, 3), outwards, times ``areas`` (faces, points) in m2."""

    def __init__(self, space: Space, faces: Faces) -> None:
        self._space, self.faces = space, faces
        places, sides, weights = _on_faces(space.kind, _ORDER[space.degree])
        cells, local = faces[:, 0], faces[:, 1]
        self.dofs = space.dofs[cells]
        self.at = np.array([shapes.values(space.kind, space.degree, x) for x in places])[local]
        jacobian, _, self.slopes = space._mapped(cells, places[local])
        along = np.einsum("fsd,fpde->fspe", sides[local], jacobian)
        normals = np.cross(along[:, 0], along[:, 1])
        # Some rules have negative weights.
        self.normals, self.areas = normals * weights[:, None], np.linalg.norm(normals, axis=-1) * weights

    def load(self) -> np.ndarray:
        """(nodes,): the integral of each shape function (m2)."""
        found = np.zeros(self._space.size)
        np.add.at(found, self.dofs, np.einsum("fp,fpn->fn", self.areas, self.at))
        return found

    def mass(self) -> csc_array:
        """(nodes, nodes): the integral of u v."""
        entries = np.einsum("fp,fpm,fpn->fmn", self.areas, self.at, self.at)
        return self._space._matrix(entries, self.faces[:, 0])

    def normal(self) -> np.ndarray:
        """(nodes, 3): the integral of the outward normal times the square of each shape function (m2)."""
        found = np.zeros((self._space.size, 3))
        np.add.at(found, self.dofs, np.einsum("fpd,fpn->fnd", self.normals, self.at**2))
        return found

    def flux(self, conductivity: np.ndarray) -> np.ndarray:
        """(nodes,): the row that gives the integral of -conductivity (faces, 1 or points) du/dn outwards."""
        found = np.zeros(self._space.size)
        outwards = np.einsum("fpd,fpdn->fpn", self.normals, self.slopes)
        np.add.at(found, self.dofs, -(conductivity[..., None] * outwards).sum(axis=1))
        return found

    def value(self, u: np.ndarray) -> np.ndarray:
        """(faces, points): a field."""
        return np.einsum("fpn,fn->fp", self.at, u[self.dofs])

    def nodes(self) -> np.ndarray:
        """The nodes on the faces."""
        reference = shapes.nodes(self._space.kind, self._space.degree)
        corners = shapes.nodes(self._space.kind, 1)[shapes.FACETS[self._space.kind]]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        on = np.abs(np.einsum("fnd,fd->fn", reference[None] - corners[:, :1], normal)) < 1e-9
        return np.unique(self.dofs[on[self.faces[:, 1]]])


@cache
def _quadrature(kind: str, order: int) -> tuple[np.ndarray, np.ndarray]:
    """Points (points, 3) and weights of scikit-fem's rule on a reference cell."""
    from skfem.quadrature import get_quadrature
    from skfem.refdom import RefHex, RefTet

    x, weights = get_quadrature(RefTet if kind == shapes.TETRA else RefHex, order)
    return x.T, weights


@cache
def _on_faces(kind: str, order: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """On each face of the reference cell: points (faces, points, 3), the two sides (faces, 2, 3) that span it, and the
    weights (points,)."""
    from skfem.quadrature import get_quadrature
    from skfem.refdom import RefQuad, RefTri

    x, weights = get_quadrature(RefTri if kind == shapes.TETRA else RefQuad, order)
    corners = shapes.nodes(kind, 1)[shapes.FACETS[kind]]
    sides = np.stack([corners[:, 1] - corners[:, 0], corners[:, -1] - corners[:, 0]], axis=1)
    return corners[:, :1] + np.einsum("sp,fsd->fpd", x, sides), sides, weights
