"""A lead to ground that sink and sensor share, and how the steady state follows its keys.

The references are the equations of heat and of the circuit, solved by themselves, and over time the steady state and
the loop's eigenvalue."""

from dataclasses import replace

import numpy as np
import pytest

from reduced1d.device import design
from reduced1d.device.design import make
from reduced1d.device.lumped import DEGREE, largest_eigenvalue, lump, modes, steady
from reduced1d.device.schemes import solve_accurate
from scenes.device import Device, External
from scenes.errors import SceneError
from statespace import circuit
from statespace.result import QUANTITIES
from statespace.stability import NARROW, held_range


def grounded(device: Device, resistance: float) -> Device:
    """The device with a lead of a resistance (ohm)."""
    return replace(device, control=replace(device.control, ground_resistance=resistance))


def off(device: Device, ground: float, outer: float) -> np.ndarray:
    """Return the residuals of both heat balances (relative to the powers) and of both controllers (relative to their
    set points) at the steady state: by currents from the voltages, Kirchhoff's laws solved as a linear system."""
    lumped, state = lump(device), steady(device, outer)
    rise = np.array([state.sink_K, state.sensor_K]) - 293.0
    warm = lumped.resistance * (1 + lumped.coefficient * rise)
    voltage, power = np.array([state.sink_V, state.sensor_V]), np.array([state.sink_power_W, state.sensor_power_W])
    current = np.linalg.solve(np.diag(warm) + ground, voltage)
    between, outside = lumped.insulator.conductance, lumped.polymer.conductance
    lost = [
        lumped.conductance * rise[0] + between * (rise[0] - rise[1]),
        between * (rise[1] - rise[0]) + outside * (rise[1] - (outer - 293.0)),
    ]
    seen = lumped.resistance * (1 + lumped.coefficient * lumped.set_rise)
    return np.r_[lost / power - 1, current**2 * warm / power - 1, voltage / current / seen - 1]


@pytest.mark.parametrize(("ground", "outer"), [(1e-6, 273.0), (1e-3, 293.0), (1e-2, 273.0), (2e-2, 230.0)])
def test_steady_state_fulfils_heat_balances_and_circuit(ground, outer):
    device = grounded(Device(), ground)
    assert np.abs(off(device, ground, outer)).max() < 1e-9
    assert np.abs(off(device, ground * 1.001, outer)).max() > 1e-9


def test_ten_milliohms_take_more_than_half_of_the_sensors_power():
    """By hand: 4.2 mohm/K of the gold film, a sixteenth of its current in the sink, and 10 mohm."""
    state = steady(grounded(Device(), 1e-2))
    assert state.sensor_K - 310.5 == pytest.approx(-1.06 * 10 / 4.2, rel=0.06)
    assert state.sensor_power_W < 0.5 * steady(Device()).sensor_power_W


def test_no_lead_is_the_run_without_one():
    device = Device(end_time=0.02, external=External(293.0, 273.0, 0.01))
    without = solve_accurate(device)
    traces = np.array([without.trace(q) for q in QUANTITIES])
    for ground, least, most in ((1e-13, 0.0, 1e-9), (1e-4, 1e-4, 1.0)):
        found = solve_accurate(grounded(device, ground))
        apart = np.abs(np.array([found.trace(q) for q in QUANTITIES]) - traces).max(axis=1)
        relative = (apart / np.abs(traces).max(axis=1)).max()
        assert least <= relative <= most


def test_a_run_comes_to_the_steady_state_as_fast_as_its_eigenvalue_says():
    device = grounded(Device(end_time=0.3, external=External(273.0, 263.0, 0.2)), 5e-3)
    found, state = solve_accurate(device), steady(device, 273.0)
    last = int(np.searchsorted(found.time_s, 0.2)) - 1
    away = found.sensor_power_W - state.sensor_power_W
    assert abs(away[last]) < 1e-6 * state.sensor_power_W
    assert found.sink_K[last] == pytest.approx(state.sink_K, abs=1e-6)
    early = int(0.08 / 1e-4)
    measured = (away[early] / away[early - 200]) ** (1 / 200)
    assert measured == pytest.approx(abs(largest_eigenvalue(device, 273.0)), rel=2e-5)
    assert measured != pytest.approx(abs(largest_eigenvalue(Device(), 273.0)), rel=2e-5)


