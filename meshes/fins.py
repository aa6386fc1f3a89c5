"""Degrees for fins: along a layer that a film cools, the rise falls like cosh(y / l), l^2 = k t / h.

On an interval of length 2 a l, polynomials of degree p leave no more than a^p / (2p - 1)!! of it in the energy norm
(the next Legendre coefficient of its slope), and a reading is estimated to miss about the square of that: of the sink
over air the peak 1.2e-3 at degree 4 and 0.9e-4 at degree 5, where it is 2.3e-3 and 0.7e-4.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from math import prod

import numpy as np

from meshes.grid import Grid
from scenes import laws
from scenes.model import Boundary, Box, Scene


def suited(grid: Grid, scene: Scene, accuracy: float, highest: int) -> Grid:
    """The grid with such degrees on each interval that a fin there misses half of an accuracy; where that takes more
    than the ``highest`` it stays as it is, and is halved in the search."""
    degrees = [d.copy() for d in grid.degrees]
    for b in scene.boundaries:
        if b.kind != "convection" or not isinstance(b.value, float | int) or b.value <= 0:
            continue
        across = grid.flat(b.lower, b.upper)
        for box in _cooled(scene, b, across):
            k = laws.along(box.material.at(scene.initial_temperature).thermal_conductivity)
            thickness = box.upper[across] - box.lower[across]
            if b.value * thickness > k[across]:  # the film of a contact, across which all of the rise falls
                continue
            for d in {0, 1, 2} - {across}:
                length = np.sqrt(k[d] * thickness / b.value)
                i, j = grid.span(d, max(b.lower[d], box.lower[d]), min(b.upper[d], box.upper[d]))
                for n, (start, end) in enumerate(pairwise(grid.breaks[d][i : j + 1].tolist()), start=i):
                    a = (end - start) / (2 * length)
                    enough = (p for p in range(degrees[d][n], highest + 1) if _missed(a, p) <= accuracy / 2)
                    degrees[d][n] = next(enough, degrees[d][n])
    return grid.with_axes(grid.breaks, degrees)


def _missed(a: float, p: int) -> float:
    """What degree p misses of a reading, relatively, where the rise falls by e^2a over the interval."""
    return (a**p / prod(range(1, 2 * p, 2))) ** 2


def _cooled(scene: Scene, film: Boundary, across: int) -> Iterator[Box]:
    """The boxes that a film across an axis lies on."""
    for box in scene.boxes:
        touches = film.lower[across] in (box.lower[across], box.upper[across])
        if touches and all(film.lower[d] < box.upper[d] and film.upper[d] > box.lower[d] for d in {0, 1, 2} - {across}):
            yield box
