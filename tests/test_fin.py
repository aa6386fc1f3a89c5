"""The fin, reference of other models, against closed forms."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import solve_banded

from scenes.sink import SILICON, Sink
from tests.fin import fin_at, fin_runaway_voltage, solve_fin
from tests.reduced1d import relative


def silicon(a):
    return replace(SILICON, temperature_coefficient=a)


def test_default_sink_with_the_anchor_resistance_of_three_dimensions():
    fin = solve_fin(Sink(), 2663.0)
    # Independent values, to the digits given.
    assert fin.peak_rise == pytest.approx(20.33, abs=0.005)
    assert fin.end_rise == pytest.approx(4.405, abs=0.0005)
    assert fin.mean_rise == pytest.approx(15.02, abs=0.005)
    assert fin.current == pytest.approx(3.3085e-3, abs=5e-8)
    assert fin.rise(np.array([0.0, 500e-6, 1000e-6])) == relative([fin.end_rise, fin.peak_rise, fin.end_rise], 1e-10)


@pytest.mark.parametrize(("R", "h", "a"), [(2663.0, 0.0, -2e-3), (2663.0, 1e3, 5e-4), (0.0, 2e4, 5e-4)])
def test_it_is_what_finite_differences_converge_to(R, h, a):
    sink, n, k = Sink(silicon=silicon(a), convection_coefficient=h), 2000, 130.0
    cell, current = sink.length / n, 5e-3
    link, end = k * sink.cross_section / cell, 1 / (R + cell / 2 / (k * sink.cross_section))
    source = current**2 * 6e-5 / sink.cross_section * cell
    bands = np.full((3, n), -link)
    bands[1] = 2 * link + h * sink.width * cell - source * a
    bands[1, [0, -1]] += end - link
    rise = solve_banded((1, 1), bands, np.full(n, source))
    # Second order in cells of a 2000th; the strongest cooling has a healing length of 20 cells.
    assert fin_at(sink, R, current).mean_rise == relative(rise.mean(), 1e-3 if h > 1e4 else 1e-5)
    assert fin_at(sink, R, 1.01 * current).mean_rise != relative(rise.mean(), 1e-3)


@pytest.mark.parametrize("R", [30.0, 2663.0, 1e5])
def test_runaway_voltage_without_air_has_a_closed_form(R):
    sink = Sink(silicon=silicon(-2e-3))
    B = R * 130 * sink.cross_section / (sink.length / 2)
    psi = 1 / (math.sqrt(1 + B) + B * math.asinh(1 / math.sqrt(B)))
    assert fin_runaway_voltage(sink, R) == relative(psi * 2 * math.sqrt(130 * 6e-5 / 2e-3), 1e-9)


@pytest.mark.parametrize("a", [5e-4, -5e-4, 0.0])
def test_between_ideal_anchors_the_peak_is_kohlrausch_s(a):
    # V^2 / 8 is the integral of k rho over the rise, for a conductor of any shape.
    peak = solve_fin(Sink(voltage=5.0, silicon=silicon(a)), 0.0).peak_rise
    assert 130 * 6e-5 * (peak + a * peak**2 / 2) == relative(5.0**2 / 8, 1e-10)
