"""The fields of a long row from the few of its spans that are solved."""

from __future__ import annotations

import numpy as np
import pytest

from fem3d.results.fields.row_fields import RowFields, RowQuadratic
from fem3d.runs import sink as sink_run
from scenes.sink import Sink, start

SINK = Sink(spans=9, accuracy=1e-2)
NOT_YET = np.empty(0)


@pytest.fixture(scope="module")
def cells() -> RowQuadratic:
    found = sink_run.solve(SINK, transient=False)
    assert found.details["spans_solved"] == 5
    fields = found.details["fields"]
    assert isinstance(fields, RowFields)
    return fields.quadratic(NOT_YET, SINK.accuracy)


def test_the_whole_row_is_there(cells: RowQuadratic) -> None:
    low, high = cells.points[:, 1].min(), cells.points[:, 1].max()
    assert [low, high] == pytest.approx([-SINK.pad_length, SINK.row_length + SINK.pad_length])
    corners = cells.points[cells.hexes[:, [0, 6]]]
    silicon = cells.material == cells.material_names.index("silicon")
    volume = np.abs(np.prod(corners[:, 1] - corners[:, 0], axis=1))[silicon].sum()
    pads = 2 * SINK.pad_length * SINK.pad_width
    assert volume == pytest.approx((SINK.row_length * SINK.width + pads) * SINK.thickness)
    assert cells.hexes.max() == len(cells.points) - 1


def test_both_halves_are_alike(cells: RowQuadratic) -> None:
    """The profile along the axis is its own mirror image, and no span within is unlike its neighbour."""
    on = (np.abs(cells.points[:, 0]) < 1e-12) & (np.abs(cells.points[:, 2] - SINK.thickness) < 1e-12)
    y, rise = cells.points[on, 1], cells.snapshot(0).temperature[on] - SINK.room_temperature
    order = np.argsort(y)
    at = start(SINK, 1) + SINK.length * np.arange(0.5, 9.5) + SINK.island * np.arange(9)
    middles = np.interp(at, y[order], rise[order])
    assert middles == pytest.approx(middles[::-1], rel=1e-3)
    assert middles[3:6] == pytest.approx(middles[4], rel=1e-3)
    assert middles[0] != pytest.approx(middles[4], rel=1e-2)


def test_the_current_is_one_and_the_voltage_is_that_of_all(cells: RowQuadratic) -> None:
    """Over every place of the row: what falls there is what the current makes of its resistance, and heats it."""
    found = cells.snapshot(0)
    y, volts = cells.points[:, 1], found.potential
    ends = [float(np.nanmean(volts[np.abs(y - end) < 1e-9])) for end in (0.0, SINK.row_length)]
    assert ends == pytest.approx([9 * SINK.voltage, 0.0], abs=1e-3)
    seen = np.isfinite(volts)
    place = np.interp(np.linspace(0, SINK.row_length, 50), *_means(y[seen], volts[seen]))
    assert np.diff(place, 2) == pytest.approx(0.0, abs=2e-3)  # the resistance follows the rise by up to 1 %
    along = found.current_density[:, 1]
    beam = along > along.max() / 2
    assert np.ptp(along[beam]) < 1e-2 * along.max()
    corners = cells.points[cells.hexes[:, [0, 6]]]
    volume = np.abs(np.prod(corners[:, 1] - corners[:, 0], axis=1))
    power = float(along[beam].mean()) * SINK.cross_section * 9 * SINK.voltage
    assert float(found.heat_source @ volume) == pytest.approx(power, rel=1e-3)


def _means(y: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    places, of = np.unique(np.round(y, 12), return_inverse=True)
    return places, np.bincount(of, values) / np.bincount(of)
