"""Models of few states: their steady state and steps against exact solutions, their moments, and names of
reductions."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from reduced1d import ladder
from reduced1d.ladder.beam import Anchor, moment_fields
from reduced1d.ladder.few_states import Trajectory, largest_drive, lumps, steady, steady_state
from reduced1d.ladder.levels import Levels
from reduced1d.ladder.plate import factorize
from scenes.errors import RunawayError, SceneError
from scenes.sink import SILICON, Drive, Sink
from tests.fin import fin_runaway_voltage, solve_fin
from tests.reduced1d import fin, relative

FALLING = replace(SILICON, temperature_coefficient=-1e-3)
CONSTANT = replace(SILICON, temperature_coefficient=0.0)
SINKS = {
    "default": Sink(),
    "hot": Sink(voltage=20.0),
    "negative": Sink(voltage=-3.0),
    "falling": Sink(voltage=4.0, silicon=FALLING),
    "constant": Sink(voltage=3.0, silicon=CONSTANT),
    "air": Sink(voltage=2.0, convection_coefficient=300.0),
}
TIMES = np.concatenate([[0.0], np.geomspace(1e-6, 0.02, 60)])


def bare(resistance: float) -> Anchor:
    """An anchor that is a resistance and nothing else."""
    return Anchor(resistance, pad=0.0, oxide=0.0, air=0.0, circuit=0.0, source=0.0, feedback=0.0)


@pytest.mark.parametrize("sink", SINKS.values(), ids=SINKS)
@pytest.mark.parametrize("resistance", [10.0, 2663.0, 5e4])
def test_the_fin_is_the_exact_fin_in_the_steady_state(sink, resistance):
    # At 4 V a falling resistance runs away on the worst of the anchors.
    limit = min(abs(sink.voltage), 0.95 * fin_runaway_voltage(sink, resistance))
    sink = replace(sink, voltage=np.copysign(limit, sink.voltage))
    exact, found = solve_fin(sink, resistance), steady(fin(sink, bare(resistance)))
    # 26 polynomial degrees along half the beam leave rounding.
    for key, value in (("peak", exact.peak_rise), ("end", exact.end_rise), ("mean", exact.mean_rise)):
        assert found[f"{key}_rise_K"] == relative(value, 1e-9)
    assert found["current_A"] == relative(exact.current, 1e-9)
    assert found["anchor_resistance_K_per_W"] == relative(resistance, 1e-9)


def test_runaway_is_the_exact_fins():
    sink = Sink(silicon=FALLING)
    model = fin(sink, bare(2663.0))
    limit = fin_runaway_voltage(sink, 2663.0)
    assert largest_drive(model) == relative(limit, 1e-8)
    steady_state(replace(model, drive=Drive(0.999 * limit)))
    with pytest.raises(RunawayError) as caught:
        steady_state(replace(model, drive=Drive(1.001 * limit)))
    assert caught.value.limit == relative(limit, 1e-8)


def test_without_feedback_every_mode_is_an_exponential():
    model = fin(SINKS["constant"], replace(bare(2663.0), pad=1e-7, oxide=1e-9))
    run = Trajectory(model, TIMES[-1])
    states, current = run.states(TIMES), run.quantities(TIMES)["current_A"]
    heat = (model.drive.value / model.resistance) ** 2 * model.source
    exact = heat * -np.expm1(-np.outer(TIMES, model.rates)) / model.rates
    rows = np.array([model.outputs["peak"], model.outputs["end"]]).T
    assert np.abs((states - exact) @ rows)[TIMES >= 1e-5].max() < 3e-5 * np.abs(exact @ rows).max()
    assert current == relative(model.drive.value / model.resistance, 1e-14)


@pytest.mark.parametrize("voltage", [2.0, 4.5])
def test_with_feedback_the_steps_are_those_of_a_general_integrator(voltage):
    """4.5 V is above the limit of 4.32 V: on the way to runaway the sweeps settle in shorter steps only."""
    model = lumps(Sink(voltage=voltage, silicon=FALLING), 2663.0)
    end = 0.02 if voltage < 4.0 else 0.006

    def rate(_: float, a: np.ndarray) -> np.ndarray:
        resistance = model.resistance + model.coefficient * model.source @ a
        heat = model.source + model.coefficient * model.feedback @ a
        return (model.drive.value / resistance) ** 2 * heat - model.rates * a

    times = np.linspace(0.0, end, 30)
    exact = solve_ivp(rate, (0.0, end), [0.0], t_eval=times, rtol=1e-10, atol=1e-14, method="Radau").y.T
    found = Trajectory(model, end).states(times)
    # Where the resistance is about to vanish, the inside of a step is less accurate than its ends.
    assert np.abs(found - exact).max() < (3e-5 if voltage < 4.0 else 3e-4) * np.abs(exact).max()
    with pytest.raises(RunawayError, match="runs away after"):
        Trajectory(replace(model, drive=Drive(20.0)), end)


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
    model, plate = levels.fine.moments(states), levels.fine.model("plate")
    assert model.states == states
    assert np.all(model.rates > 0)
    ours, theirs = steady(model), steady(plate)
    for key, value in theirs.items():
        assert ours[key] == relative(value, 1e-7)


def test_more_states_are_nearer_to_the_plate(levels):
    times = np.geomspace(1e-5, 0.02, 80)
    plate = Trajectory(levels.fine.model("plate"), times[-1]).quantities(times)
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
