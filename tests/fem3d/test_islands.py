"""A row of spans in 3D: against a second path, and a long row against one that is solved whole."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from fem3d.runs import long_rows
from fem3d.runs import sink as sink_run
from scenes.sink import Sink, decay, different
from tests.fem3d.row_second_path import Rises, SecondRow

SECOND = 5e-4
"""Of the final rise: what the second path's mesh and steps leave. Halving both moves its rises by 1e-4 steady and by
3e-4 over time."""


def apart(sink: Sink, other: Rises, time: float | None) -> dict[str, float]:
    """By how much a row and the second path differ, over what both errors allow."""
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


@pytest.mark.parametrize("contrast", [1e2, 1e8, 1e12])
def test_spans_hardly_joined_differ_by_what_passes_an_island(contrast: float) -> None:
    sink = Sink(spans=9, silicon=replace(Sink().silicon, thermal_conductivity=1 / contrast))
    r = decay(sink)
    assert 0 < r < 1e-3
    assert long_rows.modelled(sink) == 5
    more = decay(replace(sink, silicon=replace(sink.silicon, thermal_conductivity=10 / contrast)))
    assert more == pytest.approx(10 * r, rel=20 * r)


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
def test_spans_that_stand_for_others_differ_by_no_more_than_their_error(monkeypatch: pytest.MonkeyPatch) -> None:
    """Short spans on thick oxide, so that what the ends do is felt far into the row."""
    sink = Sink(spans=12, length=200e-6, oxide_thickness=8e-6, accuracy=1e-2)
    short = sink_run.solve(sink, False)
    assert short.details["spans_solved"] < 12
    monkeypatch.setattr(long_rows, "modelled", lambda sink: sink.spans)
    whole = sink_run.solve(sink, False)
    assert list(whole.steady) == [n for n in whole.steady if n in short.steady]
    # On meshes that differ, so that their errors count as well; without them the spans are closer than what is said.
    for name, exact in whole.steady.items():
        assert abs(short.steady[name].value - exact.value) < short.steady[name].error + exact.error, name
    inner = f"span{different(12)}_mean_rise_K"
    assert abs(short.steady[inner].value / whole.steady[inner].value - 1) < short.details["alike_error"]


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
