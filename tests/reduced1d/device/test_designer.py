"""What a designer asks: range, resolution, smooth starts, settling; and inputs that make no device."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import compare
from reduced1d.device import solve
from reduced1d.device.accurate import solve_accurate
from reduced1d.device.design import limiter_acts, measurable_range, resolution, smooth_start_gain
from reduced1d.device.lumped import steady
from reduced1d.device.meters import MAX1367, PXI_4070, in_the_loop, reading
from reduced1d.equations import anchor_flow
from scenes.device import GOLD, Control, Device, External
from scenes.errors import SceneError
from scenes.loop.runs import settling, settling_time


def test_steady_state_of_the_default_device():
    state = steady(Device(), 293.0)
    assert state.sensor_power_W == pytest.approx(1.5e-4 * 17.5, rel=1e-12)
    assert state.sink_power_W == pytest.approx(anchor_flow(17.5, 1861.7614, 130, 2e-10, 1e-3), rel=1e-6)
    assert (state.sink_saturated, state.sensor_saturated) == (False, False)


def test_beyond_the_set_point_the_sensor_saturates():
    device = Device(external=External(293, 320, 0.1), end_time=0.4)
    state, result = steady(device), solve(device)
    assert (state.sensor_saturated, state.sensor_power_W) == (True, 0.0)
    assert state.sensor_K > 310.5
    assert result.sensor_power_W[-1] == 0
    assert result.sensor_K[-1] == pytest.approx(state.sensor_K, abs=1e-6)
    assert result.sink_power_W[-1] == pytest.approx(state.sink_power_W, rel=1e-7)
    assert any("needs no power" in text for text in result.findings)


def test_at_the_set_point_itself_the_sensor_needs_nothing():
    state = steady(Device(), 310.5)
    assert state.sensor_power_W == pytest.approx(0.0, abs=1e-15)
    assert not state.sensor_saturated
    assert state.sensor_K == pytest.approx(310.5, abs=1e-9)


def test_range_ends_where_the_supply_does():
    device = Device()
    found = measurable_range(device, voltage=0.1)
    assert found.highest_K == 310.5
    assert steady(device, found.lowest_K).sensor_V == pytest.approx(0.1, rel=1e-9)
    by_power = measurable_range(device, power=0.009)
    assert by_power.lowest_K == pytest.approx(250.5, rel=1e-12)
    assert measurable_range(device, voltage=1e3).lowest_K == 0.0
    with pytest.raises(ValueError, match="largest voltage or power"):
        measurable_range(device)


def test_resolution_of_the_built_in_meters():
    device = Device()
    good, poor = resolution(device, PXI_4070), resolution(device, MAX1367)
    assert good.power == pytest.approx(good.sensor_power_W / 1.5e-4, rel=1e-12)
    assert good.total < 0.5 < 5 < poor.total
    assert good.sink > 10 * good.sensor  # the sink's small coefficient, times g_insulator/g_polymer = 10
    state = steady(device)
    step = reading(PXI_4070, state.sensor_V, state.sensor_power_W)
    worst = (state.sensor_V + step.voltage) / (state.sensor_power_W / state.sensor_V - step.current)
    nominal = state.sensor_V**2 / state.sensor_power_W
    assert worst - nominal == pytest.approx(step.resistance, rel=1e-4)
    with pytest.raises(ValueError, match="beyond the largest range"):
        reading(PXI_4070, 1.0, 5.0)


def test_quantisation_in_the_loop():
    device = Device(end_time=0.15, external=External(293, 293, 1.0))
    ideal, good, poor = solve(device), solve(device, meter=PXI_4070), solve(device, meter=MAX1367)
    steps = np.array(in_the_loop(device, PXI_4070)) / (np.array([300 * 5e-4, 1.115 * 3.768e-3]))
    last = slice(-500, None)
    assert np.ptp(ideal.sensor_K[last]) < 1e-4
    assert 1e-4 < np.ptp(good.sink_K[last]) < 5 * steps[0]
    assert np.ptp(poor.sink_K[last]) > 20 * np.ptp(good.sink_K[last])
    assert any("too coarse" in text for text in poor.findings)
    assert not any("too coarse" in text for text in good.findings)


@pytest.mark.parametrize(("element", "expected"), [(0, (0.2, 0.6)), (1, (0.055, 0.08))])
def test_smooth_start(element, expected):
    device = Device()
    gain = smooth_start_gain(device, element)
    assert expected[0] < gain < expected[1]
    name = ("sink_gain", "sensor_gain")[element]
    for factor, acts in ((0.98, False), (1.02, True)):
        tried = replace(device, control=replace(device.control, **{name: factor * gain}))
        assert limiter_acts(tried, element) is acts
        traced = solve(replace(tried, end_time=0.05))
        assert ((traced.sink_V, traced.sensor_V)[element] == 0).any() == acts


def test_settling_time_of_an_exponential():
    t = np.linspace(0, 10, 2001)
    assert settling_time(t, 1 + np.exp(-t), 1.0, 0.01) == pytest.approx(np.log(100), abs=1e-4)
    assert settling_time(t, 1 + np.exp(-t), 1.0, 1e-6) == float("inf")
    assert settling_time(t, np.ones_like(t), 1.0, 1e-6) == 0.0


def test_same_settling_time_for_all_steps_but_the_saturated_one():
    times = {}
    for step in (-80.0, -20.0, 10.0, 20.0):
        device = Device(external=External(293, 293 + step, 0.13), end_time=0.3)
        times[step] = settling(device, solve_accurate(device, with_findings=False), "sensor_power_W")[1].time
    assert times[-80.0] == pytest.approx(0.0507, abs=5e-4)
    assert times[-20.0] == pytest.approx(times[-80.0], rel=0.01)
    assert times[10.0] == pytest.approx(times[-80.0], rel=0.01)
    assert times[20.0] < 0.7 * times[-80.0]


@pytest.mark.parametrize(
    ("device", "says"),
    [
        (Device(control=Control(set_temperature=290.0)), "control.set_temperature = 290 K asks for cooling"),
        (Device(control=Control(sample_time=0.0)), "control.sample_time = 0.0 is out of range"),
        (Device(control=Control(sink_gain=-1.0)), "control.sink_gain = -1.0 is out of range"),
        (Device(polymer_thickness=0.0), "device.polymer_thickness = 0.0 is out of range"),
        (Device(gold=replace(GOLD, resistivity=None)), "materials.gold.resistivity = None is missing"),
        (
            Device(gold=replace(GOLD, temperature_coefficient=0.0)),
            "leaves the controllers without a signal",
        ),
        (Device(external=External(293, 10.0, 0.25)), "makes the resistivity .* at external.final_temperature = 10"),
    ],
)
def test_what_makes_no_device_is_said_in_a_sentence(device, says):
    with pytest.raises(SceneError, match=says):
        compare.device(device)
