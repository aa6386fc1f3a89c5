"""Beyond one sink in 1D: rows of spans, the spreading resistance of a plate below, and derivatives by their formulas.

The comparison of the plate with 3D is in `tests/fem3d/test_sinks.py`."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad

from reduced1d import equations, ladder
from reduced1d.equations import anchor_series_resistance, plate_resistance
from reduced1d.ladder.few_states import half_island, lumps, steady
from reduced1d.ladder.levels import Levels, rungs
from scenes.errors import NumericsError
from scenes.sink import Sink
from scenes.varied import neighbour

K, A, L = 130.0, 2e-10, 1e-3


@pytest.mark.parametrize("R", [100.0, 1861.76, 1e6])
def test_equal_ends_are_the_papers(R):
    dT0, left, right = equations.unequal_ends(13.7, R, R, K, A, L)
    assert left == right == pytest.approx(equations.end_rise_from_equivalent(13.7, R, K, A, L), rel=1e-14)
    assert equations.end_flow(dT0, K, A, L) == pytest.approx(left / R, rel=1e-13)
    assert equations.unequal_peak(dT0, left, right) == pytest.approx(dT0 + left, rel=1e-14)


def test_unequal_ends_are_what_a_parabola_and_two_resistances_say():
    """The mean, both flows and the top of the profile itself."""
    R1, R2 = 1861.76, 25_000.0
    dT0, left, right = equations.unequal_ends(10.0, R1, R2, K, A, L)

    def profile(y: float) -> float:
        return 4 * dT0 * (y / L) * (1 - y / L) + left + (right - left) * (y / L)

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


ON = Sink(substrate_thickness=0.5e-3)


def test_a_small_square_on_a_thick_plate_is_one_on_a_half_space():
    side = 1e-5
    found = plate_resistance((1e-3, 1e-3, 1e-3), (side, side), (5e-4, 5e-4), K)
    # On a half space 0.4732 / (k side) (Carslaw and Jaeger, 8.2); the plate's sides and bottom are a hundred sides off.
    assert found == pytest.approx(0.4732 / (K * side), rel=0.01)


def test_a_source_that_covers_a_plate_has_its_resistance_alone():
    assert plate_resistance((2e-3, 1e-3, 3e-4), (2e-3, 1e-3), (1e-3, 5e-4), K) == pytest.approx(3e-4 / (K * 2e-6))


def test_sides_that_are_far_do_not_matter_and_cost_nothing():
    """A wafer against a plate whose sides are 6 thicknesses away: the reflection is a part exp(-6 pi)."""
    block = (5e-5, 5e-5)
    wafer, plate = (plate_resistance((side, side, 2e-4), block, (side / 2, side / 2), K) for side in (0.3, 2.45e-3))
    near = plate_resistance((8e-4, 8e-4, 2e-4), block, (4e-4, 4e-4), K)
    assert wafer == pytest.approx(plate, rel=1e-8)
    assert abs(near / wafer - 1) > 1e-6
    with pytest.raises(NumericsError, match=r"a substrate of 1 m by 1 m by 100 mm is too large"):
        plate_resistance((1.0, 1.0, 0.1), block, (0.5, 0.5), K)


def test_two_sources_heat_each_other_alike():
    plate, block = (3e-3, 2e-3, 5e-4), (5e-5, 4e-5)
    a, b = (1e-3, 1e-3), (1.9e-3, 7e-4)
    there, back = (plate_resistance(plate, block, p, K, q) for p, q in ((a, b), (b, a)))
    assert there == pytest.approx(back, rel=1e-12)
    assert 0 < there < 0.1 * plate_resistance(plate, block, a, K)


def test_the_paper_s_equations_know_nothing_of_it_and_the_ladder_charges_it_apart():
    paper, plate = (
        [ladder.solve(sink, name, steady_only=True).steady["peak_rise_K"].value for sink in (Sink(), ON)]
        for name in ("paper", "plate")
    )
    assert paper[0] == paper[1]
    assert plate[0] < plate[1]
    assert [rung.blame for rung in rungs(Levels(ON))][-2:] == ["substrate", "rest (thin plate)"]
    assert "substrate" not in [rung.blame for rung in rungs(Levels(Sink()))]
    assert "substrate" not in [rung.blame for rung in rungs(Levels(ON), "fin")]


def slope(values, sink, key, step=1e-4):
    """d Q / d ln key by quantity, of ``values`` of a sink."""
    more, less = values(neighbour(sink, key, step)), values(neighbour(sink, key, -step))
    return {name: (value - less[name]) / (2 * step) for name, value in more.items()}


def logarithms(sink):
    return {n: np.log(e.value) for n, e in ladder.solve(sink, "paper", steady_only=True).steady.items()}


def test_anchor_resistance_by_its_formula():
    """Eq 14: R = u_o / (k w t) + t_o / (k_o l_o w_o), and u_o half of the pad's length beyond the oxide."""
    sink = Sink()
    whole = anchor_series_resistance(sink)
    pad = sink.anchor_distance / (130 * sink.pad_width * sink.thickness) / whole
    expected = {
        "sink.thickness": -pad,
        "anchor.pad_width": -pad,
        "anchor.pad_length": pad * sink.pad_length / (sink.pad_length - sink.oxide_length),
        "anchor.oxide_length": -pad * sink.oxide_length / (sink.pad_length - sink.oxide_length) - (1 - pad),
        "anchor.oxide_width": -(1 - pad),
        "anchor.oxide_thickness": 1 - pad,
        "materials.silicon.thermal_conductivity": -pad,
        "materials.oxide.thermal_conductivity": -(1 - pad),
        "drive.voltage": 0.0,
    }
    assert {key: slope(logarithms, sink, key)["anchor_resistance_K_per_W"] for key in expected} == pytest.approx(
        expected, abs=1e-6
    )
