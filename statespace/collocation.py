"""Propagate the modes of a heated structure exactly over an interval of constant voltages.

The heat V^2/R(T) is a polynomial in x = (t/h)^(1/2), given by its values at Chebyshev points: after a voltage jump the
temperatures go like t, t^(3/2), t^2 ... once heat has entered the layers, which is smooth in x. The response of each
mode to each Lagrange polynomial is integrated once for each interval length h.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from statespace.modal import Modal

POWER = 2
"""The heat is a polynomial in t^(1/2)."""


@dataclass(frozen=True)
class Interval:
    """Matrices of one interval length, for n modes, m responses, k flows and q unknown heats per response.

    The size = m (q + 1) + k places are the responses at the start, then at the nodes (response by response), and the
    flows at the start.

    Attributes
    ----------
    reading : (size, n + 2) array
        Rises (K) at the places and flows (W) per amplitude at the start, without heat in the interval.
    kernel : (size, size) array
        Rises per heat (K/W).
    gain : (n + 2, size) array
        Amplitudes at the end per heat; the last two are the energies (J) generated in sink and sensor.
    decay : (n + 2,) array
        Amplitudes at the end per amplitude at the start.
    """

    reading: np.ndarray
    kernel: np.ndarray
    gain: np.ndarray
    decay: np.ndarray


def interval(modal: Modal, length: float, q: int) -> Interval:
    """Integrate the responses of a model's modes over an interval of some length (s)."""
    m, k, n = modal.responses, len(modal.flux), modal.count
    x = (1 - np.cos(np.pi * np.arange(q + 1) / q)) / 2
    response = np.stack([_response(modal.rates * length, x, node) for node in range(1, q + 1)]) * length
    later = np.einsum("in,mnl,jn->imjl", modal.shape, response, modal.shape)
    free = np.einsum("in,mn->imn", modal.shape, np.exp(-np.outer(x[1:] ** POWER, modal.rates * length)))
    last = np.einsum("nl,jn->njl", response[-1], modal.shape)
    points, w = _graded(x[-1], 4, q + 8)
    size = m * (q + 1) + k
    reading, kernel, gain = np.zeros((size, n + 2)), np.zeros((size, size)), np.zeros((n + 2, size))
    nodes = slice(m, m * (q + 1))
    kernel[nodes, :m], kernel[nodes, nodes] = later[..., 0].reshape(m * q, m), later[..., 1:].reshape(m * q, m * q)
    gain[:n, :m], gain[:n, nodes] = last[..., 0], last[..., 1:].reshape(-1, m * q)
    weights = length * (w * POWER * points ** (POWER - 1)) @ _lagrange(x, points)
    for film in (0, 1):
        gain[n + film, np.r_[film, m + film * q + np.arange(q)]] = weights
    reading[:, :n] = np.vstack([modal.shape, free.reshape(m * q, -1), modal.flux])
    return Interval(reading, kernel, gain, np.r_[np.exp(-modal.rates * length), 1.0, 1.0])


def _response(decay: np.ndarray, x: np.ndarray, node: int) -> np.ndarray:
    """Integrals of exp(-decay (x_m^2 - s^2)) times the Lagrange polynomials in s over ds^2, (modes, nodes)."""
    s, w = _graded(x[node], int(np.ceil(np.log2(POWER * decay.max() + 1))) + 4, len(x) + 7)
    weights = (w * POWER * s ** (POWER - 1))[:, None]
    return np.exp(np.outer(decay, s**POWER - x[node] ** POWER)) @ (weights * _lagrange(x, s))


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
