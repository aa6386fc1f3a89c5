"""The controllers' limits: eigenvalues of the sampled map against simulations."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from reduced1d.device import solve
from reduced1d.device.accurate import solve_accurate
from reduced1d.device.stability import plant, stability
from scenes.device import Control, Device, External

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
    result = solve(device)
    text = " ".join(result.findings)
    assert f"grow at {stability(device).growth_rate:.4g} 1/s" in text
    assert f"its largest eigenvalue per sample is {stability(device).eigenvalue.real:.4g}" in text
    assert np.isfinite(result.sensor_K).all()
    assert "instability" not in " ".join(solve(with_gain(device, 1, 0.05)).findings)
    assert "unstable" not in " ".join(solve(with_gain(device, 1, 0.05)).findings)


def test_the_overshoot_at_a_fixed_gain_is_smaller_at_slow_sampling():
    peak = {h: solve(Device(control=Control(h, 0.5, 0.05), end_time=0.1)).sink_K.max() for h in (1e-4, 5e-3)}
    assert peak[5e-3] < peak[1e-4] - 1


def test_no_gain_means_no_feedback_and_no_power_no_response():
    assert abs(plant(Device()).eigenvalue(np.zeros(2))) < 1
    hot = stability(Device(external=External(293, 330, 0.25)))
    assert (hot.sensor_gain_limit, hot.stable) == (float("inf"), True)


def test_literal_eq_21_runs_away():
    literal = Device(control=Control(allow_negative_voltage=True))
    result = solve(literal)
    negative = result.time_s[result.sink_V < 0][0]
    assert 1.3e-3 < negative < 1.6e-3
    assert result.sink_K.max() - 293 > 2000
    assert result.time_s[-1] < 0.01
    assert np.isfinite(result.sink_K).all()
    assert "stopped" in result.findings[0]
    assert "negative" in result.findings[0]
    assert solve(Device(end_time=0.02)).sink_K.max() < 321
