"""Integrals, probes and their rows on a field that the functions hold exactly: rounding is all that may differ."""

from dataclasses import replace

import numpy as np
import pytest

from fem3d.problems.assembly import assemble
from fem3d.results.probes import cell_by_cell, gradient, reading
from fem3d.spaces.domain import boxes
from scenes.model import Boundary, Box, Probe, Scene
from scenes.sink import SILICON
from tests.fem3d import grid_of

ROUNDING = 1e-12  # of sums of some hundred terms of size one
LENGTHS = (3.0, 2.0, 1.0)


def scene(*probes):
    box = Box("block", SILICON, (0.0, 0.0, 0.0), LENGTHS)
    cold = Boundary("cold", "temperature", (0.0, 0.0, 0.0), (0.0, 2.0, 1.0), 293.0)
    return Scene("block", (box,), (cold,), probes)


def domain(*probes):
    given = scene(*probes)
    return boxes(given, grid_of(given, ([0.0, 1.0, 3.0], [0.0, 2.0], [0.0, 0.4, 1.0]), 3))


def coefficients(space, of):
    """(functions,): a polynomial of (3, cells, points) that the space holds, by its integrals with all functions."""
    cells = np.arange(space.dofs.shape[1])
    on = space.on(cells, 2)
    mass = on.mass().toarray()
    return np.linalg.solve(mass, on.load(of(on.points)))


def polynomial(points):
    x, y, z = points
    return 1 + x * y - 2 * y**2 * z + x**3


@pytest.fixture(scope="module")
def block():
    given = domain()
    return given, coefficients(given.space, polynomial)


def test_values_and_gradients_are_those_of_the_polynomial(block):
    given, u = block
    on = given.space.on(np.arange(given.space.dofs.shape[1]))
    x, y, z = on.points
    assert np.abs(on.value(u) - polynomial(on.points)).max() < 100 * ROUNDING
    slopes = np.array([y + 3 * x**2, x - 4 * y * z, -2 * y**2])
    assert np.abs(on.gradient(u) - slopes).max() < 1000 * ROUNDING
    assert np.abs(on.value(u) - polynomial(on.points) - 1e-9).max() > 100 * ROUNDING


def test_loads_flows_and_masses_are_integrals(block):
    given, u = block
    space, cells = given.space, np.arange(given.space.dofs.shape[1])
    on = space.on(cells)
    # int x y = 9, int y^2 z = 4, int x^3 = 40.5 over 3 x 2 x 1
    exact = 6.0 + 9.0 - 8.0 + 40.5
    assert on.load(np.ones((len(cells), 1))) @ u == pytest.approx(exact, rel=ROUNDING)
    assert space.unit @ (on.mass() @ u) == pytest.approx(exact, rel=ROUNDING)
    # int d/dx u = int y + 3 x^2 over the block = 6 + 54
    assert on.flow(np.array([1.0, 0.0, 0.0])[:, None, None] * np.ones(on.weights.shape)) @ u == pytest.approx(60.0)
    stiffness = space.stiffness(np.ones(len(cells)), cells)
    assert np.abs(stiffness @ space.unit).max() < ROUNDING * np.abs(stiffness).max()


def test_faces_see_areas_normals_and_slopes(block):
    given, u = block
    right = Boundary("right", "heat_flux", (3.0, 0.0, 0.0), LENGTHS, 1.0)
    face = given.faces(right)
    assert face.areas.sum() == pytest.approx(2.0, rel=ROUNDING)
    _, y, _ = face.points
    assert np.abs(face.slope(u) - (y + 27)).max() < 1000 * ROUNDING
    # int -(y + 27) over 2 x 1
    assert face.flux(np.ones((len(face.areas), 1))) @ u == pytest.approx(-56.0)


def test_a_mean_and_the_flow_through_a_section_are_those_of_the_field(block):
    _, u = block
    inside = Probe("inside", (0.0, 0.0, 0.0), (1.0, 2.0, 0.4))
    section = Probe("section", (1.0, 0.0, 0.0), (1.0, 2.0, 1.0), quantity="heat_flow")
    given = domain(inside, section)
    heat = assemble(given)
    # means of 1, x y, y^2 z, x^3 over 1 x 2 x 0.4
    exact = 1 + 0.5 - 2 * 4 / 3 * 0.2 + 1 / 4
    assert reading(heat, inside).row @ heat.take(u) == pytest.approx(exact, rel=1e3 * ROUNDING)
    k = given.per_cell("thermal_conductivity")
    # along x: -k int (y + 3) over 2 x 1
    assert gradient(given, section, cell_by_cell(k)) @ u == pytest.approx(-8.0 * SILICON.thermal_conductivity)
    twice = replace(section, upper=(1.0, 2.0, 0.4))
    assert gradient(given, twice, cell_by_cell(k)) @ u == pytest.approx(-3.2 * SILICON.thermal_conductivity)
