"""Check whether an accuracy is within reach of the layers at singular edges."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from meshes import grading
from meshes.grading import Features
from meshes.grid import Grid
from scenes.errors import NumericsError
from scenes.model import Scene

ADVICE = "ask for a larger accuracy, let more planes coincide, or leave out what does not matter"
COARSEST = 1e-2  # accuracy from which on a first grid has the fewest layers, and of rough solutions
HARDLY = 0.25  # exponent of edges that are out of reach: layers down to 1e-9 (ROUNDING) leave (1e-9)^(2 s) = 3e-5
LAYER = 0.1  # layers shorter than this fraction of the narrowest length see their edge alone: ten lengths to the next


def first_grid(scene: Scene, accuracy: float, features: Features) -> Grid:
    """Return the grid to begin with.

    It is made for a larger accuracy where an edge is so singular that its layers would come close to rounding.
    """
    if features.sharpest <= HARDLY:
        # The accuracy of a first layer of this length.
        accuracy = max(accuracy, LAYER ** (2 * features.sharpest) / grading.LAYERS)
    return grading.first_grid(scene, accuracy, features)


def check_edges(grid: Grid, features: Features, goals: Iterable[np.ndarray], accuracy: float) -> None:
    """Raise NumericsError where edges put an accuracy out of reach.

    The error at an edge of exponent s is proportional to the length of its layer to the power 2 s, whatever else is
    refined. So the shortest possible layers leave a fixed part of the indicators of layers that see their edge alone.
    """
    planes = [sorted({*inner, b[0], b[-1]}) for inner, b in zip(features.planes, grid.breaks, strict=True)]
    longest, parts = LAYER * min(float(np.diff(each).min()) for each in planes), []
    for breaks, near in zip(grid.breaks, features.near(grid), strict=True):
        s, lengths = np.minimum(near[:-1], near[1:]), np.diff(breaks)
        shrinks = np.minimum(grading.shortest_of(grid) / lengths, 1.0)
        parts.append(np.where(lengths < longest, shrinks ** (2 * s), 0.0))
    kept = [sum(float(i @ part) for i, part in zip(grid.by_interval(g), parts, strict=True)) for g in goals]
    # Solved random scenes keep no more; with only a tenth for all other errors cells would grow without end.
    if max(kept) > 0.75 * accuracy:
        raise not_reached(accuracy, explain_edge(features))


def not_reached(accuracy: float, because: str = "") -> NumericsError:
    """Return the error to raise where no level is accurate enough."""
    return NumericsError(f"an accuracy of {accuracy:g} isn't reached in this scene{because}")


def explain_edge(features: Features) -> str:
    """Return the words that name an edge too singular for any grid; empty without such an edge."""
    planes = [(s, "xyz"[d], at) for d in range(3) for at, s in features.exponents[d].items()]
    sharpest, axis, at = min(planes, default=(1.0, "", 0.0))
    if sharpest > HARDLY:
        return ""
    return (
        f": at {axis} = {at:.4g} m a given value ends, or good conductors meet along an edge only, and the solution "
        f"behaves as a distance to the power {sharpest:.2f} there; ask for a larger accuracy, or let them end elsewhere"
    )
