"""Logarithmic derivatives of the device's steady state by its keys, by central differences of the closed form."""

from __future__ import annotations

from reduced1d.device.steady import steady
from reduced1d.slopes import STEP
from scenes.device import Device
from scenes.varied import numbers, varied

QUANTITIES = {
    "sink_power_W": "sink's power",
    "sensor_power_W": "sensor's power",
    "sensor_V": "sensor's voltage",
    "sink_V": "sink's voltage",
    "polymer_flux_W": "heat to the polymer",
}
"""Temperatures are what the controllers make them, and have no derivative worth the name."""


def of_device(device: Device) -> dict[str, dict[str, float]]:
    """d ln quantity / d ln key of the steady state after the outer step, by key and quantity; quantities that are zero
    have none."""
    found: dict[str, dict[str, float]] = {}
    for key in numbers(device):
        more, less = (steady(varied(device, key, 1 + step)) for step in (STEP, -STEP))
        both = {name: (float(getattr(more, name)), float(getattr(less, name))) for name in QUANTITIES}
        found[key] = {name: (a - b) / (STEP * (a + b)) for name, (a, b) in both.items() if a * b > 0}
    return found
