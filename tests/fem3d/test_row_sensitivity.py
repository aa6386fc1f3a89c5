"""Derivatives of a row of spans: against differences of whole runs, and of a row that is solved whole."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fem3d import alike, run, sink_sensitivity
from fem3d.sink_sensitivity import Slopes
from scenes.plan import Request
from scenes.sink import Sink
from scenes.varied import varied

STEADY = Request(models=("fem3d",), transient=False)
LONG = Sink(spans=8, accuracy=1e-2, electrodes="pad-edge", convection_coefficient=1e4)
KEYS = ("sink.length", "drive.voltage", "materials.silicon.temperature_coefficient")


def slopes(sink: Sink, request: Request = STEADY) -> Slopes:
    return sink_sensitivity.of_sink(sink, run.solve(sink, request), keys=KEYS)


@pytest.fixture(scope="module")
def long() -> Slopes:
    found = run.solve(LONG, STEADY)
    assert found.details["spans_solved"] == 5
    return sink_sensitivity.of_sink(LONG, found, keys=KEYS)


def test_spans_that_stand_for_others_have_the_derivatives_of_those(
    long: Slopes, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(alike, "modelled", lambda sink: sink.spans)
    whole = slopes(LONG)
    for key, of in whole.steady.items():
        assert of.keys() == long.steady[key].keys()
        for name, exact in of.items():
            found = long.steady[key][name]
            # Both are off by the discretisation, on meshes that differ; none by more than a few thousandths.
            assert abs(found.value - exact.value) < found.error + exact.error, (key, name)
            assert found.error < 0.02


def test_a_longer_row_is_seen(long: Slopes) -> None:
    """The twin: the current of a row that stands for fewer spans follows its pads more."""
    other = slopes(replace(LONG, spans=6))
    key = "sink.length"
    assert abs(other.steady[key]["current_A"].value - long.steady[key]["current_A"].value) > 1e-3


def test_over_time() -> None:
    """Against differences of whole runs, the top of an outer span among them, which wanders."""
    sink, step = Sink(spans=3, accuracy=1e-2, length=400e-6), 0.02
    course = slopes(sink, Request()).course
    assert course is not None
    times = np.array([1e-4, 1e-3])
    for key in KEYS[:1]:
        runs = [run.solve(replace(varied(sink, key, f), accuracy=1e-3), Request()).traces for f in (1 + step, 1 - step)]
        for name, slope in course.values[key].items():
            start = sink.room_temperature if name.endswith("_K") else 0.0
            more, less = (np.interp(times, t.time, t.values[name]) - start for t in runs if t is not None)
            expected = np.log(more / less) / np.log((1 + step) / (1 - step))
            found = np.interp(np.log(times), np.log(course.times), slope)
            # Two runs at 1e-3 over the difference of their keys, where their meshes are not alike.
            assert found == pytest.approx(expected, abs=course.errors[key][name] + 5e-3), (key, name)
