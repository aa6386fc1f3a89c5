"""Transients that have no solution from some time on: the time, by a closed form, and the kept part."""

from dataclasses import replace

import numpy as np
import pytest

from fem3d.adaptivity.marched import BEFORE
from fem3d.runs.scene import solve, until
from fem3d.solution.transient import LEAST
from scenes.errors import NumericsError, RunawayError, RunawayInTimeError
from scenes.free.tables import as_toml
from scenes.model import Boundary, Box, Material, Probe, Scene
from tests.fem3d import off, plain_grid, steady_on
from validate.cli import main

SLOPE, VOLTS, LENGTH = 4e-3, 2.0, 50e-6
FALLING = Material("falling", 100.0, 2000.0, 700.0, 1e-5, -SLOPE)
HEATED = VOLTS**2 / (LENGTH**2 * FALLING.resistivity)
RUNS_AWAY = FALLING.heat_capacity * (1 - LEAST**2) / (2 * SLOPE * HEATED)
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
    rise = (1 - np.sqrt(1 - 0.9 * (1 - LEAST**2))) / SLOPE
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
    with pytest.raises(RunawayError) as steady:
        solve(replace(scene, steady=True, output_times=()))
    assert f"the largest voltage with a steady state is {steady.value.limit:.4g} V" in said


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
    with pytest.raises(NumericsError, match="not positive at the given temperatures"):
        steady_on(scene, plain_grid(scene), VOLTS)
