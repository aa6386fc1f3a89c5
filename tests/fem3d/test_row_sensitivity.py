"""Derivatives of a row of spans: against differences of whole runs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fem3d.runs import sink as sink_run
from fem3d.runs import sink_sensitivity
from scenes.sink import Sink
from scenes.varied import varied

STEADY = False
KEYS = ("sink.length", "sink.island_length", "drive.voltage")


@pytest.mark.long
def test_over_time() -> None:
    """Against differences of whole runs, the top of an outer span among them, which wanders."""
    sink, step = Sink(spans=3, accuracy=1e-2, length=400e-6), 0.05
    key = KEYS[0]
    course = sink_sensitivity.of_sink(sink, sink_run.solve(sink), keys=[key]).course
    assert course is not None
    times = np.array([1e-4, 1e-3])
    runs = [sink_run.solve(replace(varied(sink, key, f), accuracy=1e-3)).traces for f in (1 + step, 1 - step)]
    for name, slope in course.values[key].items():
        start = sink.room_temperature if name.endswith("_K") else 0.0
        more, less = (np.interp(times, t.time, t.values[name]) - start for t in runs if t is not None)
        expected = np.log(more / less) / np.log((1 + step) / (1 - step))
        found = np.interp(np.log(times), np.log(course.times), slope)
        # Two runs at 1e-3 over the difference of their keys, where their meshes are not alike.
        assert found == pytest.approx(expected, abs=course.errors[key][name] + 5e-3), (key, name)
