"""The common form's steady state and steps, against the exact solutions that other modules have."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from reduced1d.ladder.beam import Anchor
from reduced1d.ladder.beam import fin as sparse_fin
from reduced1d.ladder.few_states import FewStates, Trajectory, largest_drive, lumps, steady, steady_state
from scenes.errors import RunawayError
from scenes.sink import SILICON, Drive, Sink
from tests.fin import fin_runaway_voltage, solve_fin
from tests.reduced1d import relative

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


def fin(sink: Sink, anchor: Anchor) -> FewStates:
    """The fin in all its modes."""
    model = sparse_fin(sink, anchor)
    return model.on(np.eye(model.states)).in_modes()


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
