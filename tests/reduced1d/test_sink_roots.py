"""The safeguarded Newton iteration on functions that defeat a plain one."""

import numpy as np
import pytest

from reduced1d.roots import increasing_root
from tests.reduced1d import relative


def test_entries_converge_each_to_its_own_root():
    target = np.array([1e-12, 0.3, 1.0, 5.0])
    found = increasing_root(lambda x: (np.expm1(x) - target, np.exp(x)), np.zeros(4), np.full(4, 700.0))
    # From 700 a Newton step on the exponential is -1, so this takes the bisections as well.
    assert found == relative(np.log1p(target), 1e-15 * 4)


def test_vanishing_slopes_and_steep_ends_fall_back_on_bisection():
    found = increasing_root(lambda x: ((x - 0.25) ** 3, 3 * (x - 0.25) ** 2), np.array(-1.0), np.array(2.0))
    assert found == pytest.approx(0.25, abs=1e-6)
    with np.errstate(divide="ignore"):
        found = increasing_root(
            lambda x: (-np.log1p(-x) - 30.0, 1 / (1 - x)), np.array(0.0), np.array(1.0)
        )  # fmt: skip
    assert 1 - found == relative(np.exp(-30), 1e-2)


def test_a_root_outside_the_bracket_gives_the_nearer_end():
    for shift, end in ((10.0, 0.0), (-10.0, 1.0)):
        found = increasing_root(lambda x, a=shift: (x + a, np.ones_like(x)), np.array(0.0), np.array(1.0))
        assert found == pytest.approx(end, abs=1e-15)
