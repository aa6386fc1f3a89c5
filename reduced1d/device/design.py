"""What a designer asks next: how far the gains may go, what can be measured, and how finely."""

# ruff: noqa: N815 - the symbols of units keep their capitals, as in the keys of the output
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from reduced1d.device.designer import ExternalStep, Range, measurable_range, resolution, smooth_start_gain
from reduced1d.device.meters import METERS
from reduced1d.device.stability import at_sample_time, stability
from scenes.device import Device
from scenes.formats import quantity

SAMPLE_TIMES = (1e-4, 1e-3, 5e-3)


@dataclass(frozen=True)
class GainLimits:
    """The largest stable gains (V) of sink and sensor at a sample time (s), the smaller of those before and after the
    outer step, each with the other gain as it is; and the decay (1/s) of the loop's slowest mode at its own gains, with
    the size of its eigenvalue per sample."""

    sample_time_s: float
    sink_gain_V: float
    sensor_gain_V: float
    decay_per_s: float
    largest_eigenvalue: float


@dataclass(frozen=True)
class Design:
    """Gain limits at several sample times, the scene's first; the largest gains (sink, sensor) that start from cold
    without the limiter acting; ``range`` for the largest voltage or power, ``None`` where neither is given; and by
    meter the step of the outer temperature that it resolves, or why it can't, the same in words, and the source of its
    data."""

    limits: tuple[GainLimits, ...]
    smooth_start_gains_V: tuple[float, float]
    range: Range | None
    resolutions: dict[str, ExternalStep | str]
    meters: dict[str, str]
    sources: dict[str, str]


def answer(device: Device, largest_voltage: float = np.inf, largest_power: float = np.inf) -> Design:
    """The answers for a device whose sensor gets at most a voltage (V) and a power (W); raises ArithmeticError where
    its numerics fail."""
    times = dict.fromkeys((device.control.sample_time, *SAMPLE_TIMES))
    span = abs(device.control.set_temperature - device.external.final_temperature)
    found = {name: _resolution(device, name) for name in METERS}
    limited = min(largest_voltage, largest_power) < np.inf
    return Design(
        tuple(_limits(at_sample_time(device, time)) for time in times),
        (smooth_start_gain(device, 0), smooth_start_gain(device, 1)),
        measurable_range(device, voltage=largest_voltage, power=largest_power) if limited else None,
        found,
        {name: step if isinstance(step, str) else _resolves(step, span) for name, step in found.items()},
        {name: meter.source for name, meter in METERS.items()},
    )


def _limits(device: Device) -> GainLimits:
    found = [stability(device, t) for t in (device.external.initial_temperature, device.external.final_temperature)]
    return GainLimits(
        device.control.sample_time, min(s.sink_gain_limit for s in found), min(s.sensor_gain_limit for s in found),
        -max(s.growth_rate for s in found), max(abs(s.eigenvalue) for s in found),
    )  # fmt: skip


def _resolves(step: ExternalStep, span: float) -> str:
    """In words what a meter resolves: nothing, where its step is more than the set point is away from outside (K)."""
    parts = (
        f"{quantity(step.power, 'K', 2)} by the sensor's power, {quantity(step.sensor, 'K', 2)} by holding the "
        f"sensor's temperature, {quantity(step.sink, 'K', 2)} the sink's"
    )
    if step.total < span:
        return f"resolves {quantity(step.total, 'K', 2)} outside: {parts}"
    return (
        f"cannot resolve the outer temperature: its step of {quantity(step.total, 'K', 2)} is more than the "
        f"{span:.3g} K from outside to the set point ({parts})"
    )


def _resolution(device: Device, name: str) -> ExternalStep | str:
    try:
        return resolution(device, METERS[name])
    except ValueError as error:
        return str(error)
