"""A structure with two heated films in modes that decay on their own: what a closed loop needs to know of a model.

    db/dt = -rates b + shape^T u,      rises = shape b + external T,      b jumps by -jump dT with the outer rise T

The substrate's temperature is another such input, and what does not change besides is an offset of the rises.

The first two responses are the mean rises of sink and sensor, by which their resistances change (eq 7), and the heat
u (W) of these is the electrical power V^2/R (eqs 6, 7). Any further ones are how a film's local temperature departs
from its mean: heat is rho J^2 with the resistivity of the place, so that u_j = P a dT_j / (1 + a dT) there, which moves
heat about and makes none.

In an interval of constant voltages modes are propagated exactly, the heat V^2/R(T) collocated in powers of t^(1/p).
After a voltage jump the temperatures go like t, t^(3/2), t^2 ... once heat has entered the layers, and faster while it
charges the thin sensor; in x = (t/h)^(1/p) both are smooth. The source is a polynomial in x through its values at the
start (known) and at Chebyshev points; its response at those points is a product with tables made once per length h.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

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


@dataclass(frozen=True)
class Interval:
    """Tables for one length (s), with q + 1 nodes (the first at the start), n modes and m responses, which vary
    slowest.

    ``free`` (m q, n) rises at the nodes per mode at the start; ``first`` (m q, m) and ``later`` (m q, m q) rises per
    heat at the start and at the nodes; ``decay`` (n,), ``gain_first`` (n, m) and ``gain_later`` (n, m q) take the modes
    to the interval's end; ``weights`` (q + 1,) integrate a power over it.
    """

    length: float
    nodes: np.ndarray
    free: np.ndarray
    first: np.ndarray
    later: np.ndarray
    decay: np.ndarray
    gain_first: np.ndarray
    gain_later: np.ndarray
    weights: np.ndarray


def interval(modes: Modal, length: float, q: int, p: int) -> Interval:
    """Tables for intervals of one length (s) with q unknown heats per response in t^(1/p)."""
    m = modes.responses
    x = (1 - np.cos(np.pi * np.arange(q + 1) / q)) / 2
    response = np.stack([_response(modes.rates * length, x, k, p) for k in range(1, q + 1)]) * length
    kernel = np.einsum("in,mnl,jn->imjl", modes.shape, response, modes.shape)
    free = np.einsum("in,mn->imn", modes.shape, np.exp(-np.outer(x[1:] ** p, modes.rates * length)))
    last = np.einsum("nl,jn->njl", response[-1], modes.shape)
    points, w = _graded(x[-1], 4, q + 8)
    return Interval(
        length, length * x**p, free.reshape(m * q, -1),
        kernel[..., 0].reshape(m * q, m), kernel[..., 1:].reshape(m * q, m * q),
        np.exp(-modes.rates * length), last[..., 0], last[..., 1:].reshape(-1, m * q),
        length * (w * p * points ** (p - 1)) @ _lagrange(x, points),
    )  # fmt: skip


def _response(decay: np.ndarray, x: np.ndarray, m: int, p: int) -> np.ndarray:
    """Integrals of exp(-decay (x_m^p - s^p)) times the Lagrange polynomials in s over ds^p, (modes, nodes)."""
    s, w = _graded(x[m], int(np.ceil(np.log2(p * decay.max() + 1))) + 4, len(x) + 7)
    return np.exp(np.outer(decay, s**p - x[m] ** p)) @ ((w * p * s ** (p - 1))[:, None] * _lagrange(x, s))


def _graded(end: float, panels: int, order: int) -> tuple[np.ndarray, np.ndarray]:
    """Gauss points and weights on panels of (0, end) that halve towards the end."""
    edges = end * np.r_[1 - 0.5 ** np.arange(panels), 1.0]
    x, w = _gauss(order)
    half = np.diff(edges)[:, None] / 2
    return (edges[:-1, None] + half * (1 + x)).ravel(), (half * w).ravel()


@lru_cache
def _gauss(order: int) -> tuple[np.ndarray, np.ndarray]:
    return np.polynomial.legendre.leggauss(order)


def _lagrange(nodes: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Lagrange polynomials of the Chebyshev-Lobatto nodes at x, (points, nodes), by the barycentric formula."""
    weights = (-1.0) ** np.arange(len(nodes))
    weights[[0, -1]] /= 2
    difference = x[:, None] - nodes
    hit = np.abs(difference) < 1e-15
    terms = weights / np.where(hit, 1.0, difference)
    values = terms / terms.sum(axis=1, keepdims=True)
    return np.where(hit.any(axis=1, keepdims=True), hit, values)
