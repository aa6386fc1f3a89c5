"""Exponents of edges on tetrahedra (`fem3d.spaces.edge_exponents`), against edges between bricks."""

from dataclasses import replace

import numpy as np
import pytest

from fem3d.runs.scene import solve
from fem3d.spaces import edge_exponents
from meshes.singular import exponent
from scenes.model import Boundary, Box, Material, Probe, Scene
from tests.fem3d.sharp_edges import exponents, halved

OXIDE, GOLD = Material("oxide", 1.4, 2200.0, 700.0), Material("gold", 317.0, 19300.0, 129.0, 2.2e-8)
BASE = Box("base", OXIDE, (0.0, 0.0, 0.0), (4.0, 4.0, 1.0))
COLD = Boundary("cold", "temperature", (0.0, 0.0, 0.0), (4.0, 4.0, 0.0), 293.0)
PAD = Box("pad", GOLD, (1.0, 1.0, 1.0), (2.0, 2.0, 2.0))


def held(boxes: tuple[Box, ...], boundaries: tuple[Boundary, ...] = ()) -> Scene:
    return Scene("edges", boxes, (COLD, *boundaries), (), 293.0, steady=True)


def given(name: str, low: float, high: float, value: float) -> Boundary:
    return Boundary(name, "temperature", (low, 0.0, 1.0), (high, 4.0, 1.0), value)


@pytest.mark.parametrize(
    ("boxes", "boundaries", "known"),
    [
        ((BASE,), (), np.inf),
        ((BASE, PAD), (), exponent((317.0, 0.0, 1.4, 1.4))),
        ((BASE, replace(PAD, material=OXIDE)), (), 2 / 3),
        ((BASE,), (given("warm", 0.0, 2.0, 300.0),), 0.5),
        # Two that differ and meet: half of the exponent of one material on either side of the edge.
        ((BASE,), (given("warm", 0.0, 2.0, 300.0), given("hot", 2.0, 4.0, 310.0)), 0.5),
        # The rim of an electrode, that no heat sees.
        (
            (BASE, PAD),
            (
                Boundary("plus", "voltage", (1.0, 1.0, 2.0), (1.5, 2.0, 2.0), 1.0),
                Boundary("minus", "voltage", (2.0, 1.0, 1.0), (2.0, 2.0, 2.0), 0.0),
            ),
            0.5,
        ),
    ],
)  # fmt: skip
def test_smallest_exponent_equals_edge_of_bricks(boxes, boundaries, known):
    assert exponents(halved(held(boxes, boundaries))).min() == pytest.approx(known, rel=1e-6)


def test_errors_hold_at_held_edge_of_good_conductor(
    monkeypatch,
):
    """A heated pad of gold whose end is flush with the cold end of a plate of steel: an exponent of 0.1. The twin
    without edges is off by more than twice its errors."""
    steel = Material("steel", 16.0, 8000.0, 500.0)
    boxes = (
        Box("plate", steel, (0.0, 0.0, 0.0), (1e-4, 6e-5, 1e-5)),
        Box("pad", GOLD, (0.0, 2e-5, 1e-5), (3e-5, 4e-5, 1.3e-5), 1e13),
    )
    cold = Boundary("cold", "temperature", (0.0, 0.0, 0.0), (0.0, 6e-5, 1e-5), 293.0)
    probes = tuple(Probe(b.name, b.lower, b.upper) for b in boxes)
    scene = Scene("flush", boxes, (cold,), probes, 293.0, accuracy=10.0, steady=True, mesh="tetrahedra")
    known = solve(replace(scene, accuracy=0.1, mesh="bricks")).steady

    def off() -> float:
        found = solve(scene)
        assert found.details["levels"] == 1
        return max(abs(e.value - known[n].value) / (e.error + known[n].error) for n, e in found.steady.items())

    assert off() < 1.0
    monkeypatch.setattr(edge_exponents, "of_cells", lambda mesh, smallest: np.full((2, mesh.t.shape[1]), np.inf))
    assert off() > 2.0
