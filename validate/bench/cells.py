"""The graded cells that every full-order entry gets: those this toolkit starts with for an accuracy, cut further.

They are graded towards the singular edges with its knowledge of the exponents, which a user of another program would
have to work out or find by trial; all entries share them so that a comparison is of solvers, not of patience.
"""

from __future__ import annotations

import numpy as np

from meshes import grading
from meshes.grid import Grid
from scenes.model import Scene


def graded(scene: Scene, accuracy: float, cuts: int, degree: int, layers: int | None = None) -> Grid:
    """The first grid for an accuracy, each interval in ``cuts`` equal pieces but for those across thin layers, which
    stay whole; of one degree everywhere, or of another one (``layers``) across those."""
    breaks, degrees = [], []
    first = grading.first_grid(scene, accuracy, grading.features(scene))
    for old, own in zip(first.breaks, first.degrees, strict=True):
        thin = own < grading.LEAST_AT_EDGE
        count = np.where(thin, 1, cuts)
        inner = [np.linspace(a, b, n, endpoint=False) for a, b, n in zip(old, old[1:], count, strict=False)]
        breaks.append(np.append(np.concatenate(inner), old[-1]))
        degrees.append(np.repeat(np.where(thin, degree if layers is None else layers, degree), count))
    return first.with_axes(breaks, degrees)
