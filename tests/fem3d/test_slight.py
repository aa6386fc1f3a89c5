"""Faces that hardly matter beside the conduction: the linear problem's factors serve, and give what Newton's method
and rounds of reduced problems do."""

import numpy as np
import pytest

from fem3d.adaptivity import nested
from fem3d.runs import sink
from fem3d.solution import faces_over_time, slight
from fem3d.solution.faces_over_time import Between
from scenes.loading import load

ACCURACY = 1e-4


def solved(voltage, transient=False, emissivity=0.7, accuracy=ACCURACY):
    keys = [f"drive.voltage={voltage}", f"environment.emissivity={emissivity}", f"run.accuracy={accuracy}"]
    return sink.solve(load("sink", keys), transient=transient)


def apart(one, two):
    """The largest distance of two results' steady values over the error of the first."""
    return max(abs(e.value - two.steady[name].value) / e.error for name, e in one.steady.items())


@pytest.mark.parametrize("voltage", [1, 4])
def test_the_linear_factors_give_newtons_state(voltage, monkeypatch):
    """On the same mesh the two differ by what the iterations leave, and their errors are alike; a little more that
    radiates is told apart."""
    found = solved(voltage)
    assert slight.slight(found.details["answer"].fine.state.heat)
    monkeypatch.setattr(slight, "SLIGHT", -1.0)
    by_newton = solved(voltage)
    assert not slight.slight(by_newton.details["answer"].fine.state.heat)
    assert found.details["unknowns"] == by_newton.details["unknowns"]
    assert apart(found, by_newton) < 1e-2
    for name, e in found.steady.items():
        assert 0.8 < e.error / by_newton.steady[name].error < 3, name
    assert apart(found, solved(voltage, emissivity=0.75)) > 0.1


def test_what_radiates_most_of_the_heat_is_left_to_newton():
    """A film that matters: at 12 V the beam glows."""
    assert not slight.slight(solved(12, accuracy=1e-2).details["answer"].fine.state.heat)


def test_an_iteration_that_fails_is_left_to_newton(monkeypatch):
    monkeypatch.setattr(slight, "QUADRATURE", -1.0)
    assert not slight.slight(solved(1, accuracy=1e-2).details["answer"].fine.state.heat)


@pytest.mark.long
def test_over_time_as_by_rounds(monkeypatch):
    """As the steady state, over time: within the small part of the errors that the reduced spaces have."""
    found = solved(4, transient=True)
    assert found.details["answer"].response.transient.base.slight
    monkeypatch.setattr(slight, "SLIGHT", -1.0)
    rounds = solved(4, transient=True)
    times = np.geomspace(1e-5, 2e-2, 50)
    for name, error in found.traces.errors.items():
        one, two = (np.interp(times, r.traces.time, r.traces.values[name]) for r in (found, rounds))
        assert np.abs(one - two).max() < 0.5 * error, name


def test_what_few_states_lack_is_seen_and_made_better(monkeypatch):
    """Without the steady state and with one early state to interpolate between, the first response lacks much; the
    second has what that one shows."""
    lacks, guessed, better = [], Between.guessed, Between.better

    def poor(*arguments):
        between = guessed(*arguments)
        return nested.replace(between, states=between.states[:1])

    def noted(self, answer):
        lacks.append((made := better(self, answer))[1])
        return made

    monkeypatch.setattr(Between, "guessed", staticmethod(poor))
    monkeypatch.setattr(Between, "better", noted)
    monkeypatch.setattr(faces_over_time, "TOLERANCE", 0.01)
    solved(4, transient=True, accuracy=1e-3)
    assert lacks[0] > 1e-4 > 10 * lacks[-1]
    assert len(lacks) == 2
