"""Eq 20's exact solution: an independent integrator, energy, limits, signs of its steady states."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.optimize import bisect

from reduced1d.lumped import (
    Lump,
    progress_at,
    rise_at,
    runaway_voltage,
    steady_rise,
    steady_rounding,
    time_at_progress,
)
from reduced1d.sink import lump
from scenes.errors import RunawayError
from scenes.sink import SILICON, Sink
from tests.reduced1d import relative


def scaled(feedback):
    """A lump whose linear rise and time constant are 1, so that eq 20 is dx/ds = 1/(1 + b x) - x."""
    return Lump(1.0, 1.0, 1.0, 1.0, feedback)


def rate(model, rise):
    """The right side of eq 20 (K/s)."""
    heat = model.voltage**2 / (model.resistance * (1 + model.coefficient * rise))
    return (heat - model.conductance * rise) / model.capacity


def integrated(model, times):
    """An independent solution: Dormand and Prince of order 8 with the smallest tolerance it takes."""
    found = solve_ivp(lambda t, y: [rate(model, y[0])], (0, times[-1]), [0.0], "DOP853", times, rtol=3e-14, atol=1e-16)
    return found.y[0]


FEEDBACKS = [0.0, 1e-9, 0.00689, 0.7, 30.0, 1e3, -1e-9, -0.1, -0.24, -0.25 + 1e-7, -0.25]


@pytest.mark.parametrize("feedback", FEEDBACKS)
def test_exact_solution_agrees_with_an_independent_integrator(feedback):
    model = scaled(feedback)
    times = np.concatenate([[0.0], np.geomspace(1e-3, 10, 12)])
    found, reference = rise_at(model, times), integrated(model, times)
    # The integrator's global error at its tolerance of 3e-14, over the some 100 steps it takes.
    assert np.max(np.abs(found - reference)) < 3e-12 * reference[-1]
    # Without the feedback's sign right, none of the cases with feedback above rounding would pass.
    if abs(feedback) > 1e-6:
        assert np.max(np.abs(rise_at(scaled(-feedback / 1e4), times) - reference)) > 1e-4 * reference[-1]


def test_exact_solution_of_the_sink_in_si_units():
    model = lump(Sink(voltage=5.0))
    times = np.array([0, 1e-5, 1e-4, 1e-3, 2e-2])
    assert rise_at(model, times) == relative(integrated(model, times), 3e-12)


def test_without_feedback_it_is_the_exponential():
    times = np.geomspace(1e-12, 30, 40)
    # Newton ends at the rounding of the time: a few eps, whatever the size of the result.
    assert rise_at(scaled(0.0), times) == relative(-np.expm1(-times), 1e-15 * 8)


@pytest.mark.parametrize("feedback", FEEDBACKS)
def test_it_starts_with_the_heating_rate_to_full_relative_precision(feedback):
    times = np.array([1e-14, 1e-11, 1e-9])
    # x = s - (1 + b) s^2 / 2 + ...; the next term is of relative size ((1 + b) s)^2, 1e-12 at most for b = 1e3.
    expected = times * (1 - (1 + feedback) * times / 2)
    assert rise_at(scaled(feedback), times) == relative(expected, 2e-12 if feedback > 100 else 1e-14)


@pytest.mark.parametrize("feedback", [-0.25, 0.0, 1.0, 1e6])
def test_time_keeps_its_relative_precision_down_to_nothing(feedback):
    # ds/dv = 2/(1 + q) at the start; the next term is of relative size (q - 1) v / 4, below 1e-14 here.
    expected = 1e-17 * 2 / (1 + math.sqrt(1 + 4 * feedback))
    assert time_at_progress(scaled(feedback), np.array(1e-17)) == relative(expected, 2e-14)


@given(st.floats(-0.25, 50.0), st.floats(1e-6, 1e6))
@settings(max_examples=60, deadline=None, derandomize=True)
def test_time_and_progress_are_inverse(feedback, last):
    model = scaled(feedback)
    times = last * np.array([0.0, 1e-3, 0.1, 0.7, 1.0])
    progress = progress_at(model, times)
    # Above a progress of 700 the steady state is reached to rounding, and times are no longer distinct.
    inside = progress < 700
    assert inside[0]
    assert time_at_progress(model, progress[inside]) == relative(times[inside], 1e-13)


@given(st.floats(-0.249, 50.0), st.floats(0.01, 8.0))
@settings(max_examples=40, deadline=None, derandomize=True)
def test_energy_stored_and_lost_is_the_energy_supplied(feedback, last):
    model = scaled(feedback)
    nodes, weights = np.polynomial.legendre.leggauss(24)
    # Panels that grow from the start, where strong feedback changes the power fastest (its rate there is 1 + b).
    edges = np.concatenate([[0.0], last * np.geomspace(1e-4, 1, 14)])
    half = np.diff(edges)[:, None] / 2
    times = edges[:-1, None] + half * (1 + nodes)
    rises = rise_at(model, times)
    supplied, lost = (float(np.sum(half * weights * f)) for f in (1 / (1 + feedback * rises), rises))
    stored = float(rise_at(model, np.array([last]))[0])
    # Gauss's rule is exact to rounding on these panels; the sums have 336 terms.
    assert stored + lost == relative(supplied, 1e-12)
    # The check sees an error of 1e-6 in the rise.
    assert stored + lost * (1 + 1e-6) != relative(supplied, 1e-8 * min(1, last**2))


@given(st.floats(-0.2499, 1e4))
@settings(max_examples=60, deadline=None, derandomize=True)
def test_the_trajectory_from_rest_climbs_to_the_stable_root(feedback):
    model = scaled(feedback)
    reached = steady_rise(model)
    assert abs(feedback * reached**2 + reached - 1) < 1e-13 * max(1.0, abs(feedback) * reached**2)
    # Below it the rise grows and above it falls back: it is stable, and the first root on the way.
    assert rate(model, reached * 0.999) > 0 > rate(model, reached * 1.001)
    assert all(rate(model, fraction * reached) > 0 for fraction in np.linspace(0, 0.999, 20))
    rises = rise_at(model, np.geomspace(1e-6, 5e3, 60))
    assert np.all(np.diff(rises) >= -1e-15 * reached)
    assert rises[-1] == relative(reached, 1e-12)


@pytest.mark.parametrize("feedback", [-0.01, -0.1, -0.24])
def test_the_other_root_is_unstable(feedback):
    model = scaled(feedback)
    other = 1 / (feedback * -steady_rise(model))  # Vieta: the product of the roots is -1/b
    assert other > steady_rise(model)
    assert abs(rate(model, other)) < 1e-12 * other
    assert rate(model, other * 0.999) < 0 < rate(model, other * 1.001)


@pytest.mark.parametrize("feedback", [0.00689, 1e4, -0.2, -0.25 + 1e-10, -0.25])
def test_steady_state_is_within_its_rounding_error(feedback):
    longer = np.longdouble(feedback)
    exact = 2 / (1 + np.sqrt(1 + 4 * longer))
    error = steady_rounding(scaled(feedback))
    assert abs(steady_rise(scaled(feedback)) - exact) <= error * exact
    assert error < 1e-7 if feedback < -0.24 else error < 1e-14


def test_runaway_voltage_is_where_bisection_finds_the_last_steady_state():
    model = lump(Sink(silicon=replace(SILICON, temperature_coefficient=-2e-3)))

    def exists(voltage):
        try:
            steady_rise(replace(model, voltage=voltage))
        except RunawayError:
            return -1.0
        return 1.0

    limit = runaway_voltage(model)
    assert bisect(exists, 1.0, 50.0, xtol=1e-14, rtol=1e-15) == relative(limit, 1e-13)
    with pytest.raises(RunawayError, match=f"above {limit:.6g} V") as caught:
        steady_rise(replace(model, voltage=1.01 * limit))
    assert caught.value.limit == relative(limit, 1e-14)
    assert math.isinf(runaway_voltage(lump(Sink())))


def test_runaway_is_seen_by_an_integrator_that_knows_no_roots():
    model = lump(Sink(silicon=replace(SILICON, temperature_coefficient=-2e-3)))
    limit = runaway_voltage(model)
    long = 300 * model.time_constant
    below = integrated(replace(model, voltage=0.999 * limit), np.array([0.0, long]))[-1]
    assert below == relative(steady_rise(replace(model, voltage=0.999 * limit)), 1e-6)
    assert below < 1 / (2 * 2e-3) < 1 / 2e-3
    # Beyond it the rise passes the double root, on its way to the vanishing resistance.
    beyond = replace(model, voltage=1.001 * limit)

    def past(t, y):
        return y[0] - 0.9 / 2e-3

    past.terminal = True
    found = solve_ivp(lambda t, y: [rate(beyond, y[0])], (0, long), [0.0], "DOP853", rtol=1e-10, events=past)
    assert found.t_events[0][0] < long
    with pytest.raises(RunawayError):
        rise_at(beyond, np.array([0.0]))


def test_times_before_the_start_are_refused():
    with pytest.raises(ValueError, match="not negative"):
        rise_at(scaled(0.1), np.array([1.0, -1e-9]))
    with pytest.raises(ValueError, match="finite"):
        rise_at(scaled(0.1), np.array([np.inf]))
