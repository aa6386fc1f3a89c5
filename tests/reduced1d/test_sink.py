"""The reduction of a sink as a result: the default's numbers, signs, energy, and traces that may be interpolated."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from reduced1d.device.lumped import lump
from reduced1d.equations import equivalent_rise
from reduced1d.ladder import solve
from scenes.device import Device
from scenes.errors import RunawayError
from scenes.sink import SILICON, Sink
from tests.reduced1d import relative

TRACES = {"peak_K", "end_K", "mean_K", "current_A", "power_W"}


@st.composite
def sinks(draw):
    um = 1e-6
    length, width = draw(st.floats(50, 5000)) * um, draw(st.floats(2, 500)) * um
    a = round(draw(st.floats(-2e-3, 5e-3)), 9)  # no material's is 1e-300: the voltage below would overflow
    sink = Sink(
        length=length,
        width=width,
        thickness=draw(st.floats(0.2, 20)) * um,
        oxide_thickness=draw(st.floats(0.2, 20)) * um,
        silicon=dataclasses.replace(
            SILICON, temperature_coefficient=a, reference_temperature=draw(st.floats(280, 310))
        ),
        convection_coefficient=draw(st.sampled_from([0.0, 10.0, 1e4])),
        end_time=10 ** draw(st.floats(-5, 0)),
        accuracy=10 ** draw(st.floats(-4, -1)),
    )
    # A voltage between nothing and a drive at which the feedback a P/G is -0.24 or 5; nobody's is 1e-300.
    model = lump(Device(sink=sink))
    change, resistance = float(model.coefficient[0]), float(model.resistance[0])
    strongest = -0.24 if change < 0 else 5.0
    feedback = change / (resistance * model.conductance) or strongest
    return dataclasses.replace(sink, voltage=round(draw(st.floats(-1, 1)), 9) * (strongest / feedback) ** 0.5)


def test_default_sink_at_one_volt():
    result = solve(Sink())
    value = {key: estimate.value for key, estimate in result.steady.items()}
    # Independent values, to the digits given.
    assert value["peak_rise_K"] == pytest.approx(19.00, abs=0.005)
    assert value["end_rise_K"] == pytest.approx(3.082, abs=0.0005)
    assert value["mean_rise_K"] == pytest.approx(13.69, abs=0.005)
    assert value["current_A"] == pytest.approx(3.3107e-3, abs=5e-8)
    assert value["anchor_resistance_K_per_W"] == pytest.approx(1861.76, abs=0.005)
    assert set(value) == {
        "peak_rise_K", "end_rise_K", "mean_rise_K", "current_A", "power_W", "heat_out_W", "anchor_resistance_K_per_W",
    }  # fmt: skip
    assert result.model == "paper"
    assert all(0 < estimate.error < 1e-14 * estimate.value for estimate in result.steady.values())


def test_traces_start_at_room_and_end_in_the_steady_state():
    sink = Sink(end_time=0.05)
    result = solve(sink)
    traces, steady = result.traces, result.steady
    assert set(traces.values) == set(traces.errors) == TRACES
    assert traces.time[0] == 0
    assert traces.time[-1] == sink.end_time
    for key in ("peak", "end", "mean"):
        assert traces.values[f"{key}_K"][0] == 293
        # After 36 time constants.
        assert traces.values[f"{key}_K"][-1] - 293 == pytest.approx(steady[f"{key}_rise_K"].value, abs=1e-8)
    assert traces.values["current_A"][0] == relative(1 / 300, 1e-14)


@pytest.mark.parametrize("end_time", [1e-9, 3e-4, 0.0123, 0.7, 100.0])
def test_times_run_from_zero_to_exactly_the_end_time(end_time):
    # 100 s is 73,000 time constants: the approach has long been lost in rounding, and the last line is level.
    time = solve(Sink(end_time=end_time)).traces.time
    assert (time[0], time[-1]) == (0, end_time)
    assert np.all(np.diff(time) > 0)


@given(sinks())
@settings(max_examples=40, deadline=None, derandomize=True)
def test_straight_lines_between_the_times_keep_the_accuracy(sink):
    traces = solve(sink).traces
    assert np.all(np.diff(traces.time) > 0)
    between = (traces.time[:-1, None] + np.diff(traces.time)[:, None] * np.linspace(0, 1, 9)).ravel()
    exact = solve(sink, times=between).traces.values
    for key in ("peak_K", "end_K", "mean_K", "current_A", "power_W"):
        deviation = np.abs(np.interp(between, traces.time, traces.values[key]) - exact[key])
        if key.endswith("_K"):
            scale = abs(traces.values[key][-1] - sink.room_temperature)
            # Absolute temperatures carry the rounding of room temperature.
            assert np.all(deviation <= sink.accuracy * scale + 1e-13 * sink.room_temperature)
        else:
            assert np.all(deviation <= sink.accuracy * np.abs(exact[key]))


@pytest.mark.parametrize("feedback", [-0.24, -0.1, 0.0, 0.7, 30.0])
def test_traces_are_eq_20_by_an_independent_integrator(feedback):
    """Dormand and Prince of order 8 on C dT/dt = V^2 / (R (1 + a T)) - G T."""
    model = lump(Device())
    C, G, R = float(model.capacity[0]), model.conductance, float(model.resistance[0])
    change = feedback * R * G / 4.0  # at 2 V
    silicon = dataclasses.replace(SILICON, temperature_coefficient=change)
    times = np.array([0.0, 1e-5, 1e-4, 1e-3, 5e-3, 2e-2])
    exact = solve_ivp(
        lambda _, T: (4.0 / (R * (1 + change * T)) - G * T) / C, (0, times[-1]), [0.0], "DOP853", times, rtol=1e-13,
        atol=1e-15,
    ).y[0]  # fmt: skip
    traces = solve(Sink(voltage=2.0, silicon=silicon), times=times).over_time
    off = np.abs(traces.values["mean_K"] - 293 - exact)
    assert off.max() <= traces.errors["mean_K"] + 1e-12 < 1e-4 * exact[-1]
    assert np.abs(traces.values["mean_K"] - 293 - 1.001 * exact).max() > 1e-4 * exact[-1]


@given(sinks())
@settings(max_examples=40, deadline=None, derandomize=True)
def test_heat_out_and_air_loss_are_the_power(sink):
    result = solve(sink, steady_only=True)
    value = {key: estimate.value for key, estimate in result.steady.items()}
    # Steady balance, lost in the double root's conditioning for feedbacks up to -0.24: some 10 eps.
    balance = value["heat_out_W"] + result.details["air_loss_W"]
    assert balance == relative(value["power_W"], 1e-13)
    assert value["power_W"] == relative(sink.voltage * value["current_A"], 1e-13)
    dT0 = value["peak_rise_K"] - value["end_rise_K"]
    assert equivalent_rise(dT0, value["end_rise_K"]) == relative(value["mean_rise_K"], 1e-13)
    assert result.traces is None


def test_negative_voltage_turns_the_current_and_nothing_else():
    forward, backward = solve(Sink(voltage=2.0)), solve(Sink(voltage=-2.0))
    for key, estimate in forward.steady.items():
        sign = -1 if key == "current_A" else 1
        assert backward.steady[key].value == sign * estimate.value
        assert backward.steady[key].error == estimate.error
    assert np.array_equal(backward.traces.values["current_A"], -forward.traces.values["current_A"])
    assert np.array_equal(backward.traces.values["peak_K"], forward.traces.values["peak_K"])


def test_room_temperature_away_from_the_reference_changes_the_cold_current():
    traces = solve(Sink(room_temperature=313.0)).traces
    assert traces.values["current_A"][0] == relative(1 / (300 * (1 + 5e-4 * 20)), 1e-14)
    assert traces.values["mean_K"][0] == 313


def test_runaway_is_reported_with_the_voltage_it_starts_at():
    falling = dataclasses.replace(SILICON, temperature_coefficient=-2e-3)
    limit = solve(Sink(silicon=falling)).details["runaway_voltage_V"]
    solve(Sink(silicon=falling, voltage=0.9999 * limit))
    for steady_only in (True, False):
        with pytest.raises(RunawayError, match=f"above {limit:.6g} V"):
            solve(Sink(silicon=falling, voltage=-1.0001 * limit), steady_only=steady_only)
    assert solve(Sink()).details["runaway_voltage_V"] is None
