"""Tetrahedra of a union of boxes, in columns: the scene seen along one axis is cut into triangles along the outlines of
all that it has, and over each stand prisms between the heights that are needed there, each cut into tetrahedra.

No plane crosses more than what it bounds, and a film, however thin, is one layer of cells. Each vertex of the plan has
the heights that any triangle around it needs. Over a triangle the three chains of nodes are climbed in the order of
(height, vertex), and each step adds the tetrahedron of its node and the three that were reached: two triangles climb
the chains of their common edge alike, so that what stands on them fits. Refined, the plan gets more points and is cut
into triangles anew, and chains get more nodes: cells that are flat are divided across, tall ones along their height.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from meshes import connected
from meshes.grid import VOID, Grid
from scenes.errors import NumericsError
from scenes.model import Scene

# Triangles with a larger angle are cut at the foot of their height: linear interpolation degrades as 1/sin of it
# (Babuska and Aziz, SIAM J. Numer. Anal. 13, 1976). Feet cause others, so that there are rounds.
WIDEST, ROUNDS = np.radians(140.0), 10
MOST_ROUNDS = 80  # until all outlines are edges of triangles
FAR = 10.0  # distance, in extents of the plan, of a frame of points around it for the triangulation
OFF_ENDS = 0.1  # a foot on a piece is at least this fraction of it away from its ends; else its middle is taken
FLAT = 2.0  # cells that are longer than high by more than this are divided across only, higher ones along their height
AGAIN = 6  # rounds in which triangles are halved, at most, until they are as short as they are to be


@dataclass(frozen=True, eq=False)
class Columns:
    """The plan of a scene seen along the axis ``up``: ``points`` (n, 2) in m, and the ``pieces`` (m, 2) between them
    that outlines are made of; the ``heights`` (k,) of all nodes (m) and which of them chains have that no part needs
    (``more``: points, heights)."""

    scene: Scene
    up: int
    points: np.ndarray
    pieces: np.ndarray
    heights: np.ndarray
    more: np.ndarray

    @staticmethod
    def of(scene: Scene) -> Columns:
        """The columns of a scene, along the axis with the fewest planes."""
        grid = connected.coarsest(scene)
        up = min(range(3), key=lambda d: (len(grid.breaks[d]), -d))
        bare = Columns(scene, up, np.empty((0, 2)), np.empty((0, 2), int), grid.breaks[up], np.empty((0, 0), bool))
        numbers, pieces = _outlines(bare._parts[:, :2])
        points = np.column_stack([grid.breaks[d][numbers[:, e]] for e, d in enumerate(bare._plan)])
        points, pieces = _conforming(points, pieces)
        return replace(bare, points=points, pieces=pieces, more=np.zeros((len(points), len(bare.heights)), bool))

    @property
    def _grid(self) -> Grid:
        return connected.coarsest(self.scene)

    @property
    def _plan(self) -> list[int]:
        """The axes of the plan."""
        return [d for d in range(3) if d != self.up]

    @cached_property
    def _parts(self) -> np.ndarray:
        """(parts, 3, 2): the planes between which boxes, conditions and extended probes lie, in the plan and along the
        columns."""
        items: list[Any] = [*self.scene.boxes, *self.scene.boundaries]
        items += [p for p in self.scene.probes if p.lower != p.upper]
        return np.array([[self._grid.span(d, i.lower[d], i.upper[d]) for d in (*self._plan, self.up)] for i in items])

    @cached_property
    def _columns(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """The triangles (n, 3) under solid, the owners (n, layers) above each, where they are (n, 2) among the planes,
        and which of all triangles of the plan they are."""
        triangles = _Plan(self.points).triangles
        middles = self.points[triangles].mean(axis=1)
        at = np.column_stack([_interval(self._grid.breaks[d], middles[:, e]) for e, d in enumerate(self._plan)])
        owner = np.moveaxis(self._grid.owner, (*self._plan, self.up), (0, 1, 2))[at[:, 0], at[:, 1]]
        solid = (owner != VOID).any(axis=1)
        return triangles[solid], owner[solid], at[solid], solid

    @cached_property
    def _cells(self) -> tuple[Any, np.ndarray]:
        """scikit-fem's mesh, and the triangle that each cell stands on."""
        from skfem import MeshTet

        triangles, owner, *_ = self._columns
        layer = np.searchsorted(self._grid.breaks[self.up], self.heights) - 1
        nodes, cells, under = _climbed(triangles, owner, layer, self._needs | self.more)
        places = np.empty((3, len(nodes)))
        places[self._plan], places[self.up] = self.points[nodes[:, 0]].T, self.heights[nodes[:, 1]]
        return MeshTet(places, np.ascontiguousarray(np.sort(cells, axis=1).T)), under

    @property
    def mesh(self) -> Any:
        """scikit-fem's mesh of tetrahedra, of whose facets, edges and vertices all parts of the scene are made."""
        return self._cells[0]

    @property
    def _needs(self) -> np.ndarray:
        """(points, heights): which the chain of each point has: where the owner changes over a triangle around it, and
        where a part ends that covers the triangle or, if it is a sheet that stands upright, has the point."""
        triangles, owner, at, _ = self._columns
        breaks = self._grid.breaks[self.up]
        padded = np.pad(owner, [(0, 0), (1, 1)], constant_values=VOID)
        of_triangles = padded[:, 1:] != padded[:, :-1]
        on_planes = np.zeros((len(self.points), len(breaks)), bool)
        for (x0, x1), (y0, y1), ends in self._parts:
            if x0 < x1 and y0 < y1:
                over = np.flatnonzero((at >= (x0, y0)).all(axis=1) & (at < (x1, y1)).all(axis=1))
                for plane in ends:
                    beside = padded[over][:, [plane, plane + 1]] != VOID
                    of_triangles[over[beside.any(axis=1)], plane] = True
            else:
                on = np.ones(len(self.points), bool)
                for e, (low, high) in enumerate(((x0, x1), (y0, y1))):
                    at_planes, small = self._grid.breaks[self._plan[e]], self._grid.small(self._plan[e])
                    on &= (self.points[:, e] >= at_planes[low] - small) & (self.points[:, e] <= at_planes[high] + small)
                on_planes[np.ix_(on, np.unique(ends))] = True
        for corner in triangles.T:
            np.logical_or.at(on_planes, corner, of_triangles)
        every = np.zeros((len(self.points), len(self.heights)), bool)
        every[:, np.searchsorted(self.heights, breaks)] = on_planes
        return every

    def refined(self, times: np.ndarray) -> Columns:
        """With the cells so many ``times`` (cells,) shorter by a factor of two."""
        mesh, under = self._cells
        triangles = self._columns[0]
        low, high = (extreme(mesh.p[self.up][mesh.t], axis=0) for extreme in (np.min, np.max))
        length = _longest(self.points, triangles)[under]
        across = (times > 0) & (length * FLAT > high - low)
        wanted = np.full(len(triangles), np.inf)
        np.minimum.at(wanted, under[across], (length / 2.0**times)[across])
        columns = self._with_heights(np.flatnonzero((times > 0) & (length < FLAT * (high - low))), (low + high) / 2)
        return columns._with_points(wanted)

    def _with_heights(self, cells: np.ndarray, middle: np.ndarray) -> Columns:
        """With a node in the middle (cells,) of the height of some cells (n,), at the chains of each."""
        _, under = self._cells
        heights = np.union1d(self.heights, middle[cells])
        more = np.zeros((len(self.points), len(heights)), bool)
        more[:, np.searchsorted(heights, self.heights)] = self.more
        for corner in self._columns[0][under[cells]].T:
            more[corner, np.searchsorted(heights, middle[cells])] = True
        return replace(self, heights=heights, more=more)

    def _with_points(self, wanted: np.ndarray) -> Columns:
        """With more points of the plan, so that the sides of what lies in each triangle are as short as is ``wanted``
        (m); new points take over the chains of the triangle that they are in."""
        if not np.isfinite(wanted).any():
            return self
        before = _Plan(self.points)
        everywhere = np.full(len(before.triangles), np.inf)
        everywhere[self._columns[3]] = wanted
        points, pieces = self.points, self.pieces
        for _ in range(AGAIN):
            now = _Plan(points).triangles
            at = before.find(points[now].mean(axis=1))
            long = _longest(points, now) > np.where(at < 0, np.inf, everywhere[at]) * (1 + 1e-9)
            if not long.any():
                break
            points, pieces = _conforming(*_halved(points, pieces, now[long]))
        inside = before.triangles[before.find(points[len(self.points) :])]
        more = np.concatenate([self.more, self.more[inside].any(axis=1)])
        return replace(self, points=points, pieces=pieces, more=more)


