"""The sampled controllers: the incremental law of eq 21, its limit at zero volts and the meter in its loop; and when
they sample and the outer temperature steps."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from scenes.device import Device
from statespace.circuit import measured
from statespace.controllers import error_of


@dataclass(frozen=True)
class ControlLaw:
    """Eq 21 for (sink, sensor).

    Attributes
    ----------
    gain : (2,) array
        Gains in V.
    set_rise, lowest : float
        The set rise (K), and the smallest voltage (V), -inf for none.
    resistance, coefficient : (2,) array
        R_0 (ohm) and its temperature coefficient (1/K) of eq 7.
    resolution : (2,) array
        Step (ohm) to which a measured resistance is rounded, 0 for an ideal meter.
    ground : float
        The lead (ohm) that both currents share.
    """

    gain: np.ndarray
    set_rise: float
    lowest: float
    resistance: np.ndarray
    coefficient: np.ndarray
    resolution: np.ndarray
    ground: float = 0.0

    @cached_property
    def ideal(self) -> bool:
        """Whether the films' own resistances are measured, without rounding."""
        return not self.resolution.any() and not self.ground

    def error(self, voltage: np.ndarray, rise: np.ndarray) -> np.ndarray:
        """(R_req - R)/(R_req - R_0) as measured, no unit, for the voltages (V) that have held until then and rises in
        K, with the elements on the last axis of both."""
        if self.ideal:
            return 1 - rise / self.set_rise
        step = np.where(self.resolution > 0, self.resolution, 1.0)
        resistance = measured(voltage, self.resistance * (1 + self.coefficient * rise), self.ground)
        read = np.where(self.resolution > 0, np.rint(resistance / step) * step, resistance)
        return error_of(read, self.resistance, self.coefficient * self.set_rise)

    def next_voltage(self, voltage: np.ndarray, rise: np.ndarray) -> np.ndarray:
        """The voltage from this sample on, in V: V(t) = V(t - T_s) + gain * error, not below ``lowest``.

        The printed "dt" is the controller's sample time, and the law is integral, not proportional.
        """
        return np.maximum(voltage + self.gain * self.error(voltage, rise), self.lowest)


def control_law(
    device: Device, resistance: np.ndarray, coefficient: np.ndarray, resolution: tuple[float, float] = (0.0, 0.0)
) -> ControlLaw:
    """The law of a device's controllers; ``resistance``, ``coefficient`` and ``resolution`` for (sink, sensor)."""
    control = device.control
    return ControlLaw(
        np.array([control.sink_gain, control.sensor_gain]), device.set_rise,
        -np.inf if control.allow_negative_voltage else 0.0, resistance, coefficient, np.array(resolution, dtype=float),
        control.ground_resistance,
    )  # fmt: skip


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
            start, measure, outer = 0.0, True, None
            for after, rise in self.steps.get(k, ()):
                if after > 0.0:
                    if not end:
                        break
                    yield Stretch(k, measure, outer, after - start)
                    start, measure = after, False
                outer = rise
            yield Stretch(k, measure, outer, end - start)


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
