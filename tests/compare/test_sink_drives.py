"""A sink at a given current, and at a voltage behind a series resistance, in both models."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from compare.options import Options
from fem3d.runs import sink as sink_run
from reduced1d import ladder
from reduced1d.device.lumped import lump
from scenes.device import Device
from scenes.errors import RunawayError
from scenes.loading import distinguishes, load
from scenes.sink import Sink
from tests.conftest import judged

STEADY = Options(steady=True)


@cache
def at_a_volt():
    return sink_run.solve(Sink(), STEADY).steady


def given_current():
    return Sink(current=at_a_volt()["current_A"].value)


def behind(sink=None):
    """A sink whose series resistance is its own, at twice the voltage: the state of the voltage alone."""
    return Sink(voltage=2.0, series_resistance=1 / at_a_volt()["current_A"].value)


@pytest.mark.parametrize("sink", [given_current, behind])
def test_in_3d_it_is_the_state_of_the_voltage(sink):
    found = sink_run.solve(sink(), STEADY)
    assert found.details["symmetry"] == "the quarter"
    for name, known in at_a_volt().items():
        # One mesh, and a coupled iteration that ends at 1e-3 of the accuracy; twins differ by the feedback.
        assert found.steady[name].value == pytest.approx(known.value, rel=2e-6)
    twin = replace(sink(), silicon=replace(Sink().silicon, thermal_conductivity=1.001 * 130.0))
    more = sink_run.solve(twin, STEADY)
    assert abs(more.steady["peak_rise_K"].value / at_a_volt()["peak_rise_K"].value - 1) > 1e-4


@pytest.mark.parametrize("reduction", ["paper", "anchored", "fin", "plate"])
def test_in_1d_it_is_the_state_of_the_voltage(reduction):
    plain = ladder.solve(Sink(), reduction, steady_only=True).steady
    current = plain["current_A"].value
    for sink in (Sink(current=current), Sink(voltage=3.0, series_resistance=2 / current)):
        found = ladder.solve(sink, reduction, steady_only=True).steady
        for name, known in plain.items():
            assert found[name].value == pytest.approx(known.value, rel=1e-9)


def test_the_lump_at_a_given_current_warms_like_an_exponential():
    """C dT/dt = I^2 R0 (1 + a T) - G T is linear."""
    sink = Sink(current=6e-3)
    model = lump(Device(sink=sink))
    capacity, coefficient = model.capacity[0], model.coefficient[0]
    heat = sink.current**2 * model.resistance[0]
    rate = (model.conductance - coefficient * heat) / capacity
    times = np.array([0.0, 1e-4, 1e-3, 5e-3, 2e-2])
    traces = ladder.solve(sink, times=times).traces
    exact = heat / capacity / rate * -np.expm1(-rate * times)
    off = np.abs(traces.values["mean_K"] - 293.0 - exact)
    assert off.max() < traces.errors["mean_K"] < 1e-4 * exact[-1]
    power = heat * (1 + coefficient * exact)
    assert np.abs(traces.values["power_W"] - power).max() < traces.errors["power_W"] + 1e-12
    twin = ladder.solve(replace(sink, current=1.0001 * 6e-3), times=times).traces
    assert np.abs(twin.values["mean_K"] - 293.0 - exact).max() > 2 * traces.errors["mean_K"]


@pytest.mark.long
def test_a_given_current_has_a_largest_one_in_both_models():
    model = lump(Device())
    limit = np.sqrt(model.conductance / model.coefficient[0] / model.resistance[0])
    with pytest.raises(RunawayError, match="rising resistance") as caught:
        ladder.solve(Sink(current=1.001 * limit), steady_only=True)
    assert caught.value.limit == pytest.approx(limit, rel=1e-12)
    with pytest.raises(RunawayError, match="the largest current with a steady state") as in_3d:
        sink_run.solve(Sink(current=2 * limit), STEADY)
    # 3D has the larger anchor resistance, and warms its beam by a sine rather than a parabola.
    assert 0.8 * limit < in_3d.value.limit < limit
    assert sink_run.solve(Sink(current=0.99 * in_3d.value.limit), STEADY).steady["peak_rise_K"].value > 1e4


@pytest.mark.long
def test_a_falling_resistance_runs_away_at_more_volts_behind_a_resistance_and_behind_a_large_one_at_none():
    falling = replace(Sink().silicon, temperature_coefficient=-1e-3)
    sinks = [Sink(silicon=falling, series_resistance=ohm) for ohm in (0.0, 10.0, 40.0)]
    limits = [ladder.solve(sink, "fin", steady_only=True).details["runaway_voltage_V"] for sink in sinks]
    assert limits[1] > 1.05 * limits[0]
    # Of one lump of r = 300 ohm dV/dI is that resistance and r (1 - y)/(1 + y)^2, at least -r/8, y growing with I.
    assert limits[2] is None
    at = Sink(silicon=falling, series_resistance=10.0, voltage=1.001 * limits[1])
    with pytest.raises(RunawayError, match="no steady state"):
        ladder.solve(at, "fin", steady_only=True)
    with pytest.raises(RunawayError, match="runaway"):
        sink_run.solve(replace(at, voltage=1.2 * limits[1]), STEADY)
    assert sink_run.solve(replace(at, voltage=0.9 * limits[1]), STEADY).steady["peak_rise_K"].value > 100.0


def test_over_time_the_checks_follow():
    sink = Sink(current=3.3e-3)
    found = sink_run.solve(sink)
    reduction = ladder.solve(sink, times=found.traces.time)
    checks = judged(sink, found, reduction)
    assert "fig7_current" not in checks
    assert {"eq12", "eq13", "fig4", "fig6_peak", "energy"} <= set(checks)
    assert checks["eq12"].verdict == checks["energy"].verdict == "agrees"
    assert found.traces.values["current_A"] == pytest.approx(3.3e-3, rel=1e-12)
    # A warmer beam takes more power at the same current.
    assert found.traces.values["power_W"][-1] > found.traces.values["power_W"][0] * 1.005
    series = Sink(series_resistance=100.0)
    found = sink_run.solve(series)
    assert found.traces.values["current_A"][0] == pytest.approx(1 / (300.0 + 100.0), rel=1e-6)
    assert "fig7_current" in judged(series, found, ladder.solve(series, times=found.traces.time))


def test_keys_and_names():
    assert load("sink", ["drive.current=3mA"]).current == 3e-3
    assert distinguishes(load("sink", ["drive.current=3mA"])) == "3mA"
    assert distinguishes(load("sink", ["series_resistance=50 ohm"])) == "1V-series_resistance50ohm"
