"""The space on bricks against the weak forms of scikit-fem, entry by entry, through a Basis with the same element."""

import numpy as np
import pytest
from skfem import Basis, FacetBasis, LinearForm

from fem3d.spaces import element
from fem3d.spaces.bricks import BrickSpace
from fem3d.spaces.element import ElementHexTrunk
from meshes.grid import Grid
from scenes.model import Box, Material

STUFF = Material("stuff", 1.0, 1.0, 1.0)
BOXES = (Box("a", STUFF, (0, 0, 0), (3, 2.5, 0.8)), Box("b", STUFF, (3, 0, 0), (4, 2, 0.8)))
BREAKS = np.array([0.0, 1.0, 3.0, 4.0]), np.array([0.0, 2.0, 2.5]), np.array([0.0, 0.8])


@LinearForm
def integral(v, w):
    return w.density * v


@LinearForm
def flux(v, w):
    return -w.conductivity * sum(g * n for g, n in zip(v.grad, w.n, strict=True))


def space(p):
    """A step of bricks of one degree, and scikit-fem's basis on the same mesh."""
    found = BrickSpace(Grid(BREAKS, tuple(np.full(len(b) - 1, p) for b in BREAKS), BOXES))
    return found, Basis(found.mesh, ElementHexTrunk(p), intorder=2 * p + 1)


def far(ours, theirs):
    return float(abs(ours - theirs).max() / abs(theirs).max())


def differences(p, wrong=1.0):
    """Relative differences of both matrices, of a load, of integrals over some cells and of all that faces give."""
    ours, theirs = space(p)
    rng = np.random.default_rng(p)
    k, c, u = rng.random(ours.ijk.shape[1]), rng.random(ours.ijk.shape[1]), rng.random(ours.size)
    ones = np.ones(theirs.dx.shape)
    stiffness, mass = ours.matrices(wrong * k, c)
    found = {
        "stiffness": far(stiffness, element.conduction.assemble(theirs, conductivity=k[:, None] * ones)),
        "mass": far(mass, element.capacity.assemble(theirs, heat_capacity=c[:, None] * ones)),
    }
    some = np.arange(1, 4)
    part, cells = theirs.with_elements(some), ours.on(some)
    inner = np.ones(part.dx.shape)
    of_part = element.conduction.assemble(part, conductivity=k[some][:, None] * inner)
    found["some cells"] = far(ours.stiffness(wrong * k[some], some), of_part)
    found["flow"] = far(cells.flow(wrong * k[some][:, None] * cells.gradient(u)), of_part @ u)
    found["load"] = far(cells.load(wrong * np.ones_like(cells.weights)), integral.assemble(part, density=1.0))
    facets = ours.mesh.boundary_facets()
    faces = ours.faces(facets, ours.mesh.f2t[0, facets])
    there = FacetBasis(ours.mesh, theirs.elem, facets=facets, intorder=2 * p + 1)
    h = rng.random(len(facets))[:, None]
    found["face load"] = far(faces.load(wrong * h), integral.assemble(there, density=h * np.ones(there.dx.shape)))
    found["face mass"] = far(wrong * faces.mass(), element.film.assemble(there, coefficient=1.0))
    found["flux"] = far(faces.flux(wrong * h), flux.assemble(there, conductivity=h * np.ones(there.dx.shape)))
    return found


@pytest.mark.long
@pytest.mark.parametrize("p", [2, 6])
def test_matrices_and_loads_equal_weak_forms(p):
    found = differences(p)
    assert max(found.values()) < 1e-12, found


def test_changed_coefficient_is_detected():
    found = differences(3, 1 + 1e-6)
    assert found.pop("mass") < 1e-12
    assert min(found.values()) > 1e-7, found
