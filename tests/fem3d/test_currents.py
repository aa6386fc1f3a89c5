"""Currents over time as sums of steady currents, from a function that multiplies voltages by given conductances."""

from types import SimpleNamespace

import numpy as np
import pytest

from fem3d.runs import currents
from scenes.errors import SceneError
from scenes.model import Boundary, Box, Probe, Scene, Schedule
from scenes.result import Estimate, Result
from scenes.sink import SILICON

SIEMENS = {"first": 2.0, "second": -0.5, "third": 0.25}  # current of the probe per volt of each electrode
ERROR = 1e-3  # relative, of each steady state
RAMP = Schedule((0.0, 1.0, 3.0), (0.0, 4.0, 0.0))
JUMP = Schedule((0.0, 2.0, 2.0, 3.0), (1.0, 1.0, -3.0, -3.0))


def scene(*values, **probe):
    box = Box("bar", SILICON, (0.0, 0.0, 0.0), (3.0, 1.0, 1.0))
    at = [((float(i), 0.0, 0.0), (float(i) + 1.0, 0.0, 1.0)) for i in range(len(values))]
    drives = tuple(Boundary(n, "voltage", *xs, v) for n, xs, v in zip(SIEMENS, at, values, strict=False))
    asked = Probe("current", (0.0, 0.0, 0.0), (1.0, 0.0, 1.0), **({"quantity": "current"} | probe))
    return Scene("bar", (box,), drives, (asked,), steady=False, end_time=3.0, output_times=(3.0,))


def steady(alone):
    """The steady state of given voltages."""
    total = sum(SIEMENS[b.name] * b.value for b in alone.boundaries)
    out = {f"current:{b.name}": np.array(SIEMENS[b.name] * b.value) for b in alone.boundaries}
    scales = {p.name: abs(total) for p in alone.probes}
    details = {
        "solution": SimpleNamespace(out=out),
        "scales": scales,
        "unknowns": 1,
        "electric_unknowns": 1,
        "energy_imbalance": 0.0,
        "warnings": [],
    }
    return Result("fem3d", {p.name: Estimate(total, abs(total) * ERROR) for p in alone.probes}, None, details)


def test_voltages_superpose_at_all_times():
    given = scene(RAMP, JUMP, 2.0)
    traces = currents.over_time(given, steady, ()).traces
    t = traces.time
    assert (t == 2.0).any()
    assert 0.0 < 2.0 - t[t < 2.0].max() < 1e-8
    exact = 2.0 * np.interp(t, *map(np.array, (RAMP.times, RAMP.values))) - 0.5 * np.where(t < 2.0, 1.0, -3.0) + 0.5
    # Sums of three numbers: rounding.
    assert np.abs(traces.values["current"] - exact).max() < 1e-12
    assert np.abs(traces.values["current"] - 1.001 * exact).max() > 1e-4
    # Each voltage's own error at its largest: 2 x 4, 0.5 x 3 and 0.25 x 2.
    assert traces.errors["current"] >= ERROR * (8.0 + 1.5 + 0.5) * (1 - 1e-12)


def test_an_extreme_under_two_voltages_is_no_sum():
    with pytest.raises(SceneError, match="2 voltages that vary"):
        currents.over_time(scene(RAMP, JUMP, quantity="potential", reduce="max"), steady, ())
