"""The quarter of a sink against the whole."""

from dataclasses import replace

import numpy as np
import pytest

from fem3d.runs.scene import solve
from scenes.sink import Sink
from tests.fem3d import silicon

SINKS = [
    Sink(voltage=8.0, convection_coefficient=200.0),
    Sink(voltage=-5.0, electrodes="pad-edge", room_temperature=280.0),
    Sink(voltage=4.0, silicon=silicon(-5e-4), oxide_offset=20e-6),
]


@pytest.mark.parametrize("sink", SINKS)
def test_quarter_has_values_of_whole(sink):
    scene = replace(sink.scene(), steady=True, accuracy=1e-3)
    quarter, whole = solve(scene), solve(scene, whole=True)
    assert (quarter.details["symmetry"], whole.details["symmetry"]) == ("the quarter", "the whole")
    for name, found in quarter.steady.items():
        assert abs(found.value - whole.steady[name].value) <= found.error + whole.steady[name].error, name


@pytest.mark.long
def test_traces_of_quarter_are_those_of_whole():
    scene = replace(SINKS[0].scene(), accuracy=1e-2)
    quarter, whole = solve(scene).over_time, solve(scene, whole=True).over_time
    times = np.geomspace(1e-5, 0.02, 20)
    for name, error in quarter.errors.items():
        one, other = (np.interp(times, t.time, t.values[name]) for t in (quarter, whole))
        assert np.abs(one - other).max() <= error + whole.errors[name], name
