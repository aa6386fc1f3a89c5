"""The space on bricks against the weak forms of scikit-fem, entry by entry, through a Basis with the same element."""

from dataclasses import replace

import numpy as np
import pytest
from skfem import Basis, FacetBasis, LinearForm

from fem3d.problems import conductors
from fem3d.spaces import forms
from fem3d.spaces.bricks import BrickSpace
from fem3d.spaces.element import ElementHexTrunk
from meshes.grid import Grid
from scenes.model import Box, Material
from scenes.sink import Sink
from tests.fem3d import off, plain_grid, problem

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
        "stiffness": far(stiffness, forms.conduction.assemble(theirs, conductivity=k[:, None] * ones)),
        "mass": far(mass, forms.capacity.assemble(theirs, heat_capacity=c[:, None] * ones)),
    }
    some = np.arange(1, 4)
    part, cells = theirs.with_elements(some), ours.on(some)
    inner = np.ones(part.dx.shape)
    of_part = forms.conduction.assemble(part, conductivity=k[some][:, None] * inner)
    found["some cells"] = far(ours.stiffness(wrong * k[some], some), of_part)
    found["flow"] = far(cells.flow(wrong * k[some][:, None] * cells.gradient(u)), of_part @ u)
    found["load"] = far(cells.load(wrong * np.ones_like(cells.weights)), integral.assemble(part, density=1.0))
    facets = ours.mesh.boundary_facets()
    faces = ours.faces(facets, ours.mesh.f2t[0, facets])
    there = FacetBasis(ours.mesh, theirs.elem, facets=facets, intorder=2 * p + 1)
    h = rng.random(len(facets))[:, None]
    found["face load"] = far(faces.load(wrong * h), integral.assemble(there, density=h * np.ones(there.dx.shape)))
    found["face mass"] = far(wrong * faces.mass(), forms.film.assemble(there, coefficient=1.0))
    found["flux"] = far(faces.flux(wrong * h), flux.assemble(there, conductivity=h * np.ones(there.dx.shape)))
    return found


@pytest.mark.long
@pytest.mark.parametrize("p", [1, 2, 4, 6])
def test_matrices_loads_and_faces_are_those_of_the_forms(p):
    found = differences(p)
    assert max(found.values()) < 1e-12, found


def test_a_coefficient_changed_by_a_millionth_is_seen_in_all_but_the_mass():
    found = differences(3, 1 + 1e-6)
    assert found.pop("mass") < 1e-12
    assert min(found.values()) > 1e-7, found


@pytest.mark.parametrize("p", [2, 5])
def test_values_and_functions_on_faces_are_those_of_the_basis(p):
    ours, theirs = space(p)
    u = np.random.default_rng(p).random(ours.size)
    places = np.array([[0.5, 1.2, 0.3], [3.5, 1.0, 0.5], [2.9, 2.4, 0.7], [3.0, 2.0, 0.8]])
    for place, value in zip(places, theirs.probes(places.T) @ u, strict=True):
        assert abs(float(ours.sample(u, *place[:, None]).item()) - value) < 1e-12
    facets = np.flatnonzero(np.abs(ours.mesh.p[2, ours.mesh.facets]).max(axis=0) < 1e-12)
    faces = ours.faces(facets, ours.mesh.f2t[0, facets])
    there = FacetBasis(ours.mesh, theirs.elem, facets=facets, intorder=2 * p)
    mean = float((np.asarray(there.interpolate(u)) * there.dx).sum() / there.dx.sum())
    assert abs((faces.areas * faces.value(u)).sum() / faces.areas.sum() - mean) < 1e-12
    assert (np.flatnonzero(faces.functions) == np.sort(theirs.get_dofs(facets=facets).flatten())).all()
    assert abs(faces.normals().sum(axis=0) + np.array([0, 0, np.diag(faces.mass().toarray()).sum()])).max() < 1e-12


def test_slopes_are_those_of_the_values():
    ours, _ = space(4)
    u, step = np.random.default_rng(0).random(ours.size), 1e-6
    place = np.array([0.5, 1.2, 0.3])
    for d in range(3):
        moved = [ours.sample(u, *(place + s * step * np.eye(3)[d])[:, None]).item() for s in (-1, 1)]
        assert abs(ours.sample(u, *place[:, None], slope=d).item() - (moved[1] - moved[0]) / (2 * step)) < 1e-6


def three_materials():
    """A sink whose beam carries a thin layer of a third material over a part of it."""
    scene = Sink(convection_coefficient=1e3).scene()
    coat = Box("coat", Material("coat", 20.0, 1500.0, 900.0), (-2e-5, 1e-4, 2e-6), (3e-5, 4e-4, 3e-6), 1e9)
    return replace(scene, boxes=(*scene.boxes, coat), initial_temperature=300.0)


@pytest.mark.parametrize("degree", [2, 4])
def test_the_joule_load_is_that_of_the_form(degree):
    scene = three_materials()
    heat = problem(scene, plain_grid(scene, degree))
    conductor, ours = conductors.find(heat), heat.domain.space
    rng = np.random.default_rng(1)
    rise, phi = 200 * rng.random(heat.size), rng.random(ours.size)
    density = -conductor.on.gradient(phi) / conductor.resistivity(rise)
    # The quadrature is a part of the form's definition here: a conductivity is no polynomial.
    basis = Basis(ours.mesh, ElementHexTrunk(degree), intorder=2 * degree + 1, elements=conductor.cells)
    cold, warm = conductor.cold, conductor.warm
    sigma = 1 / (cold + warm * np.asarray(basis.interpolate(heat.field(rise))))
    theirs = forms.joule_heat.assemble(basis, conductivity=sigma, potential=basis.interpolate(phi))
    assert off(conductor.joule_load(density, rise), theirs[heat.order]) < 1e-12
    assert off(conductor.joule_load(density, (1 + 1e-6) * rise), theirs[heat.order]) > 1e-9


def test_a_uniform_rise_drives_no_heat_but_to_the_air():
    scene = three_materials()
    heat = problem(scene, plain_grid(scene, 3))
    out = sum(-f.per_kelvin.sum() if f.per_kelvin.any() else 0.0 for f in heat.films.values())
    found = heat.stiffness @ heat.unit
    air = sum((-f.per_kelvin for f in heat.films.values()), np.zeros(heat.size))
    assert out != 0
    assert np.abs(found - air).max() < 1e-12 * np.abs(heat.stiffness.data).max()
    assert abs(heat.unit @ heat.mass @ heat.unit / heat_capacity(scene) - 1) < 1e-12


def heat_capacity(scene):
    """J/K of disjoint boxes."""
    return sum(b.material.heat_capacity * np.prod(np.subtract(b.upper, b.lower)) for b in scene.boxes)
