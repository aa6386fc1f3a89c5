"""The sink's quarter with a current density that doesn't vary, in the matrices of any program.

With ideal electrodes at the beam's ends the current density is uniform (to 4e-7 at 1 V), so the Joule heat is affine in
the rise: no electric problem.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from reduced1d.equations import room_resistivity
from scenes.sink import Sink

COPIES = 4


class Uniform:
    """The Joule load of a state and the quantities.

    ``peak``, ``end``, ``mean`` (unknowns,) are the value at the middle and the integrals over the end (m2) and the beam
    (m3) of the part; ``beam`` is the mass matrix of the part's beam (m3).
    """

    def __init__(self, sink: Sink, peak: np.ndarray, end: np.ndarray, mean: np.ndarray, beam: Any) -> None:
        self.sink, self.beam, self.volume = sink, beam, mean
        self.rows = peak, end / (sink.cross_section / 2), mean / (sink.length * sink.cross_section / COPIES)
        rho, coefficient = room_resistivity(sink.silicon, sink.room_temperature)
        self.rho = rho, rho * coefficient

    def current(self, rise: np.ndarray) -> float:
        """The current (A) of the whole cross section at a rise."""
        ratio = self.sink.length / self.sink.cross_section
        return float(self.sink.voltage / ((self.rho[0] + self.rho[1] * (self.rows[2] @ rise)) * ratio))

    def load(self, rise: np.ndarray) -> np.ndarray:
        """The Joule load (W) at a rise."""
        density = self.current(rise) / self.sink.cross_section
        found: np.ndarray = density**2 * (self.rho[0] * self.volume + self.rho[1] * (self.beam @ rise))
        return found

    def quantities(self, rise: np.ndarray) -> list[float]:
        """The rises (K) of peak, end and mean, and the current (A)."""
        return [*(float(row @ rise) for row in self.rows), self.current(rise)]
