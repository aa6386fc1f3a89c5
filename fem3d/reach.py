"""Whether an accuracy is within reach: of the memory, and of the layers that singular edges take."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from fem3d.errors import NumericsError
from fem3d.estimate import Spread
from fem3d.level import Problems
from meshes import grading
from meshes.grading import Features
from meshes.grid import Grid
from scenes.model import Scene

MOST_ENTRIES = 40_000_000  # of the stiffness matrix: some 10 GB with its factors
HARDLY = 0.25  # exponent of an edge below which its layers take more than there is
LAYER = 0.1  # of the narrowest length of a scene: layers shorter than that see the edge alone
# Of what is enough, which the shortest layers may leave. `validate stress --scenes 160` counts what is refused for it;
# of its scenes that are solved none keeps more, and with only a tenth left for all the rest cells grow without end.
KEPT = 0.75


def first_grid(scene: Scene, accuracy: float, marks: Features) -> Grid:
    """The grid to start with. Where an edge is so singular that the accuracy would take layers close to rounding, it is
    that of a larger accuracy: not every quantity sees the edge, and what does so is refined for."""
    if marks.sharpest > HARDLY:
        return grading.first_grid(scene, accuracy, marks)
    suits = LAYER ** (2 * marks.sharpest) / grading.LAYERS  # the accuracy of a first layer that long
    return grading.first_grid(scene, max(accuracy, suits), marks)


def check_size(given: Problems, accuracy: float, marks: Features) -> None:
    """Raises NumericsError for a grid that takes too much memory."""
    if given.heat.stiffness.nnz > MOST_ENTRIES:
        raise NumericsError(
            f"an accuracy of {accuracy:g} takes more memory in this scene than is sensible" + because(marks)
        )


def check_edges(grid: Grid, goals: Iterable[Spread], enough: float, accuracy: float, marks: Features) -> None:
    """Raises NumericsError where the shortest layers would leave more than `KEPT` of ``enough`` of what edges cause in
    one of some goals, which miss so much on the intervals of a grid: an edge's error falls with the length of its layer
    to the power of twice its exponent, whatever else is refined.

    That holds of layers far shorter than everything else; of longer ones nothing is foreseen.
    """
    asymptotic, shortest = LAYER * _narrowest(grid, marks), grading.shortest_of(grid)
    for parts in goals:
        least = 0.0
        for breaks, near, missing in zip(grid.breaks, marks.near(grid), parts, strict=True):
            s, lengths = np.minimum(near[:-1], near[1:]), np.diff(breaks)
            at = np.isfinite(s) & (lengths < asymptotic)
            least += float((missing[at] * np.minimum(shortest / lengths[at], 1.0) ** (2 * s[at])).sum())
        if least > KEPT * enough:
            raise NumericsError(f"an accuracy of {accuracy:g} isn't reached in this scene" + because(marks))


def _narrowest(grid: Grid, marks: Features) -> float:
    """The least distance (m) of two planes of the scene along any axis, without slivers."""
    found = []
    for breaks, inner in zip(grid.breaks, marks.planes, strict=True):
        gaps = np.diff(sorted({*inner, float(breaks[0]), float(breaks[-1])}))
        found.append(float(gaps[gaps > grading.SLIVER * (breaks[-1] - breaks[0])].min()))
    return min(found)


def because(marks: Features) -> str:
    """Where the solution is so singular that no grid resolves it, in words; nothing where it isn't."""
    planes = [(s, "xyz"[d], at) for d in range(3) for at, s in marks.exponents[d].items()]
    sharpest, axis, at = min(planes, default=(1.0, "", 0.0))
    if sharpest > HARDLY:
        return ""
    return (
        f": at {axis} = {at:.4g} m a given value ends, or good conductors meet along an edge only, and the solution "
        f"behaves as a distance to the power {sharpest:.2f} there; ask for a larger accuracy, or let them end elsewhere"
    )
