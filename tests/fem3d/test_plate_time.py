"""The plate over time against closed forms: what it comes to rest at, and the half space before that."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import erfc

from fem3d.runs.plate import Plate
from fem3d.runs.plate_time import warming

PLATE, DIFFUSIVITY = Plate(3e-3, 3e-3, 0.5e-3, 130.0), 130.0 / (2330.0 * 712.0)


def test_it_comes_to_rest_as_the_plate_at_rest() -> None:
    source, target = np.array([1.3e-3, 0.9e-3]), np.array([1.7e-3, 2.1e-3])
    _, rest = warming(PLATE, DIFFUSIVITY, source, target, np.linspace(0, 0.05, 200))
    expected = PLATE.between(np.array([[1.3e-3], [1.7e-3]]), np.array([[0.9e-3], [2.1e-3]]))[0, 1, 0, 1]
    # As the quadrature in time leaves; a plate that is thinner by a thousandth is another.
    assert rest == pytest.approx(expected, rel=1e-6)
    thinner = Plate(3e-3, 3e-3, 0.4995e-3, 130.0)
    assert warming(thinner, DIFFUSIVITY, source, target, np.linspace(0, 0.05, 200))[1] != pytest.approx(
        expected, rel=1e-4
    )


def test_at_first_it_is_a_half_space() -> None:
    """erfc(r/sqrt(4 a t))/(2 pi k r); the bottom adds exp(-d^2/(a t)), which at 0.2 ms is 1e-7."""
    source, target = np.array([1.4e-3, 1.5e-3]), np.array([1.6e-3, 1.5e-3])
    time = np.linspace(0, 2e-4, 21)
    rise, _ = warming(PLATE, DIFFUSIVITY, source, target, time)
    exact = erfc(2e-4 / np.sqrt(4 * DIFFUSIVITY * time[1:])) / (2 * np.pi * 130.0 * 2e-4)
    assert np.abs(rise[1:] - exact).max() < 1e-5 * exact[-1]
    assert np.abs(warming(PLATE, 1.01 * DIFFUSIVITY, source, target, time)[0][1:] - exact).max() > 1e-3 * exact[-1]
