"""Derivatives of a row of spans: against differences of whole runs, and of a row that is solved whole."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fem3d.runs import long_rows, sink_sensitivity
from fem3d.runs import sink as sink_run
from scenes.sink import Sink
from scenes.varied import varied

STEADY = False
LONG = Sink(spans=7, accuracy=1e-2, island_length=50e-6, convection_coefficient=1e4)
KEYS = ("sink.length", "sink.island_length", "drive.voltage")


@pytest.mark.long
def test_spans_that_stand_for_others_have_the_derivatives_of_those(monkeypatch: pytest.MonkeyPatch) -> None:
    found = sink_run.solve(LONG, STEADY)
    assert found.details["spans_solved"] == 5
    short = sink_sensitivity.of_sink(LONG, found, keys=KEYS)
    # Of the current's way 300 um of 7300 um are islands, whatever they do to the rise: of five spans 200 um of 5200 um.
    assert short.steady["sink.island_length"]["current_A"].value == pytest.approx(-300 / 7300, abs=1.5e-3)
    monkeypatch.setattr(long_rows, "modelled", lambda sink: sink.spans)
    whole = sink_sensitivity.of_sink(LONG, sink_run.solve(LONG, STEADY), keys=KEYS)
    for key, of in whole.steady.items():
        assert of.keys() == short.steady[key].keys()
        for name, exact in of.items():
            mine = short.steady[key][name]
            # Both are off by the discretisation, on meshes that differ; none by more than a few thousandths.
            assert abs(mine.value - exact.value) < mine.error + exact.error, (key, name)
            assert mine.error < 0.02


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
