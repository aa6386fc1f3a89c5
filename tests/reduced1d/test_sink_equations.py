"""The paper's equations 7 to 20: the printed form fails a check of calculus or physics, the corrected one passes."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from reduced1d.device.lumped import lump
from reduced1d.equations import (
    anchor_series_resistance,
    end_flow,
    equivalent_rise,
    parabola,
    power,
    resistance,
    room_resistivity,
    series_resistance,
)
from reduced1d.ladder import solve
from scenes.device import Device
from scenes.model import Material
from scenes.sink import Sink
from tests.reduced1d import relative

L, A_C, K = 1000e-6, 200e-12, 130.0
RHO, A = 6e-5, 5e-4
# Some ten operations on doubles.
ROUNDING = 1e-14


def printed_parabola(y, dT0, dT_end):
    return dT0 * (1 + 4 * (y / L - 0.5) ** 2) + dT_end


@given(st.floats(200, 400), st.floats(200, 400), st.floats(-2e-3, 5e-3), st.floats(0, 100))
@settings(max_examples=50, deadline=None, derandomize=True)
def test_resistivity_about_room_is_the_material_s_own_law(reference, room, a_ref, rise):
    material = Material("m", 1.0, 1.0, 1.0, RHO, a_ref, reference)
    rho, a = room_resistivity(material, room)
    there = RHO * (1 + a_ref * (room + rise - reference))
    # The difference of two temperatures of up to 500 K carries an error of 500 a eps, of terms up to 1.
    assert rho * (1 + a * rise) == pytest.approx(there, abs=ROUNDING * RHO)


def test_silicon_that_does_not_conduct_is_named():
    with pytest.raises(ValueError, match="'glass' has no resistivity"):
        room_resistivity(Material("glass", 1.0, 1.0, 1.0), 293.0)
    with pytest.raises(ValueError, match="must be positive"):
        room_resistivity(Material("m", 1.0, 1.0, 1.0, RHO, -0.1, 263.0), 293.0)


def test_eq_9_has_its_peak_in_the_middle_and_its_ends_at_the_ends():
    y = np.array([0, L / 2, L])
    assert parabola(y, 16.0, 3.0, L) == relative([3, 19, 3], ROUNDING)
    printed = printed_parabola(y, 16.0, 3.0)
    assert printed[1] < printed[0]
    assert printed[0] != relative(3, 0.5)


def test_eq_12_is_the_integral_of_eq_11_with_resistivity_over_cross_section():
    nodes, weights = np.polynomial.legendre.leggauss(3)  # exact to degree 5
    y, weights = L / 2 * (1 + nodes), L / 2 * weights
    dT0, dT_end, current = 16.0, 3.0, 3.3e-3
    expected = power(current, dT0, dT_end, RHO, A, L, A_C)
    corrected = np.sum(weights * current**2 * RHO / A_C * (1 + A * parabola(y, dT0, dT_end, L)))
    assert corrected == relative(expected, ROUNDING)
    # As printed: resistance in place of resistance per length, and the parabola's sign.
    assert np.sum(weights * current**2 * RHO * L / A_C) == relative(expected * L, 0.02)
    wrong_sign = np.sum(weights * current**2 * RHO / A_C * (1 + A * printed_parabola(y, dT0, dT_end)))
    assert wrong_sign - expected == relative(current**2 * 300 * A * 2 / 3 * dT0, 1e-9)


def test_eq_13_is_the_mean_of_the_parabola_and_gives_eq_10_the_power_of_eq_12():
    nodes, weights = np.polynomial.legendre.leggauss(3)
    mean = np.sum(weights / 2 * parabola(L / 2 * (1 + nodes), 16.0, 3.0, L))
    dT_c = equivalent_rise(16.0, 3.0)
    assert dT_c == relative(mean, ROUNDING)
    assert 3.3e-3**2 * resistance(dT_c, RHO, A, L, A_C) == relative(power(3.3e-3, 16.0, 3.0, RHO, A, L, A_C), ROUNDING)


def test_eq_14_of_the_default_sink():
    pad, oxide = series_resistance(50e-6, 130, 300e-12, 0, 1, 1), series_resistance(0, 1, 1, 2e-6, 1.38, 2500e-12)
    assert (pad, oxide) == pytest.approx((1282.05, 579.71), abs=0.005)
    total = anchor_series_resistance(Sink())
    assert total == relative(pad + oxide, ROUNDING)


def test_eq_16_is_the_flow_that_leaves_the_corrected_parabola():
    step = 1e-9
    slope = (parabola(step, 16.0, 3.0, L) - parabola(0.0, 16.0, 3.0, L)) / step
    # The forward difference of a parabola is off by step / L, its rounding by 3 eps L / (step dT0).
    assert K * A_C * slope == relative(end_flow(16.0, K, A_C, L), 2e-6)
    printed = (printed_parabola(step, 16.0, 3.0) - printed_parabola(0.0, 16.0, 3.0)) / step
    assert printed < 0


def test_eq_20_conserves_energy_without_the_printed_volume_and_not_with_it():
    sink = Sink()
    model, early = lump(Device(sink=sink)), 1e-9
    heat = sink.voltage**2 / float(model.resistance[0])
    rise = solve(sink, times=np.array([0.0, early])).over_time.values["mean_K"][-1] - sink.room_temperature
    stored = float(model.capacity[0]) * rise / early
    # The rounding of 293 K in a rise of 2 uK.
    assert stored == relative(heat, 1e-6)
    volume = sink.length * sink.cross_section
    assert heat * volume == relative(stored * 2e-13, 1e-6)
