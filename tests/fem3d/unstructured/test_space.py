"""The matrices of a mesh against the forms in scikit-fem, which define them."""

from __future__ import annotations

from typing import Any

import meshio
import numpy as np
import pytest
import skfem
from skfem.io.meshio import from_meshio

from fem3d import forms
from fem3d.factorization import factorize
from fem3d.unstructured.dissection import dissection
from fem3d.unstructured.space import FaceSpace, Space
from scenes.free import from_dict
from scenes.model import Scene
from tests.meshes.grouped import boxes
from tests.meshes.grouped.scenes import bridge

ELEMENTS: dict[str, tuple[Any, int, int]] = {
    "tetra": (skfem.ElementTetP1(), 1, 3), "tetra10": (skfem.ElementTetP2(), 2, 5),
    "hexahedron": (skfem.ElementHex1(), 1, 3), "hexahedron27": (skfem.ElementHex2(), 2, 5),
}  # fmt: skip


def bent(x: np.ndarray) -> np.ndarray:
    return x + 1e-6 * np.sin(x[:, [1, 2, 0]] / 5e-6)


def both(cell: str, bend: Any) -> tuple[Any, Any, Space, np.ndarray]:
    """scikit-fem's mesh and basis, our space, and which of our nodes each of theirs is, by where it is."""
    scene = from_dict(bridge())
    assert isinstance(scene, Scene)
    mesh = boxes.grouped(scene, cell, 1, bend)
    element, degree, order = ELEMENTS[cell]
    used, local = np.unique(mesh.cells, return_inverse=True)
    theirs = from_meshio(meshio.Mesh(mesh.points[used], [(cell, local.reshape(mesh.cells.shape))]))
    basis, space = skfem.Basis(theirs, element, intorder=order), Space(mesh, degree)
    distance = np.abs(basis.doflocs.T[:, None] - space.nodes[None]).max(axis=2)
    mine = distance.argmin(axis=1)
    assert len(set(mine)) == space.size == basis.N
    assert distance.min(axis=1).max() < 1e-12 * np.ptp(space.nodes)
    return theirs, basis, space, mine


@pytest.mark.parametrize("cell", ELEMENTS)
def test_matrices_are_those_of_the_forms(cell: str) -> None:
    _, basis, space, mine = both(cell, bent)
    k = np.linspace(1, 2, len(space.weights))[:, None]
    for ours, form in (
        (space.stiffness(k), forms.conduction.assemble(basis, conductivity=k * np.ones(basis.dx.shape))),
        (space.mass(k), forms.capacity.assemble(basis, heat_capacity=k * np.ones(basis.dx.shape))),
    ):
        assert abs(ours[mine][:, mine] - form).max() < 1e-12 * abs(form).max()
        assert abs(ours[mine][:, mine] - 1.001 * form).max() > 1e-4 * abs(form).max()


@pytest.mark.parametrize("cell", ELEMENTS)
def test_films_are_those_of_the_forms(cell: str) -> None:
    theirs, _, space, mine = both(cell, None)
    element, _, order = ELEMENTS[cell]
    outer = skfem.FacetBasis(theirs, element, facets=theirs.boundary_facets(), intorder=order)
    film = forms.film.assemble(outer, coefficient=3.0)
    ours = 3.0 * FaceSpace(space, np.argwhere(~space.mesh.shared)).mass()
    assert abs(ours[mine][:, mine] - film).max() < 1e-12 * abs(film).max()


def test_flux_through_a_closed_surface_is_what_is_inside() -> None:
    """Gauss: the normals point outwards, and a linear field has none of its own."""
    scene = from_dict(bridge())
    assert isinstance(scene, Scene)
    for cell in ELEMENTS:
        mesh = boxes.grouped(scene, cell, 1)
        space = Space(mesh, 2)
        face = FaceSpace(space, np.argwhere(~mesh.shared))
        x = np.einsum("fpn,fnd->fpd", face.at, space.nodes[face.dofs])
        volume = float((x * face.normals).sum()) / 3
        assert volume == pytest.approx(float(space.weights.sum()), rel=1e-12)
        assert abs(face.flux(np.ones((len(face.faces), 1))) @ space.nodes[:, 0]) < 1e-12 * face.areas.sum()


def test_dissection_is_a_permutation_that_solves() -> None:
    scene = from_dict(bridge())
    assert isinstance(scene, Scene)
    space = Space(boxes.grouped(scene, "tetra", 2), 2)
    matrix = space.stiffness(np.ones((len(space.weights), 1))) + 1e12 * space.mass(np.ones((len(space.weights), 1)))
    order = dissection(space.nodes, matrix)
    assert sorted(order.tolist()) == list(range(space.size))
    load = np.sin(np.arange(space.size))
    found = factorize(matrix[order][:, order]).solve(load[order])
    assert np.abs(matrix[order][:, order] @ found - load[order]).max() < 1e-12
