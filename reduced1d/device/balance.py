"""Where the heat of a run went: the balance of sink, insulator and sensor together."""

from __future__ import annotations

from dataclasses import dataclass

from reduced1d.device.lumped import Lumped
from reduced1d.device.march import March


@dataclass(frozen=True)
class Balance:
    """Heat in J over a run: generated electrically; lost by the sink to substrate and air; gone into the polymer; and
    stored in sink, insulator and sensor since the start."""

    generated: float
    anchors: float
    polymer: float
    stored: float

    @property
    def imbalance(self) -> float:
        """What is missing, as a fraction of the heat that was generated or passed the boundaries."""
        total = abs(self.generated) + abs(self.anchors) + abs(self.polymer)
        missing = self.generated - self.anchors - self.polymer - self.stored
        return missing / total if total else 0.0


def balance(lumped: Lumped, run: March) -> Balance:
    """The balance of a run's first resolution.

    The time integral of each mode is exact, from its own equation. The heat into the polymer is that of the reported
    flux, from the temperature's slope at the sensor, not what the discretisation balances by construction.
    """
    m, found = run.modes.modal, run.run
    heat = (found.energy @ m.shape - found.change + found.stepped) / m.rates
    sink_time = m.shape[0] @ heat + m.external[0] * found.outer_time
    polymer = m.flux[0] @ heat + m.flux_external[0] * found.outer_time
    stored = run.modes.content @ found.change + run.modes.content_external * found.outer
    return Balance(float(found.energy.sum()), float(lumped.sink.conductance * sink_time), float(polymer), float(stored))
