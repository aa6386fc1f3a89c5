"""Whether an accuracy is within reach: of the memory, and of the layers that singular edges take."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from fem3d.adaptivity import memory
from fem3d.adaptivity.estimator import Spread
from fem3d.spaces.size import Size, foreseen
from meshes import connected, edgewise, grading
from meshes.grading import Features
from meshes.grid import Grid
from scenes.errors import NumericsError, TooLargeError
from scenes.free.crowding import crowding
from scenes.model import Scene

ADVICE = "ask for a larger accuracy, let more planes coincide, or leave out what does not matter"
# Cells, some 13,000 unknowns, beyond which a first grid is that of a larger accuracy, with half of the cells: it takes
# a quarter of the time, all of which is saved where most features are seen by no quantity. Of 700 random scenes none
# has as many, an actuator of ten boxes over films of 0.1 um has 5,000.
MANY = 1_000
COARSEST = 1e-2  # accuracy from which on a first grid has the fewest layers
HARDLY = 0.25  # edges of a smaller exponent take more layers than lengths leave room for
LAYER = 0.1  # layers shorter than this fraction of the narrowest length of a scene see their edge alone
# The shortest layers may leave this part of the allowed error: solved random scenes keep no more, and with only
# a tenth for all other errors cells would grow without end.
KEPT = 0.75
# Where errors fall most slowly a decade takes 20 times the unknowns (`fem3d.adaptivity.choice`): 8 times as many leave
# a fifth. Where they leave more than 0.9 nothing falls, and something else than the mesh is wrong.
GROWN, NOT_LESS = 8.0, 0.9


def first_grid(scene: Scene, accuracy: float, marks: Features) -> Grid:
    """The grid to start with. Where an edge is so singular that the accuracy would take layers close to rounding, or
    the scene has so many features that their layers alone make it large, it is that of a larger accuracy: not every
    quantity sees each of them, and what does so is refined for."""
    if marks.sharpest <= HARDLY:
        # The accuracy of a first layer that long.
        accuracy = max(accuracy, LAYER ** (2 * marks.sharpest) / grading.LAYERS)
    grid = grading.first_grid(scene, accuracy, marks)
    while accuracy < COARSEST and foreseen(scene, grid).cells > MANY:
        accuracy *= 10
        grid = grading.first_grid(scene, accuracy, marks)
    return grid


def least(scene: Scene) -> Size:
    """The size of the grid of a scene whose planes are its only ones, with the least degree on each interval: before
    anything is looked at cell by cell."""
    coarsest = connected.coarsest(scene)
    degrees = [np.full(len(d), 2) for d in coarsest.degrees]
    return foreseen(scene, coarsest.with_axes(coarsest.breaks, degrees))


def check_planes(scene: Scene) -> None:
    """Raises TooLargeError for a scene whose planes alone make a grid of bricks that takes too much memory."""
    _check(scene, least(scene), "at any accuracy")


def check_size(scene: Scene, grid: Grid, accuracy: float, marks: Features) -> None:
    """Raises TooLargeError for a grid that takes too much memory."""
    _check(scene, foreseen(scene, grid), f"at an accuracy of {accuracy:g}", because(marks))


def fits(scene: Scene, size: Size) -> bool:
    """Return whether memory has room for a mesh."""
    return size.memory <= memory.limit(scene)


def _check(scene: Scene, size: Size, when: str, why: str = "") -> None:
    if not fits(scene, size):
        unknowns, planes = float(f"{size.unknowns:.2g}"), connected.coarsest(scene).breaks
        raise TooLargeError(
            f"the scene takes {unknowns:,.0f} unknowns and {size.memory / 1e9:.3g} GB {when}, and "
            f"{memory.allowed(scene)}{why}; {crowding(scene, planes)}: let more coincide, or leave out what does not "
            "matter"
        )


def check_edges(grid: Grid, marks: Features, goals: Iterable[Spread], accuracy: float) -> None:
    """Raise NumericsError where edges put an accuracy out of reach.

    The error of an edge of exponent s falls with the length of its layer to the power 2 s, whatever else is refined:
    the shortest possible layers leave a known part of the indicators of layers that are short enough to see their edge
    alone.
    """
    shortest, longest, kept = grading.shortest_of(grid), LAYER * _narrowest(grid, marks), 0.0
    for goal in goals:
        left = 0.0
        for breaks, near, indicator in zip(grid.breaks, marks.near(grid), edgewise.by_interval(goal), strict=True):
            s, lengths = np.minimum(near[:-1], near[1:]), np.diff(breaks)
            at = np.isfinite(s) & (lengths < longest)
            left += float((indicator[at] * np.minimum(shortest / lengths[at], 1.0) ** (2 * s[at])).sum())
        kept = max(kept, left)
    if kept > KEPT * accuracy:
        raise not_reached(accuracy, because(marks))


def _narrowest(grid: Grid, marks: Features) -> float:
    """Return the least distance (m) of two planes of the scene along any axis, without slivers; the largest where a
    thousand planes leave nothing else."""
    narrowest = []
    for breaks, inner in zip(grid.breaks, marks.planes, strict=True):
        gaps = np.diff(sorted({*inner, float(breaks[0]), float(breaks[-1])}))
        wide = gaps[gaps > grading.SLIVER * (breaks[-1] - breaks[0])]
        narrowest.append(float(wide.min() if len(wide) else gaps.max()))
    return min(narrowest)


class Falling:
    """Whether the largest error falls as meshes become finer: told level by level."""

    def __init__(self, accuracy: float) -> None:
        self._accuracy, self._levels = accuracy, list[tuple[int, float]]()

    def check(self, unknowns: int, relative: Mapping[str, float]) -> None:
        """Raises NumericsError where the largest of the ``relative`` errors, by their quantities' names, is hardly less
        than on three meshes or more since there were `GROWN` times fewer unknowns."""
        name, worst = max(relative.items(), key=lambda item: item[1])
        smaller = [k for k, (n, _) in enumerate(self._levels[:-2]) if GROWN * n <= unknowns]
        if smaller and worst > NOT_LESS * max(w for _, w in self._levels[smaller[-1] :]):
            raise not_reached(
                self._accuracy,
                f": the error of {name} is {worst:.2g} of its size and doesn't fall, although the mesh grew from "
                f"{self._levels[smaller[-1]][0]:,} to {unknowns:,} unknowns",
            )
        self._levels.append((unknowns, worst))


def not_reached(accuracy: float, because: str = "") -> NumericsError:
    """What is raised where no level is good enough."""
    return NumericsError(f"an accuracy of {accuracy:g} isn't reached in this scene{because}")


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
