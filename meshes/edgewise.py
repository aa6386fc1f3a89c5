"""Polynomial degrees that differ from edge to edge.

A plane of a grid crosses the whole scene, and few of its cells need its degrees. Along each axis a function of an edge
has the edge's own degree, a function of a face or a cell the highest degree of its edges.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from meshes import grading
from meshes.grading import Features
from meshes.grid import Grid

# Factor by which the error indicator of an edge is expected to fall per degree; the next grid has a new estimate.
FALLS = 10.0


def of_degree(grid: Grid, degree: int) -> Grid:
    """Return the grid with all edges of one degree."""
    planes = [len(b) for b in grid.breaks]
    edges = [np.full([n - (e == d) for e, n in enumerate(planes)], degree) for d in range(3)]
    return replace(grid, degrees=tuple(np.full_like(p, degree) for p in grid.degrees), edges=tuple(edges))


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


def of_cells(grid: Grid) -> np.ndarray:
    """Return (3, cells) the degrees of the cells that a box owns."""
    at = np.argwhere(grid.solid).T
    if grid.edges:
        return np.array([entities(e, d)[tuple(2 * at + 1)] for d, e in enumerate(grid.edges)])
    return np.array([degrees[i] for degrees, i in zip(grid.degrees, at, strict=True)])


def by_interval(grid: Grid, values: np.ndarray) -> list[np.ndarray]:
    """Return per axis (intervals,) the sums of values (3, cells) of the cells that a box owns."""
    at = np.argwhere(grid.solid).T
    return [np.bincount(i, v, len(p)) for i, v, p in zip(at, values, grid.degrees, strict=True)]


def by_edge(grid: Grid, values: np.ndarray) -> list[np.ndarray]:
    """Distribute values (3, cells) along each axis equally to the four edges of each cell."""
    at, shares = np.argwhere(grid.solid).T, [np.zeros(e.shape) for e in grid.edges]
    for d, share in enumerate(shares):
        for step in product(*((0, 1) if e != d else (0,) for e in range(3))):
            np.add.at(share, tuple(at + np.array(step)[:, None]), values[d] / 4)
    return shares


def finer(grid: Grid, missing: Sequence[np.ndarray], share: float, other: Grid) -> Grid:
    """Return the cells of an ``other`` grid with the degrees of this one, raised until the indicator of each edge
    (``missing``) is expected to be its ``share``, at most to the degrees of the other grid."""
    places = [_places(old, new) for old, new in zip(grid.breaks, other.breaks, strict=True)]
    edges = []
    for d, (degrees, missed, highest) in enumerate(zip(grid.edges, missing, other.degrees, strict=True)):
        more = np.ceil(np.log(np.maximum(missed / share, 1.0)) / np.log(FALLS)).astype(int)
        at = (place[int(e == d) :: 2] for e, place in enumerate(places))
        edges.append(np.minimum(entities(degrees + more, d)[np.ix_(*at)], _along(d, highest)))
    on_each = (e.max(axis=tuple({0, 1, 2} - {d})) for d, e in enumerate(edges))
    return replace(other, degrees=tuple(on_each), edges=tuple(edges))


def refined(grid: Grid, missing: Sequence[np.ndarray], target: float, marks: Features) -> Grid:
    """Refine like `grading.refined` by indicators of edges: an interval by its edges of the highest degree there, all
    other edges up to this degree."""
    share = grading.share_of(missing, target)
    at_top = [
        np.where((e == _along(d, p)) & (m > share), m, 0.0).sum(axis=tuple({0, 1, 2} - {d}))
        for d, (e, p, m) in enumerate(zip(grid.edges, grid.degrees, missing, strict=True))
    ]
    # Where the indicators at the top are below the target, some intervals are refined all the same.
    most = min(target, 0.5 * sum(float(m.sum()) for m in at_top))
    return finer(grid, missing, share, grading.refined(grid, at_top, most, marks))


def _along(d: int, values: np.ndarray) -> np.ndarray:
    """Reshape values of intervals for the edges along an axis."""
    return values.reshape([-1 if e == d else 1 for e in range(3)])


def _places(old: np.ndarray, new: np.ndarray) -> np.ndarray:
    """Return (2 n + 1,) the place of each new breakpoint and interval among the old ones, as `entities` counts them."""
    points = np.empty(2 * len(new) - 1)
    points[::2], points[1::2] = new, (new[1:] + new[:-1]) / 2
    places: np.ndarray = np.searchsorted(old, points) + np.searchsorted(old, points, side="right") - 1
    return places
