"""Integration in time: the full-order method against its order conditions, SciPy's Radau and closed forms; exponential
collocation against a dense accurate solver; and the rows of traces."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fem3d.adaptivity import responses
from fem3d.adaptivity.trace_errors import choose_rows
from fem3d.problems import conductors
from fem3d.problems.linearized import linearized
from fem3d.results import outputs
from fem3d.runs import probe_quantities
from fem3d.runs.scene import part_of, solve
from fem3d.solution import exponential
from fem3d.solution.exponential import integrate
from fem3d.solution.march import RK_A, RK_B3, RK_C, March
from fem3d.solution.transient import Base
from scenes.errors import NumericsError
from scenes.laws import PowerLaw, Table
from scenes.model import Boundary, Box, Material, Probe, Scene, Schedule
from scenes.sink import SILICON
from tests.fem3d import BAR, bar, bar_grid, end, gap, off, problem

FALLING = PowerLaw(130.0, 293.0, -1.3)
SLOWEST = BAR[1] ** 2 * SILICON.heat_capacity / (np.pi**2 * 130.0)


def test_tableau_satisfies_order_conditions():
    """Order 4 of the method and order 3 of the embedded one (Hairer, Norsett and Wanner, table II.2.1), and L-stability
    with a stiffly accurate last stage: R(infinity) = 1 - b A^-1 1 = 0 on the implicit stages."""
    A, b, C = RK_A, RK_A[-1], RK_C
    for weights, order in ((b, 4), (RK_B3, 3)):
        conditions = [
            (weights.sum(), 1), (weights @ C, 1 / 2), (weights @ C**2, 1 / 3), (weights @ (A @ C), 1 / 6),
            (weights @ C**3, 1 / 4), (weights @ (C * (A @ C)), 1 / 8), (weights @ (A @ C**2), 1 / 12),
            (weights @ (A @ (A @ C)), 1 / 24),
        ]  # fmt: skip
        met = [abs(value - due) < 1e-15 for value, due in conditions]
        assert all(met[:4])
        assert all(met) == (order == 4)
    assert np.allclose(A @ np.transpose([C**0, C]), np.transpose([C, C**2 / 2]), rtol=0, atol=1e-15)
    assert np.allclose(np.diag(A)[1:], A[1, 1], rtol=0)
    z = -1e9
    stable = 1 + z * b @ np.linalg.solve(np.eye(6) - z * A, np.ones(6))
    assert abs(stable) < 1e-6


def radau(heat, conductor, times):
    """(times, all dofs): the rises by SciPy's Radau, with a dense mass matrix."""
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
        return -inverse @ (tangent.inner_stiffness.toarray() + tangent.inner_rest()(np.eye(n)).T)

    inverse = np.linalg.inv(heat.inner_mass.toarray())
    solved = solve_ivp(rate, (0.0, times[-1]), np.zeros(n), "Radau", times, jac=slope, rtol=1e-8, atol=1e-6)
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
    conductor, times = conductors.assemble_conductor(heat), last * np.array([0.01, 0.1, 0.3, 0.6, 1.0])
    exact, apart = radau(heat, conductor, times), []
    for tolerance in (1e-4, 1e-6):
        response = March(heat, conductor, tolerance).run(last, 1e-3 * last)
        apart.append(off(response.rises(times), exact))
        assert apart[-1] < 20 * tolerance
    assert np.abs(exact).max() > 50.0
    assert apart[1] < apart[0] / 5**2


