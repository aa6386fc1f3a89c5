"""Responses at full order: the method's order conditions, SciPy's Radau on the same equations, closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fem3d.problems import conductors
from fem3d.problems.assembly import linearized
from fem3d.solution import march
from fem3d.solution.march import EMBEDDED, GAMMA, A, C, march_full
from scenes.errors import NumericsError
from scenes.laws import PowerLaw
from scenes.model import Schedule
from scenes.sink import SILICON
from tests.fem3d import BAR, bar, bar_grid, end, off, problem

FALLING = PowerLaw(130.0, 293.0, -1.3)
SLOWEST = BAR[1] ** 2 * SILICON.heat_capacity / (np.pi**2 * 130.0)


def test_tableau_satisfies_order_conditions():
    """Order 4 of the method and order 3 of the embedded one (Hairer, Norsett and Wanner, table II.2.1), and L-stability
    with a stiffly accurate last stage: R(infinity) = 1 - b A^-1 1 = 0 on the implicit stages."""
    b = A[-1]
    for weights, order in ((b, 4), (EMBEDDED, 3)):
        conditions = [
            (weights.sum(), 1), (weights @ C, 1 / 2), (weights @ C**2, 1 / 3), (weights @ (A @ C), 1 / 6),
            (weights @ C**3, 1 / 4), (weights @ (C * (A @ C)), 1 / 8), (weights @ (A @ C**2), 1 / 12),
            (weights @ (A @ (A @ C)), 1 / 24),
        ]  # fmt: skip
        met = [abs(value - due) < 1e-15 for value, due in conditions]
        assert all(met[:4])
        assert all(met) == (order == 4)
    assert np.allclose(A @ np.transpose([C**0, C]), np.transpose([C, C**2 / 2]), rtol=0, atol=1e-15)
    assert np.allclose(np.diag(A)[1:], GAMMA, rtol=0)
    z = -1e9
    stable = 1 + z * b @ np.linalg.solve(np.eye(6) - z * A, np.ones(6))
    assert abs(stable) < 1e-6


def radau(heat, conductor, times):
    """(times, all nodes): the rises by SciPy's Radau, with a dense mass matrix."""
    n = heat.free

    def state(time, inner):
        g = heat.inputs.at(np.array([time]))[0]
        rise = np.concatenate([inner, g @ heat.given])
        return g, rise, None if conductor is None else conductor.solve(rise, g @ conductor.voltages)

    def rate(time, inner):
        g, rise, potential = state(time, inner)
        load = g @ heat.loads - heat.outflow(rise)
        if conductor is not None:
            load += conductor.joule_load(potential.density, rise)
        return inverse @ load[:n]

    def slope(time, inner):
        _, rise, potential = state(time, inner)
        tangent = linearized(heat, conductor, rise, np.empty(0) if conductor is None else potential.density)
        return -inverse @ (tangent.inner_stiffness.toarray() + tangent.inner_rest(np.eye(n)).T)

    inverse = np.linalg.inv(heat.inner_mass.toarray())
    solved = solve_ivp(rate, (0.0, times[-1]), np.zeros(n), "Radau", times, jac=slope, rtol=1e-6, atol=1e-4)
    given = heat.inputs.at(times) @ heat.given
    return np.hstack([solved.y.T, given])


SCENES = {
    "conductivity": (
        bar(replace(SILICON, thermal_conductivity=FALLING), end(0, "temperature", 293.0), end(1, "heat_flux", 3e7)),
        2.0 * SLOWEST),
    "resistivity that falls, behind a resistance": (
        bar(replace(SILICON, resistivity=PowerLaw(6e-5, 293.0, -2.0), temperature_coefficient=0.0),
            end(0, "temperature", 293.0), end(1, "temperature", 293.0), end(0, "voltage", 0.0),
            replace(end(1, "voltage", 12.0), series_resistance=300.0)), 2.0 * SLOWEST),
    "a ramp": (
        bar(replace(SILICON, thermal_conductivity=FALLING), end(0, "temperature", 293.0),
            replace(end(1, "heat_flux", 0.0), value=Schedule((0.0, SLOWEST, 2 * SLOWEST), (0.0, 3e7, 0.0)))),
        2.0 * SLOWEST),
}  # fmt: skip


@pytest.mark.parametrize("name", SCENES)
def test_response_is_that_of_radau(name):
    scene, last = SCENES[name]
    heat = problem(scene, bar_grid(scene, 2, 2))
    conductor, times = conductors.find(heat), last * np.array([0.01, 0.1, 0.3, 0.6, 1.0])
    exact, apart = radau(heat, conductor, times), []
    for tolerance in (1e-4, 1e-5):
        response = march_full(heat, conductor, last, tolerance, 1e-3 * last)
        apart.append(off(response.rises(times), exact))
        assert apart[-1] < 20 * tolerance
    assert np.abs(exact).max() > 50.0
    assert apart[1] < apart[0] / 5


def test_steps_have_a_budget(monkeypatch):
    monkeypatch.setattr(march, "MOST_STEPS", 5)
    scene, last = SCENES["a ramp"]
    heat = problem(scene, bar_grid(scene, 2, 2))
    with pytest.raises(NumericsError, match="needs more than 5 steps in time"):
        march_full(heat, None, last, 1e-5, 1e-3 * last)