def _interval(breaks: np.ndarray, at: np.ndarray) -> np.ndarray:
    intervals: np.ndarray = np.clip(np.searchsorted(breaks, at, side="right") - 1, 0, len(breaks) - 2)
    return intervals


def _longest(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """(triangles,): their longest sides (m)."""
    corners = points[triangles]
    lengths: np.ndarray = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    return lengths


class _Plan:
    """Delaunay's ``triangles`` (n, 3) of some points (m), which a frame far away stands around."""

    def __init__(self, points: np.ndarray) -> None:
        from scipy.spatial import Delaunay

        self._low, self._size = points.min(axis=0), float(np.ptp(points, axis=0).max())
        frame = np.array([[-FAR, -FAR], [FAR, -FAR], [-FAR, FAR], [FAR, FAR]])
        self._found = Delaunay(np.concatenate([(points - self._low) / self._size, frame]))
        within = (self._found.simplices < len(points)).all(axis=1)
        self.triangles = self._found.simplices[within]
        self._number = np.append(np.where(within, np.cumsum(within) - 1, -1), -1)

    def find(self, points: np.ndarray) -> np.ndarray:
        """(points,): the triangle that each is in; -1 for none."""
        triangles: np.ndarray = self._number[self._found.find_simplex((points - self._low) / self._size)]
        return triangles


def _outlines(rectangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The points (n, 2), in numbers of planes, at which the outlines of rectangles (parts, 2, 2) end or meet, and the
    pieces (m, 2) between."""
    lines = []
    for fixed in (0, 1):
        each = [np.column_stack([rectangles[:, fixed, side], rectangles[:, 1 - fixed]]) for side in (0, 1)]
        edges = np.unique(np.concatenate(each), axis=0)
        lines.append(edges[edges[:, 1] < edges[:, 2]])
    upright, level = lines
    i, j = np.nonzero(
        (level[:, None, 1] <= upright[:, 0]) & (upright[:, 0] <= level[:, None, 2])
        & (upright[:, 1] <= level[:, None, 0]) & (level[:, None, 0] <= upright[:, 2])
    )  # fmt: skip
    corners = [np.column_stack([rectangles[:, 0, s], rectangles[:, 1, t]]) for s in (0, 1) for t in (0, 1)]
    points = np.unique(np.concatenate([np.column_stack([upright[j, 0], level[i, 0]]), *corners]), axis=0)
    pieces = []
    for fixed, edges in enumerate(lines):
        order = np.lexsort((points[:, 1 - fixed], points[:, fixed]))
        a, b = order[:-1], order[1:]
        covered = np.zeros(len(a), bool)
        for at, first, last in edges.tolist():
            on = (points[a, fixed] == at) & (points[b, fixed] == at)
            covered |= on & (points[a, 1 - fixed] >= first) & (points[b, 1 - fixed] <= last)
        pieces.append(np.column_stack([a[covered], b[covered]]))
    return points, np.concatenate(pieces)


def _conforming(points: np.ndarray, pieces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points and pieces with more points, so that the pieces are edges of Delaunay's triangles: on those that aren't,
    and at the feet of wide angles. Raises NumericsError where that takes more than `MOST_ROUNDS`."""
    rounds = 0
    for _ in range(MOST_ROUNDS):
        count, triangles = len(points), _Plan(points).triangles
        edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
        missing = np.flatnonzero(~np.isin(_keys(pieces, count), _keys(edges, count)))
        if len(missing):
            points, pieces = _cut(points, pieces, missing, _in_the_way(points, pieces[missing]))
            continue
        rounds += 1
        feet = _feet(points, triangles)
        if rounds > ROUNDS or not len(feet[0]):
            return points, pieces
        points, pieces = _with(points, pieces, *feet)
    raise NumericsError("the outlines of boxes lie so close to one another that no triangles are found between them")


def _halved(points: np.ndarray, pieces: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points and pieces with the middles of the longest sides of some triangles."""
    corners = points[triangles]
    longest = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).argmax(axis=1)
    rows = np.arange(len(triangles))
    both = np.column_stack([triangles[rows, longest], triangles[rows, (longest + 1) % 3]])
    _, first = np.unique(_keys(both, len(points)), return_index=True)
    return _with(points, pieces, both[first], points[both[first]].mean(axis=1))


def _with(points: np.ndarray, pieces: np.ndarray, edges: np.ndarray, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points and pieces with a point on each of some edges (n, 2), which may be pieces."""
    known, keys = _keys(pieces, len(points)), _keys(edges, len(points))
    order = np.argsort(known)
    place = order[np.searchsorted(known[order], keys).clip(max=len(known) - 1)]
    on = known[place] == keys
    points = np.concatenate([points, at[~on]])
    return _cut(points, pieces, place[on], at[on])


def _cut(points: np.ndarray, pieces: np.ndarray, which: np.ndarray, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points and pieces with some pieces (n,) cut at a point (n, 2) each."""
    new, (first, last) = len(points) + np.arange(len(which)), pieces[which].T
    halves = [np.column_stack([first, new]), np.column_stack([new, last])]
    return np.concatenate([points, at]), np.concatenate([np.delete(pieces, which, axis=0), *halves])


def _keys(pairs: np.ndarray, count: int) -> np.ndarray:
    keys: np.ndarray = pairs.min(axis=1).astype(np.int64) * count + pairs.max(axis=1)
    return keys


def _in_the_way(points: np.ndarray, pieces: np.ndarray) -> np.ndarray:
    """(n, 2): where to cut pieces (n, 2) that are no edges: at the foot of the point that sees a piece under the
    largest angle, or in its middle."""
    a, b = points[pieces[:, 0]], points[pieces[:, 1]]
    to_a, to_b = a[:, None] - points, b[:, None] - points
    lengths = np.linalg.norm(to_a, axis=2) * np.linalg.norm(to_b, axis=2)
    with np.errstate(divide="ignore", invalid="ignore"):
        cosine = np.where(lengths > 0, (to_a * to_b).sum(axis=2) / lengths, 1.0)
    return _foot(points[cosine.argmin(axis=1)], a, b)


def _foot(p: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    along = ((p - a) * (b - a)).sum(axis=1) / ((b - a) ** 2).sum(axis=1)
    along = np.where((along > OFF_ENDS) & (along < 1 - OFF_ENDS), along, 0.5)
    # On a line of the plan to the last digit.
    feet: np.ndarray = np.where(a == b, a, a + along[:, None] * (b - a))
    return feet


def _feet(points: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The longest sides (n, 2) of triangles with wide angles, each once, and where their heights stand (n, 2)."""
    corners = points[triangles]
    sides = np.linalg.norm(np.roll(corners, -1, axis=1) - np.roll(corners, 1, axis=1), axis=2)
    longest, rows = sides.argmax(axis=1), np.arange(len(sides))
    a, b, c = (sides[rows, (longest + k) % 3] for k in (1, 2, 0))
    wide = np.flatnonzero((a**2 + b**2 - c**2) / (2 * a * b) < np.cos(WIDEST))
    apex, *ends = (triangles[wide, (longest[wide] + k) % 3] for k in range(3))
    both = np.column_stack(ends)
    _, first = np.unique(_keys(both, len(points)), return_index=True)
    return both[first], _foot(points[apex[first]], points[both[first, 0]], points[both[first, 1]])


def _climbed(
    triangles: np.ndarray, owner: np.ndarray, layer: np.ndarray, needs: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Nodes (n, 2), as point and height, the tetrahedra (m, 4) of them that a box owns, and the triangle (m,) under
    each; ``layer`` (heights,) is that of the planes below each height."""
    filled = np.pad(owner != VOID, [(0, 0), (1, 0)])[:, layer + 1]
    highest = filled.shape[1] - 1 - filled[:, ::-1].argmax(axis=1)
    # Below the first height of a solid layer.
    lowest = np.maximum(filled.argmax(axis=1) - 1, 0)
    heights, steps = np.arange(needs.shape[1]), []
    for chain in range(3):
        on = needs[triangles[:, chain]] & (heights > lowest[:, None]) & (heights <= highest[:, None])
        triangle, height = np.nonzero(on)
        steps.append(np.column_stack([triangle, height, triangles[triangle, chain], np.full(len(height), chain)]))
    every = np.concatenate(steps)
    triangle, height, point, climbing = every[np.lexsort(every[:, 2::-1].T)].T
    far = len(heights) + 1
    start = triangle * far + lowest[triangle]
    corners = [point * far + height]
    for chain in range(3):
        climbs = np.where(climbing == chain, triangle * far + height, start)
        reached = np.maximum(np.concatenate([[0], np.maximum.accumulate(climbs)[:-1]]), start) - triangle * far
        corners.append(triangles[triangle, chain] * far + reached)
    solid = filled[triangle, height]
    numbers, cells = np.unique(np.column_stack(corners)[solid], return_inverse=True)
    return np.column_stack([numbers // far, numbers % far]), cells.reshape(-1, 4), triangle[solid]
