"""The voltage above which the fin has no steady state, against closed forms, bisection and finite differences."""

import dataclasses
import math

import numpy as np
import pytest
from scipy.linalg import solve_banded

from reduced1d.errors import RunawayError
from reduced1d.fin import fin_runaway_voltage, solve_fin
from reduced1d.lumped import runaway_voltage
from reduced1d.sink import anchor_series_resistance, lump
from scenes.sink import SILICON, Sink
from tests.reduced1d import relative


def silicon(a):
    return dataclasses.replace(SILICON, temperature_coefficient=a)


def bisected_limit(sink, R, low, high):
    for _ in range(60):
        middle = (low + high) / 2
        try:
            solve_fin(dataclasses.replace(sink, voltage=middle), R)
            low = middle
        except RunawayError:
            high = middle
    return low


@pytest.mark.parametrize(("R", "h"), [(2663.0, 0.0), (2663.0, 1e3), (0.0, 1e3), (1e5, 0.0)])
def test_runaway_voltage_is_the_largest_that_any_current_gives(R, h):
    sink = Sink(silicon=silicon(-2e-3), convection_coefficient=h)
    limit = fin_runaway_voltage(sink, R)
    assert bisected_limit(sink, R, 0.0, 3 * limit) == relative(limit, 1e-12)
    # The voltage over given currents, by a finite-difference solution that knows no closed form.
    currents = np.linspace(0.5, 1.5, 41) * solve_fin(dataclasses.replace(sink, voltage=limit), R).current
    voltages = [current * _resistance_by_differences(sink, R, current) for current in currents]
    # Both the difference scheme (400 cells, second order) and the grid of currents (2.5 % of a flat maximum).
    assert max(voltages) == relative(limit, 1e-3)
    assert 0 < int(np.argmax(voltages)) < 40


def _resistance_by_differences(sink, R, current):
    n, k, A_c = 400, 130.0, sink.cross_section
    rho, a = 6e-5, sink.silicon.temperature_coefficient
    cell = sink.length / n
    link, end = k * A_c / cell, 1 / (R + cell / 2 / (k * A_c))
    source = current**2 * rho / A_c * cell
    bands = np.full((3, n), -link)
    bands[1] = 2 * link + sink.convection_coefficient * sink.width * cell - source * a
    bands[1, [0, -1]] += end - link
    rise = solve_banded((1, 1), bands, np.full(n, source))
    return float(np.sum(rho * cell / A_c * (1 + a * rise)))


@pytest.mark.parametrize("R", [1e-3, 30.0, 2663.0, 1e6])
def test_runaway_voltage_without_air_has_a_closed_form(R):
    sink = Sink(silicon=silicon(-2e-3))
    B = R * 130 * sink.cross_section / (sink.length / 2)
    psi = 1 / (math.sqrt(1 + B) + B * math.asinh(1 / math.sqrt(B)))
    assert fin_runaway_voltage(sink, R) == relative(psi * 2 * math.sqrt(130 * 6e-5 / 2e-3), 1e-13)


def test_between_ideal_anchors_runaway_is_kohlrausch_s_voltage():
    # V^2 / 8 is the integral of k rho over the rise, for a conductor of any shape, here k rho0 / (2 |a|) at its end.
    assert fin_runaway_voltage(Sink(silicon=silicon(-2e-3)), 0.0) == relative(2 * math.sqrt(130 * 6e-5 / 2e-3), 1e-12)
    fin = solve_fin(Sink(voltage=8.0), 0.0)
    peak = fin.peak_rise
    integral = 130 * 6e-5 * (peak + 5e-4 * peak**2 / 2)
    assert integral == relative(8.0**2 / 8, 1e-13)


def test_behind_a_large_anchor_resistance_the_fin_runs_away_like_the_lump():
    sink = Sink(silicon=silicon(-2e-3), oxide_thickness=2e-3)
    R = anchor_series_resistance(sink)
    # The beam's own drop is L / (6 k A_c R) = 1 % of the anchor's, and its shape a second-order effect of that.
    assert fin_runaway_voltage(sink, R) == relative(runaway_voltage(lump(sink)), 1e-4)
    assert fin_runaway_voltage(sink, 1.01 * R) != relative(runaway_voltage(lump(sink)), 1e-4)


def test_runaway_is_reported_with_its_voltage():
    sink = Sink(silicon=silicon(-2e-3))
    limit = fin_runaway_voltage(sink, 2663.0)
    with pytest.raises(RunawayError, match=f"above {limit:.6g} V") as caught:
        solve_fin(dataclasses.replace(sink, voltage=1.001 * limit), 2663.0)
    assert caught.value.limit_voltage == relative(limit, 1e-14)
    assert math.isinf(fin_runaway_voltage(Sink(), 2663.0))


def test_of_two_currents_the_one_that_grows_from_nothing_is_found():
    sink = Sink(silicon=silicon(-2e-3))
    limit = fin_runaway_voltage(sink, 2663.0)
    voltages = np.linspace(0.01, 1, 40) * limit
    currents = [solve_fin(dataclasses.replace(sink, voltage=v), 2663.0).current for v in voltages]
    assert currents[0] == relative(voltages[0] / 300, 1e-3)
    assert np.all(np.diff(currents) > 0)
