"""Polynomial degrees that differ from edge to edge.

A plane of a grid crosses the whole scene, and few of its cells need its degrees. Along each axis a function of an edge
has the edge's own degree, a function of a face or a cell the highest degree of its edges.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

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


def pooled(grid: Grid, spread: Sequence[np.ndarray]) -> list[np.ndarray]:
    """Return per axis (degrees, intervals) the sums of values of edges of one degree on an interval."""
    shapes = [(int(p.max()) + 1, len(p)) for p in grid.degrees]
    return [
        np.bincount(pool.ravel(), each.ravel(), shape[0] * shape[1]).reshape(shape)
        for pool, each, shape in zip(_pools(grid), spread, shapes, strict=True)
    ]


def shared(grid: Grid, sums: Sequence[np.ndarray], spread: Sequence[np.ndarray]) -> list[np.ndarray]:
    """Distribute sums of `pooled` to the edges in proportion to a ``spread``."""
    each = zip(_pools(grid), sums, pooled(grid, spread), spread, strict=True)
    return [part * (whole / np.maximum(total, 1e-300)).ravel()[pool] for pool, whole, total, part in each]


def by_interval(spread: Sequence[np.ndarray]) -> list[np.ndarray]:
    """Return per axis (intervals,) the values of intervals, or the sums over their edges."""
    return [m if m.ndim == 1 else m.sum(axis=tuple({0, 1, 2} - {d})) for d, m in enumerate(spread)]


def share_of(missing: Sequence[np.ndarray], target: float) -> float:
    """Return the level to which larger indicators must fall, so that the sum of all is the target."""
    return grading.share_of(np.concatenate([m.ravel() for m in missing]), target)


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
    share = share_of(missing, target)
    at_top = by_interval([
        np.where((e == _along(d, p)) & (m > share), m, 0.0)
        for d, (e, p, m) in enumerate(zip(grid.edges, grid.degrees, missing, strict=True))
    ])  # fmt: skip
    # Where the indicators at the top are below the target, some intervals are refined all the same.
    most = min(target, 0.5 * sum(float(m.sum()) for m in at_top))
    return finer(grid, missing, share, grading.refined(grid, at_top, most, marks))


def _pools(grid: Grid) -> list[np.ndarray]:
    """Return per axis the place of each edge in `pooled`."""
    each = enumerate(zip(grid.edges, grid.degrees, strict=True))
    return [edges * len(p) + _along(d, np.arange(len(p))) for d, (edges, p) in each]


def _along(d: int, values: np.ndarray) -> np.ndarray:
    """Reshape values of intervals for the edges along an axis."""
    return values.reshape([-1 if e == d else 1 for e in range(3)])


def _places(old: np.ndarray, new: np.ndarray) -> np.ndarray:
    """Return (2 n + 1,) the place of each new breakpoint and interval among the old ones, as `entities` counts them."""
    points = np.empty(2 * len(new) - 1)
    points[::2], points[1::2] = new, (new[1:] + new[:-1]) / 2
    places: np.ndarray = np.searchsorted(old, points) + np.searchsorted(old, points, side="right") - 1
    return places
