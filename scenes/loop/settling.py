"""Settling times: how long a trace takes to enter a band about its final value for good."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scenes.device import Device
from scenes.loop.result import DeviceResult


@dataclass(frozen=True)
class Settling:
    """``time`` in s after ``start`` (s) from when on ``quantity`` stays within ``band`` of ``target`` (in its unit),
    to the next outer step or the end; infinite where it is outside at the last sample."""

    quantity: str
    start: float
    target: float
    band: float
    time: float


def settling_time(time: np.ndarray, values: np.ndarray, target: float, band: float) -> float:
    """Seconds after ``time[0]`` from when on ``values`` stays within ``band`` of ``target``; infinite if it doesn't.

    Between the last sample outside and the first inside the crossing is found by a straight line.
    """
    away = np.abs(values - target) - band
    outside = np.flatnonzero(away > 0)
    if not len(outside):
        return 0.0
    i = int(outside[-1])
    if i == len(values) - 1:
        return float("inf")
    part = away[i] / (away[i] - away[i + 1])
    return float(time[i] + part * (time[i + 1] - time[i]) - time[0])


def settling(device: Device, result: DeviceResult, quantity: str, fraction: float = 0.01) -> tuple[Settling, ...]:
    """Settling of one quantity after the cold start and after the outer step, as far as the run has them.

    The band is ``fraction`` of the change in the steady state that the event asks for: of the set rise, or the power
    from none, at the start; and of the step between the steady values after it. Where the step does not change the
    steady value (the temperatures and the sink), the band after it is ``fraction`` of the one from cold.
    """
    external, time, values = device.external, result.time_s, result.trace(quantity)
    first, last = getattr(result.before, quantity), getattr(result.after, quantity)
    cold = device.sink.room_temperature if quantity.endswith("_K") else 0.0
    i = int(np.searchsorted(time, external.step_time - 1e-9 * device.control.sample_time))
    found = []
    if i > 1:
        found.append(_after(quantity, time[:i], values[:i], first, fraction * abs(first - cold)))
    if i < len(time) - 1:
        change = abs(last - first) if abs(last - first) > 1e-9 * abs(last - cold) else abs(last - cold)
        found.append(_after(quantity, time[i:], values[i:], last, fraction * change))
    return tuple(found)


def _after(quantity: str, time: np.ndarray, values: np.ndarray, target: float, band: float) -> Settling:
    return Settling(quantity, float(time[0]), target, band, settling_time(time, values, target, band))
