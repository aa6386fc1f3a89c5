"""Manufactured solutions solve the equations they are made for, and a fault in the code shows in the orders."""

from dataclasses import replace

import numpy as np
import pytest

from validate.verify import manufactured, orders
from validate.verify.report import observed_order

POINTS = np.random.default_rng(1).uniform((0.1, 0.1, 0.02), (0.5, 0.5, 0.24), (20, 3)).T
LAYERS = {0: POINTS, 1: POINTS + np.array([[0.0], [0.0], [manufactured.LAYER]])}
STEP = 1e-4


def divergence(flux, points):
    """The divergence of a vector field at some points by central differences."""
    steps = STEP * np.eye(3)[:, :, None]
    return sum((flux(*(points + s))[d] - flux(*(points - s))[d]) / (2 * STEP) for d, s in enumerate(steps))


def slope(field):
    return lambda *at: manufactured.gradient(field, *at)


@pytest.mark.parametrize("layer", LAYERS)
@pytest.mark.parametrize("k", [(2.0, 2.0), (1.5, 3.0)])
def test_the_loads_are_those_of_the_solution(k, layer):
    solution, points = manufactured.conduction(k), LAYERS[layer]
    expected = -k[layer] * divergence(slope(solution.u), points)
    assert np.abs(solution.f(*points) - expected).max() < 1e-5 * np.abs(expected).max()


def test_the_currents_have_no_divergence_and_their_heat_is_left_out_of_the_load():
    solution = manufactured.joule()

    def resistivity(*at):
        return 0.5 * (1 + 0.3 * solution.u(*at))

    def current(*at):
        return slope(solution.potential)(*at) / resistivity(*at)

    assert np.abs(divergence(current, POINTS)).max() < 1e-6 * np.abs(current(*POINTS)).max()
    heat = (current(*POINTS) ** 2).sum(axis=0) * resistivity(*POINTS)
    expected = -2.0 * divergence(slope(solution.u), POINTS) - heat
    assert np.abs(solution.f(*POINTS) - expected).max() < 1e-5 * np.abs(expected).max()


def test_eigenfunctions_meet_in_the_layer_plane():
    for rate, w in manufactured.heating((1.5, 3.0), (1.2, 2.0)).modes:
        x, y, z = POINTS[0], POINTS[1], np.full(20, manufactured.LAYER)
        below = z - 1e-12
        assert rate > 0
        assert np.abs(w(x, y, below) - w(x, y, z)).max() < 1e-11
        assert np.abs(1.5 * slope(w)(x, y, below)[2] - 3.0 * slope(w)(x, y, z)[2]).max() < 1e-9


def test_bricks_converge_in_theory_s_order_and_a_wrong_conductivity_does_not():
    solution = manufactured.conduction((1.5, 3.0))
    coarse, fine = orders.on_bricks(solution, 2, 1), orders.on_bricks(solution, 2, 2)
    # The coarsest meshes are not yet in the asymptotic range; the command goes on from here.
    assert observed_order([coarse["rise, H1"], fine["rise, H1"]], 2.0) == pytest.approx(2, abs=0.25)
    other = manufactured.conduction((1.515, 3.03))
    wrong = replace(solution, scene=replace(solution.scene, boxes=other.scene.boxes))
    off = [orders.on_bricks(wrong, 2, cuts)["rise, L2"] for cuts in (2, 3)]
    assert observed_order(off, 1.5) < 1.0


def test_both_paths_have_the_same_errors_at_the_same_degree():
    solution = manufactured.conduction((2.0, 2.0))
    one, other = orders.on_bricks(solution, 2, 1), orders.on_hexahedra(solution, 2, 1)
    # The same space; the loads are integrated at different points, which matters less than the error itself.
    assert one["rise, H1"] == pytest.approx(other["rise, H1"], rel=1e-3)
