"""The two sampled controllers of the device at work (eq 21 of the paper), with nothing but numpy.

Sample k is at k times the sample time: the resistances that are measured then raise each voltage, which holds to the
next sample. Pairs are (sink, sensor).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np


class Controllers:
    """The controllers of a document (`statespace.circuit.settings`), from their first sample on.

    A voltage is the one before plus gain (R_req - R)/(R_req - R_0), not below the ``lowest``: R is measured, R_0 the
    ``resistance`` at no rise, and R_req that at the set rise, where it has changed by the part ``change``. The printed
    "dt" of the law is the sample time, and the law is integral, not proportional.
    """

    def __init__(self, document: Mapping[str, Any]) -> None:
        self.document = document
        self.sample_time: float = document["sample_time_s"]
        self.gain, self.resistance, self.change = (
            np.array(document[key]) for key in ("gain_V", "resistance_ohm", "change_at_set_temperature")
        )
        self.lowest = -np.inf if document["lowest_V"] is None else document["lowest_V"]
        self.voltage = np.zeros(2)
        self.samples = 0

    def sample(self, measured: Sequence[float] | np.ndarray) -> np.ndarray:
        """(2,): the voltages (V) that hold from this sample on, of the resistances (2,) in ohm that are measured."""
        error = 1 - (np.asarray(measured, dtype=float) / self.resistance - 1) / self.change
        self.voltage = np.maximum(self.voltage + self.gain * error, self.lowest)
        self.samples += 1
        return self.voltage

    def until(self, end: float, measured: Sequence[float] | np.ndarray) -> np.ndarray:
        """(2,): the voltages (V) after all samples before a time (s) at which the resistances (ohm) are these."""
        while self.samples * self.sample_time < end - 1e-9 * self.sample_time:
            self.sample(measured)
        return self.voltage