def test_powers_are_those_in_the_films():
    device = grounded(Device(end_time=0.01), 0.05)
    found, lumped = solve_accurate(device), lump(device)
    rise = np.column_stack([found.sink_K, found.sensor_K]) - 293.0
    warm = lumped.resistance * (1 + lumped.coefficient * rise)
    voltage = np.column_stack([found.sink_V, found.sensor_V])
    current = np.array([np.linalg.solve(np.diag(r) + 0.05, v) for r, v in zip(warm, voltage, strict=True)])
    power = np.column_stack([found.sink_power_W, found.sensor_power_W])
    np.testing.assert_allclose(power, current**2 * warm, rtol=1e-11, atol=1e-18)
    assert not np.allclose(power, voltage**2 / warm, rtol=1e-3)


def test_what_is_measured_without_a_current_is_by_a_test_current():
    resistance, voltage = np.array([300.0, 1.2]), np.array([1.0, 0.0])
    assert circuit.measured(voltage, resistance, 0.01)[1] == 1.21
    np.testing.assert_allclose(circuit.measured(0 * voltage, resistance, 0.01), [300.01, 1.21], rtol=1e-15)


def test_the_range_ends_where_the_sensor_cannot_be_held():
    device = grounded(Device(), 1e-2)
    lowest, highest = held_range(modes(lump(device), DEGREE), device)
    step = 2 * NARROW * device.set_rise
    for inside, outside in ((highest, highest + step), (lowest, lowest - step)):
        state = steady(device, inside)
        assert not any((state.cycles, state.sink_saturated, state.sensor_saturated))
        beyond = steady(device, outside)
        assert beyond.cycles or beyond.sensor_saturated or beyond.sink_saturated
    assert held_range(modes(lump(device), DEGREE), Device()) == (0.0, 310.5)
    found = design.measurable_range(device, power=4e-3)
    assert found.highest_K == highest
    assert steady(device, found.lowest_K).sensor_power_W == pytest.approx(4e-3, rel=2e-3)


def test_where_no_steady_state_is_it_says_so():
    device = grounded(Device(external=External(293.0, 280.0, 0.1), end_time=0.15), 1e-2)
    assert steady(device).cycles
    found = solve_accurate(device)
    assert any("there is no steady state" in said for said in found.findings)
    last = found.sensor_V[-200:]
    assert np.ptp(last) > 0.5 * last.max()


def test_loop_reaches_the_steady_state_of_a_large_lead():
    """The sensor is seen with the lead in series, above the set temperature, and stays without voltage."""
    device = grounded(Device(external=External(233.0, 233.0, 1.0), end_time=0.25), 0.1)
    state, found = steady(device), solve_accurate(device, with_findings=False)
    assert not state.cycles
    assert state.sensor_V == found.sensor_V[-1] == 0
    assert found.sink_V[-1] == pytest.approx(state.sink_V, rel=1e-9)
    assert found.sensor_K[-1] == pytest.approx(state.sensor_K, abs=1e-6)


def test_a_sensor_that_lost_its_current_stays_without():
    """At 293 K outside it has none, at 273 K it could be held again; from cold, with a large current, it is."""
    lost, cold = (
        grounded(Device(external=External(before, 273.0, 0.1), end_time=0.2), 1e-2) for before in (293.0, 273.001)
    )
    state, stuck, held = steady(lost), solve_accurate(lost), solve_accurate(cold)
    assert not state.sensor_saturated
    assert not state.cycles
    assert stuck.sensor_power_W[-1] < 1e-2 * state.sensor_power_W
    assert any("the sensor's loop swings from no voltage on" in said for said in stuck.findings)
    assert held.sensor_power_W[-1] == pytest.approx(state.sensor_power_W, rel=1e-3)
    assert not any("swings" in said for said in held.findings)


def test_the_papers_scheme_refuses_it():
    with pytest.raises(SceneError, match=r"control\.ground_resistance = 0\.01 needs the accurate scheme"):
        make(replace(grounded(Device(), 1e-2), end_time=0.01), "paper", None, False, False, lambda _: None)
