"""A grid of bricks with the box that owns each cell; and the connected parts of a scene of boxes.

A grid has breakpoints and polynomial degrees along three axes. The breakpoints of the coarsest grid are the planes of
the scene; connected parts are found on it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from scenes.free.grid import VOID as VOID
from scenes.free.grid import grid_of
from scenes.model import ROUNDING, Box, Point, Scene


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
        for number, box in enumerate(self.boxes):
            owner[self.window(box.lower, box.upper)] = number
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

    def small(self, d: int) -> float:
        """The length (m) along an axis that counts as nothing."""
        breaks = self.breaks[d]
        return min(ROUNDING * float(breaks[-1] - breaks[0]), 0.1 * float(np.diff(breaks).min()))

    def at(self, d: int, coordinate: float) -> int:
        """The breakpoint nearest to a coordinate."""
        breaks = self.breaks[d]
        i = int(breaks.searchsorted(coordinate))
        below = i == len(breaks) or (i > 0 and coordinate - breaks[i - 1] <= breaks[i] - coordinate)
        return i - 1 if below else i

    def span(self, d: int, lower: float, upper: float) -> tuple[int, int]:
        """The breakpoints nearest to two coordinates."""
        return self.at(d, lower), self.at(d, upper)

    def window(self, lower: Point, upper: Point) -> tuple[slice, slice, slice]:
        """The cells of a box whose faces lie on breakpoints."""
        x, y, z = (slice(*self.span(d, lower[d], upper[d])) for d in range(3))
        return x, y, z

    def marked(self, d: int, values: Mapping[float, float], otherwise: float) -> np.ndarray:
        """(breakpoints,): the value of a plane across an axis, given by coordinate, at the breakpoint there."""
        marks = np.full(len(self.breaks[d]), otherwise)
        for coordinate, value in values.items():
            i = self.at(d, coordinate)
            if abs(self.breaks[d][i] - coordinate) <= self.small(d):
                marks[i] = value
        return marks

    def with_axes(self, breaks: Sequence[np.ndarray], degrees: Sequence[np.ndarray]) -> Grid:
        """Another grid of the same boxes."""
        return Grid(tuple(breaks), tuple(degrees), self.boxes)

    def same(self, other: Grid) -> bool:
        """Whether two grids have the same cells and degrees."""
        pairs = zip((*self.breaks, *self.finest), (*other.breaks, *other.finest), strict=True)
        return all(np.array_equal(a, b) for a, b in pairs)


def statistics(grid: Grid) -> dict[str, Any]:
    """Cells, degrees, the largest aspect ratio of a cell, and the volume (m3)."""
    sizes = [np.diff(b) for b in grid.breaks]
    solid = grid.solid
    volume = sizes[0][:, None, None] * sizes[1][:, None] * sizes[2]
    longest = np.maximum(np.maximum(sizes[0][:, None, None], sizes[1][:, None]), sizes[2])
    shortest = np.minimum(np.minimum(sizes[0][:, None, None], sizes[1][:, None]), sizes[2])
    return {
        "cells": int(solid.sum()),
        "intervals": [len(d) for d in grid.degrees],
        "lowest_degree": int(min(d.min() for d in grid.finest)),
        "highest_degree": int(max(d.max() for d in grid.degrees)),
        "largest_aspect_ratio": float((longest / shortest)[solid].max()),
        "volume_m3": float(volume[solid].sum()),
    }


graph = lru_cache(maxsize=16)(grid_of)


@lru_cache(maxsize=16)
def coarsest(scene: Scene) -> Grid:
    """Return the grid whose only breakpoints are the planes of a scene."""
    planes = graph(scene).planes
    return Grid(planes, tuple(np.ones(len(p) - 1, dtype=int) for p in planes), scene.boxes)
