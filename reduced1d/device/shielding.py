"""How well the active sink shields the sensor in 1D."""

from __future__ import annotations

from functools import lru_cache

from reduced1d.device.accurate import FIRST
from reduced1d.device.lumped import lump, modes
from scenes.device import Device
from statespace.shielding import Response, Shielding, around, response


@lru_cache(maxsize=8)
def of_device(device: Device) -> Shielding:
    """What the temperatures around do to both powers."""
    return around(modes(lump(device), FIRST.degree).modal, device)


@lru_cache(maxsize=8)
def over_time(device: Device) -> Response:
    """The response of both powers to a step of the substrate's temperature."""
    return response(modes(lump(device), FIRST.degree).modal, FIRST.nodes, device)
