"""The films' circuit, the settings of their controllers and the meter in the loop, and the times of samples and steps.

Each film is behind a voltage of its own, both in series with one lead to ground:

    V_e = R_e I_e + R_ground (I_sink + I_sensor),      measured R_e = V_e/I_e = R_e + R_ground (1 + I_other/I_e)
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from scenes.device import Device


def currents(voltage: np.ndarray, resistance: np.ndarray, ground: float) -> np.ndarray:
    """(..., 2): the currents (A) of (sink, sensor) for voltages (V) and resistances (ohm) of the same shape."""
    total = (voltage / resistance).sum(axis=-1, keepdims=True)
    drop = ground * total / (1 + ground * (1 / resistance).sum(axis=-1, keepdims=True))
    return np.asarray((voltage - drop) / resistance)


def powers(voltage: np.ndarray, resistance: np.ndarray, ground: float) -> np.ndarray:
    """(..., 2): the powers (W) in (sink, sensor) themselves."""
    return currents(voltage, resistance, ground) ** 2 * resistance


def measured(voltage: np.ndarray, resistance: np.ndarray, ground: float) -> np.ndarray:
    """(..., 2): the resistances (ohm) that the controllers see, V/I.

    A film whose voltage drives no current forward, as before the first sample, is seen by a test current of its own,
    with the lead in series: R + R_ground.
    """
    if not ground:
        return resistance
    current = currents(voltage, resistance, ground)
    forward = np.real(voltage * current) > 0
    ratio = current[..., ::-1] / np.where(forward, current, 1.0)
    return np.asarray(resistance + ground * np.where(forward, 1 + ratio, 1.0))


def settings(device: Device, resistance: np.ndarray, coefficient: np.ndarray) -> dict[str, Any]:
    """Write the document of a device's `statespace.controllers.Controllers`, for R_0 (ohm) and its temperature
    coefficient (1/K) of (sink, sensor)."""
    control = device.control
    return {
        "sample_time_s": control.sample_time, "gain_V": [control.sink_gain, control.sensor_gain],
        "resistance_ohm": resistance.tolist(), "change_at_set_temperature": (coefficient * device.set_rise).tolist(),
        "lowest_V": None if control.allow_negative_voltage else 0.0,
    }  # fmt: skip


def metered(
    voltage: np.ndarray, resistance: np.ndarray, ground: float, meter: tuple[float, float] = (0.0, 0.0)
) -> np.ndarray:
    """(2,): the resistances (ohm) of (sink, sensor) as controllers read them over a common lead, for the voltages (V)
    that have held until then, rounded to the steps of a ``meter`` (ohm, 0 for an ideal one)."""
    step = np.array(meter)
    seen = measured(voltage, resistance, ground)
    return np.where(step > 0, np.rint(seen / np.where(step > 0, step, 1.0)) * step, seen)


@dataclass(frozen=True)
class Timetable:
    """Sample time in s, number of samples (the first at 0, the last at or before the end), and the outer steps.

    ``steps`` maps a sample's number to the steps in its interval: (seconds after the sample, new outer rise in K).
    """

    sample_time: float
    samples: int
    steps: dict[int, tuple[tuple[float, float], ...]]

    @property
    def times(self) -> np.ndarray:
        return self.sample_time * np.arange(self.samples)

    def stretches(self) -> Iterator[Stretch]:
        """The run cut at every sample and outer step, in order; the last sample has a piece of length 0."""
        for k in range(self.samples):
            end = self.sample_time if k < self.samples - 1 else 0.0
            outer = {0.0: None} | {after: rise for after, rise in self.steps.get(k, ()) if not after or end}
            for (start, rise), stop in zip(outer.items(), [*outer, end][1:], strict=True):
                yield Stretch(k, start == 0.0, rise, stop - start)


class Stretch(NamedTuple):
    """A stretch of constant voltages: its sample, whether that is at its start, the new outer rise (K) or None for no
    step at its start, and its length in s."""

    sample: int
    measure: bool
    outer: float | None
    length: float


def timetable(device: Device) -> Timetable:
    """The timetable of a device: its outer face goes from room to the initial temperature at 0, later to the final.

    A step within a billionth of a sample time from a sample is at that sample.
    """
    control, external, room = device.control, device.external, device.sink.room_temperature
    h = control.sample_time
    samples = int(np.floor(device.end_time / h + 1e-9)) + 1
    steps: dict[int, tuple[tuple[float, float], ...]] = {}
    if external.initial_temperature != room and external.step_time > 0:
        steps[0] = ((0.0, external.initial_temperature - room),)
    k = int(np.floor(max(external.step_time, 0.0) / h + 1e-9))
    after = max(external.step_time - k * h, 0.0)
    after = after if after > 1e-9 * h else 0.0
    steps[k] = (*steps.get(k, ()), (after, external.final_temperature - room))
    return Timetable(h, samples, steps)
