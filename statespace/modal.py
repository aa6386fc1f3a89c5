"""A structure with two heated films, as modes that decay on their own: the state-space model of a device.

    db/dt = -rates b + shape^T u,      rises = shape b + external T,      b jumps by -jump dT with the outer rise T

The substrate's temperature is another such input; constant contributions are an offset of the rises.

The first two responses are the mean rises of sink and sensor, on which their resistances depend (eq 7), and the heat
u (W) of the two is the electrical power V^2/R (eqs 6, 7). Further responses are departures of a film's local
temperature from its mean: heat is rho J^2 with the resistivity of the place, so that u_j = P a dT_j / (1 + a dT) there,
which moves heat about and makes none.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np


@dataclass(frozen=True, eq=False)
class Inlet:
    """A given temperature of a model, per kelvin.

    Attributes
    ----------
    external : (m,) array
        Steady rises, K/K.
    jump : (n,) array
        Change of the modes by a step of the temperature.
    flux : (k,) array
        Steady heat flows, W/K.
    taken : float
        Heat that enters where the temperature is given, W/K.
    """

    external: np.ndarray
    jump: np.ndarray
    flux: np.ndarray
    taken: float = 0.0


@dataclass(frozen=True, eq=False)
class Modal:
    """The model of a device, with n modes, m responses and k heat flows (W), flux b + flux_external T + feed u.

    Attributes
    ----------
    rates : (n,) array
        Decay rates in 1/s, ascending.
    shape : (m, n) array
        Rises per amplitude, and amplitudes per heat.
    film : (m,) array
        0 where a response belongs to the sink, 1 for the sensor.
    resistance, coefficient : (2,) array
        Of (sink, sensor): ohm at no rise, and 1/K.
    external, jump : (m,), (n,) array
        Response to the outer temperature, as of `Inlet`.
    flux, flux_external, feed : (k, n), (k,), (k, m) array
    substrate : Inlet
        The substrate's temperature as an input.
    offset, flux_offset : (m,), (k,) array or 0
        Constant rises and flows.
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
        """The outer temperature as an input: all heat that leaves the polymer at rest enters there."""
        return Inlet(self.external, self.jump, self.flux_external, -float(self.flux_external[0]))

    def above_substrate(self, outer: float) -> Modal:
        """The model whose outer rise stays (K), and whose input is the substrate's temperature instead."""
        substrate = self.substrate
        return replace(
            self, external=substrate.external, jump=substrate.jump, flux_external=substrate.flux,
            offset=self.offset + outer * self.external, flux_offset=self.flux_offset + outer * self.flux_external,
        )  # fmt: skip

    def within(self, sums: np.ndarray) -> Modal:
        """The model of some ``sums`` (n, k) of its modes, which are orthonormal, in modes of its own."""
        rates, vectors = np.linalg.eigh(sums.T @ (self.rates[:, None] * sums))
        basis, substrate = sums @ vectors, self.substrate
        return replace(
            self, rates=rates, shape=self.shape @ basis, jump=self.jump @ basis, flux=self.flux @ basis,
            substrate=replace(substrate, jump=substrate.jump @ basis),
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
