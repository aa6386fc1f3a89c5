"""The grid of all planes of a scene: which box owns each cell, and which cells and faces a condition or a probe covers.

Planes closer than 1e-9 of the extent along their axis are one. A cell has its number in the order of the array of
owners. Of the faces, number 3 v + d lies across the axis d at the plane of the vertex v, its corner with the lowest
coordinates.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from scenes.errors import SceneError
from scenes.free.graph import CellGraph
from scenes.model import ROUNDING, Boundary, Point, Probe, Scene, is_zero

VOID = -1  # The owner of a cell outside the solid.
_MOST_CELLS = 10_000_000
"""The most cells of the planes' grid: to find the connected parts of so many takes 3 s and 0.8 GB."""


@dataclass(frozen=True, eq=False)
class Grid(CellGraph):
    """The planes of a scene along each axis (m, ascending) and the number of the box that owns each cell."""

    scene: Scene
    planes: tuple[np.ndarray, ...]
    owner: np.ndarray

    part_word, place_word, side_key = "box", "corners", "box"

    @cached_property
    def small(self) -> tuple[float, ...]:
        """The lengths (m) along the axes that count as nothing."""
        return tuple(ROUNDING * float(p[-1] - p[0]) for p in self.planes)

    @property
    def part_names(self) -> list[str]:
        """Names of the boxes."""
        return [box.name for box in self.scene.boxes]

    def _owned(self, boxes: Sequence[bool]) -> np.ndarray:
        """Whether each cell (cells,) is owned by one of the chosen boxes."""
        return np.array([*boxes, False])[self.owner.ravel()]

    @cached_property
    def solid(self) -> np.ndarray:
        """Whether each cell (cells,) belongs to a box."""
        return self.owner.ravel() != VOID

    @cached_property
    def conducting(self) -> np.ndarray:
        """Whether each cell (cells,) conducts electricity."""
        return self._owned([box.material.resistivity is not None for box in self.scene.boxes])

    @property
    def heated(self) -> np.ndarray:
        """Whether each cell (cells,) has a heat source."""
        return self._owned([not is_zero(box.heat_source) for box in self.scene.boxes])

    def part(self, name: str) -> np.ndarray:
        """Return whether each cell (cells,) belongs to a box."""
        return self._owned([box.name == name for box in self.scene.boxes])

    def names(self, mask: np.ndarray) -> list[str]:
        """Return the boxes with some of the chosen cells."""
        return [self.scene.boxes[number].name for number in np.unique(self.owner.ravel()[mask & self.solid]).tolist()]

    @cached_property
    def f2t(self) -> np.ndarray:
        """(2, faces) the solid cell below and the one above each face, -1 for none."""
        number = np.full(self.owner.shape, VOID, np.int32)
        number.ravel()[self.solid] = np.flatnonzero(self.solid)
        around = np.pad(number, 1, constant_values=VOID)
        above = around[1:, 1:, 1:]
        below = around[:-1, 1:, 1:], around[1:, :-1, 1:], around[1:, 1:, :-1]
        return np.stack([np.stack([cell, above]) for cell in below], axis=-1).reshape(2, -1)

    def span(self, axis: int, lower: float, upper: float) -> tuple[int, int]:
        """Return the range of planes between two coordinates of the scene, clipped to the grid."""
        # Half as much again, for a plane may stand for another that is just as far away as that.
        planes, small = self.planes[axis], 1.5 * self.small[axis]
        first = int(np.searchsorted(planes, lower - small))
        last = int(np.searchsorted(planes, upper + small, side="right")) - 1
        return min(first, len(planes) - 1), max(last, 0)

    def flat(self, lower: Point, upper: Point) -> tuple[int, ...]:
        """Return the axes along which a box has no extent."""
        return tuple(d for d in range(3) if upper[d] - lower[d] <= self.small[d])

    def covered(self, probe: Probe, mask: np.ndarray) -> np.ndarray:
        """Return (places,) whether each place of a probe touches a chosen cell.

        Along the axes along which the probe extends a place is one cell, along the others the cells on either side. A
        volume that is read in boxes has the cells of these alone.
        """
        lower, upper, flat = probe.lower, probe.upper, self.flat(probe.lower, probe.upper)
        window = []
        for axis, (planes, small) in enumerate(zip(self.planes, self.small, strict=True)):
            if lower[axis] < planes[0] - small or upper[axis] > planes[-1] + small:
                return np.zeros(1, bool)
            first, last = self.span(axis, lower[axis], upper[axis])
            if axis in flat:
                # Between two planes (a point need not be on one) first exceeds last, and it is one cell.
                at = max(first, last)
                window.append(slice(at, at + 2) if first == last else slice(at, at + 1))
            else:
                window.append(slice(first + 1, last + 1))
        chosen = np.pad(mask.reshape(self.owner.shape), 1)[tuple(window)]
        if flat or not probe.boxes:
            return np.asarray(chosen.any(axis=flat)).ravel()
        owner = np.pad(self.owner, 1, constant_values=VOID)[tuple(window)]
        return chosen[np.isin(owner, [n for n, box in enumerate(self.scene.boxes) if box.name in probe.boxes])]

    def faces(self, item: Boundary | Probe) -> np.ndarray:
        """Return the faces in a flat box, none where it misses the grid or is not flat."""
        flat = self.flat(item.lower, item.upper)
        if len(flat) != 1:
            return np.empty(0, int)
        axis = flat[0]
        planes, at = self.planes[axis], item.lower[axis]
        if not planes[0] - self.small[axis] <= at <= planes[-1] + self.small[axis]:
            return np.empty(0, int)
        spans = [self.span(d, item.lower[d], item.upper[d]) for d in range(3)]
        ranges = [np.arange(a, a + 1 if d == axis else b) for d, (a, b) in enumerate(spans)]
        return 3 * np.ravel_multi_index(np.ix_(*ranges), self._shape).ravel() + axis

    @property
    def _shape(self) -> tuple[int, ...]:
        return tuple(len(p) for p in self.planes)

    def nodes(self, faces: np.ndarray) -> np.ndarray:
        """Return (4, faces) the corners of each face."""
        steps = np.array([self._shape[1] * self._shape[2], self._shape[2], 1])
        along, up = steps[(faces + 1) % 3], steps[(faces + 2) % 3]
        return faces // 3 + np.array([0 * along, along, up, along + up])

    def marked(self, marks: Iterable[tuple[np.ndarray, float]]) -> list[np.ndarray]:
        """Return per axis (planes along it, cells along the others, axes in order) the mark of each face, 0 for none.

        ``marks`` are faces with a number; a later one wins.
        """
        table = np.zeros(3 * int(np.prod(self._shape)))
        for faces, number in marks:
            table[faces] = number
        ends = [tuple(slice(None if e == d else -1) for e in range(3)) for d in range(3)]
        return [table[d::3].reshape(self._shape)[end] for d, end in enumerate(ends)]

    def jumps(self, key: str) -> list[np.ndarray]:
        """Return `marked` of the "thermal_resistance" or the "electrical_resistance" of contacts."""
        return self.marked((self.between(c), getattr(c, key)) for c in self.scene.contacts)


