"""The grid of all planes of a scene: which box owns each cell, and which cells lie on either side of a flat box.

Planes closer than 1e-9 of the extent along their axis are one.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from scenes.errors import SceneError
from scenes.model import Point, Scene

VOID = -1
ROUNDING = 1e-9
_MOST_CELLS = 30_000_000


@dataclass(frozen=True)
class Sheet:
    """A flat box on the grid, as arrays over the faces of its plane that it covers.

    ``below`` and ``above`` are the owners of the cells on the lower and the upper side of the axis, VOID for none;
    ``faces`` number the faces and ``vertices`` (one longer along both) the grid's vertices.
    """

    below: np.ndarray
    above: np.ndarray
    faces: np.ndarray
    vertices: np.ndarray

    def beside(self, cells: np.ndarray) -> np.ndarray:
        """Which faces have, on either side, an owner for whom ``cells`` (by box, last entry for VOID) is true."""
        return cells[self.below] | cells[self.above]

    def corners(self, chosen: np.ndarray) -> set[int]:
        """The grid's vertices of some faces."""
        found: set[int] = set()
        for i in (0, 1):
            for j in (0, 1):
                part = self.vertices[i : i + chosen.shape[0], j : j + chosen.shape[1]]
                found |= set(part[chosen].tolist())
        return found


@dataclass(frozen=True, eq=False)
class Grid:
    """The planes along each axis (m, ascending) and the number of the box that owns each cell."""

    planes: tuple[np.ndarray, np.ndarray, np.ndarray]
    owner: np.ndarray

    @cached_property
    def small(self) -> tuple[float, float, float]:
        """The lengths (m) along the axes that count as nothing."""
        x, y, z = (ROUNDING * float(p[-1] - p[0]) for p in self.planes)
        return x, y, z

    def inside(self, lower: Point, upper: Point) -> bool:
        """Whether a box lies within the extent of the solid."""
        return all(
            p[0] - s <= a and b <= p[-1] + s for p, s, a, b in zip(self.planes, self.small, lower, upper, strict=True)
        )

    def span(self, axis: int, lower: float, upper: float) -> tuple[int, int]:
        """The range of planes between two coordinates of the scene, clipped to the grid."""
        # Half as much again, for a plane may stand for another that is just as far away as that.
        planes, small = self.planes[axis], 1.5 * self.small[axis]
        first = int(np.searchsorted(planes, lower - small))
        last = int(np.searchsorted(planes, upper + small, side="right")) - 1
        return min(first, len(planes) - 1), max(last, 0)

    def cells(self, lower: Point, upper: Point) -> np.ndarray:
        """The owners of the cells that touch a box of any dimension: those inside it along the axes along which it
        extends, those on either side (VOID beyond the grid) along the others."""
        padded = np.pad(self.owner, 1, constant_values=VOID)
        window = []
        for axis in range(3):
            first, last = self.span(axis, lower[axis], upper[axis])
            if upper[axis] - lower[axis] <= self.small[axis]:
                # Between two planes (a point need not be on one) first exceeds last, and it is one cell.
                first, last = min(first, last), max(first, last)
                window.append(slice(first, last + 2) if first == last else slice(last, last + 1))
            else:
                window.append(slice(first + 1, last + 1))
        return padded[tuple(window)]

    def sheet(self, axis: int, lower: Point, upper: Point) -> Sheet:
        """A flat box, normal to an axis; without faces where it misses the grid."""
        spans = [self.span(d, lower[d], upper[d]) for d in range(3)]
        others = [d for d in range(3) if d != axis]
        at, planes = spans[axis][0], self.planes[axis]
        within = planes[0] - self.small[axis] <= lower[axis] <= planes[-1] + self.small[axis]
        shape = [max(spans[d][1] - spans[d][0], 0) if within else 0 for d in others]
        sides = []
        for cell in (at - 1, at):
            window = [slice(a, max(a, b)) for a, b in spans]
            window[axis] = slice(cell, cell + 1)
            there = within and 0 <= cell < self.owner.shape[axis]
            sides.append(self.owner[tuple(window)].reshape(shape) if there else np.full(shape, VOID))
        sizes = [len(p) for p in self.planes]
        where = np.ix_(*(np.arange(spans[d][0], spans[d][0] + n + 1) for d, n in zip(others, shape, strict=True)))
        index: list[np.ndarray] = [np.array(at)] * 3
        for d, along in zip(others, where, strict=True):
            index[d] = along
        vertices = np.asarray((index[0] * sizes[1] + index[1]) * sizes[2] + index[2])
        return Sheet(sides[0], sides[1], 3 * vertices[:-1, :-1] + axis, vertices)


def grid_of(scene: Scene) -> Grid:
    """The grid of a scene; SceneError where it would be too large to look at."""
    planes = [_planes(scene, axis) for axis in range(3)]
    count = int(np.prod([len(p) - 1.0 for p in planes]))
    if count > _MOST_CELLS:
        raise SceneError(
            f"the planes of boxes, boundaries and probes cut the scene into {count} cells: give fewer, or let more of "
            f"them coincide ({_MOST_CELLS} cells are the most)"
        )
    x, y, z = planes
    grid = Grid((x, y, z), np.full((len(x) - 1, len(y) - 1, len(z) - 1), VOID, np.int32))
    for number, box in enumerate(scene.boxes):
        grid.owner[tuple(slice(*grid.span(d, box.lower[d], box.upper[d])) for d in range(3))] = number
    return grid


def flat_axis(grid: Grid, lower: Point, upper: Point) -> int | None:
    """The axis along which a box has no extent, if there is exactly one."""
    found = [d for d in range(3) if upper[d] - lower[d] <= grid.small[d]]
    return found[0] if len(found) == 1 else None


def _planes(scene: Scene, axis: int) -> np.ndarray:
    boxes = [c for b in scene.boxes for c in (b.lower[axis], b.upper[axis])]
    low, high = min(boxes), max(boxes)
    small = ROUNDING * (high - low)
    others = [(b.lower, b.upper) for b in scene.boundaries]
    others += [(p.lower, p.upper) for p in scene.probes if p.lower != p.upper]
    found = boxes + [c for pair in others for c in (pair[0][axis], pair[1][axis]) if low < c < high]
    found.sort()
    kept = found[:1]
    for c in found[1:]:
        if c - kept[-1] > small:
            kept.append(c)
    return np.array(kept)


def conducting(scene: Scene) -> np.ndarray:
    """(boxes + 1,): which boxes conduct, and False for VOID, by the owner's number."""
    return np.array([*(box.material.resistivity is not None for box in scene.boxes), False])


def solid(scene: Scene) -> np.ndarray:
    """(boxes + 1,): True for every box, False for VOID."""
    return np.array([True] * len(scene.boxes) + [False])
