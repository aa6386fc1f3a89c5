"""Which parts of a scene hang together, and which of them heat can leave or current can pass.

All of it is decided on the coarsest grid, whose breakpoints are the planes of the scene.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from meshes.grid import Grid
from scenes.free.grid import distinct as distinct
from scenes.free.grid import grid_of
from scenes.free.grid import planes_of as scene_planes
from scenes.model import Scene, Value
from scenes.physics import is_exit


@lru_cache(maxsize=16)
def coarsest(scene: Scene) -> Grid:
    """The grid whose only breakpoints are the planes of a scene."""
    planes = [np.array(scene_planes(scene, d)) for d in range(3)]
    return Grid(tuple(planes), tuple(np.ones(len(p) - 1, dtype=int) for p in planes), scene.boxes)


@lru_cache(maxsize=16)
def anchored(scene: Scene) -> bool:
    """Whether heat can leave every connected part of the solid: to a given temperature, or to the air."""
    grid = grid_of(scene)
    labels = grid.parts(grid.solid)
    anchored_parts = set().union(*(grid.parts_at(labels, b) for b in scene.boundaries if is_exit(b)))
    return len(anchored_parts) == labels.max()


@lru_cache(maxsize=16)
def _electrified(scene: Scene) -> tuple[np.ndarray, dict[int, set[Value | str]]]:
    return grid_of(scene).electrified()


def live(scene: Scene) -> np.ndarray:
    """(nx, ny, nz) of `coarsest`: the cells that current can pass, in parts that touch electrodes of two voltages."""
    labels, voltages = _electrified(scene)
    return np.isin(labels, [label for label, potentials in voltages.items() if len(potentials) > 1])


def still(scene: Scene) -> tuple[tuple[np.ndarray, Value | str], ...]:
    """Cells (nx, ny, nz of `coarsest`) of each conducting part that touches electrodes of one voltage only, and that
    voltage, or the name of the one electrode whose potential isn't given: no current passes, and it has their
    potential."""
    labels, voltages = _electrified(scene)
    alone = ((label, next(iter(potentials))) for label, potentials in voltages.items() if len(potentials) == 1)
    return tuple((labels == label, value) for label, value in alone)


def between(f2t: np.ndarray, one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """The facets inside a mesh, by the two cells ``f2t`` (2, facets) of each, that lie between some cells (cells,) and
    some others."""
    inside = np.flatnonzero(f2t[1] >= 0)
    pairs = f2t[:, inside]
    return inside[(one[pairs] & other[pairs[::-1]]).any(axis=0)]
