"""The paper's sink as boxes: its anchor by hand, and the fin on that anchor."""

import math
from dataclasses import replace

import numpy as np
import pytest

from reduced1d.equations import room_resistivity
from reduced1d.ladder.beam import Anchor
from reduced1d.ladder.beam import fin as sparse_fin
from reduced1d.ladder.few_states import FewStates, steady
from reduced1d.network.solution import solve_sink as by_lines
from scenes.errors import SceneError
from scenes.loading import load
from scenes.sink import Sink


def fin(sink: Sink, anchor: Anchor) -> FewStates:
    """The fin in all its modes."""
    model = sparse_fin(sink, anchor)
    return model.on(np.eye(model.states)).in_modes()


def test_the_anchor_and_the_rises_of_the_fin_on_it():
    sink = load("sink")
    steady_state = by_lines(sink).steady
    rise = {name: steady_state[f"{name}_rise_K"].value for name in ("end", "peak", "mean")}
    resistance = steady_state["anchor_resistance_K_per_W"].value

    k, width, thick = sink.silicon.thermal_conductivity, sink.pad_width, sink.thickness
    along = sink.anchor_distance / (k * width * thick)
    down = sink.oxide_width / (thick / 2 / k + sink.oxide_thickness / sink.oxide.thermal_conductivity)
    m = math.sqrt(down / (k * width * thick))
    over = 1 / (math.sqrt(down * k * width * thick) * math.tanh(m * sink.oxide_length))
    assert along == pytest.approx(1282, abs=0.5)
    assert over == pytest.approx(958, abs=0.5)
    # The oxide, a line along the pad's, conducts along itself too: its k A is 0.4 % of the pad's.
    oxide = sink.oxide.thermal_conductivity * sink.oxide_width * sink.oxide_thickness / (k * width * thick)
    assert resistance == pytest.approx(along + over, rel=oxide)
    assert resistance == pytest.approx(2240, rel=1e-3)

    a = room_resistivity(sink.silicon, sink.room_temperature)[1]
    assert a > 0
    by_fin = steady(fin(sink, Anchor(resistance, 0, 0, 0, 0, 0, 0)))
    for name in ("end", "peak", "mean"):
        assert rise[name] == pytest.approx(by_fin[f"{name}_rise_K"], rel=1e-3)
        assert rise[name] != pytest.approx(by_fin[f"{name}_rise_K"] * (1 + 2e-3), rel=1e-3)
    assert steady_state["current_A"].value == pytest.approx(by_fin["current_A"], rel=1e-5)
    # All heat that the current makes (1 V) leaves by the oxide.
    for name in ("power_W", "heat_out_W"):
        assert steady_state[name].value == pytest.approx(steady_state["current_A"].value, rel=1e-9)


@pytest.mark.long
def test_traces_end_in_the_steady_state():
    """After some twenty-five of the slowest time constants, 1.6 ms; after a part of one they have not."""
    sink = replace(load("sink"), end_time=40e-3)
    traces = by_lines(sink, np.array([0.0, 0.6e-3, 40e-3])).over_time
    steady_state = by_lines(sink).steady
    for name in ("peak", "end", "mean"):
        rises = traces.values[f"{name}_K"] - sink.room_temperature
        assert rises[0] == 0
        assert rises[-1] == pytest.approx(steady_state[f"{name}_rise_K"].value, rel=1e-5)
        assert rises[1] < 0.9 * rises[-1]
    for name in ("current_A", "power_W"):
        assert traces.values[name][-1] == pytest.approx(steady_state[name].value, rel=1e-6)


def test_a_row_of_spans_is_refused():
    with pytest.raises(SceneError, match=r"sink\.spans is 3"):
        by_lines(replace(load("sink"), spans=3))
