"""The accurate scheme: against itself refined, an independent solution, and the closed form."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from reduced1d.device.lumped import lump, modes, steady
from reduced1d.device.schemes import solve_accurate
from scenes.device import Control, Device, External
from statespace.march import march
from statespace.result import QUANTITIES

GOAL = 1e-4


def run(device, resolution):
    degree, nodes = resolution
    return march(modes(lump(device), degree), nodes, device, 1e-11)


def short(device, end, step):
    return replace(device, end_time=end, external=replace(device.external, step_time=step))


@pytest.fixture(scope="module")
def default():
    return solve_accurate(Device())


def test_default_device_is_converged_and_within_its_own_error(default):
    finest = run(Device(), (24, 12)).traces
    off = {q: np.abs(default.trace(q) - 293 * q.endswith("_K") - finest[:, i]).max() for i, q in enumerate(QUANTITIES)}
    assert max(off["sink_K"], off["sensor_K"]) < GOAL
    assert all(off[q] < default.errors[q] for q in QUANTITIES)
    assert max(default.errors["sink_K"], default.errors["sensor_K"]) < GOAL
    coarse = run(Device(end_time=0.01), (4, 2)).traces
    assert np.abs(coarse[:, :2] - finest[: len(coarse), :2]).max() > GOAL  # the tolerance sees a coarse run


@pytest.mark.parametrize(
    "device",
    [
        Device(control=Control(2e-5, 0.2, 0.02), sensor_thickness=50e-9, insulator_thickness=2e-6, end_time=0.004,
               external=External(293, 213, 0.002)),
        Device(control=Control(5e-2, 0.5, 0.05), insulator_thickness=20e-6, end_time=1,
               external=External(293, 273, 0.5)),
        Device(control=Control(5e-3, 4.7, 0.05), end_time=0.25, external=External(280, 313, 0.1234)),
        Device(polymer_thickness=1e-3, end_time=0.02, external=External(293, 213, 0.01)),
    ],
)  # fmt: skip
def test_error_estimate_holds_elsewhere(device):
    result = solve_accurate(device)
    finest = run(device, (36, 20)).traces
    for i, q in enumerate(QUANTITIES):
        assert np.abs(result.trace(q) - 293 * q.endswith("_K") - finest[:, i]).max() < result.errors[q]
    assert max(result.errors["sink_K"], result.errors["sensor_K"]) < GOAL


def test_first_sample_raises_the_voltage_by_the_gain_and_it_holds_from_there(default):
    assert (default.time_s[0], len(default.time_s)) == (0.0, 5001)
    assert (default.sink_V[0], default.sensor_V[0]) == (1.0, 0.05)
    assert (default.sink_K[0], default.sensor_K[0]) == (293.0, 293.0)
    assert default.sink_power_W[0] == pytest.approx(1 / 300, rel=1e-12)
    raised = np.maximum(default.sink_V[:-1] + 1 - (default.sink_K[1:] - 293) / 17.5, 0)
    assert_allclose(default.sink_V[1:], raised, atol=1e-12)


def test_steady_powers(default):
    device = Device()
    for sample, external in ((2499, 293.0), (5000, 273.0)):
        state = steady(device, external)
        for q in ("sink_power_W", "sensor_power_W", "polymer_flux_W"):
            assert default.trace(q)[sample] == pytest.approx(getattr(state, q), rel=1e-8)
        assert state.sensor_power_W == pytest.approx(0.15 * 1e-7 / 100e-6 * (310.5 - external), rel=1e-12)
    assert default.sensor_power_W[2600] != pytest.approx(steady(device).sensor_power_W, rel=1e-3)


def test_runs_of_one_sample_and_steps_at_the_ends():
    one = solve_accurate(Device(end_time=5e-5))
    assert (len(one.time_s), one.sink_V[0], one.polymer_flux_W[0]) == (1, 1.0, 0.0)
    at_once = solve_accurate(Device(external=External(300.0, 273.0, 0.0), end_time=0.01))
    from_start = solve_accurate(Device(external=External(273.0, 273.0, 0.25), end_time=0.01))
    assert_allclose(at_once.sensor_K, from_start.sensor_K, rtol=0, atol=1e-10)
    at_end = solve_accurate(Device(external=External(293.0, 273.0, 0.01), end_time=0.01))
    assert_allclose(at_end.sensor_K, solve_accurate(Device(end_time=0.01)).sensor_K, rtol=0, atol=1e-10)


def test_settled_start_stays_put():
    device = Device(external=External(283.0, 273.0, 0.01), end_time=0.02)
    result = solve_accurate(device, start="settled")
    assert np.abs(result.sensor_K[:100] - 310.5).max() < 1e-9
    assert result.sensor_power_W[0] == pytest.approx(steady(device, 283.0).sensor_power_W, rel=1e-12)
    assert np.abs(result.sensor_K[100:] - 310.5).max() > 1e-3


def finite_volumes(device, cells, samples):
    """The same device by cell-centred finite volumes and LSODA: rises (samples, 2)."""
    m, control = lump(device), device.control
    faces, links, C = 1 + 2 * cells, [], [m.capacity[0]]
    for slab in (m.insulator, m.polymer):
        size = np.diff((1 - np.cos(np.pi * np.arange(cells + 1) / cells)) / 2 * slab.thickness)
        gaps = np.r_[size[0] / 2, (size[1:] + size[:-1]) / 2, size[-1] / 2]
        links.append(slab.conductivity * slab.area / gaps)
        C += [*(slab.heat_capacity * slab.area * size), m.capacity[1]]
    C, g, film = np.array(C[:-1]), np.concatenate(links), cells + 1

    def rate(_, T, heating):
        flow = g * -np.diff(np.r_[T, 0.0])
        net = np.r_[0.0, flow[:-1]] - flow
        net[0] += heating[0] / (1 + m.coefficient[0] * T[0]) - m.conductance * T[0]
        net[film] += heating[1] / (1 + m.coefficient[1] * T[film])
        return net / C

    T, V, found = np.zeros(faces + 1), np.zeros(2), []
    for _ in range(samples):
        found.append(T[[0, film]])
        V = np.maximum(V + np.array([control.sink_gain, control.sensor_gain]) * (1 - T[[0, film]] / 17.5), 0)
        T = solve_ivp(rate, (0, control.sample_time), T, "LSODA", args=(V**2 / m.resistance,), rtol=1e-8, atol=1e-9,
                      lband=1, uband=1).y[:, -1]  # fmt: skip
    return np.array(found)


@pytest.mark.long
def test_an_independent_solution_converges_to_it_at_second_order():
    device = Device(end_time=0.0012)
    accurate = run(device, (12, 6)).traces[:, :2]
    errors = [np.abs(finite_volumes(device, n, len(accurate)) - accurate).max() for n in (12, 24, 48)]
    assert_allclose(np.log2(np.array(errors[:-1]) / errors[1:]), 2.0, atol=0.3)
    assert errors[-1] < 0.02


def test_convergence_in_space_and_time_is_spectral():
    device = short(Device(), 0.012, 0.004)
    best = run(device, (24, 14)).traces[:, :2]
    space = [np.abs(run(device, (d, 14)).traces[:, :2] - best).max() for d in (5, 8, 11)]
    time = [np.abs(run(device, (24, q)).traces[:, :2] - best).max() for q in (2, 4, 6)]
    assert space[0] > 20 * space[1] > 400 * space[2]
    assert time[0] > 10 * time[1] > 100 * time[2]


def test_heat_that_leaves_the_sink_enters_the_sensor():
    device = Device(control=Control(sensor_gain=0.0), external=External(293, 293, 1.0), end_time=0.4)
    result = solve_accurate(device)
    state = steady(device)
    assert 293 < state.sensor_K < 310.5
    assert result.sensor_K[-1] == pytest.approx(state.sensor_K, abs=1e-6)
    g = lump(device)
    series = 1 / (1 / g.insulator.conductance + 1 / g.polymer.conductance)
    assert result.sink_power_W[-1] == pytest.approx((g.conductance + series) * 17.5, rel=1e-8)


@pytest.mark.parametrize("sample_time", [2e-5, 1e-3, 5e-2])
@pytest.mark.parametrize(("sink_gain", "sensor_gain"), [(0.0, 0.0), (0.3, 0.03), (20.0, 0.0), (0.3, 3.0)])
def test_no_setting_breaks_it(sample_time, sink_gain, sensor_gain):
    # Each of the two layouts meets every sample time and every pair of gains.
    thin = (sample_time == 1e-3) == (sink_gain > sensor_gain)
    gold, insulator, outer = (50e-9, 2e-6, 213.0) if thin else (0.2e-6, 20e-6, 333.0)
    control = Control(sample_time, sink_gain, sensor_gain, allow_negative_voltage=not thin)
    device = Device(sensor_thickness=gold, insulator_thickness=insulator, control=control,
                    external=External(293, outer, 20.3 * sample_time), end_time=40 * sample_time)  # fmt: skip
    result = solve_accurate(device)
    assert all(np.isfinite(result.trace(q)).all() for q in QUANTITIES)
    wild = any("unstable" in text or "stopped" in text for text in result.findings)
    assert wild or max(result.errors["sink_K"], result.errors["sensor_K"]) < GOAL
    assert result.details["stopped"] == (len(result.time_s) < 41)
