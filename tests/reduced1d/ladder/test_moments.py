"""The few-state model: its moments, its balance and its cost; names of reductions."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from reduced1d import ladder
from reduced1d.ladder.beam import moment_fields
from reduced1d.ladder.few_states import Trajectory, steady
from reduced1d.ladder.levels import Levels
from reduced1d.ladder.plate import factorize
from scenes.errors import SceneError
from scenes.sink import Sink
from tests.reduced1d import relative


def test_the_response_is_matched_at_the_rate_and_at_rest(levels):
    """The mean rise per watt at a rate p, of the plate and of its projection on fields without feedback."""
    plate, inverse = levels.fine.plate.model, levels.fine.plate.inverse
    cold = inverse.solve(plate.source)
    model = plate.on(moment_fields(plate, cold, cold, 4)).in_modes()
    slowest = float(cold @ (plate.conductance @ cold)) / float(cold @ (plate.capacity @ cold))
    matched = np.sqrt(slowest / 1e-5)
    # Between the rates it is near only: the match there is no accident.
    for rate, near in ((0.0, True), (matched, True), (30 * matched, False)):
        field = factorize((plate.conductance + rate * plate.capacity).tocsc()).solve(plate.source)
        mean = relative(float(plate.source @ field), 1e-9 if near else 1e-6)
        assert bool(model.source @ (model.source / (model.rates + rate)) == mean) is near


@pytest.mark.parametrize("states", [1, 3, 4, 8])
def test_it_is_stable_and_has_the_plates_steady_state(levels, states):
    model, plate = levels.fine.moments(states), levels.fine.whole_plate()
    assert model.states == states
    assert np.all(model.rates > 0)
    ours, theirs = steady(model), steady(plate)
    for key, value in theirs.items():
        assert ours[key] == relative(value, 1e-7)


def test_more_states_are_nearer_to_the_plate(levels):
    times = np.geomspace(1e-5, 0.02, 80)
    plate = Trajectory(levels.fine.whole_plate(), times[-1]).quantities(times)
    few = [Trajectory(levels.fine.moments(n), times[-1]).quantities(times) for n in (1, 2, 3, 4, 6)]
    off = [np.abs(each["peak_K"] - plate["peak_K"]).max() for each in few]
    assert all(after < before / 2 for before, after in pairwise(off))


def test_names():
    assert ladder.canonical("moments") == "moments:4"
    assert ladder.canonical("moments:03") == "moments:3"
    assert [ladder.canonical(name) for name in ("paper", "fin")] == ["paper", "fin"]
    for wrong in ("plat", "fin:2", "moments:", "moments:x", "moments:0", "moments:13", "moments:\u00b2", ""):
        with pytest.raises(SceneError, match="reduction"):
            ladder.canonical(wrong)


@pytest.mark.parametrize("name", ["paper", "anchored", "fin-massless", "fin", "plate", "moments:3"])
def test_every_reduction_answers_alike(name, levels):
    found = ladder.solve(levels.sink, name, levels=levels)
    assert found.model == name
    assert set(found.steady) == {
        "peak_rise_K", "end_rise_K", "mean_rise_K", "current_A", "power_W", "heat_out_W", "anchor_resistance_K_per_W",
    }  # fmt: skip
    assert found.traces.time[0] == 0.0
    assert found.traces.time[-1] == levels.sink.end_time
    assert set(found.traces.values) == {"peak_K", "end_K", "mean_K", "current_A", "power_W"} == set(found.traces.errors)
    last = found.traces.values["peak_K"][-1] - levels.sink.room_temperature
    assert last == relative(found.steady["peak_rise_K"].value, 1e-4)
    assert ladder.solve(levels.sink, name, steady_only=True, levels=levels).traces is None


def test_its_own_times_are_dense_enough(levels):
    sink = replace(levels.sink, accuracy=1e-3)
    found = ladder.solve(sink, "moments:4", levels=Levels(sink)).traces
    times = np.geomspace(1e-7, sink.end_time, 3000)
    exact = Trajectory(levels.fine.moments(4), times[-1]).quantities(times)
    for key, scale in (("peak_K", exact["peak_K"][-1]), ("end_K", exact["end_K"][-1])):
        chords = np.interp(times, found.time, found.values[key]) - sink.room_temperature
        assert np.abs(chords - exact[key]).max() < sink.accuracy * scale


def test_reductions_of_a_beam_wider_than_its_pads():
    sink = Sink(width=200e-6, pad_width=100e-6, oxide_width=80e-6, electrodes="pad-edge", convection_coefficient=50.0)
    levels = Levels(sink)
    plate = ladder.solve(sink, "plate", levels=levels, steady_only=True)
    few = ladder.solve(sink, "moments:3", levels=levels, steady_only=True)
    assert few.steady["peak_rise_K"].value == relative(plate.steady["peak_rise_K"].value, 1e-6)
    lost = plate.details["air_loss_W"]
    assert plate.steady["power_W"].value == relative(plate.steady["heat_out_W"].value + lost, 1e-12)
    assert lost > 0
