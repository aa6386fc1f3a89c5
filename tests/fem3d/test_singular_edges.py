"""Edges where the solution is a distance to a small power: errors are honest there, what is out of reach is said."""

import numpy as np
import pytest

from fem3d import indicators, level, probe_quantities
from fem3d.errors import NumericsError
from fem3d.solve_scene import clipped, solve
from meshes import grading, symmetry
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


@pytest.mark.parametrize("contrast", [3.0, 10.0, 30.0])
def test_the_estimate_is_near_the_true_error_at_any_exponent(contrast, monkeypatch):
    scene = checkerboard(contrast)
    part = symmetry.reduce(clipped(scene))
    study, features = probe_quantities.study(scene, part), grading.features(part.scene)
    mesh = first = grading.first_mesh(part.scene, scene.accuracy)

    def heated(mesh):
        return float(level.solution(study, mesh).quantities["heated"])

    def estimate():
        return level.examined(study, first, level.solution(study, first), features).goals["heated"].remaining

    # Each refinement leaves a quarter: the last one is as good as exact.
    for _ in range(3):
        at_edges = [grading.singular_intervals(a, e) for a, e in zip(mesh.axes, features.exponents, strict=True)]
        mesh = grading.refine(mesh, at_edges, features)
    true = abs(heated(mesh) - heated(first))
    assert 0.5 * estimate() < true < 1.2 * estimate()
    # The tail of a re-entrant corner's modes would be taken for that of any edge.
    monkeypatch.setattr(indicators, "WEAKER", 0.0)
    assert estimate() < 0.75 * true


def test_layers_are_cut_as_the_exponent_needs():
    scene = checkerboard(30.0)
    features, mesh = grading.features(scene), grading.first_mesh(scene, 1e-2)
    (exponent,) = features.exponents[1].values()
    marked = [grading.singular_intervals(a, e) for a, e in zip(mesh.axes, features.exponents, strict=True)]
    finer = grading.refine(mesh, marked, features)
    shrunk = np.diff(finer.axes[1].breaks).min() / np.diff(mesh.axes[1].breaks).min()
    assert grading.STEP * grading.RATIO ** (2 * exponent) < shrunk ** (2 * exponent) <= grading.STEP
    for _ in range(20):
        marked = [grading.singular_intervals(a, e) for a, e in zip(finer.axes, features.exponents, strict=True)]
        finer = grading.refine(finer, marked, features, 3)
    assert np.diff(finer.axes[1].breaks).min() >= grading.RATIO * grading.shortest_of(finer)


def test_what_no_layer_resolves_is_refused_at_once_and_named():
    said = []
    with pytest.raises(NumericsError, match=r"at y = 1e-05 m .* to the power 0\.0"):
        solve(checkerboard(1000.0), said.append)
    assert len(said) < 5


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


def test_edges_of_films_spread_over_their_thickness(monkeypatch):
    """Fine and coarse degrees agree on cells far longer than a film is thick, at whose edges they see nothing."""
    true = solve(thin_films(1e-3)).steady

    def excess():
        found = solve(thin_films(3e-3)).steady
        return max(abs(found[n].value - true[n].value) / (found[n].error + true[n].error) for n in true)

    assert excess() <= 1.0
    monkeypatch.setattr(indicators, "UNSEEN", 0.0)
    assert excess() > 1.0
