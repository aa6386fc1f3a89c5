"""Manufactured solutions solve the equations they are made for, and a fault in the code shows in the orders."""

from dataclasses import replace

import numpy as np
import pytest

from validate.verify import bricks, hexahedra, manufactured
from validate.verify.answers import observed_order

POINTS = np.random.default_rng(1).uniform(0.1, 0.5, (3, 20))
STEP = 1e-4


def divergence(flux, layer):
    """The divergence of a vector field at POINTS by central differences, in one layer."""
    total = 0.0
    for d in range(3):
        step = np.zeros((3, 1))
        step[d] = STEP
        total = total + (flux(layer, *(POINTS + step))[d] - flux(layer, *(POINTS - step))[d]) / (2 * STEP)
    return total


@pytest.mark.parametrize("layer", [0, 1])
@pytest.mark.parametrize("layered", [False, True])
def test_the_loads_are_those_of_the_solution(layered, layer):
    solution = manufactured.conduction(layered)
    k = solution.scene.boxes[layer].material.thermal_conductivity
    expected = -k * divergence(solution.gradient, layer)
    assert np.abs(solution.f(layer, *POINTS) - expected).max() < 1e-5 * np.abs(expected).max()


def test_the_currents_have_no_divergence_and_their_heat_is_left_out_of_the_load():
    solution, rho, a = manufactured.joule(), 0.5, 0.3
    resistivity = rho * (1 + a * solution.u(0, *POINTS))

    def current(_, *at):
        return solution.potential_gradient(0, *at) / (rho * (1 + a * solution.u(0, *at)))

    assert np.abs(divergence(current, 0)).max() < 1e-6 * np.abs(current(0, *POINTS)).max()
    heat = (solution.potential_gradient(0, *POINTS) ** 2).sum(axis=0) / resistivity
    expected = -2.0 * divergence(solution.gradient, 0) - heat
    assert np.abs(solution.f(0, *POINTS) - expected).max() < 1e-5 * np.abs(expected).max()


def test_eigenfunctions_meet_in_the_layer_plane():
    for rate, w, slope in manufactured.heating(layered=True).modes:
        x, y, z = POINTS[0], POINTS[1], np.full(20, manufactured.LAYER)
        assert rate > 0
        assert np.abs(w(0, x, y, z) - w(1, x, y, z)).max() < 1e-12
        assert np.abs(1.5 * slope(0, x, y, z)[2] - 3.0 * slope(1, x, y, z)[2]).max() < 1e-9


def test_bricks_converge_in_theory_s_order_and_a_wrong_conductivity_does_not():
    solution = manufactured.conduction(layered=True)
    coarse, fine = bricks.errors(solution, 2, 1), bricks.errors(solution, 2, 2)
    # The coarsest meshes are not yet in the asymptotic range; the command goes on from here.
    assert observed_order([coarse["rise, H1"], fine["rise, H1"]], 2.0) == pytest.approx(2, abs=0.25)
    boxes = tuple(
        replace(b, material=replace(b.material, thermal_conductivity=1.01 * b.material.thermal_conductivity))
        for b in solution.scene.boxes
    )
    wrong = replace(solution, scene=replace(solution.scene, boxes=boxes))
    off = [bricks.errors(wrong, 2, cuts)["rise, L2"] for cuts in (2, 3)]
    assert observed_order(off, 1.5) < 1.0


def test_both_paths_have_the_same_errors_at_the_same_degree():
    solution = manufactured.conduction(layered=False)
    one, other = bricks.errors(solution, 2, 1), hexahedra.errors(solution, 2, 1)
    # The same space; the loads are integrated at different points, which matters less than the error itself.
    assert one["rise, H1"] == pytest.approx(other["rise, H1"], rel=1e-3)
