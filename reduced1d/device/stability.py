"""Stability of the sampled loop: the map from sample to sample, linearised about the steady state."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg

from reduced1d.device.lumped import lump
from reduced1d.device.march import GRIDS
from reduced1d.device.modes import modes
from reduced1d.device.steady import steady
from scenes.device import Device

DEGREE = 9
SMALLEST_GAIN, LARGEST_GAIN = 1e-6, 1e6  # V: between which a limit is sought
CLOSER = 1.6  # from one gain that is tried to the next


@dataclass(frozen=True)
class Plant:
    """The linearised device from sample to sample: b' = a b + in dV (amplitudes, V), rises (K) = out b.

    ``a`` (n, n), ``inlet`` (n, 2), ``out`` (2, n); ``active`` (2,) whether (sink, sensor) can respond to its voltage.
    """

    a: np.ndarray
    inlet: np.ndarray
    out: np.ndarray
    active: np.ndarray
    set_rise: float
    sample_time: float

    def eigenvalue(self, gain: np.ndarray) -> complex:
        """The eigenvalue of largest size of the closed loop with these gains (V) of (sink, sensor), per sample: stable
        below 1 in size; negative where the loop swings from sample to sample."""
        at = np.flatnonzero(self.active & (np.asarray(gain) > 0))
        feedback = -np.asarray(gain)[at, None] / self.set_rise * self.out[at]
        inlet = self.inlet[:, at]
        loop = np.block([[self.a + inlet @ feedback, inlet], [feedback, np.eye(len(at))]])
        found = np.linalg.eigvals(loop)
        largest = complex(found[np.abs(found).argmax()])
        return complex(largest.real, abs(largest.imag))


def plant(device: Device, external: float | None = None) -> Plant:
    """Linearise a device about its steady state at an outer temperature (K; by default the final one).

    Between samples P = V^2/R(T) changes by 2 V/R dV - P R'/R dT, exactly propagated. An element that has no power
    there does not respond to its voltage to first order, and its loop is left out.
    """
    lumped, state = lump(device), steady(device, external)
    m = modes(lumped, DEGREE, GRIDS)
    room, h = device.sink.room_temperature, device.control.sample_time
    rise = np.array([state.sink_K, state.sensor_K]) - room
    voltage, power = np.array([state.sink_V, state.sensor_V]), np.array([state.sink_power_W, state.sensor_power_W])
    resistance = lumped.resistance * (1 + lumped.coefficient * rise)
    self_heating = power * lumped.coefficient / (1 + lumped.coefficient * rise)
    rates, vectors = scipy.linalg.eigh(np.diag(m.rates) + (m.shape.T * self_heating) @ m.shape)
    out = m.shape @ vectors
    inlet = (-np.expm1(-rates * h) / rates)[:, None] * out.T * (2 * voltage / resistance)
    return Plant(np.diag(np.exp(-rates * h)), inlet, out, power > 0, lumped.set_rise, h)


@dataclass(frozen=True)
class Stability:
    """The loop's eigenvalue of largest size per sample, its growth rate in 1/s (negative: it decays), and the largest
    stable gain (V) of each controller with the other at its own gain; infinite where no gain below 1e6 V is unstable.
    """

    eigenvalue: complex
    growth_rate: float
    sink_gain_limit: float
    sensor_gain_limit: float

    @property
    def stable(self) -> bool:
        """Whether small disturbances die out."""
        return abs(self.eigenvalue) < 1


def stability(device: Device, external: float | None = None) -> Stability:
    """Stability of a device's controllers about the steady state at an outer temperature (K)."""
    system, control = plant(device, external), device.control
    gains = np.array([control.sink_gain, control.sensor_gain])
    largest = system.eigenvalue(gains)
    rate = float(np.log(abs(largest)) / control.sample_time)
    return Stability(largest, rate, gain_limit(system, gains, 0), gain_limit(system, gains, 1))


def largest_eigenvalue(device: Device, external: float | None = None) -> complex:
    """That of ``stability`` alone, which takes a fraction of the time."""
    return plant(device, external).eigenvalue(np.array([device.control.sink_gain, device.control.sensor_gain]))


def gain_limit(system: Plant, gains: np.ndarray, element: int) -> float:
    """The largest gain (V) of one element (0 sink, 1 sensor) below which the loop is stable, the other gain as given.

    Zero where the other loop is unstable by itself, infinite where no gain up to LARGEST_GAIN is unstable.
    """
    from scipy.optimize import brentq

    def growth(gain: float) -> float:
        return math.log(abs(system.eigenvalue(np.where(np.arange(2) == element, gain, gains))))

    if growth(0.0) >= 0:
        return 0.0
    if not system.active[element]:
        return math.inf
    low, high = 0.0, SMALLEST_GAIN
    while growth(high) < 0:
        low, high = high, CLOSER * high
        if high > LARGEST_GAIN:
            return math.inf
    return float(brentq(growth, low, high, xtol=1e-12 * high, rtol=1e-10))


def at_sample_time(device: Device, sample_time: float) -> Device:
    """The same device with another sample time (s)."""
    return replace(device, control=replace(device.control, sample_time=sample_time))
