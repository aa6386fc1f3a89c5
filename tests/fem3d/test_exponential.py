"""Exponential collocation against a dense accurate solver, its convolutions against quadrature, and the rows."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fem3d.results import fields
from fem3d.runs.scene import solve
from fem3d.solution.exponential import integrate
from scenes.errors import NumericsError
from scenes.model import Boundary, Box, Material, Probe, Scene

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


@pytest.mark.long
@pytest.mark.parametrize("accuracy", [1e-4, 1e-6, 1e-8])
def test_a_stiff_problem_is_solved_to_the_accuracy_asked_for(truth, accuracy):
    times, expected = truth
    found = integrate(RATES, lambda since: lambda times, a: source(a), 1.0, accuracy, 1.0)
    error = np.abs(found(times)[0] - expected).max()
    assert error < 5 * accuracy + 1e-10


def test_few_more_steps_gain_many_digits(truth):
    times, expected = truth
    runs = [integrate(RATES, lambda since: lambda times, a: source(a), 1.0, accuracy, 1.0) for accuracy in (1e-3, 1e-9)]
    steps = [len(r.steps) for r in runs]
    errors = [np.abs(r(times)[0] - expected).max() for r in runs]
    order = np.log(errors[0] / max(errors[1], 1e-13)) / np.log(steps[1] / steps[0])
    assert order > 5
    assert np.abs(runs[1](times)[1] - source(expected)).max() < 1e-6 * np.abs(source(expected)).max()


def test_heat_that_runs_away_in_time_is_refused():
    with pytest.raises(NumericsError, match="runs away at"):
        integrate(np.ones(1), lambda since: lambda times, a: 1 + 4 * a**2, 10.0, 1e-4, 1.0)


def test_a_source_that_damps_a_state_more_than_sweeps_settle_is_no_runaway():
    """da/dt = b (1 - a) - a/2, where sweeps over a step t reduce the error only if b t is below one."""
    damping = 1e9
    found = integrate(np.array([0.5]), lambda since: lambda times, a: damping * (1 - a), 1.0, 1e-6, 1.0)
    assert found(np.array([1.0]))[0][0, 0] == pytest.approx(damping / (damping + 0.5), rel=1e-12)


@pytest.mark.parametrize("fading", [1e-1, 3e-3, 3e-4])
def test_lines_between_rows_stay_within_their_share_behind_a_bend_that_samples_hardly_see(fading):
    """A slope that turns at the start of a step, within less than the distance of the samples there."""
    (step,) = integrate(np.array([1.0]), lambda since: lambda times, a: 0 * a, 1.0, 1e-2, 1.0).steps[:1]
    steps = [replace(step, start=0.0, length=1.0), replace(step, start=1.0, length=1.0)]

    def evaluate(t):
        behind = np.maximum(t - 1.0, 0.0)
        return {"flow": np.minimum(t, 1.0) + np.exp(-behind / fading)}

    times, rows, errors = fields.choose(steps, evaluate, {"flow": 1e-3})
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
