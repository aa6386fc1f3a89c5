"""Observed orders on a problem with a smooth solution: the Joule-heated bar with temperature-dependent resistance."""

import numpy as np
import pytest

from fem3d.results import outputs
from scenes.sink import Sink
from tests.fem3d import BAR, bar_grid, off, steady_on, whole
from tests.fem3d.test_exact import joule_bar
from tests.fin import solve_fin

SINK = Sink(width=BAR[0], voltage=9.0)


def errors(intervals, degree):
    scene = joule_bar(SINK)
    state = steady_on(scene, bar_grid(scene, intervals, degree), SINK.voltage)
    out, exact = outputs.of_steady(state, whole(scene)), solve_fin(SINK, 0.0)
    return np.array([off(out["probe:mean"], exact.mean_rise), off(out["power"], exact.power)])


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_energy_like_quantities_converge_at_twice_the_degree(degree):
    coarse, fine = errors(2, degree), errors(16, degree)
    orders = np.log2(coarse / fine) / 3
    assert (np.abs(orders - 2 * degree) < 0.4).all()


def test_the_error_falls_exponentially_with_the_degree():
    found = np.array([errors(2, degree).max() for degree in range(1, 7)])
    assert (found[1:5] < 0.1 * found[:4]).all()
    assert found[-1] < 1e-8
