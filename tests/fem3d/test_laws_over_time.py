"""Properties that follow the temperature, over time: against the method of lines of Kirchhoff's variable, a second path
on scikit-fem's own elements, closed forms, constant properties and the steady state."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fem3d.runs import sink as sinks
from fem3d.runs.scene import solve
from scenes.errors import RunawayInTimeError
from scenes.free import from_dict
from scenes.laws import PowerLaw, Table
from tests.fem3d.test_laws import COLD, FALLING, LENGTH, POWER, RHO, K, bar, of_sink

CAPACITY = {"density": 2330.0, "specific_heat": 700.0}
SLOWEST = LENGTH**2 * 2330.0 * 700.0 / (np.pi**2 * K)


def over(law, end_time, times=(), accuracy=1e-3, volts=None, source=0.0, **material):
    """The bar of the steady tests, between cold ends, heated from time 0 on."""
    given = bar(law, volts=volts, accuracy=accuracy, **(CAPACITY | material))
    given["box"][0]["heat_source"] = source
    given["run"] = {"end_time": end_time, "accuracy": accuracy}
    if len(times):
        given["run"]["output_times"] = [*times]
    return given


def at(found, name, times):
    return np.interp(times, found.over_time.time, found.over_time.values[name])


def lines(law, source, times, intervals=200, capacity=lambda T: 2330.0 * 700.0):
    """(times,): the temperature (K) in the middle of the bar by the method of lines, C dT/dt = theta_xx + q with theta
    the integral of k from COLD on, on equal intervals of one half."""
    h = LENGTH / 2 / intervals

    def rate(_, rise):
        theta = law.integral(COLD + rise) - law.integral(np.array(COLD))
        return (np.diff(theta, 2, prepend=0.0, append=theta[-2]) / h**2 + source) / capacity(COLD + rise)

    options = {"lband": 1, "uband": 1, "rtol": 1e-8, "atol": 1e-6}
    return COLD + solve_ivp(rate, (0.0, times[-1]), np.zeros(intervals), "LSODA", times, **options).y[-1]


@pytest.mark.long
@pytest.mark.parametrize(("law", "twin", "accuracy"), [
    (PowerLaw(K, COLD, -1.3), {"exponent": -1.313}, 1e-3),
    # Bends that move through long cells take a mesh after the other: more than a minute at 1e-3.
    (Table((350.0, 420.0, 600.0), (130.0, 60.0, 90.0)), {"values": (130.0, 63.0, 90.0)}, 1e-2),
])  # fmt: skip
def test_a_heated_bar_is_as_hot_as_kirchhoff_s_variable_has_it(law, twin, accuracy):
    times, source = np.array([0.05, 0.3, 1.0, 4.0]) * SLOWEST, 2e13
    found = solve(from_dict(over(vars(law), times[-1], times, accuracy, source=source)))

    error, exact = found.over_time.errors["at"], lines(law, source, times)
    assert error < accuracy * (exact.max() - COLD)
    assert np.abs(at(found, "at", times) - exact).max() <= error
    assert np.abs(at(found, "at", times) - lines(replace(law, **twin), source, times)).max() > error
    assert found.details["transient_imbalance"] < 1e-4


@pytest.mark.long
def test_a_law_that_is_constant_changes_nothing():
    """Two of them, beside a voltage that rises and a temperature that jumps."""
    given = over(K, 2 * SLOWEST, [SLOWEST], volts=0.4)
    given["boundary"][0]["temperature"] = {"times": [0.0, SLOWEST, SLOWEST, 1.0], "values": [COLD, COLD, 320.0, 320.0]}
    given["boundary"][3]["voltage"] = {"times": [0.0, SLOWEST / 2, 1.0], "values": [0.0, 0.4, 0.4]}
    known = solve(from_dict(given)).over_time
    constant = {"value": 1.0, "at": COLD, "exponent": 0.0}
    given["material"][0] |= {
        "thermal_conductivity": constant | {"value": K}, "resistivity": constant | {"value": RHO},
    }  # fmt: skip
    found = solve(from_dict(given)).over_time
    times = np.array([0.3, 0.6, 0.99, 1.3, 1.9]) * SLOWEST
    for name, values in found.values.items():
        mine, its = (np.interp(times, t.time, v) for t, v in ((found, values), (known, known.values[name])))
        assert np.abs(mine - its).max() <= found.errors[name] + known.errors[name], name
    given["material"][0]["thermal_conductivity"] = constant | {"value": K, "exponent": -2.0}
    twin = solve(from_dict(given)).over_time
    off = np.interp(times, twin.time, twin.values["at"]) - np.interp(times, known.time, known.values["at"])
    assert np.abs(off).max() > twin.errors["at"] + known.errors["at"]


@pytest.mark.long
def test_the_sink_ends_in_its_steady_state():
    """Its peak rises by 21.2769 K at 1 V, as the second path has it."""
    result = sinks.solve(replace(of_sink(FALLING), end_time=0.1, accuracy=1e-2))
    traces = result.over_time
    assert abs(traces.values["peak_K"][-1] - 293.0 - 21.2769) <= traces.errors["peak_K"] < 0.2
    assert abs(traces.values["peak_K"][-1] - 293.0 - 20.3324) > traces.errors["peak_K"]


@pytest.mark.long
def test_a_resistivity_that_falls_with_the_square_of_the_temperature_runs_away_when_it_must():
    """Of an insulated bar c dT/dt = H (T/T0)^2: T = T0 / (1 - H t / T0), which is 100,000 K hot just before T0 / H."""
    given = over(K, 1.0, volts=1.0, resistivity={"value": RHO, "at": COLD, "exponent": -2.0})
    given["boundary"] = [b for b in given["boundary"] if "temperature" not in b]
    given["probe"] = [{"name": "at", "at": [LENGTH / 2, 0, 0]}]
    time = COLD * RHO * LENGTH**2 * 2330.0 * 700.0
    given["run"] = {"end_time": 5 * time, "accuracy": 1e-2}
    with pytest.raises(RunawayInTimeError, match="the heating runs away at t = ") as caught:
        solve(from_dict(given))
    assert caught.value.time == pytest.approx(time, rel=5e-3)
    assert caught.value.time != pytest.approx(1.01 * time, rel=5e-3)


@pytest.mark.long
def test_specific_heat_follows_temperature():
    """The same bar, its enthalpy per volume being the state of the method of lines."""
    times, source = np.array([0.05, 0.3, 1.0, 6.0]) * SLOWEST, 2e13
    law = {"value": 700.0, "at": COLD, "exponent": 0.8}
    found = solve(from_dict(over(POWER, times[-1], times, source=source, specific_heat=law)))

    def capacity(T, factor=1.0):
        return 2330.0 * 700.0 * (T / COLD) ** (factor * 0.8)

    error, exact = found.over_time.errors["at"], lines(PowerLaw(K, COLD, -1.3), source, times, capacity=capacity)
    assert error < 1e-3 * (exact.max() - COLD)
    assert np.abs(at(found, "at", times) - exact).max() <= error
    off = lines(PowerLaw(K, COLD, -1.3), source, times, capacity=lambda T: capacity(T, 1.02))
    assert np.abs(at(found, "at", times) - off).max() > error
    assert found.details["transient_imbalance"] < 1e-4


@pytest.mark.long
def test_falling_resistivity_settles_at_its_steady_state():
    """Between cold ends 8 times the integral of k rho over the temperature is V^2, here for a rise of 80 K at 95 % of
    the largest voltage with a steady state."""
    rows = np.linspace(COLD, COLD + 400.0, 17)
    law = Table(tuple(rows), tuple(RHO * np.exp(-(rows - COLD) / 50.0)))
    volts = np.sqrt(8 * K * float(law.integral(np.array(COLD + 80.0)) - law.integral(np.array(COLD))))
    table = {"temperatures": list(law.temperatures), "values": list(law.values)}
    found = solve(from_dict(over(K, 50 * SLOWEST, volts=volts, resistivity=table)))
    assert abs(found.over_time.values["at"][-1] - COLD - 80.0) <= found.over_time.errors["at"] < 0.2
