"""The integrals of the space of a mesh file, against exact values."""

from __future__ import annotations

from math import factorial
from pathlib import Path

import numpy as np
import pytest
import skfem

from fem3d.spaces import forms
from fem3d.spaces.mapped import MappedSpace, _rule
from meshes.grouped.model import GroupedMesh
from meshes.grouped.read import read
from scenes.free import from_dict
from scenes.model import Scene
from tests.meshes.grouped import boxes
from tests.meshes.grouped.scenes import bridge

CELLS = tuple(boxes.BLOCKS)
ELEMENTS = {4: (skfem.ElementTetP1(), skfem.ElementTetP2()), 8: (skfem.ElementHex1(), skfem.ElementHex2())}


def bent(x: np.ndarray) -> np.ndarray:
    return x + 1e-6 * np.sin(x[:, [1, 2, 0]] / 5e-6)


def mesh_of(cell: str, folder: Path, pieces: int = 1) -> GroupedMesh:
    scene = from_dict(bridge())
    assert isinstance(scene, Scene)
    boxes.write(boxes.grouped(scene, cell, pieces, bent), folder / "m.msh")
    return read(folder / "m.msh", 1.0)


@pytest.mark.parametrize("cell", CELLS)
def test_spans_the_spaces_of_scikit_fem(cell: str, tmp_path: Path) -> None:
    """Energies of functions that both have: of scikit-fem's degree 1, and, by its nodes' values, of degree 2."""
    space = MappedSpace(mesh_of(cell, tmp_path).mesh)
    k = np.linspace(1, 2, space.mesh.t.shape[1])
    stiffness, mass = space.matrices(k, k)
    rng = np.random.default_rng(1)
    for degree, element in enumerate(ELEMENTS[len(space.mesh.t)]):
        basis = skfem.Basis(space.mesh, element, intorder=7 if len(space.mesh.t) == 4 else 5)
        u = rng.random(space.size) * space.nested[degree]
        theirs = np.zeros(basis.N)
        theirs[basis.element_dofs] = space.at(np.asarray(element.doflocs).T) @ u[space.dofs]
        full = np.broadcast_to(k[:, None], basis.dx.shape)
        for ours, form in (
            (stiffness, forms.conduction.assemble(basis, conductivity=full)),
            (mass, forms.capacity.assemble(basis, heat_capacity=full)),
        ):
            ratio = (u @ (ours @ u)) / (theirs @ (form @ theirs))
            assert ratio == pytest.approx(1, rel=1e-11)
            assert 1.001 * ratio != pytest.approx(1, rel=1e-4)


# Its search for points in cells does not end on curved tetrahedra.
@pytest.mark.parametrize("cell", [c for c in CELLS if c != "tetra10"])
def test_faces_are_those_of_scikit_fem(cell: str, tmp_path: Path) -> None:
    mesh = mesh_of(cell, tmp_path).mesh
    space, outer = MappedSpace(mesh), mesh.boundary_facets()
    faces = space.faces(outer, mesh.f2t[0, outer])
    # Lengths of 1, as scikit-fem's search for points in cells stops at an absolute 1e-12.
    theirs = skfem.FacetBasis(mesh.scaled(1e5), space.element, facets=outer, intorder=6 if len(mesh.t) == 4 else 5)
    film = forms.film.assemble(theirs, coefficient=np.full(theirs.dx.shape, 1e-10))
    assert abs(faces.mass() - film).max() < 1e-11 * abs(film).max()
    assert faces.areas.sum() == pytest.approx(1e-10 * theirs.dx.sum(), rel=1e-11)


@pytest.mark.parametrize("cell", CELLS)
def test_flux_through_a_closed_surface_is_what_is_inside(cell: str, tmp_path: Path) -> None:
    """Gauss: the flux of each function through the surface is the integral of -div grad over the adjacent cells;
    the normals of a closed surface add to zero."""
    mesh = mesh_of(cell, tmp_path).mesh
    space, outer = MappedSpace(mesh), mesh.boundary_facets()
    faces = space.faces(outer, mesh.f2t[0, outer])
    x = np.zeros(space.size)
    x[: mesh.nvertices] = mesh.doflocs[0, : mesh.nvertices]
    if mesh.doflocs.shape[1] > mesh.nvertices:
        # The map of a curved cell is in the space of degree 2: vertex functions and bubbles.
        at, nodes = np.asarray(mesh.elem().doflocs).T, mesh.dofs.element_dofs
        second = [0, 1, 2, 3, 4, 6, 8, 10, 12, 14] if len(mesh.t) == 4 else np.arange(27)
        x[space.dofs[second]] = np.linalg.solve(space.at(at)[:, second], mesh.doflocs[0, nodes])
    assert abs(faces.flux(np.ones((len(outer), 1))) @ x) < 1e-12 * faces.areas.sum()
    half = outer[: len(outer) // 2]
    part = space.faces(half, mesh.f2t[0, half])
    assert abs(part.flux(np.ones((len(half), 1))) @ x) > 1e-3 * part.areas.sum()


@pytest.mark.parametrize("more", [0, 6, 9])
def test_sides_of_tetrahedra_have_rules_of_any_order(more: int) -> None:
    """scikit-fem's end at 19; a polynomial of the highest degree exposes a rule of lower order."""
    mesh = skfem.MeshTet()
    faces = MappedSpace(mesh).faces(np.array([0]), mesh.f2t[0, :1]).finer(more)
    a, b, c = mesh.p[:, mesh.facets[:, 0]].T
    degree = 6 + 2 * more
    along = np.einsum("d,dfp->fp", (b - a) / np.linalg.norm(b - a) ** 2, faces.points - a[:, None, None])
    across = np.einsum("d,dfp->fp", (c - a) / np.linalg.norm(c - a) ** 2, faces.points - a[:, None, None])
    # Sides at right angles: the integral of x^n over the triangle is its area times 2 / ((n + 1) (n + 2)).
    for x in (along, across):
        exact = faces.areas.sum() * 2 / ((degree + 1) * (degree + 2))
        assert (faces.areas * x**degree).sum() == pytest.approx(exact, rel=1e-9)


@pytest.mark.parametrize("more", range(4))
def test_rules_of_the_tetrahedron_are_exact_to_their_order(more: int) -> None:
    """The rules of scikit-fem from the fifth to the ninth are exact to one order less than stated."""
    x, y, z = _rule((True, 3), 5 + more).points
    weights = _rule((True, 3), 5 + more).weights
    for i in range(6 + more):
        for j in range(6 + more - i):
            k = 5 + more - i - j
            exact = factorial(i) * factorial(j) * factorial(k) / factorial(8 + more)
            assert (weights * x**i * y**j * z**k).sum() == pytest.approx(exact, rel=1e-12)
