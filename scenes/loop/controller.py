"""The sampled controllers: the incremental law of eq 21, its limit at zero volts and the meter in its loop."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from scenes.device import Device


@dataclass(frozen=True)
class Law:
    """Eq 21 for (sink, sensor): gains in V, the set rise in K, and the smallest voltage allowed (-inf for none).

    ``resistance`` in ohm and ``coefficient`` in 1/K are eq 7's; ``resolution`` is the step in ohm to which a measured
    resistance is rounded, 0 for an ideal meter.
    """

    gain: np.ndarray
    set_rise: float
    lowest: float
    resistance: np.ndarray
    coefficient: np.ndarray
    resolution: np.ndarray

    @cached_property
    def ideal(self) -> bool:
        """Whether resistances are measured without rounding."""
        return not self.resolution.any()

    def error(self, rise: np.ndarray) -> np.ndarray:
        """(R_req - R)/(R_req - R_0) as measured, for rises in K with the elements on the last axis; no unit."""
        if self.ideal:
            return 1 - rise / self.set_rise
        step = np.where(self.resolution > 0, self.resolution, 1.0)
        resistance = self.resistance * (1 + self.coefficient * rise)
        measured = np.where(self.resolution > 0, np.rint(resistance / step) * step, resistance)
        return 1 - (measured / self.resistance - 1) / (self.coefficient * self.set_rise)

    def next_voltage(self, voltage: np.ndarray, rise: np.ndarray) -> np.ndarray:
        """The voltage from this sample on, in V: V(t) = V(t - T_s) + gain * error, not below ``lowest``.

        The printed "dt" is the controller's sample time, and the law is integral, not proportional.
        """
        return np.maximum(voltage + self.gain * self.error(rise), self.lowest)


def law(
    device: Device, resistance: np.ndarray, coefficient: np.ndarray, resolution: tuple[float, float] = (0.0, 0.0)
) -> Law:
    """The law of a device's controllers; ``resistance``, ``coefficient`` and ``resolution`` for (sink, sensor)."""
    control = device.control
    return Law(
        np.array([control.sink_gain, control.sensor_gain]), device.set_rise,
        -np.inf if control.allow_negative_voltage else 0.0, resistance, coefficient, np.array(resolution, dtype=float),
    )  # fmt: skip
