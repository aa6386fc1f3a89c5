"""Where no steady state exists: the fold's voltage by the walk along the current, on its two sides and by the fin."""

from dataclasses import replace

import numpy as np
import pytest

from fem3d.adaptivity.adapt import adapt
from fem3d.runs.sink import study
from meshes import symmetry
from scenes.errors import NumericsError, RunawayError
from scenes.sink import Sink
from tests.fem3d import off, plain_grid, silicon, state_on, steady_on
from tests.fin import fin_runaway_voltage


def solved(sink):
    sink = replace(sink, accuracy=1e-2)
    return adapt(study(sink, symmetry.reduce(sink.scene())), False).fine.quantities


def limit(sink):
    with pytest.raises(RunawayError, match="no steady state exists") as caught:
        solved(sink)
    return caught.value.limit


def limit_on(grid, sink):
    part = symmetry.reduce(sink.scene())
    with pytest.raises(RunawayError) as caught:
        steady_on(part.scene, grid, sink.voltage, 1e-6)
    return caught.value.limit


@pytest.mark.long
@pytest.mark.parametrize(("coefficient", "voltage"), [(-2e-3, 5.0), (-5e-4, 7.0)])
def test_the_limit_is_near_that_of_the_fin_behind_the_anchor_resistance(coefficient, voltage):
    sink = Sink(silicon=silicon(coefficient), voltage=voltage)
    found = limit(sink)
    assert found < voltage
    resistance = float(solved(Sink(silicon=silicon(0.0)))["anchor_resistance_K_per_W"])
    fin = fin_runaway_voltage(sink, resistance)
    assert off(found, fin) < 0.01
    assert off(found, fin_runaway_voltage(sink, 1.1 * resistance)) > 0.01
    below = solved(replace(sink, voltage=0.98 * found))
    assert 0 < below["peak_rise_K"] < -1 / coefficient
    above = replace(sink, voltage=1.02 * found)
    assert off(limit(above), found) < 0.01


# Between electrodes at the pads' edges the resistivity nearly vanishes at the fold, and the current's pattern with it.
@pytest.mark.long
@pytest.mark.parametrize(("electrodes", "voltage", "within"), [("beam-end", 4.0, 1e-3), ("pad-edge", 4.7, 1e-2)])
def test_just_below_the_limit_there_is_a_steady_state_and_just_above_it_none(electrodes, voltage, within):
    sink = Sink(silicon=silicon(-2e-3), voltage=voltage, electrodes=electrodes, convection_coefficient=100.0)
    part = symmetry.reduce(sink.scene())
    grid = plain_grid(part.scene)
    found = limit_on(grid, sink)
    state_on(replace(sink, voltage=(1 - within) * found), grid)
    with pytest.raises(NumericsError):
        state_on(replace(sink, voltage=(1 + within) * found), grid)
    assert off(limit_on(grid, replace(sink, voltage=-voltage)), found) < 1e-4


def test_it_converges_up_to_the_limit_and_the_rise_grows_without_a_gap():
    sink = Sink(silicon=silicon(-5e-4))
    grid = plain_grid(symmetry.reduce(sink.scene()).scene)
    found = limit_on(grid, replace(sink, voltage=9.0))
    voltages = np.array([0.01, 0.3, 0.6, 0.9, 0.99, 0.9999]) * found
    states = [state_on(replace(sink, voltage=v), grid)[1] for v in voltages]
    peaks = np.array([float(q["peak_rise_K"]) for q in states])
    conductance = np.array([float(q["current_A"]) for q in states]) / voltages
    assert (np.diff(peaks) > 0).all()
    assert (np.diff(conductance) > 0).all()
    assert (np.diff(peaks / voltages**2) > 0).all()


@pytest.mark.long
@pytest.mark.parametrize(
    ("coefficient", "voltage", "electrodes"), [(-2e-3, 5.0, "pad-edge"), (-5e-4, 30.0, "beam-end")]
)
def test_far_beyond_the_limit_it_is_named_too(coefficient, voltage, electrodes):
    sink = Sink(silicon=silicon(coefficient), voltage=voltage, electrodes=electrodes)
    with pytest.raises(NumericsError) as caught:
        solved(sink)
    assert isinstance(caught.value, RunawayError)
    assert 0 < caught.value.limit < voltage


@pytest.mark.long
def test_a_transient_whose_heating_damps_itself_ends_in_the_steady_state():
    """Hotter conductors take less of the power, whatever happens on the way."""
    sink = Sink(length=3e-9)
    answer = adapt(study(sink, symmetry.reduce(sink.scene())), True)
    rise = answer.response.traces["peak_K"][-1] - sink.room_temperature
    error = answer.response.errors["peak_K"] + answer.errors["peak_rise_K"]
    assert abs(rise - answer.fine.quantities["peak_rise_K"]) <= error < 2e-2 * rise
