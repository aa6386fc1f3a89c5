"""The exponents of edges against the theory of wedges of one and two materials."""

import numpy as np
import pytest

from fem3d.spaces import edge_exponents
from fem3d.spaces.edge_exponents import exponent, features
from scenes.model import Boundary, Box, Material, Scene
from scenes.sink import Sink


@pytest.mark.parametrize(
    ("quadrants", "expected"),
    [
        ((1, 1, 1, 1), 1.0),
        ((1, 1, 1, 0), 2 / 3),
        ((1, 1, 0, 0), 1.0),
        ((1, 0, 0, 0), 2.0),
        ((130, 1.38, 0, 0), 1.0),
        ((1, 0, 1, 0), 2.0),
    ],
)
def test_wedges_of_one_material_and_the_straight_interface(quadrants, expected):
    assert abs(exponent(tuple(map(float, quadrants))) - expected) < 2e-4


@pytest.mark.parametrize("ratio", [1.0, 3.0, 161.4476387975881])
def test_checkerboard(ratio):
    # Kellogg's problem: tan(pi s / 4)^2 = k_small / k_large; 161.45 gives 0.1.
    expected = 4 / np.pi * np.arctan(ratio**-0.5)
    assert abs(exponent((ratio, 1.0, ratio, 1.0)) - expected) < 1e-4


@pytest.mark.parametrize("ratio", [0.01, 1.0, 130 / 1.38])
def test_half_a_plane_on_a_quarter_of_another_material(ratio):
    # k_1 tan(pi s) = -k_2 tan(pi s / 2), by the half-angle formula.
    expected = 2 / np.pi * np.arctan(np.sqrt(1 + 2 * ratio))
    assert abs(exponent((ratio, ratio, 1.0, 0.0)) - expected) < 1e-4
    assert abs(exponent((0.0, 1.0, ratio, ratio)) - expected) < 1e-4
    assert abs(exponent((ratio, ratio, 1.1, 0.0)) - expected) > 1e-4 * min(ratio, 1 / ratio)


def test_only_ratios_matter():
    assert abs(exponent((5e3, 2e3, 1e3, 0.0)) - exponent((5.0, 2.0, 1.0, 0.0))) < 1e-9


@pytest.mark.parametrize(
    ("quadrants", "rays", "expected"),
    [
        ((1, 1, 0, 0), (1, 0, 0, 0), 1 / 2),  # the rim of an electrode on a flat face
        ((1, 1, 0, 0), (1, 0, 1, 0), 1.0),
        ((1, 0, 0, 0), (1, 0, 0, 0), 1.0),
        ((1, 0, 0, 0), (1, 1, 0, 0), 2.0),
        ((1, 1, 1, 0), (1, 0, 0, 0), 1 / 3),
        ((1, 1, 1, 0), (1, 0, 0, 1), 2 / 3),
        ((1, 1, 1, 1), (0, 1, 0, 0), 1 / 2),  # the edge of a sheet inside
        ((1, 1, 1, 1), (0, 1, 0, 1), 1.0),
    ],
)
def test_wedges_with_given_values(quadrants, rays, expected):
    assert abs(exponent(tuple(map(float, quadrants)), tuple(map(bool, rays))) - expected) < 2e-4


def test_the_rim_of_a_partial_electrode_is_found_and_the_rim_of_a_whole_face_is_not():
    box = Box("b", Material("m", 1.0, 1.0, 1.0, 1.0), (0.0, 0.0, 0.0), (4.0, 4.0, 1.0))
    ground = Boundary("g", "voltage", (0.0, 0.0, 0.0), (4.0, 4.0, 0.0), 0.0)
    part = Boundary("e", "voltage", (1.0, 1.0, 1.0), (2.0, 3.0, 1.0), 1.0)
    x, y, z = features(Scene("s", (box,), (ground, part), ())).exponents
    assert sorted(x) == [1.0, 2.0]
    assert sorted(y) == [1.0, 3.0]
    assert z == pytest.approx({1.0: 0.5}, abs=1e-4)
    whole = Boundary("e", "voltage", (0.0, 0.0, 1.0), (4.0, 4.0, 1.0), 1.0)
    assert features(Scene("s", (box,), (ground, whole), ())).exponents == ({}, {}, {})


@pytest.mark.parametrize(("kind", "value", "found"), [
    ("convection", 750.0, True), ("convection", 1.0, False), ("heat_flux", 10.0, True), ("heat_flux", 0.0, False),
])  # fmt: skip
def test_a_face_that_heat_passes_contradicts_a_given_temperature_at_their_edge(kind, value, found):
    box = Box("plate", Material("steel", 52.0, 1.0, 1.0), (0.0, 0.0, 0.0), (0.6, 1.0, 0.1))
    base = Boundary("base", "temperature", (0.0, 0.0, 0.0), (0.6, 0.0, 0.1), 373.0)
    side = Boundary("side", kind, (0.6, 0.0, 0.0), (0.6, 1.0, 0.1), value, 273.0)
    planes = list(features(Scene("plate", (box,), (base, side), ())).exponents)
    assert planes == (
        [{0.6: pytest.approx(1.0, abs=1e-4)}, {0.0: pytest.approx(1.0, abs=1e-4)}, {}] if found else [{}] * 3
    )


def test_a_thin_layer_has_singular_edges_where_it_ends():
    ground = Boundary("ground", "temperature", (0.0, 0.0, 0.0), (4.0, 9.0, 0.0), 293.0)
    body = Box("body", Material("steel", 52.0, 1.0, 1.0), (0.0, 0.0, 0.0), (4.0, 9.0, 3.0))
    film = Box("film", Material("gold", 300.0, 1.0, 1.0), (0.0, 0.0, 3.0), (4.0, 5.0, 3.1))
    _, y, z = features(Scene("film", (body, film), (ground,), ())).exponents
    assert set(y) == {5.0}
    assert set(z) == {3.0}


@pytest.mark.parametrize(("side", "expected"), [(300.0, {}), (320.0, {0.0: 1.0})])
def test_where_given_temperatures_differ_the_solution_jumps(side, expected):
    # Half the exponent 2 of the dual solution in the corner.
    box = Box("a", Material("m", 1.0, 1.0, 1.0), (0.0, 0.0, 0.0), (1.0, 1.0, 1.0))
    boundaries = (
        Boundary("side", "temperature", (0.0, 0.0, 0.0), (0.0, 1.0, 1.0), side),
        Boundary("front", "temperature", (0.0, 0.0, 0.0), (1.0, 0.0, 1.0), 300.0),
    )
    exponents = features(Scene("corner", (box,), boundaries, (), 300.0)).exponents
    assert [{at: round(s, 3) for at, s in found.items()} for found in exponents[:2]] == [expected, expected]


def test_gas_around_the_rim_of_a_contact_is_void_where_nothing_resolves_what_it_carries(monkeypatch):
    """A film of gas beside oxide under a contact: its quadrant carries a hundred-thousandth, and alone would tie
    sides together with an exponent of a hundredth."""
    scene = Sink(contact_resistance=2e-8, gap_gas_conductivity=0.026, substrate_thickness=0.5e-3).scene()
    sharpest = min(s for axis in features(scene).exponents for s in axis.values())
    assert sharpest > 0.3
    monkeypatch.setattr(edge_exponents, "RESOLVED", 0.0)
    assert min(s for axis in features(scene).exponents for s in axis.values()) < 0.05
