"""Properties that follow the temperature, at rest and over time.

Kirchhoff's transform theta(T), the integral of k from the coldest temperature on, solves the linear problem; over time
the references are the method of lines, closed forms, constant properties and the steady state."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq

from fem3d.runs import sink as sinks
from fem3d.runs.scene import solve
from scenes.errors import RunawayError, RunawayInTimeError
from scenes.free import from_dict
from scenes.laws import PowerLaw, Table
from scenes.sink import SILICON, Sink
from tests.fem3d import grid_of, steady_on

LENGTH, COLD, K, RHO = 1e-4, 300.0, 130.0, 1e-5
POWER = {"value": K, "at": COLD, "exponent": -1.3}
TABLE = {"temperatures": [350.0, 420.0, 600.0], "values": [130.0, 60.0, 90.0]}


def theta(law, temperature):
    """The integral of k from COLD to a temperature (K), in W/m."""
    if "exponent" in law:
        n = law["exponent"] + 1
        return law["value"] * law["at"] / n * ((temperature / law["at"]) ** n - (COLD / law["at"]) ** n)
    rows = law["temperatures"]
    points = [COLD, *(t for t in rows if COLD < t < temperature), temperature]
    return float(np.trapezoid(np.interp(points, rows, law["values"]), points))


def inverse(law, value):
    """The temperature (K) of a theta, by bisection."""
    low, high = COLD, 1e5
    for _ in range(200):
        middle = (low + high) / 2
        low, high = (middle, high) if theta(law, middle) < value else (low, middle)
    return low


def bar(law, hot=None, volts=None, accuracy=1e-4, **material):
    """A bar along x between ends at COLD and ``hot`` (K), or both at COLD and ``volts`` apart."""
    a, b = [0, 0, 0], [LENGTH, 1e-5, 2e-6]
    ends = {"lower": a, "upper": [0, *b[1:]]}, {"lower": [LENGTH, 0, 0], "upper": b}
    boundary = [
        {"name": "cold", **ends[0], "temperature": COLD},
        {"name": "hot", **ends[1], "temperature": hot or COLD},
    ]
    given = {"name": "m", "thermal_conductivity": law, **material}
    probe = [{"name": "at", "at": [LENGTH / 2, 0, 0]}]
    if volts:
        boundary += [{"name": f"v{i}", **end, "voltage": volts * i} for i, end in enumerate(ends)]
        given = given if "electrical_conductivity" in given else {"resistivity": RHO, **given}
        probe.append({"name": "current", **ends[1], "quantity": "current"})
    probe.append({"name": "flow", **ends[0], "quantity": "heat_flow"})
    quarter = LENGTH / 4
    probe.append({"name": "section", "lower": [quarter, 0, 0], "upper": [quarter, *b[1:]], "quantity": "heat_flow"})
    return {
        "scene": {"initial_temperature": COLD},
        "material": [given],
        "box": [{"name": "bar", "material": "m", "lower": a, "upper": b}],
        "boundary": boundary,
        "probe": probe,
        "run": {"steady": True, "accuracy": accuracy},
    }


def held(found, exact, at_most):
    assert abs(found.value - exact) <= found.error
    assert found.error <= at_most


@pytest.mark.parametrize("law", [POWER, pytest.param(TABLE, marks=pytest.mark.long), {**POWER, "exponent": 2.0}])
def test_between_two_temperatures_the_transform_is_linear(law):
    accuracy = 1e-3 if law is TABLE else 1e-4
    found = solve(from_dict(bar(law, hot=700.0, accuracy=accuracy))).steady
    whole, area = theta(law, 700.0), 2e-11
    exact = inverse(law, whole / 2)
    held(found["at"], exact, accuracy * (exact - COLD))
    held(found["flow"], -whole / LENGTH * area, 1e-3 * whole / LENGTH * area)
    held(found["section"], -whole / LENGTH * area, 1e-3 * whole / LENGTH * area)
    # A law that differs a little is detected.
    off = {"exponent": law["exponent"] * 1.001} if "exponent" in law else {"values": [130.0, 61.0, 90.0]}
    twin = law | off
    assert abs(found["at"].value - inverse(twin, theta(twin, 700.0) / 2)) > found["at"].error


@pytest.mark.long
def test_quadratures_see_a_law_across_a_thin_plate():
    """With heat q in the thickness t theta is q t^2 / 2 at the insulated top. All rows of the table lie across it."""
    law = {"temperatures": [340.0, 450.0, 470.0, 530.0, 890.0], "values": [55.0, 56.0, 57.0, 52.0, 46.0]}
    thick, source, accuracy = 8e-6, 6e14, 1e-3
    scene = bar(law, accuracy=accuracy)
    plate = {"lower": [0, 0, 0], "upper": [6e-5, 7e-5, thick]}
    scene["box"] = [{"name": "bar", "material": "m", **plate, "heat_source": source}]
    scene["boundary"] = [{"name": "cold", **plate, "upper": [6e-5, 7e-5, 0], "temperature": COLD}]
    scene["probe"] = [{"name": "top", "at": [0, 0, thick]}]
    exact = inverse(law, source * thick**2 / 2)
    held(solve(from_dict(scene)).steady["top"], exact, accuracy * (exact - COLD))


def test_a_flux_that_is_given_is_read_as_it_is():
    """theta at the heated end is q L; a probe of the given flux there does not depend on the temperature."""
    flux = theta(POWER, 600.0) / LENGTH
    given = bar(POWER, hot=600.0, accuracy=1e-3)
    del given["boundary"][1]["temperature"]
    given["boundary"][1]["heat_flux"] = flux
    end = given["boundary"][1]
    given["probe"] = [
        {"name": "at", "at": end["upper"]},
        {"name": "given", "lower": end["lower"], "upper": end["upper"], "quantity": "heat_flow"},
    ]
    found = solve(from_dict(given)).steady
    held(found["at"], 600.0, 0.3)
    assert found["given"].value == pytest.approx(flux * 2e-11, rel=1e-9)


RISING = {"value": RHO, "at": COLD, "exponent": 1.0}


@pytest.mark.parametrize("series", [0.0, 80.0])
def test_a_given_current_and_a_series_resistance(series):
    """With rho = rho0 T/T0 and k of the temperature as k0 (T/T0)^n the state at a voltage equals the state at its
    current, and at a larger voltage behind a resistance."""
    given = bar(POWER, volts=0.5, resistivity=RISING, accuracy=1e-4)
    known = solve(from_dict(given)).steady
    current = abs(known["current"].value)
    on = next(b for b in given["boundary"] if b.get("voltage"))
    if series:
        on |= {"voltage": 0.5 + series * current, "series_resistance": series}
    else:
        del on["voltage"]
        on["current"] = current
    found = solve(from_dict(given)).steady["at"]
    assert abs(found.value - known["at"].value) <= found.error + known["at"].error
    on["voltage" if series else "current"] *= 1.005
    twin = solve(from_dict(given)).steady["at"]
    assert abs(twin.value - known["at"].value) > twin.error + known["at"].error


@pytest.mark.long
def test_a_conductivity_that_falls_too_fast_runs_away():
    """k = k0 (T/T0)^-2 conducts theta below k0 T0 alone, however hot it gets."""
    law = {**POWER, "exponent": -2.0}
    limit = np.sqrt(8 * RHO * K * COLD)
    below = solve(from_dict(bar(law, volts=0.9 * limit, accuracy=1e-3))).steady["at"]
    held(below, COLD / (1 - 0.81), 1e-3 * (COLD / (1 - 0.81) - COLD))
    with pytest.raises(RunawayError, match=r"runaway: .* the largest voltage with a steady state is 1.7") as caught:
        solve(from_dict(bar(law, volts=1.2 * limit, accuracy=1e-2)))
    # At 100,300 K, the hottest state of interest, theta is 0.997 of its bound, and the voltage 0.9985.
    assert 0.995 < caught.value.limit / limit < 1.002
    twin = np.sqrt(8 * RHO * 1.02 * K * COLD)
    assert caught.value.limit / twin < 0.995


@pytest.mark.long
def test_heat_alone_that_no_longer_leaves():
    """A bar with a source q has theta = q L^2 / 8 in its middle: the fraction of q that has a state is 1/1.2."""
    given = bar({**POWER, "exponent": -3.0}, accuracy=1e-2)
    given["box"][0]["heat_source"] = 1.2 * 8 * K * COLD / 2 / LENGTH**2
    with pytest.raises(RunawayError, match=r"heats the scene with a steady state is 0.83") as caught:
        solve(from_dict(given))
    assert abs(caught.value.limit - 1 / 1.2) < 5e-3


def test_path_that_turns_back_and_forth_on_a_coarse_mesh_is_no_runaway():
    """A fall by 100 within 10 K takes no state away: theta grows without end."""
    given = bar({"temperatures": [COLD + 20.0, COLD + 30.0], "values": [K, K / 100]}, accuracy=1e-2)
    given["box"][0]["heat_source"] = 8 * K * 200.0 / LENGTH**2
    scene = from_dict(given)
    coarse = grid_of(scene, (np.linspace(0.0, LENGTH, 9), [0.0, 1e-5], [0.0, 2e-6]), 1)
    with pytest.raises(RunawayError, match="which need not be a runaway") as caught:
        steady_on(scene, coarse, 0.0, 1e-3)
    assert 0 < caught.value.limit < 1
    assert caught.value.error == np.inf  # a finer mesh may show where the path leads


def test_limit_of_zero_is_named():
    """No state is found at any voltage where the conductivity rises by 10,000 within 0.01 K."""
    law = {"temperatures": [COLD, COLD + 0.01], "values": [K, 1e4 * K]}
    with pytest.raises(RunawayError, match="beyond 0 times the drive of the scene, which need not be") as caught:
        solve(from_dict(bar(law, volts=0.5, accuracy=1e-1)))
    assert caught.value.limit == caught.value.error == 0.0


@pytest.mark.parametrize("volts", [0.0, 0.1])
def test_limit_of_heat_beside_a_voltage_is_a_fraction_of_the_heat(volts):
    """No law of order one: theta at 100,300 K is 0.82 of its bound, and the fraction is that of q L^2 / 8."""
    law = PowerLaw(K, COLD, -1.3)
    hottest = float(law.integral(np.array(COLD + 1e5)) - law.integral(np.array(COLD)))
    given = bar({**POWER, "exponent": -1.3}, volts=1.0, accuracy=1e-2)
    given["box"][0]["heat_source"] = 1.5 * 8 * hottest / LENGTH**2
    given["boundary"][-1]["voltage"] = volts
    with pytest.raises(RunawayError, match="the largest part of what heats the scene") as caught:
        solve(from_dict(given))
    assert abs(caught.value.limit - 1 / 1.5) <= caught.value.error < 0.02


def test_state_hotter_than_any_solid_is_refused():
    """A bar that conducts the better the hotter it is has a state at any heat: here at some 400,000 K."""
    given = bar({**POWER, "exponent": 0.5}, accuracy=1e-1)
    given["box"][0]["heat_source"] = 8 * K * (4e5**1.5 / COLD**0.5) / 1.5 / LENGTH**2
    with pytest.raises(
        RunawayError, match=r"^at 0\.\d+ times the drive .* reaches 100,300 K, hotter than any solid"
    ) as caught:
        solve(from_dict(given))
    assert caught.value.limit == pytest.approx((1e5 / 4e5) ** 1.5, rel=0.02)


@pytest.mark.long
def test_a_conductivity_that_falls_sharply_has_a_state():
    """A fall by 100 within 1e-7 K leaves the conductivity behind it, by which theta = V^2 / (8 rho) sets the peak."""
    law = {"temperatures": [COLD, COLD + 1e-7], "values": [130, 1.3]}
    peak = COLD + 1.0 / (8 * RHO) / 1.3
    held(solve(from_dict(bar(law, volts=1.0, accuracy=1e-1))).steady["at"], peak, 1e-1 * (peak - COLD))


@pytest.mark.long
def test_a_resistivity_that_falls_by_800_is_seen_beside_the_ends():
    """The integral of k rho from the ends to the peak is V^2 / 8. On a coarse mesh all points of a quadrature see the
    constant behind the last row, by which the peak would be 39,600 K."""
    table = {"temperatures": [COLD + 50 * i for i in range(9)], "values": [1e6 * np.exp(i / 1.2) for i in range(9)]}
    scene = from_dict(bar(100.0, volts=0.2, accuracy=1e-3, electrical_conductivity=table))
    law = scene.boxes[0].material.resistivity
    rows = table["temperatures"]
    peak = brentq(lambda top: quad(law, COLD, top, points=rows)[0] - 0.2**2 / 800, COLD + 1, COLD + 400)
    held(solve(scene).steady["at"], peak, 1e-3 * (peak - COLD))


FALLING = PowerLaw(130.0, 293.0, -1.3)
STEADY = False


def of_sink(law, volts=1.0, **given):
    return Sink(voltage=volts, silicon=replace(SILICON, thermal_conductivity=law), accuracy=1e-3, **given)


@pytest.mark.long
@pytest.mark.parametrize(("law", "volts", "peak"), [(FALLING, 1.0, 21.2769), (FALLING, 4.0, 623.27)])
def test_the_sink_is_as_hot_as_the_second_path_has_it(law, volts, peak):
    """Rises (K) of the second path on grids refined until these digits stay."""
    found = sinks.solve(of_sink(law, volts), STEADY).steady["peak_rise_K"]
    held(found, peak, 1e-3 * peak)
    twin = sinks.solve(of_sink(law, 1.003 * volts), STEADY).steady["peak_rise_K"]
    assert abs(twin.value - peak) > twin.error


def test_where_a_table_ends_a_warning_says_so():
    inside = solve(from_dict(bar({**TABLE, "temperatures": [300.0, 420.0, 700.0]}, hot=700.0, accuracy=1e-2)))
    assert inside.details["warnings"] == []
    given = bar(TABLE, hot=700.0, accuracy=1e-2)
    given["box"] += [given["box"][0] | {"name": "hot half", "lower": [LENGTH / 2, 0, 0]}]  # one warning of both boxes
    outside = solve(from_dict(given))
    exact = inverse(TABLE, theta(TABLE, 700.0) / 2)
    held(outside.steady["at"], exact, 1e-2 * (exact - COLD))
    (said,) = outside.details["warnings"]
    assert said.startswith("thermal_conductivity of m is a table from 350 to 600 K, and 300 to 700 K are reached")


def test_pictures_have_the_heat_of_the_law():
    """Joule heat summed over the cells of the files is the power."""
    given = bar(POWER, volts=0.5, resistivity=RISING, accuracy=1e-3)
    given["probe"] = [
        {"name": "current", "lower": [LENGTH, 0, 0], "upper": [LENGTH, 1e-5, 2e-6], "quantity": "current"}
    ]
    result = solve(from_dict(given))
    fields = result.details["fields"]
    sides = np.ptp(fields.points[fields.cells], axis=1)
    heat = float(fields.snapshot(None).heat_source @ sides.prod(axis=1))
    assert heat == pytest.approx(0.5 * abs(result.steady["current"].value), rel=2e-3)
    assert heat < 0.95 * 0.5**2 / RHO / LENGTH * 2e-11


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
