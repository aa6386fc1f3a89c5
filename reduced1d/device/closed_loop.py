"""The closed loop of the 1D device about its steady states: stability, shielding, and a common lead to ground."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

from reduced1d.device.lumped import lump, modes
from scenes.device import Device, External
from statespace import stability as loop
from statespace.ground import Ground, effects
from statespace.modal import Modal
from statespace.shielding import Response, Shielding, around, response
from statespace.stability import Plant, Stability

DEGREE = 9
"""Polynomial degree of the layers' elements in questions about a steady state."""


def _modal(device: Device, degree: int = DEGREE) -> Modal:
    return modes(lump(device), degree).modal


def plant(device: Device, external: float | None = None) -> Plant:
    """Linearise a device about its steady state at an outer temperature (K; by default the final one)."""
    return loop.plant(_modal(device), device, external)


def stability(device: Device, external: float | None = None) -> Stability:
    """Stability of a device's controllers about the steady state at an outer temperature (K)."""
    outer = device.external.final_temperature if external is None else external
    # Neither what is outside at other times nor for how long matters, so that many runs share one answer.
    return _about(replace(device, external=External(outer, outer), end_time=1.0))


@lru_cache(maxsize=64)
def _about(device: Device) -> Stability:
    return loop.assess(plant(device), device)


def largest_eigenvalue(device: Device, external: float | None = None) -> complex:
    """The eigenvalue of ``stability`` alone, which takes a fraction of the time."""
    return plant(device, external).eigenvalue(loop.gains(device))


def at_sample_time(device: Device, sample_time: float) -> Device:
    return replace(device, control=replace(device.control, sample_time=sample_time))


@lru_cache(maxsize=8)
def shielding(device: Device) -> Shielding:
    """Change of both powers per kelvin of the temperatures around a device."""
    return around(_modal(device, 12), device)


@lru_cache(maxsize=8)
def shielding_response(device: Device) -> Response:
    """Response of both powers to a step of the substrate's temperature."""
    return response(_modal(device, 12), 6, device)


@lru_cache(maxsize=8)
def ground_effects(device: Device, power: float, resistance: float) -> Ground:
    """Effects of leads to ground, the device's own among them; which are off by a step of the sensor's power (W), and
    of its resistance (ohm)."""
    film, lead = float(lump(device).resistance[1]), device.control.ground_resistance
    # Two a decade, from a ten-thousandth to a tenth of the sensor's.
    leads = sorted({*(film * 10 ** (-half / 2) for half in range(8, 1, -1)), *([lead] if lead else [])})
    return effects(_modal(device), device, leads, power, resistance)
