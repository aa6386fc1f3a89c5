"""A rectangular plate of constant conductivity over time, its bottom at zero and its sides adiabatic: the rise that
heat entering at one point of its top from time 0 on makes at another.

Of a plate without sides, per unit of heat that entered at one instant, a distance r away and a time t later,

    2/(rho c d) sum_(n odd) exp(-(n pi/(2 d))^2 a t) exp(-r^2/(4 a t))/(4 pi a t)

(Carslaw and Jaeger, Conduction of Heat in Solids, 1959, sections 14.3 and 14.9), and each side mirrors what heats it
(`fem3d.runs.plate`). r^2 is a sum along both sides, so that the sums over images are each other's factors.
"""

from __future__ import annotations

import math

import numpy as np

from fem3d.runs.plate import NOTHING, Plate

ORDER = 6
"""Gauss points between two times, and in each of the panels after the last."""
LONGER = 1.3
"""By this factor each panel on the way to rest is longer than the one before."""


def warming(
    plate: Plate, diffusivity: float, source: np.ndarray, target: np.ndarray, times: np.ndarray
) -> tuple[np.ndarray, float]:
    """(times,) the rise in K/W at ascending times (s), the first 0, and the rise at rest; ``source`` and ``target`` are
    places (x, y) from a corner, m; diffusivity in m2/s."""
    rate = (math.pi / (2 * plate.thickness)) ** 2 * diffusivity
    tail, length = [float(times[-1])], max(float(times[1] - times[0]), 1e-3 / rate)
    while (tail[-1] - tail[0]) * rate < NOTHING:
        tail.append(tail[-1] + length)
        length *= LONGER
    edges = np.concatenate([times, tail[1:]])
    x, weights = np.polynomial.legendre.leggauss(ORDER)
    half = np.diff(edges)[:, None] / 2
    at = edges[:-1, None] + half * (1 + x)
    gained = (half * weights * _kernel(plate, diffusivity, source, target, at.ravel()).reshape(at.shape)).sum(axis=1)
    whole = np.concatenate([[0.0], np.cumsum(gained)])
    return whole[: len(times)], float(whole[-1])


def _kernel(plate: Plate, a: float, source: np.ndarray, target: np.ndarray, t: np.ndarray) -> np.ndarray:
    """(times,): the rise after a joule at time 0 (K/J)."""
    spread = 4 * a * t
    product = np.ones(len(t))
    for side, x, y in zip((plate.x, plate.y), target, source, strict=True):
        distances = plate.along(side, np.array([x]), np.array([y]))[0, 0]
        near = distances[distances < plate.reach]
        product *= np.exp(-(near[:, None] ** 2) / spread).sum(axis=0)
    decay = (math.pi / (2 * plate.thickness)) ** 2 * a * t
    down = np.zeros(len(t))
    seen = product > 0
    n, last = 1, float(decay[seen].min(initial=np.inf))
    while n**2 * last < NOTHING:
        down[seen] += np.exp(-(n**2) * decay[seen])
        n += 2
    return np.asarray(2 * a / (plate.conductivity * plate.thickness) * down * product / (math.pi * spread))
