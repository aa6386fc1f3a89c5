"""The spreading resistance of a plate: its limits, and what a sink's 1D models make of it."""

from dataclasses import replace
from functools import cache

import pytest

from fem3d.runs.sink import solve as solve_3d
from reduced1d import ladder
from reduced1d.ladder.levels import Levels, rungs
from reduced1d.ladder.plate import below
from reduced1d.spreading import plate_resistance
from scenes.plan import Request
from scenes.sink import Sink

K = 130.0
ON = Sink(substrate_thickness=0.5e-3)


def test_a_small_square_on_a_thick_plate_is_one_on_a_half_space():
    side = 1e-5
    found = plate_resistance((1e-3, 1e-3, 1e-3), (side, side), (5e-4, 5e-4), K)
    # On a half space 0.4732 / (k side) (Carslaw and Jaeger, 8.2); the plate's sides and bottom are a hundred sides off.
    assert found == pytest.approx(0.4732 / (K * side), rel=0.01)


def test_a_source_that_covers_a_plate_has_its_resistance_alone():
    assert plate_resistance((2e-3, 1e-3, 3e-4), (2e-3, 1e-3), (1e-3, 5e-4), K) == pytest.approx(3e-4 / (K * 2e-6))


def test_two_sources_heat_each_other_alike():
    plate, block = (3e-3, 2e-3, 5e-4), (5e-5, 4e-5)
    a, b = (1e-3, 1e-3), (1.9e-3, 7e-4)
    there, back = (plate_resistance(plate, block, p, K, q) for p, q in ((a, b), (b, a)))
    assert there == pytest.approx(back, rel=1e-12)
    assert 0 < there < 0.1 * plate_resistance(plate, block, a, K)


@cache
def end_in_3d(sink):
    return solve_3d(sink, Request(transient=False)).steady["end_rise_K"]


@pytest.mark.parametrize("name", ["fin", "plate"])
def test_models_on_the_plate_rise_by_what_3d_does(name):
    bare, on = Sink(accuracy=3e-4), replace(ON, accuracy=3e-4)
    # Both 1D models lie on one mesh, whose error their difference doesn't have.
    rises = [ladder.solve(sink, name, steady_only=True).steady["end_rise_K"].value for sink in (Sink(), ON)]
    in_3d = [end_in_3d(sink) for sink in (bare, on)]
    added = in_3d[1].value - in_3d[0].value
    # 1D overstates it: a resistance for each place under the oxide, where more heat flows near the beam, is the mean
    # of the flux's square, and the series is of an even flux, 7 % above that of an even temperature.
    off = in_3d[0].error + in_3d[1].error
    assert added - off < rises[1] - rises[0] < 1.1 * added + off
    assert off < 0.03 * added
    assert below(bare) == 0


def test_the_paper_s_equations_know_nothing_of_it_and_the_ladder_charges_it_apart():
    paper = [ladder.solve(sink, "paper", steady_only=True).steady["peak_rise_K"].value for sink in (Sink(), ON)]
    assert paper[0] == paper[1]
    assert [rung.blame for rung in rungs(Levels(ON))][-2:] == ["substrate", "rest (thin plate)"]
    assert "substrate" not in [rung.blame for rung in rungs(Levels(Sink()))]
    assert "substrate" not in [rung.blame for rung in rungs(Levels(ON), "fin")]
