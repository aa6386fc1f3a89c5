"""The operating point of one state and one current, whose law of heating has a closed form.

With K a = c^2 R, the resistance R (1 + alpha a) and the supply V, a current of beta times the cold one V/R makes the
rise a = beta^2 p / (K - beta^2 p alpha), p = V^2/R, and needs the voltage beta (1 + alpha a) V = beta K V / (K - beta^2
p alpha). For alpha < 0 that has a maximum at beta^2 = K / (p |alpha|), where it is sqrt(K / (p |alpha|)) V / 2.
"""

import numpy as np
import pytest

from fem3d.solution import continuation, joule_tensors
from fem3d.solution.reduced import Reduced

K, R, V = 3.0, 2.0, 5.0
POWER = V**2 / R


def scalar(alpha):
    """One temperature field, heated by one current field whose resistance follows it."""
    heat = joule_tensors.nothing(1, 1, 1)
    heat.cold[:], heat.cold_load[:] = R, R
    heat.warm[:], heat.warm_load[:] = alpha * R, alpha * R
    parts = {name: getattr(heat, name) for name in heat.__dataclass_fields__}
    one = np.ones((1, 1))
    return Reduced(
        **parts,
        basis=one,
        stiffness=K * one,
        source=0 * one,
        inertia=0 * one,
        supply=V * one,
        drawn=np.empty((0, 1)),
        given=np.empty((1, 0)),
    )


def steady(alpha):
    """The rise on the stable branch at the voltage V: beta solves p alpha beta^2 + K beta - K = 0."""
    beta = 2 * K / (K + np.sqrt(K**2 + 4 * K * POWER * alpha))
    return beta**2 * POWER / (K - beta**2 * POWER * alpha)


# The root is found where the voltage is right to 1e-13 (`continuation`); a rise may have some times that.
@pytest.mark.parametrize("alpha", [0.3, 1e-3, 0.0, -1e-3, -0.9 * K / (4 * POWER)])
def test_the_rise_is_that_of_the_closed_form(alpha):
    point = continuation.find(scalar(alpha))
    assert not point.folded
    assert point.a[0] == pytest.approx(steady(alpha), rel=1e-11)
    assert point.c[0] == pytest.approx(V / (R * (1 + alpha * point.a[0])), rel=1e-11)
    assert point.a[0] != pytest.approx(steady(alpha + 1e-6), rel=1e-9)


def test_the_fold_is_at_the_largest_voltage():
    alpha = -1.5 * K / (4 * POWER)
    point = continuation.find(scalar(alpha))
    # A maximum is flat: currents known to 1e-7 give its voltage to the square of that.
    assert point.folded
    assert point.fraction == pytest.approx(np.sqrt(K / (POWER * -alpha)) / 2, rel=1e-12)
    assert point.a[0] == pytest.approx(1 / (2 * -alpha), rel=1e-5)


def test_just_below_the_fold_there_is_a_steady_state_and_just_above_none():
    limit = -K / (4 * POWER)
    assert not continuation.find(scalar(limit * (1 - 1e-6))).folded
    assert continuation.find(scalar(limit * (1 + 1e-6))).folded


def test_at_a_current_without_a_state_the_voltage_is_infinite():
    beyond = np.sqrt(K / (POWER * 0.3))
    assert np.isfinite(continuation.at_current(scalar(0.3), 0.999 * beyond).fraction)
    assert continuation.at_current(scalar(0.3), 1.001 * beyond).fraction == np.inf
