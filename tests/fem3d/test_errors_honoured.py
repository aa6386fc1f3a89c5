"""Reported errors against true errors, for cheap sinks, and heat in against heat out and stored; the truth
is a run at 1e-4, whose own error is allowed for."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks import invariants
from benchmarks.random_boxes import draw
from fem3d.runs import sink as sink_run
from scenes.result import Estimate
from scenes.sink import Sink
from tests.fem3d import silicon

SINKS = {
    "paper": Sink(),
    "pads": Sink(voltage=6.0, electrodes="pad-edge", convection_coefficient=200.0),
    "narrow": Sink(
        length=500e-6, width=40e-6, pad_length=100e-6, oxide_width=80e-6, silicon=silicon(-5e-4), voltage=-2.0,
        room_temperature=250.0,
    ),
}  # fmt: skip


@pytest.fixture(scope="module", params=SINKS)
def sink(request):
    return SINKS[request.param]


@pytest.fixture(scope="module")
def runs(sink):
    return {a: sink_run.solve(replace(sink, accuracy=a)) for a in (1e-2, 1e-3, 1e-4)}


def broken(found, truth):
    """The quantities of a steady state whose true error is beyond the reported one (and the truth's own)."""
    return [q for q, e in found.items() if abs(e.value - truth[q].value) > e.error + truth[q].error]


@pytest.mark.parametrize("accuracy", [1e-2, 1e-3])
def test_steady_quantities_are_within_their_errors_and_the_accuracy(runs, accuracy):
    found, truth = runs[accuracy].steady, runs[1e-4].steady
    assert broken(found, truth) == []
    for name, e in found.items():
        assert 0 < e.error <= accuracy * abs(e.value), name
        assert abs(e.value / truth[name].value - 1) <= accuracy, name
    wrong = {q: Estimate(e.value + 3 * e.error, e.error) for q, e in found.items()}
    assert broken(wrong, truth) == list(found)


def astray(found, truth, shift=0.0):
    """The traces whose distance from the truth at any time from 10 us on is beyond their error."""
    time = np.unique(np.concatenate([np.geomspace(1e-5, found.time[-1], 400), found.time[found.time >= 1e-5]]))
    beyond = []
    for name, error in found.errors.items():
        value = np.interp(time, found.time, found.values[name]) + shift * error
        distance = np.abs(value - np.interp(time, truth.time, truth.values[name])).max()
        if distance > error + truth.errors[name]:
            beyond.append(name)
    return beyond


@pytest.mark.parametrize("accuracy", [1e-2, 1e-3])
def test_traces_between_rows_too_are_within_their_errors_and_the_accuracy(sink, runs, accuracy):
    found, truth = runs[accuracy].traces, runs[1e-4].traces
    assert astray(found, truth) == []
    assert set(astray(found, truth, 3.0)) == set(found.values)
    steady = runs[1e-4].steady
    for name in ("peak", "end", "mean"):
        assert found.errors[f"{name}_K"] <= accuracy * steady[f"{name}_rise_K"].value
        assert abs(found.values[f"{name}_K"][0] - sink.room_temperature) < 1e-9


def test_a_trace_ends_in_the_steady_state_when_the_run_is_long(sink, runs):
    found, steady = runs[1e-3].traces, runs[1e-3].steady
    for name, key in (("peak_K", "peak_rise_K"), ("mean_K", "mean_rise_K")):
        last = found.values[name][-1] - sink.room_temperature
        assert abs(last - steady[key].value) <= 2 * found.errors[name] + 1e-3 * steady[key].value


def test_heat_balances_steady_to_rounding_and_over_time_to_the_accuracy(sink, runs):
    for found in runs.values():
        assert 0 <= found.details["energy_imbalance"] < 1e-9
        assert abs(found.steady["power_W"].value / (sink.voltage * found.steady["current_A"].value) - 1) < 1e-9
    # A tenth of the accuracy, which the reduced space may lose in its balance; how much is chance.
    assert 0 < runs[1e-4].details["transient_imbalance"] < 1e-5
    assert 0 < runs[1e-2].details["transient_imbalance"] < 1e-3


@pytest.mark.long
@pytest.mark.parametrize("seed", [1349, 425])
def test_errors_hold_where_the_rim_of_an_electrode_causes_nearly_all_of_them(seed):
    """An edge of exponent 1/3 in a film thinner than the cells beside it; one of 1/2 in half of a scene."""
    drawn = draw(seed)
    found = invariants.solve(drawn.scene)
    assert 0.01 < invariants.compared(drawn, found, 10.0)[0] < 0.8
    less = replace(found, steady={q: Estimate(e.value, e.error / 10) for q, e in found.steady.items()})
    assert invariants.compared(drawn, less, 10.0)[0] > 1


@pytest.mark.long
def test_heat_is_in_balance_after_a_jump_of_a_given_temperature():
    """A slab that follows its cold face within a hundredth of the earliest time of interest."""
    drawn = draw(238)
    found = invariants.solve(drawn.scene)
    assert len(found.over_time.jumps) == 1
    assert 0 < found.details["energy_imbalance"] < 1e-3


@pytest.mark.long
@pytest.mark.parametrize("seed", [278, 958])
def test_traces_hold_where_heat_passes_by_a_singular_edge_and_where_they_are_asked_for_soon_after_a_jump(seed):
    """Two good conductors meet at an edge among poor conductors: a step from rest shows a third of the change by a
    degree. A flux jumps just before an output time, at a thirteenth of the first one."""
    drawn = draw(seed)
    found = invariants.solve(drawn.scene)
    assert 0.1 < invariants.compared(drawn, found, 10.0)[0] < 0.9
    less = replace(found.over_time, errors={name: error / 5 for name, error in found.traces.errors.items()})
    assert invariants.compared(drawn, replace(found, traces=less), 10.0)[0] > 1
