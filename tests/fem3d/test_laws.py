"""Properties that follow the temperature, against Kirchhoff's transform: theta(T), the integral of k from the coldest
temperature on, solves the linear problem."""

import numpy as np
import pytest

from fem3d.runs.scene import solve
from scenes.errors import RunawayError
from scenes.free import from_dict
from tests.meshes.grouped.test_scenes import on_mesh

LENGTH, COLD, K, RHO = 1e-4, 300.0, 130.0, 1e-5
POWER = {"value": K, "at": COLD, "exponent": -1.3}
TABLE = {"temperatures": [350.0, 420.0, 600.0], "values": [130.0, 60.0, 90.0]}


def theta(law, temperature):
    """The integral of k from COLD to a temperature (K), in W/m."""
    if "exponent" in law:
        n = law["exponent"] + 1
        return law["value"] * law["at"] / n * ((temperature / law["at"]) ** n - (COLD / law["at"]) ** n)
    at = np.unique(np.clip([COLD, *law["temperatures"], temperature], COLD, temperature))
    k = np.interp(at, law["temperatures"], law["values"])
    return float((np.diff(at) * (k[1:] + k[:-1]) / 2).sum())


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
        given = {"resistivity": RHO, **given}
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


@pytest.mark.parametrize("law", [POWER, TABLE, {**POWER, "exponent": 2.0}])
def test_between_two_temperatures_the_transform_is_linear(law):
    found = solve(from_dict(bar(law, hot=700.0))).steady
    whole, area = theta(law, 700.0), 2e-11
    exact = inverse(law, whole / 2)
    held(found["at"], exact, 1e-4 * (exact - COLD))
    held(found["flow"], -whole / LENGTH * area, 1e-3 * whole / LENGTH * area)
    held(found["section"], -whole / LENGTH * area, 1e-3 * whole / LENGTH * area)
    # A law that differs by a thousandth is told apart.
    off = {"exponent": law["exponent"] * 1.001} if "exponent" in law else {"values": [130.0, 60.06, 90.0]}
    twin = law | off
    assert abs(found["at"].value - inverse(twin, theta(twin, 700.0) / 2)) > found["at"].error


@pytest.mark.parametrize("law", [POWER, TABLE])
def test_joule_heat_between_cold_ends(law):
    """theta is a parabola of height V^2 / (8 rho)."""
    volts = np.sqrt(8 * RHO * theta(law, 900.0))
    found = solve(from_dict(bar(law, volts=volts))).steady
    held(found["at"], 900.0, 1e-4 * 600.0)
    held(found["current"], volts / RHO / LENGTH * 2e-11, 1e-6 * volts / RHO / LENGTH * 2e-11)


def test_a_law_of_the_resistivity():
    """With k rho = L T, L = k0 rho0 / T0, the hottest temperature follows V^2 = 4 L (Th^2 - T0^2) (Kohlrausch)."""
    volts = np.sqrt(4 * K * RHO / COLD * (900.0**2 - COLD**2))
    rising = {"value": RHO, "at": COLD, "exponent": 1.0}
    for law, given in ((K, rising), ({**POWER, "exponent": 1.0}, RHO)):
        held(solve(from_dict(bar(law, volts=volts, resistivity=given))).steady["at"], 900.0, 1e-4 * 600.0)


def test_a_conductivity_that_falls_too_fast_runs_away():
    """k = k0 (T/T0)^-2 conducts theta below k0 T0 alone, however hot it gets."""
    law = {**POWER, "exponent": -2.0}
    limit = np.sqrt(8 * RHO * K * COLD)
    below = solve(from_dict(bar(law, volts=0.9 * limit, accuracy=1e-3))).steady["at"]
    held(below, COLD / (1 - 0.81), 1e-3 * COLD)
    with pytest.raises(RunawayError, match="thermal runaway") as caught:
        solve(from_dict(bar(law, volts=1.2 * limit, accuracy=1e-2)))
    assert 0.9 * limit < caught.value.limit < 1.02 * limit


def test_on_a_mesh_file(tmp_path):
    given = bar(POWER, hot=700.0, accuracy=1e-2)
    given["probe"] = [p for p in given["probe"] if p["name"] != "section"]
    found = on_mesh(given, "tetra", 4, tmp_path).steady
    exact = inverse(POWER, theta(POWER, 700.0) / 2)
    held(found["at"], exact, 1e-2 * (exact - COLD))
