"""What a lead to ground that sink and sensor share does in 1D."""

from __future__ import annotations

from functools import lru_cache

from reduced1d.device.lumped import lump, modes
from reduced1d.device.stability import DEGREE
from scenes.device import Device
from statespace.ground import Ground, effects

PARTS = tuple(10 ** (-half / 2) for half in range(8, 1, -1))
"""Resistances of the leads to ground that are reported, in units of the sensor's, two a decade."""


def leads(device: Device) -> tuple[float, ...]:
    """The leads (ohm) that are tried, the device's own among them."""
    film, lead = float(lump(device).resistance[1]), device.control.ground_resistance
    return tuple(sorted({*(part * film for part in PARTS), *([lead] if lead else [])}))


@lru_cache(maxsize=8)
def of_device(device: Device, power: float, resistance: float) -> Ground:
    """Their effects, and which are off by a step of the sensor's ``power`` (W) and of its ``resistance`` (ohm)."""
    return effects(modes(lump(device), DEGREE).modal, device, leads(device), power, resistance)
