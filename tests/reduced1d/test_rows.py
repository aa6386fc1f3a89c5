"""Rows of spans in 1D: the paper's equations for unequal ends, and the fin along the whole row."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad, solve_bvp

from reduced1d import equations, ladder
from reduced1d.equations import anchor_series_resistance
from reduced1d.ladder.few_states import half_island, lumps, steady
from reduced1d.ladder.plate import film
from scenes.errors import SceneError
from scenes.sink import Sink

K, A, L = 130.0, 2e-10, 1e-3


@pytest.mark.parametrize("R", [100.0, 1861.76, 1e6])
def test_equal_ends_are_the_papers(R):
    dT0, left, right = equations.unequal_ends(13.7, R, R, K, A, L)
    assert left == right == pytest.approx(equations.end_rise_from_equivalent(13.7, R, K, A, L), rel=1e-14)
    assert dT0 == pytest.approx(equations.peak_above_end(left, R, K, A, L), rel=1e-13)
    assert equations.unequal_peak(dT0, left, right) == pytest.approx(dT0 + left, rel=1e-14)


def test_unequal_ends_are_what_a_parabola_and_two_resistances_say():
    """The mean, both flows and the top of the profile itself."""
    R1, R2 = 1861.76, 25_000.0
    dT0, left, right = equations.unequal_ends(10.0, R1, R2, K, A, L)

    def profile(y: float) -> float:
        return equations.parabola_between(y, dT0, left, right, L)

    step = 1e-6
    assert quad(profile, 0, L)[0] / L == pytest.approx(10.0, rel=1e-12)
    assert (profile(step) - profile(-step)) / (2 * step) * K * A == pytest.approx(left / R1, rel=1e-9)
    assert (profile(L - step) - profile(L + step)) / (2 * step) * K * A == pytest.approx(right / R2, rel=1e-9)
    top = max(profile(y) for y in np.linspace(0, L, 20_001))
    assert equations.unequal_peak(dT0, left, right) == pytest.approx(top, rel=1e-8)
    assert equations.unequal_peak(1.0, 0.0, 5.0) == 5.0


def test_a_rows_lumps_are_in_one_circuit():
    """Heat, resistance and voltage of the spans add up to the totals of the row."""
    sink = Sink(spans=5)
    found = {name: e.value for name, e in ladder.solve(sink, "paper", steady_only=True).steady.items()}
    rho, a = equations.room_resistivity(sink.silicon, sink.room_temperature)
    of_span = [equations.resistance(found[f"span{min(k, 6 - k)}_mean_rise_K"], rho, a, L, A) for k in range(1, 6)]
    assert found["current_A"] == pytest.approx(5 / sum(of_span), rel=1e-11)
    islands = [found[f"island{min(k, 5 - k)}_heat_W"] for k in range(1, 5)]
    assert 2 * found["anchor_heat_W"] + sum(islands) == pytest.approx(found["power_W"], rel=1e-11)
    assert found["end_rise_K"] / found["anchor_heat_W"] == pytest.approx(anchor_series_resistance(sink), rel=1e-12)
    assert half_island(sink) == pytest.approx(2 * 2e-6 / (1.38 * 50e-6 * 50e-6), rel=1e-12)


def test_only_the_outer_spans_differ():
    found = ladder.solve(Sink(spans=7), "paper", steady_only=True).steady
    names = [f"span{k}_mean_rise_K" for k in range(1, 5)]
    assert found[names[1]].value == found[names[3]].value != found[names[0]].value


def test_a_span_between_anchors_of_islands_alone_is_the_papers_sink():
    """A row with anchors like its islands has spans that are all alike, and like one sink on such anchors."""
    sink = Sink(spans=4)
    row = lumps(sink, half_island(sink))
    one = steady(lumps(replace(sink, spans=1), half_island(sink)))
    all_of = steady(row)
    assert all_of["span1_mean_rise_K"] == pytest.approx(one["mean_rise_K"], rel=1e-11)
    assert all_of["span2_peak_rise_K"] == pytest.approx(one["peak_rise_K"], rel=1e-11)
    assert all_of["current_A"] == pytest.approx(one["current_A"], rel=1e-11)


def test_the_fin_of_a_row_solves_its_equation():
    """Against a boundary-value solver on the same equation, with no feedback so that one current does."""
    silicon = replace(Sink().silicon, temperature_coefficient=0.0)
    sink = Sink(spans=3, silicon=silicon, convection_coefficient=300.0)
    found = ladder.solve(sink, "fin", steady_only=True)
    anchor = found.steady["anchor_resistance_K_per_W"].value
    k, area, rho = silicon.thermal_conductivity, sink.cross_section, silicon.resistivity or 0.0
    current = found.steady["current_A"].value
    assert current == pytest.approx(3.0 / (rho * sink.row_length / area), rel=1e-10)
    ends = [1e-3, 1.05e-3, sink.row_length / 2]

    def slopes(y: np.ndarray, u: np.ndarray) -> np.ndarray:
        over = (y > ends[0]) & (y < ends[1])
        loss = sink.convection_coefficient * sink.width + over * film(sink) * sink.island_width
        return np.array([u[1], (loss * u[0] - current**2 * rho / area) / (k * area)])

    def at_ends(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return np.array([k * area * a[1] - a[0] / anchor, b[1]])

    y = np.unique(np.concatenate([np.linspace(0, ends[2], 301), [ends[0] - 1e-12, ends[0] + 1e-12, ends[1] + 1e-12]]))
    exact = solve_bvp(slopes, at_ends, y, np.zeros((2, len(y))), tol=1e-6, max_nodes=20_000)
    # The error of the polynomials is the change by finer ones (the result's own error), and the solver's tolerance.
    for name, place in (("end_rise_K", 0.0), ("span1_middle_rise_K", 0.5e-3), ("span2_middle_rise_K", ends[2])):
        value = found.steady[name]
        assert float(exact.sol(place)[0]) == pytest.approx(value.value, abs=2e-5 * value.value + value.error)


def test_what_is_made_for_one_span_says_so():
    with pytest.raises(SceneError, match="made for one span"):
        ladder.solve(Sink(spans=2), "plate")


def test_a_long_row_is_solved_whole():
    """At one current the spans in the middle of 100 are alike, and like the inner spans of 20."""
    silicon = replace(Sink().silicon, temperature_coefficient=0.0)
    per_heat = []
    for spans in (100, 20):
        found = ladder.solve(Sink(spans=spans, silicon=silicon), "fin", times=np.array([0.0, 1e-4, 1e-3]))
        heat = found.steady["current_A"].value ** 2
        values = [found.steady[f"{name}_rise_K"].value for name in ("span9_mean", "span9_peak", "end")]
        late = [found.over_time.values[f"{name}_K"][1:] - 293.0 for name in ("span9_mean", "end")]
        per_heat.append(np.concatenate([values, *late]) / heat)
        middle = found.steady[f"span{spans // 2}_mean_rise_K"].value
        assert found.steady[f"span{spans // 2 - 1}_mean_rise_K"].value == pytest.approx(middle, rel=1e-6)
    assert per_heat[0] == pytest.approx(per_heat[1], rel=3e-5)
