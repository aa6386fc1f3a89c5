"""Integrals, probes and their rows on a field that the functions hold exactly: rounding is all that may differ."""

from dataclasses import replace

import numpy as np
import pytest

from fem3d.problems.assembly import assemble
from fem3d.problems.following import Conduction
from fem3d.results.probes import cell_by_cell, gradient, reading
from fem3d.spaces.domain import boxes
from scenes.laws import Table
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


def test_a_sum_along_the_axes_is_the_one_over_all_points(block):
    given, _ = block
    rule, random = given.space.rule(np.arange(1), 1, (4, 2, 1)), np.random.default_rng(0)
    coefficients = random.standard_normal((7, len(rule.functions)))
    field = random.standard_normal((7, len(rule.weights)))
    assert rule.dense is None  # they would be large
    assert rule.values == pytest.approx(given.space.at(rule.points)[:, rule.functions], abs=1e3 * ROUNDING)
    assert rule.values_at(5) == pytest.approx(rule.values[5], abs=1e3 * ROUNDING)
    for along in (None, 0, 1, 2):
        each = rule.values if along is None else rule.slopes[along]
        assert np.abs(rule.at(coefficients, along) - coefficients @ each.T).max() < 1000 * ROUNDING
        assert np.abs(rule.tested(field, along) - field @ each).max() < 1000 * ROUNDING
        assert np.abs(rule.tested(field, along) - field[:, ::-1] @ each).max() > 1


def test_a_finer_quadrature_tells_the_error_where_isotherms_of_bends_are_curved():
    """Of a table in one brick, the rise running along x and y: cut along x alone, pieces change next to nothing in the
    end and are off by 2 %."""
    law = Table((400.0, 450.0, 500.0), (1.0, 2.0, 0.5))
    block = Box("block", replace(SILICON, thermal_conductivity=law), (0.0, 0.0, 0.0), (1.0, 1.0, 1.0))
    given = replace(scene(), boxes=(block,), initial_temperature=300.0)
    cube = boxes(given, grid_of(given, ([0.0, 1.0],) * 3, 3))
    u = coefficients(cube.space, lambda points: 260 * points[0] + 200 * points[1] ** 2)

    def flow(pieces):
        return Conduction(cube, pieces=np.array(pieces)[:, None]).outflow(u)

    best, term = flow([32, 32, 1]), Conduction(cube)
    for _ in range(3):
        finer = term.finer(u)
        changed = np.abs(finer.outflow(u) - term.outflow(u)).max()
        assert np.abs(finer.outflow(u) - best).max() < changed
        term = finer
    assert np.abs(flow([64, 1, 1]) - best).max() > 10 * np.abs(flow([64, 1, 1]) - flow([16, 1, 1])).max()
