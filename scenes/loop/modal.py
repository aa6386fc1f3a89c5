"""A structure with two heated films in modes that decay on their own: what a closed loop needs to know of a model.

    db/dt = -rates b + shape^T u,      rises = shape b + external T,      b jumps by -jump dT with the outer rise T

The first two responses are the mean rises of sink and sensor, by which their resistances change (eq 7), and the heat
u (W) of these is the electrical power V^2/R (eqs 6, 7). Any further ones are how a film's local temperature departs
from its mean: heat is rho J^2 with the resistivity of the place, so that u_j = P a dT_j / (1 + a dT) there, which moves
heat about and makes none.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Modal:
    """``rates`` (n,) in 1/s, ascending; ``shape`` (m, n); ``film`` (m,): 0 where a response is of the sink, 1 of the
    sensor; ``resistance`` (ohm, no rise) and ``coefficient`` (1/K), (2,) each; ``external`` (m,) and ``jump`` (n,) as
    above. Heat flows (W), k of them: flux b + flux_external T + feed u, with ``flux`` (k, n) and ``feed`` (k, m).
    """

    rates: np.ndarray
    shape: np.ndarray
    film: np.ndarray
    resistance: np.ndarray
    coefficient: np.ndarray
    external: np.ndarray
    jump: np.ndarray
    flux: np.ndarray
    flux_external: np.ndarray
    feed: np.ndarray

    @property
    def count(self) -> int:
        return len(self.rates)

    @property
    def responses(self) -> int:
        return len(self.film)

    def power(self, voltage: np.ndarray, rise: np.ndarray) -> np.ndarray:
        """V^2/R(T) of (sink, sensor) in W; the last axis of both arguments is the films."""
        return voltage**2 / (self.resistance * (1 + self.coefficient * rise))

    def heat(self, power: np.ndarray, rise: np.ndarray) -> np.ndarray:
        """(m,): the heat u for powers (2,) at rises (m,) of the responses."""
        a, own = self.coefficient[self.film], self.film
        local = a * rise / (1 + a * rise[own])
        local[:2] = 1.0
        return power[own] * local
