"""The network on real scenes: the paper's sink by hand, its table, and given currents."""

import math
from dataclasses import replace

import numpy as np
import pytest

from reduced1d.equations import room_resistivity
from reduced1d.ladder.beam import Anchor
from reduced1d.ladder.few_states import steady
from reduced1d.network import solve
from reduced1d.network.model import table
from reduced1d.network.solution import solve_sink as by_lines
from scenes.errors import RunawayError
from scenes.loading import load
from scenes.result import Result
from tests.reduced1d import fin
from tests.reduced1d.network.scenes import COLD, LONG, RHO, THICK, WIDE, C, box, flat, material, over, scene
from tests.reduced1d.network.test_closed_forms import AREA, BAR, FILM, LEFT, OHM, cooled_wire, over_time, rises


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


def test_the_sinks_anchor_by_hand():
    """The numbers that make 1282 and 958 K/W, as one reads them."""
    from dataclasses import replace

    scene = load("sink").scene()
    made = table(solve(replace(scene, steady=True)).details["model"].layout)
    joints = {row["what"]: row for row in made["joints"]}
    assert joints["pad-0 | beam"]["how"] == "ends meet, nothing between"
    down = joints["oxide-0 | pad-0"]
    assert down["how"] == "point by point, y = -100 um to -50 um of oxide-0 and y = -100 um to -50 um of pad-0"
    assert down["W/K"]["value"] == pytest.approx(2500e-12 / (1e-6 / 1.38 + 1e-6 / 130))
    beam = next(row for row in made["lines"] if row["what"] == "beam")
    assert beam["W/K"]["value"] == pytest.approx(26e-6)
    assert beam["ohm"]["value"] == pytest.approx(300)


def test_a_wire_over_time_at_given_currents():
    """C dT/dt = I^2 R (1 + a T) - G T, of a current that jumps."""
    coefficient, capacity = 3e-3, RHO * C * AREA * LONG
    limit = math.sqrt(FILM / OHM / coefficient)
    end = 4 * capacity / FILM
    currents, jump = (0.5 * limit, 0.3 * limit), end / 3
    exact: list[float] = []
    times = np.linspace(0, end, 31)
    for current, (start, stop) in zip(currents, ((0.0, jump), (jump, end)), strict=True):
        rate = (FILM - current**2 * OHM * coefficient) / capacity
        rest = current**2 * OHM / capacity / rate
        first = exact[-1] if exact else 0.0
        inside = times[(times >= start) & (times < stop - 1e-9 * end)] if stop < end else times[times >= start]
        exact += [*(rest + (first - rest) * np.exp(-rate * (inside - start)))]
        if stop < end:
            exact.append(rest + (first - rest) * math.exp(-rate * (stop - start)))
    values = np.delete(exact, np.searchsorted(times, jump))
    wire = cooled_wire(coefficient, end, current={"times": [jump, jump], "values": list(currents)})
    traces = solve(wire, times)
    over_time(traces, "middle", values)
    current = np.where(times >= jump, currents[1], currents[0])
    over_time(traces, "R", OHM * (1 + coefficient * values), start=0.0)
    over_time(traces, "P", current**2 * OHM * (1 + coefficient * values), start=0.0)


def test_the_wire_that_runs_away_at_a_given_current():
    """I^2 R (1 + a T) = G T has a state below I = sqrt(G / (a R)) alone; just below it there is a state."""
    limit = math.sqrt(FILM / OHM / 3e-3)
    with pytest.raises(RunawayError, match="the resistance rises as it heats; the largest current") as caught:
        solve(cooled_wire(3e-3, current=1.01 * limit))
    assert caught.value.limit == pytest.approx(limit, rel=1e-3)
    part = 0.99**2
    rises(solve(cooled_wire(3e-3, current=0.99 * limit)), middle=part / (1 - part) / 3e-3)


def test_a_current_through_sides():
    """A given current through an electrode on a side has the potential that gives the same current."""
    pads = ((0, 0, THICK), (LONG / 4, WIDE, THICK)), ((0.75 * LONG, 0, THICK), (LONG, WIDE, THICK))

    def bar(**drive: float) -> Result:
        return solve(scene(
            [box(*BAR)],
            [flat("cold", *LEFT, temperature=COLD), flat("plus", *pads[0], **drive),
             flat("minus", *pads[1], voltage=0)],
            [over("mean", *BAR), over("I", *pads[0], quantity="current"), over("face", *pads[0], quantity="potential"),
             over("R", *pads[0], quantity="resistance")],
            [material(resistivity=1e-5, temperature_coefficient=1e-3, reference_temperature=COLD)],
        ))  # fmt: skip

    given = bar(voltage=0.05)
    value = {name: estimate.value for name, estimate in given.steady.items()}
    rises(bar(current=value["I"]), I=value["I"], R=0.05 / value["I"], face=0.05, mean=value["mean"] - COLD)
    rises(bar(voltage=0.05 + 20 * value["I"], series_resistance=20), I=value["I"], face=0.05)
