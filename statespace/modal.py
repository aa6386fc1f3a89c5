"""A structure with two heated films in modes that decay on their own: what a closed loop needs to know of a model.

    db/dt = -rates b + shape^T u,      rises = shape b + external T,      b jumps by -jump dT with the outer rise T

The substrate's temperature is another such input, and what does not change besides is an offset of the rises.

The first two responses are the mean rises of sink and sensor, by which their resistances change (eq 7), and the heat
u (W) of these is the electrical power V^2/R (eqs 6, 7). Any further ones are how a film's local temperature departs
from its mean: heat is rho J^2 with the resistivity of the place, so that u_j = P a dT_j / (1 + a dT) there, which moves
heat about and makes none.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np


@dataclass(frozen=True, eq=False)
class Inlet:
    """A temperature that a model is given, per kelvin: the rises ``external`` (m,) that it keeps up, the heat flows
    ``flux`` (k,) in W/K, by what ``jump`` (n,) a step of it changes the modes, and the heat (W/K) that is ``taken`` in
    where it is given. ``plate`` (n,) is what of the jump is in the plate on whose bottom it is given."""

    external: np.ndarray
    jump: np.ndarray
    flux: np.ndarray
    taken: float = 0.0
    plate: np.ndarray | float = 0.0


@dataclass(frozen=True, eq=False)
class Modal:
    """``rates`` (n,) in 1/s, ascending; ``shape`` (m, n); ``film`` (m,): 0 where a response is of the sink, 1 of the
    sensor; ``resistance`` (ohm, no rise) and ``coefficient`` (1/K), (2,) each; ``external`` (m,) and ``jump`` (n,) as
    above. Heat flows (W), k of them: flux b + flux_external T + feed u, with ``flux`` (k, n) and ``feed`` (k, m).
    ``substrate`` is that temperature as an input; ``offset`` (m,) and ``flux_offset`` (k,) are added to rises and
    flows, none where they are left out.
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
    substrate: Inlet
    offset: np.ndarray | float = 0.0
    flux_offset: np.ndarray | float = 0.0

    @property
    def outside(self) -> Inlet:
        """The outer temperature as an input: what leaves the polymer at rest enters nowhere else."""
        return Inlet(self.external, self.jump, self.flux_external, -float(self.flux_external[0]))

    def above_substrate(self, outer: float) -> Modal:
        """The model whose outer rise stays (K), and whose input is the substrate's temperature instead."""
        substrate = self.substrate
        return replace(
            self, external=substrate.external, jump=substrate.jump, flux_external=substrate.flux,
            offset=self.offset + outer * self.external, flux_offset=self.flux_offset + outer * self.flux_external,
        )  # fmt: skip

    def on_top_of_plate(self) -> Modal:
        """The model whose substrate's temperature is that which the plate would have under its feet without it: a step
        of that warms the plate at once, and the structure on it by and by."""
        below = self.substrate
        return replace(self, substrate=replace(below, jump=below.jump - below.plate, plate=0.0))

    def with_heat_below(self) -> Modal:
        """The model with one flow more, the last: the heat that leaves into the substrate (or the plate below), as what
        is stored, conducted and generated, each weighed with the steady rise per kelvin of substrate."""
        below = self.substrate
        drawn = float(below.flux[0])  # what a kelvin outside sends there is what one of substrate sends outside
        return replace(
            self, flux=np.vstack([self.flux, self.rates * below.jump]),
            flux_external=np.append(self.flux_external, drawn),
            feed=np.vstack([self.feed, below.external - self.shape @ below.jump]),
            substrate=replace(below, flux=np.append(below.flux, -below.taken)),
        )  # fmt: skip

    def within(self, sums: np.ndarray) -> Modal:
        """The model of some ``sums`` (n, k) of its modes, which are orthonormal, in modes of its own."""
        rates, vectors = np.linalg.eigh(sums.T @ (self.rates[:, None] * sums))
        basis, substrate = sums @ vectors, self.substrate
        plate = np.broadcast_to(substrate.plate, substrate.jump.shape) @ basis
        return replace(
            self, rates=rates, shape=self.shape @ basis, jump=self.jump @ basis, flux=self.flux @ basis,
            substrate=replace(substrate, jump=substrate.jump @ basis, plate=plate),
        )  # fmt: skip

    @property
    def count(self) -> int:
        return len(self.rates)

    @property
    def responses(self) -> int:
        return len(self.film)

    def heat(self, power: np.ndarray, rise: np.ndarray) -> np.ndarray:
        """(m,): the heat u for powers (2,) at rises (m,) of the responses."""
        a, film = self.coefficient[self.film], self.film
        local = a * rise / (1 + a * rise[film])
        local[:2] = 1.0
        return power[film] * local
