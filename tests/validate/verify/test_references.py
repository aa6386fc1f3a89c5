"""The exact values that scenes are held to: series against the Laplace domain, printed numbers, known limits."""

from dataclasses import replace

import numpy as np
import pytest

from scenes.sink import SILICON, Sink
from tests.fin import solve_fin
from validate.verify import exact_bodies, published, series
from validate.verify.series import HELD, Layer, step_response

SLAB = Layer(0.5, 2.0, 3.0)  # diffusivity 2/3 m2/s


@pytest.mark.parametrize("time", [0.01, 0.1, 1.0])
def test_the_inverted_transform_is_the_series_of_a_slab(time):
    number = 2 / 3 * time / 0.25
    # A slab warmed on both sides is half a slab that is adiabatic in the middle.
    held = step_response([SLAB], "temperature", 1.0, 0.0, np.array([time]))[0, 1]
    assert abs(1 - held - float(series.cooling(0.0, number))) < 1e-11
    film = step_response([SLAB], "film", 1.0, 0.0, np.array([time]), 5.0)[0, 1]
    assert abs(1 - film - series.film_cooling(0.0, 5 * 0.5 / 2, number)) < 1e-11
    # A coefficient 0.2 % off is seen even early, when hardly anything has reached the middle.
    assert abs(1 - film - series.film_cooling(0.0, 5.01 * 0.5 / 2, number)) > 1e-9


def test_layers_of_one_material_are_one_layer_and_end_as_resistances_in_series():
    times = np.array([0.05, 0.5, 100.0])
    one = step_response([Layer(1.0, 2.0, 3.0)], "flux", 7.0, HELD, times)
    two = step_response([SLAB, SLAB], "flux", 7.0, HELD, times)
    assert np.abs(one[:, 0] - two[:, 0]).max() < 1e-10
    late = step_response([Layer(0.3, 2.0, 3.0), Layer(0.1, 0.5, 1.0)], "flux", 7.0, HELD, times)[-1]
    assert late == pytest.approx([7 * (0.3 / 2 + 0.1 / 0.5), 7 * 0.1 / 0.5, 0.0], abs=1e-9)


def test_the_series_give_the_printed_numbers_of_nafems_and_iso():
    slow = 0.1**2 * 7200 * 440.5 / 35
    assert round(100 * series.sine_driven(0.8, slow, np.pi / 40, 32.0), 2) == 36.60
    assert round(100 * series.convective_rectangle(0.6, 1.0, 52.0, 750.0, 0.6, 0.2), 2) == 18.25
    found = [[round(20 * series.half_heated_square(i / 8, j / 8), 1) for i in (1, 2, 3, 4)] for j in range(1, 8)]
    assert found == [list(row) for row in published.CASE_1]


def test_straight_lines_approach_the_sine():
    times, slow = np.linspace(0, 32, 641), 0.1**2 * 7200 * 440.5 / 35
    sine = series.sine_driven(0.8, slow, np.pi / 40, 32.0)
    off = [
        abs(series.ramped(0.8, slow, times[::step], np.sin(np.pi * times[::step] / 40), 32.0) - sine)
        for step in (20, 10)
    ]
    # The error of straight lines falls with the square of their length.
    assert np.log2(off[0] / off[1]) == pytest.approx(2, abs=0.05)


@pytest.mark.parametrize("coefficient", [5e-4, -5e-4, 0.0])
def test_the_heated_bar_is_the_fin(coefficient):
    material = replace(SILICON, temperature_coefficient=coefficient)
    fin = solve_fin(Sink(silicon=material, voltage=5.0), 0.0)
    found = exact_bodies.heated_bar(material, 1e-3, 2e-10, 5.0)
    assert found == pytest.approx((fin.peak_rise, fin.mean_rise, fin.current), rel=1e-10)
