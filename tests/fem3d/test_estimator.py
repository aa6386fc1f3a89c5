"""Errors from three nested degrees: rates recovered, remainders of given decays, true errors of solutions."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.random_boxes import draw
from fem3d.adaptivity import estimator, goal_errors, goal_parts, nested, reach
from fem3d.adaptivity.estimator import SLOWEST, Contributions, Estimator
from fem3d.problems import conductors
from fem3d.problems.current_fields import combined, independent
from fem3d.runs import probe_quantities
from fem3d.runs.scene import part_of
from fem3d.solution.reduced import project
from fem3d.solution.steady import solve_steady
from fem3d.spaces.domain import boxes
from meshes import grading
from meshes.grading import Features
from meshes.grid import Grid
from scenes.model import Box, Probe
from scenes.sink import SILICON
from tests.fem3d import bar, bar_grid, end, grid_of, problem, silicon, whole
from tests.fem3d.test_forms import three_materials

DEGREES = np.arange(3, 9)
UNIT = Box("box", SILICON, (0.0, 0.0, 0.0), (1.0, 1.0, 1.0))


def parts(p, a, size=1.0):
    """The contributions of degrees p - 1 and p to an error that falls like size * q^-a."""
    return size * ((p - 2.0) ** -a - (p - 1.0) ** -a), size * ((p - 1.0) ** -a - float(p) ** -a)


@pytest.mark.parametrize("a", [1.0, 1.7, 4.0, 11.0, 30.0])
def test_the_rate_of_an_algebraic_decay_is_recovered(a):
    found = np.array([estimator.rate(np.array([p]), np.array([parts(p, a)[1] / parts(p, a)[0]]))[0] for p in DEGREES])
    assert np.abs(found / a - 1).max() < 1e-3
    assert np.abs(found / (1.01 * a) - 1).min() > 1e-3


@pytest.mark.parametrize("a", [0.5, 1.0, 5.0, 20.0])
def test_what_is_left_of_an_algebraic_decay_is_what_all_further_degrees_add(a):
    for p in DEGREES:
        assert parts(p, a)[1] * estimator.left(np.array([p]), np.array([a]))[0] == pytest.approx(float(p) ** -a)


def judge(p, exponents=None, planes=(0.0, 1.0)):
    """An estimator on the unit interval along x, and on one of the lowest degree along the others."""
    breaks = np.array(planes), np.array([0.0, 1.0]), np.array([0.0, 1.0])
    grid = Grid(breaks, (np.full(len(planes) - 1, p), np.array([2]), np.array([2])), (UNIT,))
    marks = Features((frozenset(),) * 3, (exponents or {}, {}, {}))
    return Estimator.of_grid(grid, marks)


def remains(p, before, last, ratio=0.0, **features):
    nothing = np.zeros(1)
    parts = ([np.array([v]), nothing, nothing] for v in (before, last, ratio))
    return judge(p, **features).indicators(Contributions(*parts))


@pytest.mark.parametrize("p", [3, 4, 5, 8])
@pytest.mark.parametrize("a", [2.0, 3.0, 8.0, 25.0])
def test_what_remains_of_an_algebraic_error_is_all_of_it(p, a):
    found = remains(p, *parts(p, a, 7.0))
    assert found[0][0] == pytest.approx(7.0 * float(p) ** -a, rel=2e-2)
    assert not found[1].any()
    # An error that falls more slowly than the least rate is the twin that must be caught.
    assert remains(p, *parts(p, 0.3, 7.0))[0][0] < 0.5 * 7.0 * float(p) ** -0.3


@pytest.mark.parametrize("p", [3, 5, 7])
def test_a_part_that_every_second_degree_lacks_is_not_taken_for_the_end(p):
    """An even error whose parts fall by a tenth: the odd degree p contributes nothing, and 1/9 of the last part is
    left; of degree 3, without a rate, the remainder by the least rate."""
    even = remains(p, 1.0, 0.0, 0.1 if p > 3 else np.inf)[0][0]
    assert even == pytest.approx(1 / 9 if p > 3 else 0.0694, rel=1e-2)
    assert remains(p, 1.0, 0.0)[0][0] < 1e-3
    # Beside an edge nothing is even, and theory alone counts there.
    beside = [remains(p, 1.0, 1e-9, ratio, exponents={0.0: 0.5})[0][0] for ratio in (0.0, 0.1)]
    assert beside[0] == beside[1]


@pytest.mark.parametrize("degree", [3, 4, 5, 8])
def test_the_parts_of_every_second_degree_are_compared(degree):
    """On one interval functions of one coordinate are apart in the stiffness matrix: the sizes are the
    coefficients, whatever the cross-section."""
    scene = bar(silicon(0.0), end(0, "temperature", 293.0), end(1, "temperature", 293.0))
    heat = problem(scene, bar_grid(scene, 1, degree))
    space = heat.domain.space
    along_y = (space.position % 2 == [False, True, False]).all(axis=1)
    u = np.where(along_y, 1e3 * 0.1 ** space.depth.clip(0), 0.0)
    sizes = u[heat.order] * estimator.degree_products(heat.stiffness, u[heat.order], space.depth[heat.order])
    found = estimator.every_second(space, heat.order, sizes)[1][0]
    # Coefficients grow tenfold with the degree here, their products hundredfold; a degree below 2 there is none.
    assert found == pytest.approx({3: np.inf, 4: 1e4, 5: 1e4, 8: 1e4}[degree], rel=0.2)


@pytest.mark.parametrize("p", [3, 4, 6])
@pytest.mark.parametrize("exponent", [0.1, 0.2, 0.5, 2 / 3])
def test_next_to_an_edge_no_faster_rate_is_taken_than_the_element_has(p, exponent):
    """A first pair of parts that falls fast by chance: the remainder of (q + lag)^-4s after degree p is the least."""
    found = remains(p, 1.0, 1e-3, exponents={0.0: exponent})[0][0]
    a = estimator.rate_at_edge(np.array([p]), np.array([exponent]))
    most = estimator.left(np.array([p]), a)[0]
    shifted = p + estimator.LAG + estimator.LAG_OVER_EXPONENT / exponent + np.array([-1.0, 0.0])
    assert most == pytest.approx(1 / ((shifted[1] / shifted[0]) ** (4 * exponent) - 1))
    assert found >= (1 - 1e-12) * 1e-3 * most
    assert found > 2 * remains(p, 1.0, 1e-3)[0][0]
    # The same pair at the slowest rate of all: the bound is no larger than that.
    slow = np.minimum(a, SLOWEST)
    bound = max(1e-3 * estimator.left(np.array([p]), slow)[0], estimator.left(np.array([p - 1.0]), a)[0])
    assert found <= (1 + 1e-12) * bound


def test_a_near_edge_slows_the_decay_by_its_ellipse_and_a_far_one_hardly():
    def left(at):
        # The interval from 1 to 2 of a line from 0 to 40, and an edge at 0 or at 40.
        found = judge(6, exponents={at: 0.5}, planes=(0.0, 1.0, 2.0, 39.0, 40.0))
        last = [np.array([0.0, 1e-6, 0.0, 0.0]), np.zeros(1), np.zeros(1)]
        return found.indicators(Contributions([1e6 * last[0], *last[1:]], last, [0 * v for v in last]))[0][1]

    assert left(0.0) > 1.2 * left(40.0)


def test_spreads_add_up_to_the_sum_of_absolute_parts_on_the_intervals_of_each_function():
    scene = three_materials()
    space = problem(scene, grid_of(scene, [np.array(b) for b in _planes(scene)], 5)).domain.space
    rng = np.random.default_rng(0)
    functions = np.flatnonzero((space.position % 2).any(axis=1))
    values = rng.normal(size=len(functions))
    found = space.spread(functions, values)
    assert estimator.total(found) == pytest.approx(np.abs(values).sum())
    along_x = functions[(space.position[functions] % 2 == [True, False, False]).all(axis=1)][:1]
    one = space.spread(along_x, np.array([-2.0]))
    assert one[0][space.position[along_x[0], 0] // 2] == 2.0
    assert estimator.total(one) == 2.0


def _planes(scene):
    from meshes import connected

    return [connected.scene_planes(scene, d) for d in range(3)]


@pytest.mark.parametrize("name", ["beam", "coat"])
def test_nested_problems_are_those_assembled_at_the_lower_degrees(name):
    """Leaving functions out of the matrices and assembling without them are one."""
    scene = three_materials()
    breaks = [np.array(b) for b in _planes(scene)]
    degrees = [np.full(len(b) - 1, p) for b, p in zip(breaks, (4, 5, 3), strict=True)]
    given = nested.problems(boxes(scene, Grid(tuple(breaks), tuple(degrees), scene.boxes)), 1e-6)
    (probe,) = [Probe(name, box.lower, box.upper) for box in scene.boxes if box.name == name]
    for k, less in ((0, 2), (1, 1)):
        lower = Grid(tuple(breaks), tuple(np.maximum(d - less, 1) for d in degrees), scene.boxes)
        alone = nested.problems(boxes(scene, lower), 1e-6)
        states = [solve_steady(p.heats[n], p.conductors[n], 1.0, 1e-12) for p, n in ((given, k), (alone, 2))]
        assert given.heats[k].size == alone.heat.size < given.heat.size
        assert len(given.conductors[k].free) == len(alone.conductor.free)
        means = [float(s.heat.take(s.heat.domain.mean(probe)) @ s.rise) for s in states]
        assert means[0] == pytest.approx(means[1], rel=1e-9)
        assert states[0].power == pytest.approx(states[1].power, rel=1e-9)
    top = solve_steady(given.heat, given.conductor, 1.0, 1e-12)
    assert float(given.heat.take(given.domain.mean(probe)) @ top.rise) != pytest.approx(means[0], rel=1e-9)


def test_what_a_goal_misses_of_the_joule_heat_is_seen_from_where_it_heats():
    """A film's mean follows the square of the current, which the far rim of an electrode spoils: its error is nearly
    twice the error of the power."""
    scene = draw(1349).scene
    study = probe_quantities.study(scene, part_of(scene, False))
    given = nested.problems(boxes(study.part.scene, reach.first_grid(scene, 1e-3, grading.features(scene))), 1e-6)
    potentials = [phi[0] for phi in given.cold_potentials]
    (name, *_), heat, own = study.goals, given.heat, given.conductor
    duals = goal_parts.duals_of({name: name}, given, np.zeros(heat.size), None)
    (found,) = goal_parts.joule_parts({name: name}, given, potentials, {name: 1.0}, duals).values()
    z = heat.field(
        heat.solve_steady(goal_parts.goal_row(heat, given.domain.probes[name], np.zeros(heat.size))[: heat.free])
    )
    seen = [(own.on.weights * own.on.value(z) * (own.on.gradient(phi) ** 2).sum(axis=0) / own.cold).sum()
            for phi in potentials]  # fmt: skip
    change = abs(seen[2] - seen[1])
    assert change < estimator.total(found.last) < 1.5 * change
    assert change / seen[2] > 1.5 * estimator.total(given.electric_parts.last)


def test_a_current_field_that_heating_hardly_changes_makes_the_heat_better():
    """The difference of two fields of nearly one pattern is a field too, whatever the solves leave in it."""
    part = part_of(draw(257).scene, False)
    first = reach.first_grid(part.scene, 1e-2, grading.features(part.scene))
    given = nested.problems(boxes(part.scene, first), 1e-2)
    heat, own = given.heat, given.conductor
    g, n = heat.inputs.at(np.zeros(1))[0], heat.free
    cold = own.solve(np.zeros(heat.size), g @ own.voltages)
    rise = 1e-3 * heat.whole(heat.solve_steady(own.joule_load(cold.density, np.zeros(heat.size))[:n]))
    hot = own.solve(rise, g @ own.voltages, cold.potential)

    def off(known):
        patterns = independent(own, known)
        reduced = project(heat, own, rise[:n, None], patterns)
        c = reduced.currents(reduced.basis.T @ (heat.inner_mass @ rise[:n]), g)
        return np.abs(own.joule_load(combined(patterns, c), rise) - own.joule_load(hot.density, rise)).sum()

    assert off([cold, hot]) < 0.05 * off([cold])


def test_what_the_solve_of_a_potential_leaves_is_no_current_field():
    """Two fields that differ by the gradient of a potential, from which current enters inside, are one."""
    scene = bar(silicon(2e-3), end(0, "temperature", 293.0), end(0, "voltage", 1.0), end(1, "voltage", 0.0))
    heat = problem(scene, bar_grid(scene, 4, 3))
    own = conductors.find(heat)
    cold = own.solve(np.zeros(heat.size), own.voltages[0])
    amiss = np.zeros_like(cold.potential)
    amiss[own.free] = 1e-7 * np.random.default_rng(1).normal(size=len(own.free))
    density = cold.density - own.on.gradient(amiss) / own.cold
    patterns = independent(own, [cold, replace(cold, density=density, reaction=-own.on.flow(density))])
    for pattern in patterns:
        inside = own.on.flow(pattern.density)[own.free]
        assert inside @ own.solve_cold(inside) < 1e-12 * own.product(pattern.density, pattern.density)


def middle(voltage, intervals, degree):
    """The true and the estimated error at the middle of a Joule-heated bar that is not reduced."""
    cold = end(0, "temperature", 293.0), end(1, "temperature", 293.0)
    scene = bar(silicon(2e-3), *cold, end(0, "voltage", voltage), end(1, "voltage", 0.0))
    study, marks = probe_quantities.study(scene, whole(scene)), grading.features(scene)
    judge = Estimator.of_grid(bar_grid(scene, intervals, degree), marks)

    def solved(intervals, degree):
        given = nested.problems(boxes(scene, bar_grid(scene, intervals, degree)), 1e-6)
        return given, nested.solution(study, given)

    given, fine = solved(intervals, degree)
    best = solved(4, 8)[1].quantities["middle"]
    return abs(float(fine.quantities["middle"] - best)), goal_errors.examined(study, given, fine, judge).errors[
        "middle"
    ]


@pytest.mark.parametrize("voltage", [2.0, 9.0])
@pytest.mark.parametrize(("intervals", "degree"), [*((1, p) for p in range(2, 8)), *((3, p) for p in range(4, 7))])
def test_the_error_at_the_top_of_a_symmetric_rise_is_bounded(voltage, intervals, degree):
    true, estimated = middle(voltage, intervals, degree)
    assert true <= estimated
