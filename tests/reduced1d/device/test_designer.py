"""Questions of a designer: range, resolution, smooth starts, settling and largest stable gains."""

from dataclasses import replace

import numpy as np
import pytest

from reduced1d.device.design import MAX1367, PXI_4070, in_the_loop, measurable_range, resolution, too_coarse
from reduced1d.device.lumped import plant, stability, steady
from reduced1d.device.schemes import solve_accurate
from scenes.device import Control, Device, External
from statespace.result import settling_time


def test_beyond_the_set_point_the_sensor_saturates():
    device = Device(external=External(293, 320, 0.1), end_time=0.4)
    state, result = steady(device), solve_accurate(device)
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
    ohm, watt = PXI_4070.steps(state.sensor_V, state.sensor_power_W)
    # 82 mV are read to 0.1 uV, and 69 mA to 0.1 uA.
    current = state.sensor_power_W / state.sensor_V
    worst = (state.sensor_V + 1e-7) / (current - 1e-7)
    assert worst - state.sensor_V / current == pytest.approx(ohm, rel=1e-4)
    assert (state.sensor_V + 1e-7) * (current + 1e-7) - state.sensor_power_W == pytest.approx(watt, rel=1e-4)
    with pytest.raises(ValueError, match="beyond the largest range"):
        PXI_4070.steps(1.0, 5.0)


def test_quantisation_in_the_loop():
    device = Device(end_time=0.15, external=External(293, 293, 1.0))
    rounded = [in_the_loop(device, meter, 293.0) for meter in (PXI_4070, MAX1367)]
    ideal, good, poor = (solve_accurate(device, meter=steps) for steps in ((0.0, 0.0), *rounded))
    steps = np.array(in_the_loop(device, PXI_4070)) / (np.array([300 * 5e-4, 1.115 * 3.768e-3]))
    last = slice(-500, None)
    assert np.ptp(ideal.sensor_K[last]) < 1e-4
    assert 1e-4 < np.ptp(good.sink_K[last]) < 5 * steps[0]
    assert np.ptp(poor.sink_K[last]) > 20 * np.ptp(good.sink_K[last])
    assert [bool(too_coarse(device, steps)) for steps in rounded] == [False, True]


def test_settling_time_of_an_exponential():
    t = np.linspace(0, 10, 2001)
    assert settling_time(t, 1 + np.exp(-t), 1.0, 0.01) == pytest.approx(np.log(100), abs=1e-4)
    assert settling_time(t, 1 + np.exp(-t), 1.0, 1e-6) == float("inf")
    assert settling_time(t, np.ones_like(t), 1.0, 1e-6) == 0.0


NAMES = ("sink_gain", "sensor_gain")


def with_gain(device, element, gain):
    return replace(device, control=replace(device.control, **{NAMES[element]: gain}))


def disturbed(device, samples):
    """Deviations from the set point after a step of 1 mK outside, settled before."""
    h = device.control.sample_time
    device = replace(device, external=External(273.0, 273.001, 2 * h), end_time=samples * h, accuracy=1e-4)
    result = solve_accurate(device, start="settled", with_findings=False)
    return np.abs(np.column_stack([result.sink_K, result.sensor_K]) - 310.5).max(axis=1)


@pytest.mark.parametrize("sample_time", [1e-4, 1e-3, 5e-3])
@pytest.mark.parametrize("element", [0, 1])
def test_largest_stable_gain_by_simulation(element, sample_time):
    device = Device(control=Control(sample_time, 0.5, 0.05))
    predicted = stability(device)
    limit = predicted.sink_gain_limit if element == 0 else predicted.sensor_gain_limit
    below, above = (disturbed(with_gain(device, element, factor * limit), 300) for factor in (0.97, 1.03))
    assert below[-40:].max() < 0.7 * below.max()
    assert above[-40:].max() > 100 * above[40:60].max()


def test_growth_rate_by_simulation():
    device = with_gain(Device(control=Control(1e-3, 0.5, 0.05)), 1, 1.3 * stability(
        Device(control=Control(1e-3, 0.5, 0.05))).sensor_gain_limit)  # fmt: skip
    away = disturbed(device, 60)
    early, late = 20, 30
    measured = np.log(away[late] / away[early]) / ((late - early) * 1e-3)
    assert measured == pytest.approx(stability(device).growth_rate, rel=0.01)
    assert stability(device).growth_rate > 0


def test_instability_is_a_finding_with_its_growth_rate():
    device = Device(control=Control(1e-3, 0.5, 2.0), end_time=0.1, external=External(293, 273, 0.05))
    result = solve_accurate(device)
    text = " ".join(result.findings)
    assert f"grow at {stability(device).growth_rate:.4g} 1/s" in text
    assert f"its largest eigenvalue per sample is {stability(device).eigenvalue.real:.4g}" in text
    assert np.isfinite(result.sensor_K).all()
    assert "instability" not in " ".join(solve_accurate(with_gain(device, 1, 0.05)).findings)
    assert "unstable" not in " ".join(solve_accurate(with_gain(device, 1, 0.05)).findings)


def test_the_overshoot_at_a_fixed_gain_is_smaller_at_slow_sampling():
    peak = {h: solve_accurate(Device(control=Control(h, 0.5, 0.05), end_time=0.1)).sink_K.max() for h in (1e-4, 5e-3)}
    assert peak[5e-3] < peak[1e-4] - 1


def test_no_gain_means_no_feedback_and_no_power_no_response():
    assert abs(plant(Device()).eigenvalue(np.zeros(2))) < 1
    hot = stability(Device(external=External(293, 330, 0.25)))
    assert (hot.sensor_gain_limit, hot.stable) == (float("inf"), True)


def test_literal_eq_21_runs_away():
    literal = Device(control=Control(allow_negative_voltage=True))
    result = solve_accurate(literal)
    negative = result.time_s[result.sink_V < 0][0]
    assert 1.3e-3 < negative < 1.6e-3
    assert result.sink_K.max() - 293 > 2000
    assert result.time_s[-1] < 0.01
    assert np.isfinite(result.sink_K).all()
    assert "stopped" in result.findings[0]
    assert "negative" in result.findings[0]
    assert solve_accurate(Device(end_time=0.02)).sink_K.max() < 321
