"""Bars with a solution in closed form, and observed orders of convergence."""

from dataclasses import replace

import numpy as np
import pytest

from fem3d.adaptivity.adapt import adapt
from fem3d.results import outputs
from fem3d.runs.sink import study
from meshes import symmetry
from scenes.model import Material
from scenes.sink import SILICON, Sink
from tests.fem3d import BAR, bar, bar_grid, end, off, silicon, steady_on, whole
from tests.fin import solve_fin

K, LENGTH, AREA = 130.0, BAR[1], BAR[0] * BAR[2]
OXIDE = Material("oxide", 1.38, 2200.0, 703.0)


def solved(scene, intervals=4, degree=2, voltage=1.0):
    state = steady_on(scene, bar_grid(scene, intervals, degree), voltage)
    return state, outputs.of_steady(state, whole(scene))


def test_a_heated_bar_between_cold_ends_is_a_parabola():
    q = 1e12
    _, out = solved(bar(SILICON, end(0, "temperature", 293.0), end(1, "temperature", 293.0), heat_source=q))
    assert off(out["probe:middle"], q * LENGTH**2 / (8 * K)) < 1e-11
    assert off(out["probe:mean"], q * LENGTH**2 / (12 * K)) < 1e-11
    assert off(out["flow:temperature-0"], -q * LENGTH * AREA / 2) < 1e-11


def joule_bar(sink):
    """The beam of a sink alone, its ends at room temperature and on the electrodes."""
    room = sink.room_temperature
    cold = end(0, "temperature", room), end(1, "temperature", room)
    scene = bar(sink.silicon, *cold, end(0, "voltage", sink.voltage), end(1, "voltage", 0.0))
    return replace(scene, initial_temperature=room)


@pytest.mark.parametrize("coefficient", [0.0, 5e-4, -5e-4])
@pytest.mark.parametrize("voltage", [-1.0, 7.0])
def test_the_joule_heated_bar_is_the_exact_fin(coefficient, voltage):
    sink = Sink(width=BAR[0], silicon=silicon(coefficient), voltage=voltage, room_temperature=310.0)
    exact = solve_fin(sink, 0.0)
    out = solved(joule_bar(sink), 6, 6)[1]
    assert off(out["probe:middle"], exact.peak_rise) < 1e-9
    assert off(out["probe:mean"], exact.mean_rise) < 1e-9
    assert off(out["current:voltage-0"], exact.current) < 1e-9
    assert off(out["power"], exact.power) < 1e-9
    # Electrodes of one temperature (Kohlrausch): the integral of k rho over the peak rise is V^2 / 8, for any shape.
    rho, rise = 6e-5 * (1 + coefficient * (310.0 - 293.0)), out["probe:middle"]
    assert off(K * (rho * rise + 6e-5 * coefficient * rise**2 / 2), voltage**2 / 8) < 1e-9


def test_a_bar_of_pads_of_its_own_width_is_a_fin_behind_a_known_resistance():
    # Pads as wide as the beam and oxide under all of them, thick enough to conduct downwards only.
    pad, length, width = 5e-6, 1000e-6, 20e-6
    sink = Sink(
        length=length, width=width, pad_length=pad, pad_width=width, oxide_length=pad, oxide_width=width,
        oxide_thickness=4e-3, convection_coefficient=0.0, oxide=replace(OXIDE, thermal_conductivity=130.0),
    )  # fmt: skip
    resistance = 4e-3 / (130.0 * pad * width)
    answer = adapt(study(sink, symmetry.reduce(sink.scene())), False)
    # The turn from beam to oxide adds a part of the order of the beam's thickness over the oxide's.
    fin = solve_fin(sink, resistance)
    assert off(answer.fine.quantities["peak_rise_K"], fin.peak_rise) < 2e-3
    assert off(answer.fine.quantities["peak_rise_K"], solve_fin(sink, 0.99 * resistance).peak_rise) > 4e-3


def test_a_cooled_bar_is_the_fin_with_air():
    h = 2e3
    sink = Sink(width=BAR[0], voltage=3.0, convection_coefficient=h)
    scene = joule_bar(sink)
    top = replace(end(0, "convection", h), lower=(0.0, 0.0, BAR[2]), upper=BAR)
    _, out = solved(replace(scene, boundaries=(*scene.boundaries, top)), 6, 6)
    # Across the thickness the temperature differs by the Biot number h t / k = 3e-5, at most.
    assert off(out["probe:middle"], solve_fin(sink, 0.0).peak_rise) < 2e-5
    assert off(out["probe:middle"], solve_fin(replace(sink, convection_coefficient=1.01 * h), 0.0).peak_rise) > 1e-4


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
