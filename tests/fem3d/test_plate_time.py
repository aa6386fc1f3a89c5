"""The plate over time against closed forms: what it comes to rest at, and the half space before that."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.special import erfc

from fem3d.runs.plate import Plate
from fem3d.runs.plate_time import warming

Point = tuple[float, float]
PLATE, DIFFUSIVITY = Plate(3e-3, 3e-3, 0.5e-3, 130.0), 130.0 / (2330.0 * 712.0)


def warmed(plate: Plate, diffusivity: float, source: Point, target: Point, times: np.ndarray) -> tuple[Any, Any]:
    """`warming` of one point by another, as pairs of feet in one place."""
    feet = [np.array([y, y]) for _, y in (source, target)]
    rise, rest = warming(plate, diffusivity, source[0], feet[0], np.array([target[0]]), feet[1][None], times)
    return rise[0], rest[0]


def test_it_comes_to_rest_as_the_plate_at_rest() -> None:
    source, target = (1.3e-3, 0.9e-3), (1.7e-3, 2.1e-3)
    time = np.linspace(0, 0.05, 200)
    expected = PLATE.between(np.array([[1.3e-3], [1.7e-3]]), np.array([[0.9e-3], [2.1e-3]]))[0, 1, 0, 1]
    # As the quadrature in time leaves; a plate that is thinner by a thousandth is another.
    assert warmed(PLATE, DIFFUSIVITY, source, target, time)[1] == pytest.approx(expected, rel=1e-6)
    thinner = Plate(3e-3, 3e-3, 0.4995e-3, 130.0)
    assert warmed(thinner, DIFFUSIVITY, source, target, time)[1] != pytest.approx(expected, rel=1e-4)


def test_feet_add_up_and_take_turns() -> None:
    """Half a watt at each foot of a pair, and the mean of both of another's: four points' rises; and the same back."""
    time, columns = np.linspace(0, 0.02, 50), np.array([1.3e-3, 1.7e-3])
    rows = np.array([[0.9e-3, 2.1e-3], [0.6e-3, 1.8e-3]])
    rises, rest = warming(PLATE, DIFFUSIVITY, columns[0], rows[0], columns, rows, time)
    by_points = [
        warmed(PLATE, DIFFUSIVITY, (columns[0], a), (columns[1], b), time)[0] / 4 for a in rows[0] for b in rows[1]
    ]
    assert rises[3] == pytest.approx(sum(by_points), rel=1e-12)
    back, _ = warming(PLATE, DIFFUSIVITY, columns[1], rows[1], columns, rows, time)
    assert back[0] == pytest.approx(rises[3], rel=1e-12)
    assert rest[3] > rises[3, -1] > rises[3, 1] > 0


def test_at_first_it_is_a_half_space() -> None:
    """erfc(r/sqrt(4 a t))/(2 pi k r); the bottom adds exp(-d^2/(a t)), which at 0.2 ms is 1e-7."""
    source, target = (1.4e-3, 1.5e-3), (1.6e-3, 1.5e-3)
    time = np.linspace(0, 2e-4, 21)
    rise, _ = warmed(PLATE, DIFFUSIVITY, source, target, time)
    exact = erfc(2e-4 / np.sqrt(4 * DIFFUSIVITY * time[1:])) / (2 * np.pi * 130.0 * 2e-4)
    assert np.abs(rise[1:] - exact).max() < 1e-5 * exact[-1]
    assert np.abs(warmed(PLATE, 1.01 * DIFFUSIVITY, source, target, time)[0][1:] - exact).max() > 1e-3 * exact[-1]
