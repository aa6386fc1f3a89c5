"""The coupled steady state against closed forms: of a bar whose ends are held at T0 and carry a voltage V, the integral
of k rho dT from T0 to the peak is V^2/8, whatever the laws are (Kohlrausch, Ann. Phys. 306, 1900)."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad

from fem3d.runs.scene import solve
from scenes.errors import RunawayError
from scenes.free import from_dict
from scenes.laws import PowerLaw, Table
from tests.fem3d.test_laws import COLD
from tests.fem3d.test_laws import bar as bar_of


def bar(conductivity, resistivity, volts, accuracy=1e-3):
    """The bar between cold ends with a voltage between them, read at its middle and by its current."""
    document = bar_of(conductivity, volts=volts, accuracy=accuracy, resistivity=resistivity)
    return document | {"probe": document["probe"][:2]}


def power(value, exponent):
    return {"value": value, "at": COLD, "exponent": exponent}


def table(value, *factors):
    temperatures = np.linspace(290.0, 1500.0, len(factors))
    return {"temperatures": temperatures.tolist(), "values": [value * f for f in factors]}


def volts(conductivity, resistivity, peak):
    """The voltage (V) that a peak temperature (K) takes."""
    laws = [
        PowerLaw(**each) if "exponent" in each else Table(tuple(each["temperatures"]), tuple(each["values"]))
        for each in (conductivity, resistivity)
    ]
    rows = {row for each in (conductivity, resistivity) for row in each.get("temperatures", ())}
    knots = [COLD, *sorted(row for row in rows if COLD < row < peak), peak]
    pieces = [quad(lambda t: laws[0](t) * laws[1](t), *ends, epsrel=1e-10) for ends in pairwise(knots)]
    return float(np.sqrt(8 * sum(piece for piece, _ in pieces)))


LAWS = [
    (power(130.0, -1.3), power(1e-5, -0.5)), (power(130.0, 0.4), power(1e-5, -2.2)),
    (power(130.0, -1.0), power(1e-5, 1.0)),
    (power(130.0, 0.0), table(1e-5, 1.0, 0.5, 0.4, 0.1)), (table(130.0, 1.0, 0.4, 0.3), table(1e-5, 1.0, 1.6, 0.7)),
]  # fmt: skip


@pytest.mark.long
@pytest.mark.parametrize(("conductivity", "resistivity"), LAWS)
def test_peak_of_bar_between_cold_ends(conductivity, resistivity):
    peak = 1400.0
    driven = volts(conductivity, resistivity, peak)
    found = solve(from_dict(bar(conductivity, resistivity, driven))).steady["at"]
    assert abs(found.value - peak) <= found.error <= 1e-3 * (peak - COLD)
    other = solve(from_dict(bar(conductivity, resistivity, 0.99 * driven))).steady["at"]
    assert abs(other.value - peak) > other.error


@pytest.mark.long
@pytest.mark.parametrize("exponent", [-2.0, -2.5, -3.0])
def test_limit_is_where_the_integral_of_a_falling_resistivity_ends(exponent):
    """With rho = rho0 (T/T0)^n, n < -1, the integral ends at k rho0 T0 / -(n + 1): at 0.98 of that voltage there is a
    state, and beyond it none."""
    laws = power(130.0, 0.0), power(1e-5, exponent)
    limit = np.sqrt(8 * 130.0 * 1e-5 * COLD / -(exponent + 1))
    peak = COLD * (1 - 0.98**2) ** (1 / (exponent + 1))
    found = solve(from_dict(bar(*laws, 0.98 * limit))).steady["at"]
    assert abs(found.value - peak) <= found.error
    limits = []
    for beyond in (1.5, 2.0):
        with pytest.raises(RunawayError, match="thermal runaway") as caught:
            solve(from_dict(bar(*laws, beyond * limit, accuracy=1e-2)))
        limits.append(caught.value.limit)
    # The limit does not depend on the voltage. Its state is infinitely hot, so that a mesh misses up to 5 % of it.
    assert limits[1] == pytest.approx(limits[0], rel=1e-6)
    assert 0.945 * limit < limits[0] < 1.002 * limit


@pytest.mark.long
def test_a_table_that_falls_has_a_state_at_any_voltage():
    """Constant beyond its last row, it never lets the integral end: at a large voltage the state is on that branch."""
    laws = power(130.0, 0.0), table(1e-5, 1.0, 0.2, 0.02)
    driven = volts(*laws, 4000.0)
    found = solve(from_dict(bar(*laws, driven, accuracy=1e-2))).steady["at"]
    assert abs(found.value - 4000.0) <= found.error
