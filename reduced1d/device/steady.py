"""The steady state that the controllers bring the device to, in closed form."""

from __future__ import annotations

import numpy as np

from reduced1d.device.lumped import lump
from scenes.device import Device
from scenes.loop.result import Steady
from scenes.loop.steady import complementary


def steady(device: Device, external: float | None = None) -> Steady:
    """The steady state at an outer temperature ``external`` (K; by default the final one).

    An element with power sits at the set temperature; then sink and sensor exchange nothing and the sensor's power is
    k A/t (T_set - T_external) of the polymer, whatever R(T) is. Where that asks for a negative power, the power is
    zero and the element's temperature follows from its neighbours. A gain of zero leaves an element without power.
    """
    lumped, room = lump(device), device.sink.room_temperature
    outer = (device.external.final_temperature if external is None else external) - room
    sink, between, polymer = lumped.sink.conductance, lumped.insulator.conductance, lumped.polymer.conductance
    K = np.array([[sink + between, -between], [-between, between + polymer]])
    load = np.array([0.0, polymer * outer])
    gains = np.array([device.control.sink_gain, device.control.sensor_gain])
    rise, power, held = complementary(K, load, lumped.set_rise, gains > 0)
    volts = np.sqrt(power * lumped.resistance * (1 + lumped.coefficient * rise))
    saturated = (gains > 0) & ~held
    return Steady(
        float(room + rise[0]), float(room + rise[1]), float(volts[0]), float(volts[1]), float(power[0]),
        float(power[1]), float(polymer * (rise[1] - outer)), bool(saturated[0]), bool(saturated[1]),
    )  # fmt: skip


def around(device: Device) -> dict[str, Steady]:
    """The steady states ``before`` the outer step and ``after`` it."""
    return {"before": steady(device, device.external.initial_temperature), "after": steady(device)}