def test_error_of_steps_is_the_largest_one_after_a_drive_bends_too():
    """The error between the ends of steps counts: fluxes of random scenes were off by up to 2.7 times their errors."""
    end_time = 6 * SLOWEST
    turned = Schedule((0.8 * end_time, 0.82 * end_time), (1.0, -1.0))
    ends = [end(side, "temperature", 293.0) for side in (0, 1)]
    heated = bar(
        replace(SILICON, thermal_conductivity=FALLING), *ends, end(0, "voltage", 0.0), end(1, "voltage", turned)
    )
    cold = Probe("cold", (0.0, 0.0, 0.0), (BAR[0], 0.0, BAR[2]), "heat_flow")
    scene = replace(
        heated, probes=(*heated.probes, cold), steady=False, end_time=end_time, output_times=(0.3 * end_time,),
        accuracy=0.02,
    )  # fmt: skip
    answer, study = solve(scene).details["answer"], probe_quantities.study(scene, part_of(scene, False))
    base = Base.bare(answer.heat, answer.conductor)
    fine, low = responses.march_nonlinear(study, base, base, None)
    times = np.linspace(0.3 * end_time, end_time, 2000)
    one, other = (study.traces(outputs.of_transient(each, study.part, times)) for each in (low, fine.worse))
    for name, error in fine.gaps.items():
        assert np.abs(one[name] - other[name]).max() / 3 <= 1.1 * error, name


def test_heat_ends_with_a_voltage_that_is_switched_off():
    """No potential is left to decay until it underflows: no step was short enough then."""
    off_at = Schedule((SLOWEST / 2, SLOWEST / 2), (1.0, 0.0))
    ends = [end(side, "temperature", 293.0) for side in (0, 1)]
    heated = bar(
        replace(SILICON, thermal_conductivity=FALLING), *ends, end(0, "voltage", 0.0), end(1, "voltage", off_at)
    )
    inlet = Probe("current", (0.0, BAR[1], 0.0), BAR, "current")
    scene = replace(
        heated, probes=(*heated.probes, inlet), steady=False, end_time=3 * SLOWEST, output_times=(2 * SLOWEST,),
        accuracy=0.05,
    )  # fmt: skip
    found = solve(scene)
    assert found.over_time.values["current"][-1] == 0
    assert gap(found, solve(replace(scene, accuracy=0.02)), (SLOWEST / 4, SLOWEST, 2 * SLOWEST)) <= 1


def test_steps_have_a_budget(monkeypatch):
    monkeypatch.setattr(exponential, "MOST_IN_TIME", 5)
    scene, last = SCENES["a ramp"]
    heat = problem(scene, bar_grid(scene, 2, 2))
    with pytest.raises(NumericsError, match="needs more than 5 steps in time"):
        March(heat, None, 1e-5).run(last, 1e-3 * last)


RATES = np.array([3.0, 40.0, 900.0, 2e5])
GAIN = np.array([1.0, 2.0, -1.0, 0.5])


def source(a):
    """A source that weakens with the state, like the power at a given voltage."""
    return GAIN * RATES / (1 + 0.4 * a.sum(axis=-1, keepdims=True))


@pytest.fixture(scope="module")
def truth():
    def slope(_, a):
        return source(a) - RATES * a

    times = np.geomspace(1e-6, 1.0, 40)
    return times, solve_ivp(slope, (0, 1), np.zeros(4), "Radau", times, rtol=1e-11, atol=1e-13).y.T


def test_few_more_steps_gain_many_digits(truth):
    times, expected = truth
    accuracies = 1e-3, 1e-9
    runs = [integrate(RATES, lambda since: lambda times, a: source(a), 1.0, accuracy, 1.0) for accuracy in accuracies]
    steps = [len(r.steps) for r in runs]
    errors = [np.abs(r(times)[0] - expected).max() for r in runs]
    assert all(error < 5 * accuracy + 1e-10 for error, accuracy in zip(errors, accuracies, strict=True))
    order = np.log(errors[0] / max(errors[1], 1e-13)) / np.log(steps[1] / steps[0])
    assert order > 5
    assert np.abs(runs[1](times)[1] - source(expected)).max() < 1e-6 * np.abs(source(expected)).max()


def test_heat_that_runs_away_in_time_is_refused():
    with pytest.raises(NumericsError, match="runs away at"):
        integrate(np.ones(1), lambda since: lambda times, a: 1 + 4 * a**2, 10.0, 1e-4, 1.0)


def test_source_that_damps_a_state_fast_is_no_runaway():
    """da/dt = b (1 - a) - a/2, with b t far above one in each step t."""
    damping = 1e9
    found = integrate(np.array([0.5]), lambda since: lambda times, a: damping * (1 - a), 1.0, 1e-6, 1.0)
    assert found(np.array([1.0]))[0][0, 0] == pytest.approx(damping / (damping + 0.5), rel=1e-12)