def grid_of(scene: Scene) -> Grid:
    """Return the grid of a scene; SceneError where it would be too large to look at."""
    return grid_on(scene, tuple(np.array(planes_of(scene, axis)) for axis in range(3)))


def grid_on(scene: Scene, planes: tuple[np.ndarray, ...]) -> Grid:
    """Return the grid of given planes, among them all of the scene."""
    count = float(np.prod([len(p) - 1.0 for p in planes]))
    if count > _MOST_CELLS:
        raise SceneError(
            f"the scene is cut into {count:.3g} cells, and {_MOST_CELLS:.0e} are the most: {crowding(planes)}; "
            "give fewer, or let more of them coincide"
        )
    grid = Grid(scene, planes, np.full([len(p) - 1 for p in planes], VOID, np.int32))
    for number, box in enumerate(scene.boxes):
        grid.owner[tuple(slice(*grid.span(d, box.lower[d], box.upper[d])) for d in range(3))] = number
    return grid


def planes_of(scene: Scene, axis: int) -> list[float]:
    """Return the coordinates (m) along an axis where cells end: at faces of boxes, conditions and extended probes."""
    planes = [c for b in scene.boxes for c in (b.lower[axis], b.upper[axis])]
    low, high = min(planes), max(planes)
    others = [(b.lower, b.upper) for b in scene.boundaries]
    others += [(p.lower, p.upper) for p in scene.probes if p.lower != p.upper]
    planes += [corner[axis] for pair in others for corner in pair if low < corner[axis] < high]
    return distinct(planes, ROUNDING * (high - low))


def distinct(coordinates: Sequence[float], small: float) -> list[float]:
    """Return coordinates in order, without near duplicates."""
    kept: list[float] = []
    for c in sorted(coordinates):
        if not kept or c - kept[-1] > small:
            kept.append(c)
    return kept


def crowding(planes: tuple[np.ndarray, ...]) -> str:
    """Say how many planes (m, ascending) cross a scene along each axis. A plane of one small box crosses it whole."""
    counts = ", ".join(f"{len(at)} along {'xyz'[axis]}" for axis, at in enumerate(planes))
    return f"boxes, boundaries and probes begin and end at planes that all cross the whole scene, {counts}"
