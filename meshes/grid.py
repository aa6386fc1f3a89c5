"""A grid of bricks with the box that owns each cell.

A grid has breakpoints and polynomial degrees along three axes. The planes of its scene are among the breakpoints.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from scenes.free.grid import VOID as VOID
from scenes.free.grid import grid_of
from scenes.model import Box, Scene

graph = lru_cache(maxsize=16)(grid_of)


@dataclass(frozen=True, eq=False)
class Grid:
    """A tensor-product grid with boxes.

    Attributes
    ----------
    breaks: per axis the breakpoints (m, increasing).
    degrees: per axis the polynomial degree of each interval; the highest where degrees differ from edge to edge.
    boxes: boxes that own the cells; later boxes override earlier ones.
    edges: per axis the degrees of its edges (`meshes.edgewise`), (intervals along it, planes across the others) in the
        order x, y, z; empty where all edges on an interval have its degree.
    """

    breaks: tuple[np.ndarray, ...]
    degrees: tuple[np.ndarray, ...]
    boxes: tuple[Box, ...]
    edges: tuple[np.ndarray, ...] = ()

    @cached_property
    def owner(self) -> np.ndarray:
        """(nx, ny, nz): the number of the box that owns each cell, or VOID."""
        owner = np.full([len(d) for d in self.degrees], VOID)
        middles = [(b[1:] + b[:-1]) / 2 for b in self.breaks]
        for number, box in enumerate(self.boxes):
            inside = ((low < m) & (m < high) for low, m, high in zip(box.lower, middles, box.upper, strict=True))
            owner[np.ix_(*inside)] = number
        return owner

    @property
    def solid(self) -> np.ndarray:
        """(nx, ny, nz): which cells a box owns."""
        solid: np.ndarray = self.owner != VOID
        return solid

    @property
    def finest(self) -> tuple[np.ndarray, ...]:
        """The degrees per axis: of edges, or of intervals."""
        return self.edges or self.degrees

    def with_axes(self, breaks: Sequence[np.ndarray], degrees: Sequence[np.ndarray]) -> Grid:
        """Another grid of the same boxes."""
        return Grid(tuple(breaks), tuple(degrees), self.boxes)

    def same(self, other: Grid) -> bool:
        """Whether two grids have the same cells and degrees."""
        pairs = zip((*self.breaks, *self.finest), (*other.breaks, *other.finest), strict=True)
        return all(np.array_equal(a, b) for a, b in pairs)


def statistics(grid: Grid) -> dict[str, Any]:
    """Cells, degrees, the largest aspect ratio of a cell, and the volume (m3)."""
    sizes = np.array(np.broadcast_arrays(*np.ix_(*map(np.diff, grid.breaks))))[:, grid.solid]
    return {
        "cells": sizes.shape[1],
        "intervals": [len(d) for d in grid.degrees],
        "lowest_degree": int(min(d.min() for d in grid.finest)),
        "highest_degree": int(max(d.max() for d in grid.degrees)),
        "largest_aspect_ratio": float((sizes.max(axis=0) / sizes.min(axis=0)).max()),
        "volume_m3": float(sizes.prod(axis=0).sum()),
    }


def coarsest(scene: Scene, degree: int) -> Grid:
    """Return the grid of one degree whose only breakpoints are the planes of a scene."""
    planes = graph(scene).planes
    return Grid(planes, tuple(np.full(len(p) - 1, degree) for p in planes), scene.boxes)
