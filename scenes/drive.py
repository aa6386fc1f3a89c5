"""What drives a sink: a voltage, perhaps behind a series resistance, or a given current."""

from __future__ import annotations

import math
from typing import Any, NamedTuple


class Drive(NamedTuple):
    """A voltage (V) behind a ``series`` resistance (ohm); or where that is infinite a given current (A)."""

    value: float
    series: float = 0.0

    @property
    def unit(self) -> str:
        return "A" if self.series == math.inf else "V"

    @property
    def called(self) -> str:
        return "current_A" if self.series == math.inf else "voltage_V"

    def through(self, resistance: Any) -> Any:
        """The current (A) through a resistance (ohm), a number or an array."""
        return self.value + 0 * resistance if self.series == math.inf else self.value / (resistance + self.series)
