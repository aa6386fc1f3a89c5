"""A grid of bricks with the box that owns each cell.

A grid has breakpoints and polynomial degrees along three axes. The planes of its scene are among the breakpoints. A
plane crosses the whole scene, and few of its cells need its degrees: degrees may differ from edge to edge. Along each
axis a function of an edge then has the edge's own degree, one of a face or a cell the highest degree of its edges.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import product
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
    edges: per axis the degrees of its edges, (intervals along it, planes across the others) in the
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
        return np.asarray(self.owner != VOID)

    @property
    def finest(self) -> tuple[np.ndarray, ...]:
        """Per axis the degrees of its edges, of shape (intervals along it, planes across the others)."""
        planes = [len(b) for b in self.breaks]
        return self.edges or tuple(
            np.broadcast_to(
                p.reshape([-1 if e == d else 1 for e in range(3)]), [n - (e == d) for e, n in enumerate(planes)]
            )
            for d, p in enumerate(self.degrees)
        )

    @property
    def of_entities(self) -> np.ndarray:
        """(3, 2 nx + 1, 2 ny + 1, 2 nz + 1) the degrees of each edge, face and cell along the axes."""
        return np.array([entities(degrees.astype(np.int8), d) for d, degrees in enumerate(self.finest)])

    @property
    def of_cells(self) -> np.ndarray:
        """(3, cells) the degrees of the cells that a box owns."""
        return self.of_entities[:, 1::2, 1::2, 1::2][:, self.solid].astype(int)

    def by_interval(self, values: np.ndarray) -> list[np.ndarray]:
        """Return per axis (intervals,) the sums of values (3, cells) of the cells that a box owns."""
        at = np.argwhere(self.solid).T
        return [np.bincount(i, v, len(p)) for i, v, p in zip(at, values, self.degrees, strict=True)]

    def spread(self, values: np.ndarray) -> list[np.ndarray]:
        """Return the sums of values (3, cells) per interval; of a grid with degrees of edges, per edge: along each axis
        an equal share goes to the four edges of a cell."""
        if not self.edges:
            return self.by_interval(values)
        at, shares = np.argwhere(self.solid).T, [np.zeros(e.shape) for e in self.edges]
        for d, share in enumerate(shares):
            for step in product(*((0, 1) if e != d else (0,) for e in range(3))):
                np.add.at(share, tuple(at + np.array(step)[:, None]), values[d] / 4)
        return shares

    def with_edges(self, degree: int) -> Grid:
        """Return the grid with all edges of one degree."""
        alike = replace(self, degrees=tuple(np.full_like(p, degree) for p in self.degrees), edges=())
        return replace(alike, edges=alike.finest)

    def with_axes(self, breaks: Sequence[np.ndarray], degrees: Sequence[np.ndarray]) -> Grid:
        """Another grid of the same boxes."""
        return Grid(tuple(breaks), tuple(degrees), self.boxes)

    def same(self, other: Grid) -> bool:
        """Whether two grids have the same cells and degrees."""
        pairs = zip((*self.breaks, *self.finest), (*other.breaks, *other.finest), strict=True)
        return all(np.array_equal(a, b) for a, b in pairs)


def entities(edges: np.ndarray, d: int) -> np.ndarray:
    """Return (2 nx + 1, 2 ny + 1, 2 nz + 1) the largest value of the edges of each edge, face and cell along an axis.

    ``edges`` (intervals along the axis, planes across the others) are values of edges; the result is zero where nothing
    extends along the axis. Along each axis even places are planes, odd places intervals.
    """
    everywhere = np.zeros([2 * n + (1 if e == d else -1) for e, n in enumerate(edges.shape)], edges.dtype)
    everywhere[tuple(slice(int(e == d), None, 2) for e in range(3))] = edges
    for e in {0, 1, 2} - {d}:
        along = np.moveaxis(everywhere, e, 0)
        np.maximum(along[:-1:2], along[2::2], out=along[1::2])
    return everywhere


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
