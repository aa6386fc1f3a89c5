"""A rectangular plate of constant conductivity over time, its bottom at zero and its sides adiabatic: the rise that
heat entering at two points of its top from time 0 on makes at pairs of others.

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
    plate: Plate, diffusivity: float, x: float, y: np.ndarray, columns: np.ndarray, rows: np.ndarray, times: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """(places, times) the mean rise in K/W under each of some pairs of feet by a watt that enters in equal parts at one
    pair, at ascending times (s), the first 0, and (places,) that at rest. Feet are points from a corner (m): the one
    pair has ``x`` and ``y`` (2,), the others ``columns`` (n,) and ``rows`` (m, 2), places along the columns first;
    diffusivity in m2/s. Of the pair itself the rise depends on the points between times.
    """
    rate = (math.pi / (2 * plate.thickness)) ** 2 * diffusivity
    tail, length = [float(times[-1])], max(float(times[1] - times[0]), 1e-3 / rate)
    while (tail[-1] - tail[0]) * rate < NOTHING:
        tail.append(tail[-1] + length)
        length *= LONGER
    edges = np.concatenate([times, tail[1:]])
    points, weights = np.polynomial.legendre.leggauss(ORDER)
    half = np.diff(edges)[:, None] / 2
    at = (edges[:-1, None] + half * (1 + points)).ravel()
    down = _downwards(plate, diffusivity, at) * (half * weights).ravel()
    across = [_sideways(plate, plate.x, np.array([c]), np.array([x]), 4 * diffusivity * at) for c in columns]
    along = [_sideways(plate, plate.y, row, y, 4 * diffusivity * at) / 4 for row in rows]
    gained = np.array([(down * a * b).reshape(-1, ORDER).sum(axis=1) for b in along for a in across])
    whole = np.concatenate([np.zeros((len(gained), 1)), np.cumsum(gained, axis=1)], axis=1)
    return whole[:, : len(times)], whole[:, -1]


def _sideways(plate: Plate, side: float, targets: np.ndarray, sources: np.ndarray, spread: np.ndarray) -> np.ndarray:
    """(times,): exp(-r^2/spread) along one side, summed over targets, sources and their images."""
    distances = plate.along(side, targets, sources).ravel()
    near = distances[distances < plate.reach]
    return np.asarray(sum((np.exp(-(r**2) / spread) for r in near.tolist()), np.zeros(len(spread))))


def _downwards(plate: Plate, a: float, t: np.ndarray) -> np.ndarray:
    """(times,): the rise after a joule at time 0 (K/J), where none of it spread sideways from the point."""
    decay = (math.pi / (2 * plate.thickness)) ** 2 * a * t
    down, n = np.zeros(len(t)), 1
    while n**2 * decay[0] < NOTHING:
        down += np.exp(-(n**2) * decay)
        n += 2
    return np.asarray(2 * a / (plate.conductivity * plate.thickness) * down / (math.pi * 4 * a * t))
