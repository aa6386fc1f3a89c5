"""Several devices on one plate in 1D, against the two heat balances of each, solved by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from reduced1d.device.array import beside
from reduced1d.device.lumped import lump
from scenes.array import DeviceArray
from scenes.device import External
from scenes.loop.array import Paths, after, times
from scenes.sink import Sink

SINK = Sink(columns=3, driven=(1, 2), substrate_thickness=0.5e-3)
ARRAY = DeviceArray(sink=SINK, external=External(293.0, 273.0, 0.01), end_time=0.2)
PLATE = np.array([[0.1, 0.8, 0.2], [0.8, 0.0, 0.8], [0.2, 0.8, 0.1]])


def test_at_rest_it_is_the_balances_of_each() -> None:
    """With the sinks off a sensor is held at the set rise; idle elements take what is outside: none at room's."""
    lumped, both = lump(ARRAY.element), beside(ARRAY, PLATE, None)
    down, between = lumped.conductance, lumped.insulator.conductance
    through = down * between / (down + between)
    # Heat into the plate, and how it follows the plate: of a sensor that is held, and of an idle one.
    outside = lumped.polymer.conductance
    idle_one = 1 / (1 / through + 1 / outside)
    heat, follows = np.array([through * lumped.set_rise] * 2 + [0.0]), -np.array([through, through, idle_one])
    rise = np.linalg.solve(np.eye(3) - PLATE * follows, PLATE @ heat)
    assert both.sinks_off.plate_rise == pytest.approx(rise, rel=1e-9)
    assert both.sinks_off.power_change == pytest.approx([-through * rise[0], -through * rise[1], 0.0], rel=1e-6)
    assert both.sinks_off.per_outside[1, 2] < -1e-9
    # Closed, the sink keeps all of it from the sensor, and sends what it is held for into the plate.
    assert np.abs(both.closed.power_change).max() < 1e-18
    heat, follows = np.array([down * lumped.set_rise] * 2 + [0.0]), -np.array([down, down, idle_one])
    rise = np.linalg.solve(np.eye(3) - PLATE * follows, PLATE @ heat)
    assert both.closed.plate_rise == pytest.approx(rise, rel=1e-9)


def test_over_time_an_idle_ones_step_comes_to_what_is_at_rest() -> None:
    """By paths that are at rest at once; 0.6 s are 26 time constants of the polymer. The others' answers are 1e-4 of
    it, what they answer to these a ten-thousandth of that."""
    array = replace(ARRAY, end_time=0.61, control=replace(ARRAY.control, sample_time=1e-3))
    steady = np.where(times(array.element) > 0, 1.0, 0.0)
    working = np.array([1.0, 1.0, 0.0])
    back = np.array([[PLATE[0] * kind @ PLATE[2]] for kind in (1 - working, working)]) * steady
    through = Paths(2, 0, PLATE[0, 2] * steady, back)
    both = beside(array, PLATE, through)
    at_rest, last = both.sinks_off.per_outside[0, 2], both.over_time[1].sensor_power[-1]
    assert last == pytest.approx(at_rest, rel=1e-6)
    assert both.over_time[1].rest < 1e-6
    without = beside(array, PLATE, replace(through, back=0 * back)).over_time[1].sensor_power[-1]
    assert without != pytest.approx(at_rest, rel=3e-5)


def test_one_response_after_another_is_that_of_both() -> None:
    """1 - exp(-2 t) after 1 - exp(-t) is (1 - exp(-t))^2, to second order in the sample's length."""
    off = []
    for h in (0.02, 0.01):
        time = h * np.arange(int(4 / h))
        first, then = (1 - np.exp(-rate * np.array([time, time])) for rate in (1.0, 2.0))
        off.append(np.abs(after(first, then) - first**2)[:, :-1].max())
    assert off[1] < 2e-5
    assert off[0] / off[1] == pytest.approx(4.0, rel=0.05)
