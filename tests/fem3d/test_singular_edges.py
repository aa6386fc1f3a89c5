"""Edges where the solution is a distance to a small power: errors hold there, and an accuracy out of reach is
reported."""

from dataclasses import replace

import pytest

from benchmarks.random_boxes import draw
from fem3d.adaptivity.adapt import adapt
from fem3d.runs import probe_quantities
from fem3d.runs.scene import clipped, solve
from meshes import symmetry
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


@pytest.mark.long
def test_errors_hold_at_small_exponents():
    def answer(accuracy):
        scene = replace(checkerboard(30.0), accuracy=accuracy)
        found = adapt(replace(probe_quantities.study(scene, symmetry.reduce(clipped(scene))), field=None), False)
        return float(found.fine.quantities["heated"]), found.errors["heated"]

    (value, error), (best, left) = answer(3e-2), answer(6e-3)
    assert abs(value - best) <= error + left
    assert abs(value - best) > 0.2 * error


@pytest.mark.parametrize("steady", [True, False])
def test_unresolvable_edge_is_refused_at_once(steady):
    said = []
    with pytest.raises(NumericsError, match=r"at y = 1e-05 m .* to the power 0\.0"):
        solve(replace(checkerboard(1000.0), steady=steady, end_time=1e-3), said.append)
    assert len(said) < 5


@pytest.mark.long
@pytest.mark.parametrize(("seed", "levels"), [(985, 1), (1442, 2)])
def test_unreachable_accuracy_is_reported_early(seed, levels):
    """By the potential of the cold conductor, or by an error that hardly falls from the first level to the second."""
    said = []
    with pytest.raises(NumericsError, match=r"isn't reached .* to the power 0\."):
        solve(draw(seed).scene, said.append)
    assert len(said) == levels


def test_falling_error_is_not_an_edge():
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
def test_errors_hold_at_edges_of_films():
    """Degrees agree on cells far longer than a film is thick, at whose edges they see nothing."""
    true = solve(thin_films(1e-3)).steady

    def excess(scene):
        found = solve(scene).steady
        return max(abs(found[n].value - true[n].value) / (found[n].error + true[n].error) for n in true)

    coarse = thin_films(3e-3)
    assert excess(coarse) <= 1.0
    plus = replace(coarse.boundaries[1], value=1.01 * 6e-4)
    assert excess(replace(coarse, boundaries=(coarse.boundaries[0], plus, coarse.boundaries[2]))) > 1.0
