"""Connected parts of a scene of boxes on its coarsest grid, whose breakpoints are the planes of the scene."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from meshes.grid import Grid
from scenes.free.grid import distinct as distinct
from scenes.free.grid import grid_of
from scenes.free.grid import planes_of as scene_planes
from scenes.model import Scene, Value

graph = lru_cache(maxsize=16)(grid_of)


@lru_cache(maxsize=16)
def coarsest(scene: Scene) -> Grid:
    """Return the grid whose only breakpoints are the planes of a scene."""
    planes = [np.array(scene_planes(scene, d)) for d in range(3)]
    return Grid(tuple(planes), tuple(np.ones(len(p) - 1, dtype=int) for p in planes), scene.boxes)


def anchored(scene: Scene) -> bool:
    """Return whether heat can leave every connected part of the solid: to a given temperature, or to the air."""
    return graph(scene).anchored


def live(scene: Scene) -> np.ndarray:
    """Return (nx, ny, nz) of `coarsest` the cells of conductors between electrodes of two potentials."""
    cells = graph(scene)
    return cells.live.reshape(cells.owner.shape)


def still(scene: Scene) -> tuple[tuple[np.ndarray, Value | str], ...]:
    """Return the cells (nx, ny, nz) of each conductor without a current, and its potential, or its electrode's name."""
    shape = graph(scene).owner.shape
    return tuple((cells.reshape(shape), value) for cells, value in graph(scene).still)


def between(f2t: np.ndarray, one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return the facets between some cells (cells,) and others, by the two cells ``f2t`` (2, facets) of each facet."""
    inside = np.flatnonzero(f2t[1] >= 0)
    pairs = f2t[:, inside]
    return inside[(one[pairs] & other[pairs[::-1]]).any(axis=0)]