@pytest.mark.parametrize(("height", "fading"), [(1.0, 1e-1), (1.0, 3e-3), (1.0, 3e-4), (9e-4, 1e-6)])
def test_lines_between_rows_stay_within_their_share_behind_a_bend_that_samples_hardly_see(height, fading):
    """A slope that turns at the start of a step, within less than the distance of the samples there; a heat flow that
    jumps there by less than may be missed."""

    def evaluate(t):
        behind = np.maximum(t - 1.0, 0.0)
        return {"flow": np.minimum(t, 1.0) + height * np.exp(-behind / fading)}

    times, rows, errors = choose_rows([0.0, 1.0, 2.0], evaluate, {"flow": 1e-3})
    dense = np.unique(np.concatenate([1 + np.geomspace(1e-7, 1, 5000), np.linspace(0, 2, 5000)]))
    worst = np.abs(np.interp(dense, times, rows["flow"]) - evaluate(dense)["flow"]).max()
    assert worst <= 1.05 * errors["flow"] <= 1.05e-3
    assert len(times) < 10 / np.sqrt(1e-3)


def test_all_of_many_output_times_are_rows():
    conductor = Material("m", 100.0, 2000.0, 700.0)
    box = Box("b", conductor, (0.0, 0.0, 0.0), (1e-4, 1e-5, 1e-5), heat_source=1e12)
    base = Boundary("base", "temperature", (0.0, 0.0, 0.0), (0.0, 1e-5, 1e-5), 293.0)
    tip = Probe("tip", (1e-4, 5e-6, 5e-6), (1e-4, 5e-6, 5e-6))
    asked = tuple(1e-6 * n for n in range(1, 2001))
    scene = Scene("s", (box,), (base,), (tip,), end_time=2e-3, output_times=asked)
    times = solve(scene).traces.time
    assert np.isin(asked, times).all()


def test_error_of_a_table_over_time_holds_where_its_bends_lie_inside_cells():
    """Between cold ends k rho dT integrates to V^2 / 8 from the ends to the peak, at rest."""
    law = Table((375.0, 428.0, 653.0, 1076.0, 1120.0), (7.27e-5, 8.5e-5, 9.26e-5, 11.46e-5, 11.7e-5))
    volts = (8 * 130.0 * (law.integral(2000.0) - law.integral(293.0))) ** 0.5
    cold = [end(side, "temperature", 293.0) for side in (0, 1)]
    material = replace(SILICON, resistivity=law, temperature_coefficient=0.0)
    scene = bar(material, *cold, end(0, "voltage", volts), end(1, "voltage", 0.0))
    last = 20 * np.pi**2 * SLOWEST
    traces = solve(replace(scene, end_time=last, output_times=(last,), accuracy=1e-2)).over_time
    assert abs(traces.values["middle"][-1] - 2000.0) <= traces.errors["middle"]


@pytest.mark.parametrize("key", ["thermal_conductivity", "specific_heat"])
def test_tangents_of_laws_couple_no_more_functions_than_the_stiffness(key):
    """One order of elimination serves both; where a property is constant its integrals vanish for even and odd
    functions."""
    law = PowerLaw(getattr(SILICON, key), 293.0, -1.3)
    scene = bar(replace(SILICON, **{key: law}), end(0, "temperature", 293.0), end(1, "heat_flux", 3e7))
    heat = problem(scene, bar_grid(scene, 2, 4))
    u, w = np.random.default_rng(1).uniform(0.0, 50.0, (2, heat.domain.space.size))
    tangent = heat.storage.tangent(u, w)[0] if heat.storage else heat.terms[0].tangent(u)[0]
    coupled = tangent[heat.order][:, heat.order] != 0
    structure = heat.stiffness.copy()
    structure.data[:] = 1.0
    assert (coupled > (structure != 0)).nnz == 0
    assert coupled.nnz > (abs(heat.stiffness) > 1e-12 * abs(heat.stiffness).max()).nnz
