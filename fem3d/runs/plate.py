"""A rectangular plate of constant conductivity, its bottom at zero and its sides adiabatic: the rise that heat entering
at one place of its top makes at another.

Of a plate without sides, per unit of heat at a distance r along the top (Carslaw and Jaeger, Conduction of Heat in
Solids, 1959, section 14.9, with the bottom's images summed),

    g(r) = 1/(pi k t) sum_(n odd) K_0(n pi r / (2 t)),

which falls like exp(-pi r / (2 t)). Each adiabatic side mirrors what heats the plate, so that g is summed over the
images of the source in both directions. Heat that enters over a footprint is that of a few points with the footprint's
first moments, as is the mean over another.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.sparse import csr_array
from scipy.special import k0

from scenes.errors import NumericsError

NOTHING = 36.0
"""exp(-36) is 2e-16: where a term, or an image, is that small it is left out."""
MOST_IMAGES = 4_000_000
"""The most distances between points and images that are looked up, which takes some seconds."""
SAMPLES = 1500
"""Number of samples of log g over log r; cubic polynomials between them are off by less than 1e-9."""


@dataclass(frozen=True, eq=False)
class Plate:
    """Sides ``x`` and ``y`` and ``thickness`` in m, ``conductivity`` in W/(m K); places are from a corner."""

    x: float
    y: float
    thickness: float
    conductivity: float

    @property
    def reach(self) -> float:
        """The distance (m) beyond which nothing is felt."""
        return NOTHING * 2 * self.thickness / math.pi

    @property
    def _curve(self) -> tuple[float, CubicSpline]:
        """The least distance, and log g over log r from there."""
        least = 1e-3 * min(self.x, self.y, self.thickness)
        return least, _curve_of(least, self.reach, self.thickness, self.conductivity)

    def unsided(self, distance: np.ndarray) -> np.ndarray:
        """g in K/W at distances (m); none beyond the reach, and at no distance, which belongs to no two places."""
        least, curve = self._curve
        rises = np.zeros(distance.shape)
        far = (distance > least) & (distance < self.reach)
        rises[far] = np.exp(curve(np.log(distance[far])))
        near = (distance > 0) & (distance <= least)
        rises[near] = np.exp(curve(np.log(least))) * least / distance[near]
        return rises

    def along(self, side: float, targets: np.ndarray, sources: np.ndarray) -> np.ndarray:
        """(targets, sources, images): distances (m) along one side to each source, the first, and to its images."""
        count = math.ceil((self.reach + 2 * side) / (2 * side))
        shifts = 2 * side * np.array(sorted(range(-count, count + 1), key=abs))
        same = np.abs(targets[:, None, None] - sources[None, :, None] - shifts)
        mirrored = np.abs(targets[:, None, None] + sources[None, :, None] - shifts)
        return np.concatenate([same, mirrored], axis=2)

    def between(self, columns: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """(columns, columns, rows, rows): the mean rise (K/W) over each footprint by heat in each, where footprints are
        a column and a row: places (columns, points) along x and (rows, points) along y, of equal weights. A
        footprint's own rise is that by its images, and by its other points, alone."""
        parts = [self._distances(side, at) for side, at in ((self.x, columns), (self.y, rows))]
        (x, weights_x), (y, weights_y) = parts
        if x.size * y.size > MOST_IMAGES:
            raise NumericsError(
                f"a substrate {self.thickness * 1e3:.3g} mm thick under {self.x * 1e3:.3g} mm x {self.y * 1e3:.3g} mm "
                "mirrors what stands on it too often to be summed: give a thinner or a larger one"
            )
        table = self.unsided(np.hypot(x[:, None], y[None, :]))
        means = weights_y @ np.asarray(weights_x @ table).T
        n, m = len(columns), len(rows)
        return np.ascontiguousarray(means.T).reshape(n, n, m, m)

    def _distances(self, side: float, places: np.ndarray) -> tuple[np.ndarray, csr_array]:
        """The distances (m) that occur along a side, and with which weights between each two groups of places."""
        count, points = places.shape
        given = self.along(side, places.ravel(), places.ravel())
        given = given[:, :, given.min(axis=(0, 1)) < self.reach]
        kinds, at = np.unique(np.round(given.ravel() / (1e-9 * side)), return_inverse=True)
        values = np.zeros(len(kinds))
        values[at] = given.ravel()
        group = np.repeat(np.arange(count), points)
        pair = (group[:, None] * count + group[None, :])[:, :, None] + np.zeros(given.shape[2], int)
        weight = np.full(given.size, 1 / points**2)
        return values, csr_array((weight, (pair.ravel(), at.ravel())), shape=(count**2, len(kinds)))

    def mirrored(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """(feet, feet): the mean rise (K/W) over each of some footprints that stand together by heat in each of them,
        of their images alone: places (points,) along x, the same for all, and (feet, points) along y."""
        feet, points = y.shape
        dx, dy = self.along(self.x, x, x), self.along(self.y, y.ravel(), y.ravel())
        rises = np.zeros((feet * points, feet * points))
        for a in range(len(x)):
            for b in range(len(x)):
                images = self.unsided(np.hypot(dx[a, b][:, None, None, None], dy[None]))
                images[0, :, :, 0] = 0.0
                rises += images.sum(axis=(0, 3))
        return rises.reshape(feet, points, feet, points).mean(axis=(1, 3)) / len(x) ** 2


@lru_cache(maxsize=16)
def _curve_of(least: float, reach: float, thickness: float, conductivity: float) -> CubicSpline:
    """log g over log r from ``least`` to ``reach`` (m)."""
    r, sums = np.geomspace(least, reach, SAMPLES), np.empty(SAMPLES)
    for i, at in enumerate(r.tolist()):
        n = np.arange(1, max(NOTHING * 2 * thickness / (math.pi * at), 3) + 2, 2)
        sums[i] = k0(n * math.pi * at / (2 * thickness)).sum()
    return CubicSpline(np.log(r), np.log(sums / (math.pi * conductivity * thickness)))
