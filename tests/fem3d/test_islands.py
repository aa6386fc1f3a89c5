"""A row of spans in 3D, against a second path."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from fem3d.runs import sink as sink_run
from scenes.sink import Sink
from tests.fem3d.row_second_path import Rises, SecondRow

SECOND = 5e-4
"""Of the final rise: what the second path's mesh and steps leave. Halving both moves its rises by 1e-4 steady and by
3e-4 over time."""


def apart(sink: Sink, other: Rises, time: float | None) -> dict[str, float]:
    """Return the differences of a row and the second path over the sum of their errors."""
    found = sink_run.solve(sink, time is not None)
    off = {}
    for name, value in other.items():
        steady = found.steady[name]
        if time is None:
            mine, error = steady.value, steady.error
        else:
            assert found.traces is not None
            trace = name.replace("_rise_K", "_K")
            mine = float(np.interp(time, found.traces.time, found.traces.values[trace]))
            mine -= sink.room_temperature if trace != name else 0.0
            error = found.traces.errors[trace]
        # The current follows the rises by the coefficient of its resistance.
        allowed = SECOND * (0.01 if name == "current_A" else 1.0) * abs(steady.value)
        off[name] = abs(mine - value) / (error + allowed)
    return off


PAIR = Sink(spans=2, convection_coefficient=100.0)


@cache
def second(sink: Sink) -> Rises:
    return SecondRow(sink, 8e-6).steady()


@pytest.mark.long
@pytest.mark.parametrize("sink", [PAIR, Sink(spans=3, length=400e-6, convection_coefficient=10.0)])
def test_a_row_agrees_with_a_second_path(sink: Sink) -> None:
    assert max(apart(sink, second(sink), None).values()) < 1


@pytest.mark.long
def test_a_row_agrees_with_a_second_path_over_time() -> None:
    sink = Sink(spans=3)
    assert max(apart(sink, SecondRow(sink, 8e-6).at(1e-3), 1e-3).values()) < 1


@pytest.mark.long
def test_a_shorter_island_is_seen() -> None:
    """The twin: another island must not pass for the same."""
    assert max(apart(replace(PAIR, island_length=45e-6), second(PAIR), None).values()) > 10


@pytest.mark.long
def test_spans_and_islands_carry_all_heat() -> None:
    """Every watt leaves through an anchor or an island, whichever of them are solved."""
    for spans in (2, 3, 20):
        found = sink_run.solve(Sink(spans=spans, accuracy=1e-2), False)
        value = {name: e.value for name, e in found.steady.items()}
        islands = [value[f"island{min(k, spans - k)}_heat_W"] for k in range(1, spans)]
        assert 2 * value["anchor_heat_W"] + sum(islands) == pytest.approx(value["heat_out_W"], rel=1e-12)
        assert value["heat_out_W"] == pytest.approx(value["power_W"], rel=1e-3)
        assert found.details["energy_imbalance"] < 1e-9


def test_the_ends_of_a_row_are_like_those_of_one_span() -> None:
    """An anchor resistance is the anchor's own, whatever it carries."""
    one, row_of_three = (sink_run.solve(Sink(spans=n, accuracy=1e-2), False).steady for n in (1, 3))
    name = "anchor_resistance_K_per_W"
    assert row_of_three[name].value == pytest.approx(one[name].value, rel=1e-3)
