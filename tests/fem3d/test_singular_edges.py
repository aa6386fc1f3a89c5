"""Edges where the solution is a distance to a small power: errors hold there, and an accuracy out of reach is
reported."""

from dataclasses import replace

import numpy as np
import pytest

from fem3d.adaptivity.adapt import adapt
from fem3d.runs import probe_quantities
from fem3d.runs.scene import clipped, solve
from fem3d.spaces import edge_exponents
from meshes import symmetry
from scenes.errors import NumericsError
from scenes.model import Boundary, Box, Material, Probe, Scene
from tests.fem3d import drawn, gap

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
        run = adapt(replace(probe_quantities.study(scene, symmetry.reduce(clipped(scene))), field_accuracy=None), False)
        return float(run.fine.quantities["heated"]), run.errors["heated"]

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
        solve(drawn(f"boxes {seed}"), said.append)
    assert len(said) == levels


def test_falling_error_is_not_an_edge():
    """On long layers a coarse grid misses thousands of times the tolerance, and the edges cause none of the error."""
    scene = drawn("boxes 372")
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
    true, coarse = solve(thin_films(1e-3)), thin_films(3e-3)
    assert gap(solve(coarse), true) <= 1.0
    plus = replace(coarse.boundaries[1], value=1.01 * 6e-4)
    assert gap(solve(replace(coarse, boundaries=(coarse.boundaries[0], plus, coarse.boundaries[2]))), true) > 1.0


def test_errors_hold_at_held_edge_of_good_conductor(monkeypatch):
    """A heated pad of gold whose end is flush with the cold end of a plate of steel: an exponent of 0.1. The twin
    without edges is off by more than twice its errors."""
    steel, gold = Material("steel", 16.0, 8000.0, 500.0), Material("gold", 317.0, 19300.0, 129.0, 2.2e-8)
    boxes = (
        Box("plate", steel, (0.0, 0.0, 0.0), (1e-4, 6e-5, 1e-5)),
        Box("pad", gold, (0.0, 2e-5, 1e-5), (3e-5, 4e-5, 1.3e-5), 1e13),
    )
    cold = Boundary("cold", "temperature", (0.0, 0.0, 0.0), (0.0, 6e-5, 1e-5), 293.0)
    probes = tuple(Probe(b.name, b.lower, b.upper) for b in boxes)
    scene = Scene("flush", boxes, (cold,), probes, 293.0, accuracy=10.0, steady=True, mesh="tetrahedra")
    known = solve(replace(scene, accuracy=0.1, mesh="bricks"))

    def off() -> float:
        found = solve(scene)
        assert found.details["levels"] == 1
        return gap(found, known)

    assert off() < 1.0
    smooth = np.full((2, 3, 1_000), np.inf)
    monkeypatch.setattr(edge_exponents, "at_vertices", lambda domain: smooth[..., : domain.space.mesh.p.shape[1]])
    assert off() > 2.0


@pytest.mark.long
def test_errors_hold_where_two_given_temperatures_meet(monkeypatch):
    """Near the edge of a block that is hot below and cold at one side, where the solution jumps. The twin without the
    jump's error is off by more than twice its errors."""
    block = Box("block", Material("silicon", 130.0, 2330.0, 712.0), (0.0, 0.0, 0.0), (1e-4, 6e-5, 2e-5))
    hot = Boundary("hot", "temperature", block.lower, (1e-4, 6e-5, 0.0), 350.0)
    cold = Boundary("cold", "temperature", block.lower, (0.0, 6e-5, 2e-5), 293.0)
    probes = Probe("mean", block.lower, block.upper), Probe("near", (5e-6, 3e-5, 3e-6), (5e-6, 3e-5, 3e-6))
    scene = Scene("torn", (block,), (hot, cold), probes, 293.0, accuracy=5e-2, steady=True)
    known = solve(replace(scene, accuracy=1e-3, mesh="bricks"))
    assert gap(solve(replace(scene, mesh="bricks")), known) < 1.0
    assert gap(solve(replace(scene, mesh="tetrahedra")), known) < 1.0
    monkeypatch.setattr("fem3d.adaptivity.goal_errors.Duals.contradictions", lambda *_: {})
    assert gap(solve(replace(scene, mesh="tetrahedra")), known) > 2.0
