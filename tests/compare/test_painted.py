"""The 1D model on the 3D geometry: its own rises at its own places."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from reduced1d.painted import paint
from reduced1d.sink import anchor_series_resistance
from scenes.sink import Sink

SINK = Sink()
END, PEAK = 3.0, 19.0


def at(y: float, z: float = 1e-6, sink: Sink = SINK) -> float:
    return float(paint(sink, np.array([[0.0, y, z]]), END, PEAK)[0])


def test_beam_and_pad_meet_and_both_ends_are_alike() -> None:
    assert at(SINK.length / 2) == pytest.approx(PEAK)
    assert at(0.0) == pytest.approx(END)
    assert at(-1e-12) == pytest.approx(END, rel=1e-6)
    for y in (-120e-6, -20e-6, 100e-6):
        assert at(SINK.length - y) == pytest.approx(at(y))


def test_the_anchor_is_eq_14_s_two_prisms() -> None:
    """Where the pad reaches the oxide the rise is what the oxide's part of eq 14 leaves, and it ends in none."""
    thick, area = SINK.oxide_thickness, SINK.oxide_length * SINK.oxide_width
    oxide = thick / (SINK.oxide.thermal_conductivity * area) / anchor_series_resistance(SINK)
    assert at(-SINK.anchor_distance) == pytest.approx(END * oxide)
    assert at(-140e-6) == pytest.approx(END * oxide)
    assert at(-75e-6, -1e-6) == pytest.approx(END * oxide / 2)
    assert at(-75e-6, -2e-6) == pytest.approx(0.0, abs=1e-12)


def test_a_sink_whose_oxide_begins_at_the_beam() -> None:
    sink = replace(SINK, oxide_offset=0.0)
    assert at(-10e-6, sink=sink) == pytest.approx(END)
