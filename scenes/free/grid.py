"""The grid of all planes of a scene: which box owns each cell, which cells lie on either side of a flat box, and which
parts of the solid hang together.

Planes closer than 1e-9 of the extent along their axis are one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from scenes.errors import SceneError, listed
from scenes.free.crowding import crowding
from scenes.model import ROUNDING, Boundary, Point, Probe, Scene, Value
from scenes.physics import potential_of, share_terminals

VOID = -1  # The owner of a cell outside the solid.
_MOST_CELLS = 10_000_000
"""The most cells of the planes' grid: checking them takes two or three seconds and 0.6 GB."""


@dataclass(frozen=True)
class Sheet:
    """A flat box on the grid, as arrays over the faces of its plane that it covers.

    ``below`` and ``above`` are the owners of the cells on the lower and the upper side of the axis, VOID for none;
    ``faces`` number the faces and ``vertices`` (one longer along both) the grid's vertices.
    """

    axis: int
    below: np.ndarray
    above: np.ndarray
    faces: np.ndarray
    vertices: np.ndarray

    def beside(self, cells: np.ndarray) -> np.ndarray:
        """Which faces have, on either side, an owner for whom ``cells`` (by box, last entry for VOID) is true."""
        return cells[self.below] | cells[self.above]

    def corners(self, chosen: np.ndarray) -> set[int]:
        v = self.vertices
        return set(np.concatenate([part[chosen] for part in (v[:-1, :-1], v[:-1, 1:], v[1:, :-1], v[1:, 1:])]).tolist())

    def edges(self, chosen: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The edges of some faces, by number, and which face each belongs to (four of each to a face)."""
        first, second = (d for d in range(3) if d != self.axis)
        at, across, along = (self.vertices[s] for s in (np.s_[:-1, :-1], np.s_[1:, :-1], np.s_[:-1, 1:]))
        edges = [3 * at + first, 3 * along + first, 3 * at + second, 3 * across + second]
        return np.concatenate([e[chosen] for e in edges]), np.tile(self.faces[chosen], 4)


@dataclass(frozen=True, eq=False)
class Grid:
    """The planes of a scene along each axis (m, ascending) and the number of the box that owns each cell."""

    scene: Scene
    planes: tuple[np.ndarray, ...]
    owner: np.ndarray

    @cached_property
    def small(self) -> tuple[float, ...]:
        """The lengths (m) along the axes that count as nothing."""
        return tuple(ROUNDING * float(p[-1] - p[0]) for p in self.planes)

    @cached_property
    def conducting(self) -> np.ndarray:
        """(boxes + 1,): which boxes conduct, and False for VOID, by the owner's number."""
        return np.array([*(box.material.resistivity is not None for box in self.scene.boxes), False])

    @cached_property
    def solid(self) -> np.ndarray:
        """(boxes + 1,): True for every box, False for VOID."""
        return np.array([True] * len(self.scene.boxes) + [False])

    @cached_property
    def _padded(self) -> np.ndarray:
        """The owners with a layer of VOID around."""
        return np.pad(self.owner, 1, constant_values=VOID)

    def inside(self, lower: Point, upper: Point) -> bool:
        along = zip(self.planes, self.small, lower, upper, strict=True)
        return all(p[0] - s <= a and b <= p[-1] + s for p, s, a, b in along)

    def span(self, axis: int, lower: float, upper: float) -> tuple[int, int]:
        """The range of planes between two coordinates of the scene, clipped to the grid."""
        # Half as much again, for a plane may stand for another that is just as far away as that.
        planes, small = self.planes[axis], 1.5 * self.small[axis]
        first = int(np.searchsorted(planes, lower - small))
        last = int(np.searchsorted(planes, upper + small, side="right")) - 1
        return min(first, len(planes) - 1), max(last, 0)

    def cells(self, lower: Point, upper: Point, values: np.ndarray | None = None) -> np.ndarray:
        """Return the owners of the cells that touch a box of any dimension.

        Along the axes along which the box extends the cells lie inside, along the others on either side (VOID beyond
        the grid). ``values`` of the cells replace the numbers of their owners (0 beyond the grid).
        """
        window = []
        for axis in range(3):
            first, last = self.span(axis, lower[axis], upper[axis])
            if upper[axis] - lower[axis] <= self.small[axis]:
                # Between two planes (a point need not be on one) first exceeds last, and it is one cell.
                first, last = min(first, last), max(first, last)
                window.append(slice(first, last + 2) if first == last else slice(last, last + 1))
            else:
                window.append(slice(first + 1, last + 1))
        return (self._padded if values is None else np.pad(values, 1))[tuple(window)]

    def flat(self, lower: Point, upper: Point) -> tuple[int, ...]:
        return tuple(d for d in range(3) if upper[d] - lower[d] <= self.small[d])

    def sheet(self, item: Boundary | Probe, values: np.ndarray | None = None) -> Sheet | None:
        """Return a flat box, without faces where it misses the grid; ``None`` for a box that is not flat.

        ``values`` of the cells replace the numbers of their owners.
        """
        flat = self.flat(item.lower, item.upper)
        if len(flat) != 1:
            return None
        (axis,) = flat
        planes, at = self.planes[axis], item.lower[axis]
        hit = planes[0] - self.small[axis] <= at <= planes[-1] + self.small[axis]
        spans = [self.span(d, item.lower[d], item.upper[d]) for d in range(3)]
        ranges = [np.arange(a, max(a, b) if hit else a) for a, b in spans]
        cells, sides = self.owner if values is None else values, []
        for cell in (spans[axis][0] - 1, spans[axis][0]):
            ranges[axis] = np.array([cell])
            inside = 0 <= cell < cells.shape[axis]
            owners = cells[np.ix_(*ranges)] if inside else np.full([len(r) for r in ranges], VOID)
            sides.append(owners.squeeze(axis))
        corners = [np.arange(r[0], r[-1] + 2) if len(r) else np.array([0]) for r in ranges]
        corners[axis] = ranges[axis]
        vertices = np.ravel_multi_index(np.ix_(*corners), [len(p) for p in self.planes]).squeeze(axis)
        return Sheet(axis, sides[0], sides[1], 3 * vertices[:-1, :-1] + axis, vertices)

    def acting(self, sheet: Sheet, kind: str) -> np.ndarray:
        """The faces of a boundary at which its condition acts."""
        if kind in ("heat_flux", "convection", "radiation"):
            return self.solid[sheet.below] ^ self.solid[sheet.above]
        return sheet.beside(self.conducting if kind == "voltage" else self.solid)

    def parts(self, wanted: np.ndarray, cuts: Sequence[Boundary] = ()) -> np.ndarray:
        """(cells): labels from 1 on of sets of ``wanted`` cells joined by faces that no cut covers, 0 elsewhere."""
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import connected_components

        inside = wanted[self.owner]
        joined = [np.moveaxis(inside, axis, 0)[:-1] & np.moveaxis(inside, axis, 0)[1:] for axis in range(3)]
        for sheet in (s for b in cuts if (s := self.sheet(b))):
            at = np.array(np.unravel_index(sheet.faces.ravel() // 3, [len(p) for p in self.planes]))
            # The face across an axis at its plane i lies between the cells i - 1 and i along it.
            at[sheet.axis] -= 1
            at = at[:, (at[sheet.axis] >= 0) & (at[sheet.axis] < inside.shape[sheet.axis] - 1)]
            joined[sheet.axis][at[sheet.axis], *np.delete(at, sheet.axis, axis=0)] = False
        # Cells in a row along z are one node of a graph, whose edges are the faces between rows.
        starts = inside.copy()
        starts[..., 1:] &= ~np.moveaxis(joined[2], 0, 2)
        row = np.cumsum(starts, dtype=np.int32).reshape(inside.shape) - 1
        pairs = []
        for axis in (0, 1):
            low, high = (np.moveaxis(row, axis, 0)[s] for s in (slice(None, -1), slice(1, None)))
            new, same = joined[axis].copy(), joined[axis][..., :-1]
            new[..., 1:] &= ~(same & (low[..., 1:] == low[..., :-1]) & (high[..., 1:] == high[..., :-1]))
            pairs.append(np.stack([low[new], high[new]]))
        rows, columns = np.concatenate(pairs, axis=1)
        count = int(starts.sum())
        graph = coo_array((np.ones(len(rows), bool), (rows, columns)), shape=(count, count))
        labels = np.append(1 + connected_components(graph, directed=False)[1], 0)
        return labels[np.where(inside, row, count)]

    def parts_at(self, labels: np.ndarray, boundary: Boundary) -> set[int]:
        sheet, beside = self.sheet(boundary), self.sheet(boundary, labels)
        assert sheet is not None
        assert beside is not None
        acts = self.acting(sheet, boundary.kind)
        return {*beside.below[acts].tolist(), *beside.above[acts].tolist()} - {0, VOID}

    def electrified(self) -> tuple[np.ndarray, dict[int, set[Value | str]]]:
        """A label for each cell of a conductor, electrodes being cuts, and the voltages at the cells of each label, as
        `scenes.physics.potential_of` has them."""
        electrodes = [b for b in self.scene.boundaries if b.kind == "voltage"]
        labels, voltages = self.parts(self.conducting, electrodes), dict[int, set[Value | str]]()
        touched = [(b, self.parts_at(labels, b)) for b in electrodes]
        for b, parts in touched:
            for label in parts:
                voltages.setdefault(label, set()).add(potential_of(b))
        share_terminals(voltages, touched)
        return labels, voltages

    def joined(self) -> dict[int, set[str]]:
        """The names of the electrodes that each label of `electrified` touches."""
        labels, names = self.electrified()[0], dict[int, set[str]]()
        for b in self.scene.boundaries:
            for label in self.parts_at(labels, b) if b.kind == "voltage" else ():
                names.setdefault(label, set()).add(b.name)
        return names

    @cached_property
    def fixed(self) -> np.ndarray:
        """(cells): the cells of conductors that an electrode touches; any other potential is undetermined."""
        labels, voltages = self.electrified()
        return np.isin(labels, list(voltages))


def grid_of(scene: Scene) -> Grid:
    """The grid of a scene; SceneError where it would be too large to look at."""
    planes = tuple(np.array(planes_of(scene, axis)) for axis in range(3))
    count = float(np.prod([len(p) - 1.0 for p in planes]))
    if count > _MOST_CELLS:
        raise SceneError(
            f"the scene is cut into {count:.3g} cells, and {_MOST_CELLS:.0e} are the most: {crowding(scene, planes)}; "
            "give fewer, or let more of them coincide"
        )
    grid = Grid(scene, planes, np.full([len(p) - 1 for p in planes], VOID, np.int32))
    for number, box in enumerate(scene.boxes):
        grid.owner[tuple(slice(*grid.span(d, box.lower[d], box.upper[d])) for d in range(3))] = number
    return grid


def planes_of(scene: Scene, axis: int) -> list[float]:
    """Where cells end along an axis (m): at faces of boxes, conditions and extended probes."""
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


def cut(grid: Grid) -> str:
    """Return a sentence on insulating boxes between electrodes of different voltages, or ""."""
    labels, voltages = grid.electrified()
    insulating = grid.parts(grid.solid & ~grid.conducting)
    touched: dict[int, set[int]] = {}
    between: dict[int, set[int]] = {}
    for axis in range(3):
        insulator, conductor, owner = (np.moveaxis(a, axis, 0) for a in (insulating, labels, grid.owner))
        for a, b in ((slice(None, -1), slice(1, None)), (slice(1, None), slice(None, -1))):
            at = (insulator[a] > 0) & (conductor[b] > 0)
            for part, label, box in np.unique(
                np.stack([insulator[a][at], conductor[b][at], owner[a][at]]), axis=1
            ).T.tolist():
                if label in voltages:
                    touched.setdefault(part, set()).add(label)
                    between.setdefault(part, set()).add(box)
    for part, conductors in touched.items():
        if len(set().union(*(voltages[label] for label in conductors))) > 1:
            names = [grid.scene.boxes[n].name for n in sorted(between[part])]
            which = "box {}, which does" if len(names) == 1 else "boxes {}, which do"
            return f"the current is cut at {which.format(listed(names))} not conduct"
    return ""
