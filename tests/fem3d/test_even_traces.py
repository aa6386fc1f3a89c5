"""A wire between cold ends, whose mirror plane a probe of its potential keeps from being used: every second degree
changes nothing, and errors over time hold all the same."""

from dataclasses import replace

import numpy as np
import pytest

from fem3d.runs.scene import solve
from scenes.loading import load_free
from scenes.model import Boundary, Box, Material, Probe, Scene

LENGTH, SIDE, CURRENT = 2e-4, 2e-6, 0.02
METAL = Material("metal", 230.0, 2700.0, 900.0, 3e-8)


def wire(accuracy: float) -> Scene:
    near, far = (((x, 0.0, 0.0), (x, SIDE, SIDE)) for x in (0.0, LENGTH))
    middle = (LENGTH / 2, SIDE / 2, SIDE / 2)
    conditions = (
        Boundary("cold", "temperature", *near, 300.0), Boundary("cold too", "temperature", *far, 300.0),
        Boundary("in", "voltage", *near, CURRENT, series_resistance=np.inf), Boundary("out", "voltage", *far, 0.0),
    )  # fmt: skip
    probes = Probe("middle", middle, middle), Probe("drop", *near, "potential")
    boxes = (Box("wire", METAL, (0.0, 0.0, 0.0), (LENGTH, SIDE, SIDE)),)
    return Scene("wire", boxes, conditions, probes, 300.0, 2e-3, accuracy)


@pytest.mark.parametrize("accuracy", [1e-4, 1e-5])
def test_a_trace_whose_last_degree_changes_nothing_is_known_to_its_error(accuracy):
    traces = solve(wire(accuracy)).traces
    times = traces.time[traces.time >= 2e-6]
    n, capacity = np.arange(1, 4000, 2), METAL.density * METAL.specific_heat
    heat = (CURRENT / SIDE**2) ** 2 * 3e-8  # W/m3
    rates = METAL.thermal_conductivity / capacity * (n * np.pi / LENGTH) ** 2
    parts = 4 / (np.pi * n) * np.sin(n * np.pi / 2) * heat / capacity / rates
    exact = 300.0 + (1 - np.exp(-np.outer(times, rates))) @ parts
    found = traces.values["middle"][traces.time >= 2e-6]
    # An even solution on a mesh of degree 7 is off by 150 times what its last degree, of odd functions, changes.
    assert np.abs(found - exact).max() <= traces.errors["middle"] < 10 * accuracy * np.ptp(exact)


def test_largest_current_is_the_inrush_at_the_start():
    """The cold conductor carries most; its error is bounded at t = 0, before the errors of traces hold."""
    scene = replace(load_free("hotplate"), end_time=1e-3, output_times=(1e-3,), accuracy=1e-2)
    close = solve(replace(scene, accuracy=1e-3)).over_time
    traces = solve(scene).over_time
    assert traces.values["current"].argmax() == 0
    assert traces.values["current"][0] == pytest.approx(2 / 44)
    for name in traces.values:
        times = close.time[(close.time > 0) & (close.time < traces.since)]
        apart = np.abs(np.subtract(*(np.interp(times, each.time, each.values[name]) for each in (traces, close))))
        assert (apart <= traces.error_at(name, times) + close.error_at(name, times)).all(), name
