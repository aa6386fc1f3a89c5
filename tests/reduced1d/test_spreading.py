"""The spreading resistance of a plate: its limits, and the 1D models that include it.

The comparison with 3D is in `tests/fem3d/test_substrate.py`."""

import pytest

from reduced1d import ladder
from reduced1d.equations import plate_resistance
from reduced1d.ladder.levels import Levels, rungs
from scenes.errors import NumericsError
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
    paper = [ladder.solve(sink, "paper", steady_only=True).steady["peak_rise_K"].value for sink in (Sink(), ON)]
    assert paper[0] == paper[1]
    assert [rung.blame for rung in rungs(Levels(ON))][-2:] == ["substrate", "rest (thin plate)"]
    assert "substrate" not in [rung.blame for rung in rungs(Levels(Sink()))]
    assert "substrate" not in [rung.blame for rung in rungs(Levels(ON), "fin")]
