"""The Runge-Kutta solution of eq 20: its order, its error estimate, its stability limit, against the exact solution."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from reduced1d.errors import RunawayError
from reduced1d.lumped import Lump, rise_at, vanishing_time
from reduced1d.rk4 import STABILITY_LIMIT, integrate, largest_stable_step, solve_rk4
from reduced1d.sink import lump
from scenes.sink import Sink


def true_error(model, found):
    return np.max(np.abs(found.rises - rise_at(model, found.times)))


@pytest.mark.parametrize("model", [lump(Sink()), lump(Sink(voltage=20.0)), Lump(1e-7, 1e-4, 0.1, 300.0, -2e-3)])
def test_error_falls_with_the_fourth_power_of_the_step(model):
    # Steps of 1/8 to 1/32 of the time constant: small enough for the order, large enough for rounding.
    steps = largest_stable_step(model) / STABILITY_LIMIT / np.array([8, 16, 32])
    errors = [true_error(model, solve_rk4(model, 3 * model.time_constant, step=h)) for h in steps]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders == pytest.approx(4, abs=0.1)


def test_the_order_check_sees_a_wrong_weight():
    def crude(rate, end, n):
        y, h = 0.0, end / n
        for _ in range(n):
            k1 = rate(y)
            k2 = rate(y + h / 2 * k1)
            k3 = rate(y + h / 2 * k2)
            k4 = rate(y + h * k3)
            y += h / 6 * (k1 + 2.1 * k2 + 1.9 * k3 + k4)
        return y

    errors = [abs(crude(lambda y: 1 - y, 1.0, n) + math.expm1(-1)) for n in (8, 16, 32)]
    assert np.log2(np.array(errors[:-1]) / errors[1:]) != pytest.approx(4, abs=0.1)


@given(st.floats(-0.24, 20.0), st.floats(0.05, 30.0), st.floats(-7, -2))
@settings(max_examples=40, deadline=None, derandomize=True)
def test_error_is_within_what_was_asked_and_what_is_estimated(feedback, end, exponent):
    model = Lump(1.0, 1.0, 1.0, 1.0, feedback)
    found = solve_rk4(model, end, accuracy=10**exponent)
    final = found.rises[-1]
    assert found.error <= 10**exponent * final
    # Step halving leaves out the next order of the step, a share of the estimate that is some d h / 5 for d h <= 1;
    # 1e-14 is the rounding of the steps.
    assert true_error(model, found) <= 1.2 * found.error + 1e-14 * final
    assert true_error(model, found) >= 0.6 * found.error - 1e-14 * final


def test_the_paper_s_step_of_a_microsecond_is_exact_to_rounding():
    model = lump(Sink(end_time=2e-3))
    found = solve_rk4(model, 2e-3, step=1e-6)
    assert len(found.times) == 2001
    assert found.times[-1] == 2e-3
    # 2000 additions, each rounded to half an eps of some 10 K.
    assert true_error(model, found) < 2000 * np.finfo(float).eps * found.rises[-1]


def test_steps_beyond_the_stability_limit_diverge_and_are_refused():
    model = Lump(1.0, 1.0, 1.0, 1.0, 0.0)
    assert largest_stable_step(model) == STABILITY_LIMIT
    growth = [1 - h + h**2 / 2 - h**3 / 6 + h**4 / 24 for h in (0.999 * STABILITY_LIMIT, 1.001 * STABILITY_LIMIT)]
    assert growth[0] < 1 < growth[1]
    assert abs(integrate(model.rate, 0.0, 500 * 2.9, 500)[-1] - 1) > 1e3
    for step in (2.9, 0.0, -1.0):
        with pytest.raises(ValueError, match="must be positive and below"):
            solve_rk4(model, 10.0, step=step)


def test_runaway_before_the_end_time_is_reported():
    model = Lump(1.0, 1.0, 1.0, 1.0, -0.3)
    last = vanishing_time(model)
    with pytest.raises(RunawayError, match="resistance vanishes"):
        solve_rk4(model, last)
    assert true_error(model, solve_rk4(model, 0.9 * last, accuracy=1e-4)) < 1e-4 * rise_at(model, [0.9 * last])[0]


def test_no_voltage_no_rise():
    found = solve_rk4(lump(Sink(voltage=0.0)), 1e-3)
    assert not found.rises.any()
    assert found.error == 0
