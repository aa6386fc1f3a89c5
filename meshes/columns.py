"""Tetrahedra of a union of boxes, in columns: the scene seen along one axis is cut into triangles (`meshes.tiles`), and
over each stand prisms between the heights that are needed there, each cut into tetrahedra.

A plane cuts no cells beyond the part that it bounds, and a film, however thin, is one layer of cells. Each vertex of
the plan has the heights that any tile around it needs. Over a triangle the three chains of nodes are climbed in the
order of (height, vertex), and each step adds the tetrahedron of its node and the last node of each chain: two triangles
climb the chains of their common edge alike, so that their tetrahedra fit. Refinement cuts tiles along either axis
and adds nodes to chains: in the middle, or near an end at which edges are sharp (`meshes.tiles.NEAR`).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from meshes.grid import VOID, graph
from meshes.tiles import UNIT, Tiles, metres, share
from scenes.model import Scene


@dataclass(frozen=True, eq=False)
class Columns:
    """The plan of a scene seen along an axis, and the heights of the nodes over it.

    Attributes
    ----------
    up : the axis of sight
    tiles : the plan
    heights : (k,) heights of all nodes, in `meshes.tiles.UNIT` of the planes
    more : (tiles, heights) whether the columns over a tile have a height that no part needs
    """

    scene: Scene
    up: int
    tiles: Tiles
    heights: np.ndarray
    more: np.ndarray

    @staticmethod
    def of(scene: Scene) -> Columns:
        """The columns of a scene, along the axis with the fewest planes."""
        planes = graph(scene).planes
        up = min(range(3), key=lambda d: (len(planes[d]), -d))
        plan = [d for d in range(3) if d != up]
        tiles = Tiles.of(tuple(planes[d] for d in plan), _parts(scene)[:, plan])
        heights = np.arange(len(planes[up])) * UNIT
        return Columns(scene, up, tiles, heights, np.zeros((len(tiles.low), len(heights)), bool))

    @property
    def _plan(self) -> list[int]:
        """The axes of the plan."""
        return [d for d in range(3) if d != self.up]

    @cached_property
    def _owner(self) -> np.ndarray:
        """(tiles, layers): the box that each column belongs to, between the planes."""
        owner = np.moveaxis(graph(self.scene).owner, (*self._plan, self.up), (0, 1, 2))
        return np.asarray(owner[*(self.tiles.low // UNIT).T])

    @cached_property
    def _cells(self) -> tuple[Any, np.ndarray, np.ndarray]:
        """scikit-fem's mesh, the tile under each cell, and (cells, 2) the lowest and the highest node of each cell."""
        from skfem import MeshTet

        solid = (self._owner != VOID).any(axis=1)[self.tiles.triangles[1]]
        triangles, tile = (each[solid] for each in self.tiles.triangles)
        layers = (self.heights - 1) // UNIT
        nodes, cells, under = _climbed(triangles, self._owner[tile], layers, self._needs(triangles, tile))
        places = np.empty((3, len(nodes)))
        places[self._plan] = self.tiles.points[nodes[:, 0]].T
        places[self.up] = self._metres[nodes[:, 1]]
        at = self.heights[nodes[:, 1]][cells]
        ends = np.column_stack([at.min(axis=1), at.max(axis=1)])
        return MeshTet(places, np.ascontiguousarray(np.sort(cells, axis=1).T)), tile[under], ends

    @property
    def mesh(self) -> Any:
        """scikit-fem's mesh of tetrahedra, of whose facets, edges and vertices all parts of the scene are made."""
        return self._cells[0]

    def _needs(self, triangles: np.ndarray, tile: np.ndarray) -> np.ndarray:
        """(points, heights): whether the chain of each point has a node at each height.

        The tiles around the point need a node where the owner changes over a tile and where a part ends that covers a
        tile. An upright sheet needs a node at its ends over each of its points. `_graded` adds further nodes.
        """
        low, points = self.tiles.low // UNIT, self.tiles.places
        padded = np.pad(self._owner, [(0, 0), (1, 1)], constant_values=VOID)
        planes = np.arange(len(graph(self.scene).planes[self.up]))
        of_tiles = padded[:, 1:] != padded[:, :-1]
        on_planes = np.zeros((len(points), len(planes)), bool)
        for (x0, x1), (y0, y1), ends in _parts(self.scene)[:, [*self._plan, self.up]].tolist():
            if x0 < x1 and y0 < y1:
                over = np.flatnonzero((low >= (x0, y0)).all(axis=1) & (low < (x1, y1)).all(axis=1))
                for plane in ends:
                    beside = padded[over][:, [plane, plane + 1]] != VOID
                    of_tiles[over[beside.any(axis=1)], plane] = True
            else:
                first, last = np.array([[x0, y0], [x1, y1]]) * UNIT
                on = (points >= first).all(axis=1) & (points <= last).all(axis=1)
                on_planes[np.ix_(on, np.unique(ends))] = True
        at = np.searchsorted(self.heights, planes * UNIT)
        wanted, needs = self.more.copy(), np.zeros((len(points), len(self.heights)), bool)
        wanted[:, at] |= of_tiles
        needs[:, at] = on_planes
        for corner in triangles.T:
            np.logical_or.at(needs, corner, wanted[tile])
        return self._graded(triangles, needs)

    def _graded(self, triangles: np.ndarray, needs: np.ndarray) -> np.ndarray:
        """``needs`` (points, heights) with more, so that for each node there is one on the chains beside it that is no
        farther above or below than twice their distance.

        That keeps the angles of upright triangles below 153 degrees: else errors of vias grow with refinement."""
        pairs = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
        pairs = np.unique(np.sort(pairs, axis=1), axis=0)
        one, other = np.concatenate([pairs, pairs[:, ::-1]]).T
        points, at = self.tiles.points, self._metres
        reach = 2 * np.linalg.norm(points[one] - points[other], axis=1)[:, None]
        while True:
            below = np.maximum.accumulate(np.where(needs, at, -np.inf), axis=1)
            above = np.minimum.accumulate(np.where(needs, at, np.inf)[:, ::-1], axis=1)[:, ::-1]
            away = np.minimum(at - below, above - at)
            away[np.isinf(below) | np.isinf(above)] = 0.0
            edge, height = np.nonzero(needs[one] & (away[other] > reach))
            if not len(edge):
                return needs
            needs[other[edge], height] = True

    @property
    def _metres(self) -> np.ndarray:
        """(heights,): in m."""
        return metres(graph(self.scene).planes[self.up], self.heights)

    def refined(self, shorter: np.ndarray, sharp: np.ndarray) -> Columns:
        """With cells cut that are to be ``shorter`` along an axis (3, cells): near an end with vertices that are
        ``sharp`` (3, vertices), where an edge across that axis ends at which gradients are infinite."""
        mesh, under, ends = self._cells

        def asked(d: int, group: np.ndarray, lows: np.ndarray, highs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            """Of groups of cells (cells,) between ``lows`` and ``highs`` (groups,) along an axis, which are to be cut
            (groups,), and whether edges across the axis are sharp at either end (groups, 2)."""
            cut, near = np.zeros(len(lows), bool), np.zeros((len(lows), 2), bool)
            np.logical_or.at(cut, group, shorter[d])
            at, across = mesh.p[d][mesh.t], sharp[[e for e in range(3) if e != d]][:, mesh.t].any(axis=0)
            for end, units in enumerate((lows, highs)):
                places = metres(graph(self.scene).planes[d], units)
                np.logical_or.at(near[:, end], group, ((at == places[group]) & across).any(axis=0))
            return cut, near

        plan = [asked(d, under, self.tiles.low[:, e], self.tiles.high[:, e]) for e, d in enumerate(self._plan)]
        tiles, parents = self.tiles.finer(*(np.stack(each, axis=1) for each in zip(*plan, strict=True)))
        # All cells of a column between the same heights get the same one in between.
        spans, number = np.unique(np.column_stack([under, ends]), axis=0, return_inverse=True)
        cut, near = asked(self.up, number, *spans[:, 1:].T)
        column, below, above = spans[cut].T
        heights = below + ((above - below) * share(near[cut])).astype(np.int64)
        every = np.union1d(self.heights, heights)
        more = np.zeros((len(self.more), len(every)), bool)
        more[:, np.searchsorted(every, self.heights)] = self.more
        more[column, np.searchsorted(every, heights)] = True
        return Columns(self.scene, self.up, tiles, every, more[parents])


def _parts(scene: Scene) -> np.ndarray:
    """(parts, 3, 2): the planes between which boxes, conditions and extended probes lie."""
    items: list[Any] = [*scene.boxes, *scene.boundaries, *(p for p in scene.probes if p.lower != p.upper)]
    ends = np.array([(i.lower, i.upper) for i in items])
    middles = [(p[1:] + p[:-1]) / 2 for p in graph(scene).planes]
    return np.stack([np.searchsorted(middle, ends[..., d]) for d, middle in enumerate(middles)], axis=1)


def _climbed(
    triangles: np.ndarray, owner: np.ndarray, layer: np.ndarray, needs: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Nodes (n, 2), as point and height, the tetrahedra (m, 4) that a box owns, and the triangle (m,) under each;
    ``layer`` (heights,) is the layer of planes below each height."""
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
