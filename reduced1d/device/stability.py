"""Stability of the sampled loop of the 1D device about its steady states."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from reduced1d.device.lumped import lump
from reduced1d.device.march import GRIDS
from reduced1d.device.modes import modes
from reduced1d.device.steady import steady
from scenes.device import Device, External
from scenes.loop.stability import Plant, Stability, linearised
from scenes.loop.steady import State

DEGREE = 9


def plant(device: Device, external: float | None = None) -> Plant:
    """Linearise a device about its steady state at an outer temperature (K; by default the final one)."""
    lumped, found = lump(device), steady(device, external)
    state = State(
        np.array([found.sink_K, found.sensor_K]) - device.sink.room_temperature,
        np.array([found.sink_power_W, found.sensor_power_W]), np.array([found.sink_V, found.sensor_V]),
    )  # fmt: skip
    return linearised(modes(lumped, DEGREE, GRIDS).modal, state, lumped.set_rise, device.control.sample_time)


def stability(device: Device, external: float | None = None) -> Stability:
    """Stability of a device's controllers about the steady state at an outer temperature (K)."""
    outer = device.external.final_temperature if external is None else external
    # Neither what is outside at other times nor for how long matters, so that many runs share one answer.
    return _about(replace(device, external=External(outer, outer), end_time=1.0))


@lru_cache(maxsize=64)
def _about(device: Device) -> Stability:
    return Stability.of(plant(device), _gains(device))


def largest_eigenvalue(device: Device, external: float | None = None) -> complex:
    """That of ``stability`` alone, which takes a fraction of the time."""
    return plant(device, external).eigenvalue(_gains(device))


def _gains(device: Device) -> np.ndarray:
    return np.array([device.control.sink_gain, device.control.sensor_gain])


def at_sample_time(device: Device, sample_time: float) -> Device:
    """The same device with another sample time (s)."""
    return replace(device, control=replace(device.control, sample_time=sample_time))
