"""Edges where the solution is a distance to a small power: errors hold there, and an accuracy out of reach is
reported."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.random_boxes import draw
from fem3d.adaptivity import goal_errors, nested, reach
from fem3d.adaptivity.adapt import adapt
from fem3d.adaptivity.estimator import Estimator
from fem3d.runs import probe_quantities
from fem3d.runs.scene import clipped, solve
from fem3d.spaces.domain import boxes as domain_of
from meshes import grading, symmetry
from scenes.errors import NumericsError
from scenes.model import Boundary, Box, Material, Probe, Scene

SIDE = 1e-5


def checkerboard(contrast: float) -> Scene:
    """Two bricks that meet along an edge, heat in the upper one, and a third of another conductivity beside them."""
    good, poor = (Material(name, k, 2000.0, 700.0) for name, k in (("good", 100.0), ("poor", 100.0 / contrast)))
    boxes = (
        Box("cooled", good, (0.0, 0.0, 0.0), (SIDE, SIDE, SIDE)),
        Box("between", poor, (0.0, 0.0, SIDE), (SIDE, SIDE, 2 * SIDE)),
        Box("heated", good, (0.0, SIDE, SIDE), (SIDE, 2.3 * SIDE, 2 * SIDE), 1e8),
    )
    cold = Boundary("cold", "temperature", (0.0, 0.0, 0.0), (SIDE, SIDE, 0.0), 293.0)
    probes = tuple(Probe(b.name, b.lower, b.upper) for b in boxes[1:])
    return Scene("checkerboard", boxes, (cold,), probes, 293.0, accuracy=1e-2, steady=True)


def at_edges(grid, marks):
    """Per axis 1 for the intervals next to a singular plane."""
    return [np.where(np.isfinite(np.minimum(n[:-1], n[1:])), 1.0, 0.0) for n in marks.near(grid)]


def cut(grid, marks, times):
    """The grid cut next to singular planes until their error falls by a factor."""
    missing = at_edges(grid, marks)
    return grading.refined(grid, missing, sum(float(m.sum()) for m in missing) / times, marks)


@pytest.mark.parametrize("contrast", [3.0, 10.0, 30.0])
def test_the_estimate_is_near_the_true_error_at_any_exponent(contrast):
    scene = checkerboard(contrast)
    part = symmetry.reduce(clipped(scene))
    study, marks = probe_quantities.study(scene, part), grading.features(part.scene)
    first = grid = grading.first_grid(part.scene, scene.accuracy, marks)

    def solved(grid):
        given = nested.problems(domain_of(part.scene, grid), 1e-6)
        return given, nested.solution(study, given)

    for _ in range(2):
        grid = grading.raised(cut(grid, marks, 50.0))
    given, fine = solved(first)
    true = abs(float(solved(grid)[1].quantities["heated"] - fine.quantities["heated"]))

    def level(marks):
        return goal_errors.examined(study, given, fine, Estimator.of_grid(first, marks))

    def estimated(marks):
        return level(marks).errors["heated"]

    assert 0.4 * estimated(marks) < true < 0.8 * estimated(marks)
    assert level(marks).worst > scene.accuracy
    # A grid without knowledge of the edges overrates degrees.
    assert estimated(replace(marks, exponents=({}, {}, {}))) < 0.9 * true


@pytest.mark.long
@pytest.mark.parametrize(("contrast", "finer"), [(10.0, 3e-3), (30.0, 6e-3)])
def test_errors_of_answers_hold_at_small_exponents(contrast, finer):
    def answer(accuracy):
        scene = replace(checkerboard(contrast), accuracy=accuracy)
        found = adapt(replace(probe_quantities.study(scene, symmetry.reduce(clipped(scene))), field=None), False)
        return float(found.fine.quantities["heated"]), found.errors["heated"]

    (value, error), (best, left) = answer(3e-2), answer(finer)
    assert abs(value - best) <= error + left
    assert abs(value - best) > 0.2 * error


def test_layers_are_cut_as_the_exponent_needs():
    scene = checkerboard(30.0)
    marks = grading.features(scene)
    (exponent,) = marks.exponents[1].values()
    grid = grading.first_grid(scene, 1e-1, marks)
    finer = cut(grid, marks, 4.0)
    fallen = (np.diff(finer.breaks[1]).min() / np.diff(grid.breaks[1]).min()) ** (2 * exponent)
    # The error falls with twice the exponent; layers are whole, and rounded at 0.3 of one.
    one = grading.RATIO ** (2 * exponent)
    assert 0.25 * one < fallen < 0.25 / one**0.31
    smooth = replace(marks, exponents=tuple(dict.fromkeys(found, 1.0) for found in marks.exponents))
    assert np.diff(cut(grid, smooth, 4.0).breaks[1]).min() > 2 * np.diff(finer.breaks[1]).min()
    for _ in range(20):
        finer = cut(finer, marks, 100.0)
    assert np.diff(finer.breaks[1]).min() >= 0.9 * grading.RATIO * grading.shortest_of(finer)
    degrees = list(zip(finer.degrees, at_edges(finer, marks), strict=True))
    assert all((d[e > 0] >= grading.LEAST_AT_EDGE).all() for d, e in degrees)
    # Layers between an edge and a smooth part have fewer, as they are smaller.
    assert all(d.min() < grading.LEAST_AT_EDGE for d, e in degrees if e.any())


@pytest.mark.parametrize("steady", [True, False])
def test_what_no_layer_resolves_is_refused_at_once_and_named(steady):
    said = []
    with pytest.raises(NumericsError, match=r"at y = 1e-05 m .* to the power 0\.0"):
        solve(replace(checkerboard(1000.0), steady=steady, end_time=1e-3), said.append)
    assert len(said) < 5


@pytest.mark.long
@pytest.mark.parametrize(("seed", "levels"), [(985, 1), (1442, 2)])
def test_what_edges_leave_is_said_as_early_as_it_can_be_known(seed, levels):
    """By the potential of the cold conductor, or by an error that hardly falls from the first level to the second."""
    said = []
    with pytest.raises(NumericsError, match=r"isn't reached .* to the power 0\."):
        solve(draw(seed).scene, said.append)
    assert len(said) == levels


def test_what_falls_from_level_to_level_is_no_edge():
    """On long layers a coarse grid misses thousands of times the tolerance, and the edges cause none of the error."""
    scene = draw(372).scene
    found = solve(scene)
    assert found.details["levels"] > 2
    assert max(e.error / found.details["scales"][n] for n, e in found.steady.items()) <= scene.accuracy


def thin_films(accuracy: float) -> Scene:
    """Two metal films, one on the other, fed at opposite ends of a thick one, and a poor film that their end warms."""
    metal = Material("metal", 240.0, 2700.0, 900.0, 2.8e-8)
    poor = Material("poor", 0.15, 970.0, 1460.0)
    um = 1e-6
    boxes = (
        Box("lower", metal, (0.0, 0.0, 0.0), (34 * um, 15 * um, 0.23 * um)),
        Box("upper", metal, (0.0, 0.0, 0.23 * um), (34 * um, 15 * um, 0.35 * um)),
        Box("beside", poor, (0.0, 15 * um, 0.23 * um), (34 * um, 38 * um, 0.35 * um)),
    )
    boundaries = (
        Boundary("cold", "temperature", (0.0, 0.0, 0.0), (34 * um, 15 * um, 0.0), 293.0),
        Boundary("plus", "voltage", (0.0, 0.0, 0.23 * um), (34 * um, 0.0, 0.35 * um), 6e-4),
        Boundary("minus", "voltage", (0.0, 15 * um, 0.0), (34 * um, 15 * um, 0.23 * um), 0.0),
    )
    probes = tuple(Probe(b.name, b.lower, b.upper) for b in boxes[1:])
    return Scene("films", boxes, boundaries, probes, 293.0, accuracy=accuracy, steady=True)


@pytest.mark.long
def test_edges_of_films_spread_over_their_thickness():
    """Degrees agree on cells far longer than a film is thick, at whose edges they see nothing."""
    true = solve(thin_films(1e-3)).steady

    def excess(scene):
        found = solve(scene).steady
        return max(abs(found[n].value - true[n].value) / (found[n].error + true[n].error) for n in true)

    coarse = thin_films(3e-3)
    assert excess(coarse) <= 1.0
    plus = replace(coarse.boundaries[1], value=1.01 * 6e-4)
    assert excess(replace(coarse, boundaries=(coarse.boundaries[0], plus, coarse.boundaries[2]))) > 1.0


def pillars(count: int) -> Scene:
    """A plate, cooled from below, on which heated pillars stand at unequal distances."""
    plate, post = Material("plate", 100.0, 2000.0, 700.0), Material("post", 1.0, 2000.0, 700.0)
    boxes = [Box("plate", plate, (0.0, 0.0, 0.0), (count * SIDE, count * SIDE, SIDE))]
    for n in range(count):
        x, y = ((n + 0.2 + 0.01 * n) * SIDE, ((3 * n) % count + 0.1 + 0.02 * n) * SIDE)
        boxes.append(Box(f"post {n}", post, (x, y, SIDE), (x + 0.5 * SIDE, y + 0.4 * SIDE, 1.5 * SIDE), 1e8))
    cold = Boundary("cold", "temperature", (0.0, 0.0, 0.0), (count * SIDE, count * SIDE, 0.0), 293.0)
    probes = tuple(Probe(b.name, b.lower, b.upper) for b in boxes[1:2])
    return Scene("pillars", tuple(boxes), (cold,), probes, 293.0, accuracy=1e-3, steady=True)


@pytest.mark.parametrize(("count", "large"), [(1, False), (7, True)])
def test_a_first_grid_that_is_large_is_that_of_a_larger_accuracy(count, large):
    scene = pillars(count)
    marks = grading.features(scene)
    for accuracy in (1e-3, 1e-4):
        asked, first = grading.first_grid(scene, accuracy, marks), reach.first_grid(scene, accuracy, marks)
        assert (asked.solid.sum() > reach.MANY) == large
        assert first.same(grading.first_grid(scene, reach.COARSEST, marks) if large else asked)
