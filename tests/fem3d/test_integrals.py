"""Integrals, probes and their rows on a field that the functions hold exactly: rounding is all that may differ."""

from dataclasses import replace

import numpy as np
import pytest

from fem3d.problems.assembly import assemble
from fem3d.problems.following import Conduction
from fem3d.results.probes import cell_by_cell, gradient, reading
from fem3d.spaces.cut import Boxes
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


def equal(cells, parts):
    """Boxes of some cells, as many along each axis."""
    lower = np.array(list(np.ndindex(*parts))).T / np.array(parts)[:, None]
    sides = np.broadcast_to(1 / np.array(parts)[:, None], lower.shape)
    return Boxes(np.repeat(cells, lower.shape[1]), np.tile(lower, len(cells)), np.tile(sides, len(cells)))


def test_a_field_on_boxes_has_its_integrals_on_the_whole_cell(block):
    """With all products of polynomials that the cell's points tell apart, whatever jumps it has; and no more."""
    given, u = block
    space, cells, more = given.space, np.array([2, 0]), 1
    on, cut, rule = space.on(cells, more), space.cut(cells, more, equal(cells, (4, 2, 1))), space.rule(cells, more)
    assert cut.within(cut.value(u)) == pytest.approx(on.value(u), abs=1e3 * ROUNDING)
    assert cut.changes(u)[1].max() == pytest.approx(on.within(on.gradient(u))[1].max() / 2, rel=0.5)
    # 1 in the left half of each cell, 3 in the right one
    step = np.where(cut.boxes.lower[0] < 0.5, 1.0, 3.0)[:, None] * np.ones(cut.value(u).shape)
    x, y, _ = rule.points

    def exact(power):
        return (0.5 ** (power + 1) + 3 * (1 - 0.5 ** (power + 1))) / (power + 1) / 2

    for power in range(5):  # of the five points of degree 3
        assert cut.within(step) @ (rule.weights * x**power * y) == pytest.approx(exact(power), rel=1e3 * ROUNDING)
        assert abs(np.where(x < 0.5, 1.0, 3.0) @ (rule.weights * x**power * y) / exact(power) - 1) > 1e-4
    assert abs(cut.within(step) @ (rule.weights * x**5 * y) / exact(5) - 1).max() > 1e-4


def test_a_finer_quadrature_tells_the_error_where_isotherms_of_bends_are_curved():
    """Of a table in one brick, the rise running along x and y: cut along x alone, boxes change next to nothing in the
    end and are off by 2 %."""
    law = Table((400.0, 450.0, 500.0), (1.0, 2.0, 0.5))
    block = Box("block", replace(SILICON, thermal_conductivity=law), (0.0, 0.0, 0.0), (1.0, 1.0, 1.0))
    given = replace(scene(), boxes=(block,), initial_temperature=300.0)
    cube = boxes(given, grid_of(given, ([0.0, 1.0],) * 3, 3))
    u = coefficients(cube.space, lambda points: 260 * points[0] + 200 * points[1] ** 2)

    def flow(parts):
        return Conduction(cube, boxes=equal(np.arange(1), parts)).outflow(u)

    best, term = flow([32, 32, 1]), Conduction(cube)
    for _ in range(3):
        finer = term.finer(u)
        changed = np.abs(finer.outflow(u) - term.outflow(u)).max()
        assert np.abs(finer.outflow(u) - best).max() < changed
        term = finer
    assert np.abs(flow([64, 1, 1]) - best).max() > 10 * np.abs(flow([64, 1, 1]) - flow([16, 1, 1])).max()
