"""The functions of a signed argument against exact rational series."""

import math
from fractions import Fraction

import numpy as np
import pytest

from reduced1d import stumpff
from tests.reduced1d import relative

ARGUMENTS = np.concatenate(
    [-np.geomspace(1e-18, 30, 14), [0.0], np.geomspace(1e-18, 2.4, 14), [0.999, 1.0, -0.999, -1.0]]
)


def series(z, coefficient):
    """Sum of coefficient(n) (-z)^n in exact arithmetic; 40 terms leave 30^40 / 80! = 1e-60."""
    return float(sum(coefficient(n) * (-Fraction(float(z))) ** n for n in range(40)))


@pytest.mark.parametrize(
    ("function", "coefficient", "tolerance"),
    [
        (stumpff.c, lambda n: Fraction(1, math.factorial(2 * n)), 4e-15),
        (stumpff.s, lambda n: Fraction(1, math.factorial(2 * n + 1)), 4e-15),
        (stumpff.p, lambda n: Fraction(2 * (n + 1), math.factorial(2 * n + 3)), 4e-15),
        # Only Newton's convergence depends on it: s - 3 p cancels by a factor of 15 at z = 1.
        (stumpff.p_slope, lambda n: Fraction(-2 * (n + 1) * (n + 2), math.factorial(2 * n + 5)), 1e-13),
    ],
)
def test_functions_are_their_series_times_the_scale(function, coefficient, tolerance):
    expected = [series(z, coefficient) * math.exp(-math.sqrt(max(-z, 0.0))) for z in ARGUMENTS]
    assert function(ARGUMENTS) == relative(expected, tolerance)


def test_the_plain_difference_would_have_cancelled():
    z = np.array(1e-12)
    plain = (np.sin(1e-6) / 1e-6 - np.cos(1e-6)) / z
    assert stumpff.p(z) == relative(1 / 3, 1e-12)
    assert plain != relative(1 / 3, 1e-6)


def test_far_into_the_hyperbolic_side_nothing_overflows():
    z = np.array([-1e4, -1e8, -1e300])
    for function in (stumpff.c, stumpff.s, stumpff.p, stumpff.p_slope):
        assert np.all(np.isfinite(function(z)))
    assert stumpff.c(z) == relative(0.5, 1e-15)
    assert stumpff.s(z) == relative(0.5 / np.sqrt(-z), 1e-15)
