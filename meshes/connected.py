"""Which parts of a scene hang together, and which of them heat can leave or current can pass.

All of it is decided on the coarsest grid, whose breakpoints are the planes of the scene.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import lru_cache

import numpy as np

from meshes.grid import VOID, Grid
from scenes.model import Boundary, Point, Scene, Value


@lru_cache(maxsize=16)
def coarsest(scene: Scene) -> Grid:
    """The grid whose only breakpoints are the planes of a scene."""
    planes = [np.array(scene_planes(scene, d)) for d in range(3)]
    return Grid(tuple(planes), tuple(np.ones(len(p) - 1, dtype=int) for p in planes), scene.boxes)


def scene_planes(scene: Scene, axis: int) -> list[float]:
    """Coordinates (m) along an axis that must be breakpoints: faces of boxes, conditions and extended probes."""
    found = [c for b in scene.boxes for c in (b.lower[axis], b.upper[axis])]
    low, high = min(found), max(found)
    small = 1e-9 * (high - low)
    extended = [p for p in scene.probes if p.lower != p.upper]
    corners = [(b.lower, b.upper) for b in scene.boundaries] + [(p.lower, p.upper) for p in extended]
    found += [c for pair in corners for c in (pair[0][axis], pair[1][axis]) if low - small <= c <= high + small]
    return distinct(found, small)


def distinct(coordinates: Iterable[float], small: float) -> list[float]:
    """Coordinates in order, without those that are hardly apart from another."""
    found = sorted(coordinates)
    return [c for i, c in enumerate(found) if i == 0 or c - found[i - 1] > small]


def parts(grid: Grid, inside: np.ndarray, cuts: Sequence[tuple[Point, Point]] = ()) -> np.ndarray:
    """(nx, ny, nz): a label for each of some cells, equal where they are joined by faces that no cut covers; VOID
    elsewhere."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    numbers = np.arange(inside.size).reshape(inside.shape)
    rows, columns = [], []
    for d in range(3):
        low, high = [slice(None)] * 3, [slice(None)] * 3
        low[d], high[d] = slice(None, -1), slice(1, None)
        joined = inside[tuple(low)] & inside[tuple(high)]
        for lower, upper in cuts:
            if grid.flat(lower, upper) == d and 0 < grid.at(d, lower[d]) < inside.shape[d]:
                window = list(grid.window(lower, upper))
                window[d] = slice(window[d].start - 1, window[d].start)
                joined[tuple(window)] = False
        rows.append(numbers[tuple(low)][joined])
        columns.append(numbers[tuple(high)][joined])
    r, c = np.concatenate(rows), np.concatenate(columns)
    graph = coo_array((np.ones(len(r), bool), (r, c)), shape=(inside.size, inside.size))
    labels = connected_components(graph, directed=False)[1].reshape(inside.shape)
    return np.where(inside, labels, VOID)


def touched(grid: Grid, labels: np.ndarray, boundary: Boundary, exposed: bool = False) -> set[int]:
    """The labels of the cells on either side of a flat box; ``exposed``: only where one side of it is void."""
    d = grid.flat(boundary.lower, boundary.upper)
    at, sides, solid = grid.at(d, boundary.lower[d]), [], []
    for cell in (at - 1, at):
        window = list(grid.window(boundary.lower, boundary.upper))
        window[d] = slice(cell, cell + 1)
        there = 0 <= cell < labels.shape[d]
        shape = [s.stop - s.start for s in window]
        sides.append(labels[tuple(window)] if there else np.full(shape, VOID))
        solid.append(grid.solid[tuple(window)] if there else np.zeros(shape, bool))
    acts = solid[0] != solid[1] if exposed else solid[0] | solid[1]
    return set(np.unique([side[acts] for side in sides]).tolist()) - {VOID}


@lru_cache(maxsize=16)
def anchored(scene: Scene) -> bool:
    """Whether heat can leave every connected part of the solid: to a given temperature, or to the air."""
    grid = coarsest(scene)
    labels = parts(grid, grid.solid)
    found: set[int] = set()
    for b in scene.boundaries:
        if b.kind == "temperature" or (b.kind == "convection" and b.value):
            found |= touched(grid, labels, b, exposed=b.kind == "convection")
    return set(np.unique(labels[labels != VOID]).tolist()) <= found


@lru_cache(maxsize=16)
def _electrified(scene: Scene) -> tuple[np.ndarray, dict[int, set[Value]]]:
    """A label for each cell of a conductor, electrodes being cuts, and the voltages at the cells of each label."""
    grid = coarsest(scene)
    conducts = np.array([*(b.material.resistivity is not None for b in scene.boxes), False])[grid.owner]
    electrodes = [b for b in scene.boundaries if b.kind == "voltage"]
    labels = parts(grid, conducts, [(b.lower, b.upper) for b in electrodes])
    voltages: dict[int, set[Value]] = {}
    for b in electrodes:
        for label in touched(grid, labels, b):
            voltages.setdefault(label, set()).add(b.value)
    return labels, voltages


def live(scene: Scene) -> np.ndarray:
    """(nx, ny, nz) of `coarsest`: the cells that current can pass, in parts that touch electrodes of two voltages."""
    labels, voltages = _electrified(scene)
    return np.isin(labels, [label for label, found in voltages.items() if len(found) > 1])


def still(scene: Scene) -> tuple[tuple[np.ndarray, Value], ...]:
    """Cells (nx, ny, nz of `coarsest`) of each conducting part that touches electrodes of one voltage only, and that
    voltage: no current passes, and it has their potential."""
    labels, voltages = _electrified(scene)
    return tuple((labels == label, next(iter(found))) for label, found in voltages.items() if len(found) == 1)
