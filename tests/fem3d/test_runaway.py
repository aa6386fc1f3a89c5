"""Where no steady state exists, and from when on a transient has no solution.

The fold's voltage is found by the walk along the current, on its two sides and by the fin; the time by a closed
form."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks import invariants
from fem3d.adaptivity.adapt import adapt
from fem3d.adaptivity.responses import BEFORE
from fem3d.runs.scene import solve, until
from fem3d.runs.sink import study
from fem3d.solution.transient import RUNAWAY_RATIO
from meshes import symmetry
from scenes.errors import NumericsError, RunawayError, RunawayInTimeError
from scenes.free.tables import as_toml
from scenes.model import Boundary, Box, Material, Probe, Scene
from scenes.sink import Sink
from tests.fem3d import drawn, off, plain_grid, silicon, state_on, steady_on
from tests.fin import fin_runaway_voltage
from validate.cli import main


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
def test_a_transient_whose_heating_damps_itself_ends_in_the_steady_state():
    """Hotter conductors take less of the power, whatever happens on the way."""
    sink = Sink(length=3e-9)
    answer = adapt(study(sink, symmetry.reduce(sink.scene())), True)
    rise = answer.response.traces["peak_K"][-1] - sink.room_temperature
    error = answer.response.errors["peak_K"] + answer.errors["peak_rise_K"]
    assert abs(rise - answer.fine.quantities["peak_rise_K"]) <= error < 2e-2 * rise


SLOPE, VOLTS, LENGTH = 4e-3, 2.0, 50e-6
FALLING = Material("falling", 100.0, 2000.0, 700.0, 1e-5, -SLOPE)
HEATED = VOLTS**2 / (LENGTH**2 * FALLING.resistivity)
RUNS_AWAY = FALLING.heat_capacity * (1 - RUNAWAY_RATIO**2) / (2 * SLOPE * HEATED)
"""When (s) the resistivity of an insulated bar is used up: of the rise T, c dT/dt = HEATED / (1 - SLOPE T)."""


def bar(end_time, *more, accuracy=1e-3):
    """A bar between electrodes, insulated but for ``more``."""
    low, high = (0.0, 0.0, 0.0), (LENGTH, 5e-6, 2e-6)
    ends = [((x, 0.0, 0.0), (x, 5e-6, 2e-6)) for x in (0.0, LENGTH)]
    electrodes = (Boundary("in", "voltage", *ends[0], VOLTS), Boundary("out", "voltage", *ends[1], 0.0))
    probes = (Probe("mean", low, high), Probe("current", *ends[0], "current"))
    box = Box("bar", FALLING, low, high)
    return Scene("bar", (box,), (*electrodes, *more), probes, 293.0, end_time, accuracy)


def test_insulated_bar_runs_away_at_exact_time():
    with pytest.raises(RunawayInTimeError, match="the heating runs away at t = ") as caught:
        solve(bar(10 * RUNS_AWAY))
    # Ends of the current's law are as exact as the time steps, a hundredth of the accuracy.
    assert off(caught.value.time, RUNS_AWAY) < 1e-4
    assert off(caught.value.time, 1.01 * RUNS_AWAY) > 1e-4
    before = solve(bar(0.9 * RUNS_AWAY)).over_time
    rise = (1 - np.sqrt(1 - 0.9 * (1 - RUNAWAY_RATIO**2))) / SLOPE
    assert abs(before.values["mean"][-1] - 293.0 - rise) < before.errors["mean"]


@pytest.mark.long
def test_traces_before_runaway_are_kept():
    cold = Boundary("cold", "temperature", (0.0, 0.0, 0.0), (0.0, 5e-6, 2e-6), 293.0)
    scene = replace(bar(100 * RUNS_AWAY, cold, accuracy=1e-2), output_times=(0.1 * RUNS_AWAY, 50 * RUNS_AWAY))
    with pytest.raises(RunawayInTimeError) as caught:
        solve(scene)
    kept, result, said = until(scene, caught.value)
    time, traces = caught.value.time, result.over_time
    # A finer mesh runs away a little earlier, which takes one more try.
    assert traces.time[-1] == kept.end_time
    assert 0.9 * BEFORE**2 * time < kept.end_time < 1.01 * BEFORE * time
    assert kept.output_times == (0.1 * RUNS_AWAY, kept.end_time)
    # At 1 % two digits are certain.
    assert said.startswith(f"the heating runs away at t = {1e6 * time:.2g} us; ")
    assert all(np.isfinite(v).all() for v in traces.values.values())
    assert (np.diff(traces.values["current"]) > 0).all()


@pytest.mark.long
def test_command_ends_with_status_3_and_keeps_traces(tmp_path, capsys):
    scene = bar(20 * RUNS_AWAY, accuracy=1e-2)
    (tmp_path / "bar.toml").write_text(as_toml(scene), encoding="utf-8")
    assert main(["solve", str(tmp_path / "bar.toml"), "--out", str(tmp_path / "out"), "--no-figures"]) == 3
    printed = capsys.readouterr()
    assert "the heating runs away at t = " in printed.err
    assert "mean" in printed.out
    rows = np.genfromtxt(tmp_path / "out" / "traces.csv", delimiter=",", names=True)
    assert rows["time_s"][-1] == pytest.approx(BEFORE * RUNS_AWAY, rel=1e-2)
    assert "runs away" in (tmp_path / "out" / "summary.json").read_text(encoding="utf-8")


def test_temperatures_without_positive_resistivity_are_refused():
    hot = Boundary("hot", "temperature", (0.0, 0.0, 0.0), (0.0, 5e-6, 2e-6), 293.0 + 1.1 / SLOPE)
    scene = replace(bar(1.0, hot), steady=True)
    with pytest.raises(NumericsError, match="resistivity zero or less at the temperatures"):
        steady_on(scene, plain_grid(scene), VOLTS)


@pytest.mark.long
def test_a_state_is_found_where_meshes_swing_below_zero():
    """A film that a flux enters by an edge: 29,000 K hot there, as a power of -0.35 has it, and down to -1,000 K on the
    first meshes."""
    hard = drawn("laws 3023")
    assert invariants.compared(hard, invariants.solve(hard), 3.0)[0] <= 1.0


@pytest.mark.long
def test_a_resistivity_that_falls_to_zero_runs_away():
    """Not by a fold: a line of -0.0033 per kelvin ends 304 K above the cold end, in one box of two in series."""
    scene = drawn("laws 3064")
    with pytest.raises(RunawayError, match="thermal runaway"):
        solve(scene)
