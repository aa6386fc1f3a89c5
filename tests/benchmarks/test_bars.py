"""Bars of random laws: their closed form."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks import bars
from fem3d.runs.scene import solve
from scenes.laws import PowerLaw, Table
from scenes.sink import SILICON


def test_the_peak_of_a_constant_and_of_an_inverse_square_is_known():
    """With rho_0 (T0/T)^2 the integral from T0 is rho_0 T0 (1 - T0/T): it ends at rho_0 T0."""
    constant = PowerLaw(6e-5, bars.ROOM, 0.0)
    assert bars.peak(constant, 130.0, 1.0) == pytest.approx(bars.ROOM + 1 / (8 * 130 * 6e-5), rel=1e-9)
    assert bars.limit(constant, 130.0) == np.inf
    falling = PowerLaw(6e-5, bars.ROOM, -2.0)
    most = bars.limit(falling, 130.0)
    assert most == pytest.approx((8 * 130 * 6e-5 * bars.ROOM) ** 0.5, rel=1e-12)
    assert bars.peak(falling, 130.0, 0.9 * most) == pytest.approx(bars.ROOM / (1 - 0.81), rel=1e-9)


def test_laws_of_both_slopes_are_drawn():
    drawn = [bars.random_resistivity(np.random.default_rng([seed, 8])) for seed in range(40)]
    powers = [law.exponent for law in drawn if isinstance(law, PowerLaw)]
    slopes = [np.sign(np.diff(law.values)) for law in drawn if isinstance(law, Table)]
    assert min(powers) < -2.5
    assert max(powers) > 0
    assert {float(s[0]) for s in slopes} == {-1.0, 1.0}
    assert all(len(set(s)) == 1 for s in slopes)


def test_a_steady_bar_has_the_peak_of_the_closed_form():
    law = PowerLaw(6e-5, bars.ROOM, 1.0)
    exact = bars.peak(law, bars.CONDUCTIVITY, 5.0)
    scene = bars.bar(replace(SILICON, resistivity=law, temperature_coefficient=0.0), 5.0)
    found = solve(scene).steady["middle"]
    assert abs(found.value - exact) <= found.error < 1e-2 * (exact - bars.ROOM)
    assert abs(found.value - bars.peak(law, bars.CONDUCTIVITY, 5.05)) > found.error
