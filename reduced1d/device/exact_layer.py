"""Eq 3 in one layer exactly: Appendix A with its misprints corrected, as an oracle for every other solution of it.

T = u + w, with u = T1 + (T2 - T1) x/L (A.9) and w = sum_n b_n sin(n pi x/L) exp(-alpha n^2 pi^2 t'/L^2) (A.14). When
the end temperatures change, b_n changes by the sine coefficients of a straight line, known in closed form: the modes
propagate exactly and the paper's oscillatory integrals never arise. (Printed: A.9 and A.13 with a bracket misplaced,
A.15 with 2n + 1 for n.)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from reduced1d.device.lumped import Slab


@dataclass(frozen=True)
class ExactLayer:
    """A layer's temperature in K: ``ends``, those of its faces at x = 0 and x = L, and ``b`` (N,), the b_n of w."""

    slab: Slab
    ends: tuple[float, float]
    b: np.ndarray

    def hold(self, ends: tuple[float, float], duration: float) -> ExactLayer:
        """The layer after its faces were put to ``ends`` (K) and held there for a ``duration`` in s."""
        n = np.arange(1, len(self.b) + 1)
        change = line_coefficients(self.ends[0] - ends[0], self.ends[1] - ends[1], len(n))
        rate = self.slab.diffusivity * (n * np.pi / self.slab.thickness) ** 2
        return ExactLayer(self.slab, ends, (self.b + change) * np.exp(-rate * duration))

    def temperature(self, x: np.ndarray) -> np.ndarray:
        """T in K at the heights x in m."""
        s = np.asarray(x) / self.slab.thickness
        n = np.arange(1, len(self.b) + 1)
        return self.ends[0] + (self.ends[1] - self.ends[0]) * s + np.sin(np.pi * np.multiply.outer(s, n)) @ self.b

    def heat_flow(self) -> tuple[float, float]:
        """Heat flow -k A dT/dx in W, along x, at x = 0 and at x = L."""
        n = np.arange(1, len(self.b) + 1)
        slope = self.ends[1] - self.ends[0] + np.array([np.sum(n * self.b), np.sum(n * (-1.0) ** n * self.b)]) * np.pi
        lower, upper = -self.slab.conductance * slope
        return float(lower), float(upper)


def uniform_layer(slab: Slab, temperature: float, modes: int) -> ExactLayer:
    """A layer at one temperature in K, to be followed with some number of modes."""
    return ExactLayer(slab, (temperature, temperature), np.zeros(modes))


def line_coefficients(T1: float, T2: float, modes: int) -> np.ndarray:
    """Sine coefficients on (0, L) of the straight line from T1 to T2: 2/(n pi) (T1 - T2 cos(n pi)), n = 1 .. modes."""
    n = np.arange(1, modes + 1)
    return 2 / (n * np.pi) * (T1 - T2 * (-1.0) ** n)
