"""What goes in comes out, or stays."""

from dataclasses import replace

import pytest

from fem3d import run
from scenes.plan import Request
from scenes.sink import Sink
from tests.fem3d import silicon

SINKS = [
    Sink(),
    Sink(voltage=8.0, electrodes="pad-edge", convection_coefficient=500.0),
    Sink(voltage=-4.0, silicon=silicon(-5e-4), room_temperature=250.0),
]


@pytest.mark.parametrize("sink", SINKS)
def test_heat_balances_steady_to_rounding_and_over_time_to_the_accuracy(sink):
    loose, tight = (run.solve(replace(sink, accuracy=a), Request()).details for a in (1e-2, 1e-4))
    for found in (loose, tight):
        assert 0 <= found["energy_imbalance"] < 1e-9
    # A tenth of the accuracy: what the reduced space may lose, whose balance it is; how much of that is chance.
    assert 0 < tight["transient_imbalance"] < 1e-5
    assert 0 < loose["transient_imbalance"] < 1e-3


def test_power_is_voltage_times_current():
    steady = run.solve(SINKS[2], Request(transient=False)).steady
    assert abs(steady["power_W"].value / (-4.0 * steady["current_A"].value) - 1) < 1e-9
