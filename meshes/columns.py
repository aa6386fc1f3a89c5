"""Tetrahedra of a union of boxes, in columns: the scene seen along one axis is cut into triangles along the outlines of
all that it has, and over each stand prisms between the planes that are needed there, each cut into tetrahedra.

No plane crosses more than what it bounds, and a film, however thin, is one layer of cells. Each vertex of the plan has
the planes that any triangle around it needs. Over a triangle the three chains of nodes are climbed in the order of
(plane, vertex), and each step adds the tetrahedron of its node and the three that were reached: two triangles climb the
chains of their common edge alike, so that what stands on them fits.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from meshes import connected
from meshes.grid import VOID, Grid
from scenes.model import Scene

# Triangles with a larger angle are cut at the foot of their height: P1 interpolation degrades as 1/sin of it (Babuska
# and Aziz, SIAM J. Numer. Anal. 13, 1976). Feet cause others, so that there are rounds.
WIDEST, ROUNDS = np.radians(140.0), 10
MOST_ROUNDS = 80  # until all outlines are edges of triangles
FAR = 10.0  # extents of the plan, at which a frame stands around it
OFF_ENDS = 0.1  # a foot on a piece is at least this fraction of it away from its ends; else its middle is taken


def tetrahedra(scene: Scene) -> Any:
    """scikit-fem's mesh of the boxes of a scene, of whose facets, edges and vertices all its parts are made: boxes,
    conditions and extended probes. The columns stand along the axis with the fewest planes."""
    from skfem import MeshTet

    grid = connected.coarsest(scene)
    up = min(range(3), key=lambda d: (len(grid.breaks[d]), -d))
    x, y = (d for d in range(3) if d != up)
    items: list[Any] = [*scene.boxes, *scene.boundaries, *(p for p in scene.probes if p.lower != p.upper)]
    parts = np.array([[grid.span(d, i.lower[d], i.upper[d]) for d in (x, y, up)] for i in items])
    points, triangles = _triangulated((grid.breaks[x], grid.breaks[y]), parts[:, :2])
    owner = np.moveaxis(grid.owner, (x, y, up), (0, 1, 2))
    at = [_interval(grid.breaks[d], points[triangles, e].mean(axis=1)) for e, d in enumerate((x, y))]
    columns = owner[at[0], at[1]]
    solid = (columns != VOID).any(axis=1)
    needs = _needs(parts, points, triangles[solid], [a[solid] for a in at], columns[solid], grid, (x, y))
    nodes, cells = _climbed(triangles[solid], columns[solid], needs)
    places = np.empty((3, len(nodes)))
    places[[x, y]], places[up] = points[nodes[:, 0]].T, grid.breaks[up][nodes[:, 1]]
    return MeshTet(places, np.ascontiguousarray(np.sort(cells, axis=1).T))


def _interval(breaks: np.ndarray, at: np.ndarray) -> np.ndarray:
    found: np.ndarray = np.clip(np.searchsorted(breaks, at, side="right") - 1, 0, len(breaks) - 2)
    return found


def _outlines(own: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The points (n, 2), in numbers of planes, at which the outlines of rectangles (parts, 2, 2) end or meet, and the
    pieces (m, 2) between."""
    lines = []
    for fixed in (0, 1):
        each = [np.column_stack([own[:, fixed, side], own[:, 1 - fixed]]) for side in (0, 1)]
        found = np.unique(np.concatenate(each), axis=0)
        lines.append(found[found[:, 1] < found[:, 2]])
    upright, level = lines
    i, j = np.nonzero(
        (level[:, None, 1] <= upright[:, 0]) & (upright[:, 0] <= level[:, None, 2])
        & (upright[:, 1] <= level[:, None, 0]) & (level[:, None, 0] <= upright[:, 2])
    )  # fmt: skip
    corners = [np.column_stack([own[:, 0, s], own[:, 1, t]]) for s in (0, 1) for t in (0, 1)]
    points = np.unique(np.concatenate([np.column_stack([upright[j, 0], level[i, 0]]), *corners]), axis=0)
    pieces = []
    for fixed, found in enumerate(lines):
        order = np.lexsort((points[:, 1 - fixed], points[:, fixed]))
        a, b = order[:-1], order[1:]
        covered = np.zeros(len(a), bool)
        for at, first, last in found.tolist():
            on = (points[a, fixed] == at) & (points[b, fixed] == at)
            covered |= on & (points[a, 1 - fixed] >= first) & (points[b, 1 - fixed] <= last)
        pieces.append(np.column_stack([a[covered], b[covered]]))
    return points, np.concatenate(pieces)


def _triangulated(breaks: tuple[np.ndarray, np.ndarray], own: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 2) in m and triangles (m, 3) of the plan, of which all outlines of rectangles (parts, 2, 2) are
    edges: Delaunay's, with points added on outlines that aren't, and at the feet of wide angles."""
    from scipy.spatial import Delaunay

    numbers, pieces = _outlines(own)
    low, size = np.array([b[0] for b in breaks]), max(float(b[-1] - b[0]) for b in breaks)
    points = (np.column_stack([b[numbers[:, e]] for e, b in enumerate(breaks)]) - low) / size
    frame = np.array([[-FAR, -FAR], [FAR, -FAR], [-FAR, FAR], [FAR, FAR]])
    rounds = 0
    for _ in range(MOST_ROUNDS):
        count = len(points)
        triangles = Delaunay(np.concatenate([points, frame])).simplices
        triangles = triangles[(triangles < count).all(axis=1)]
        edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
        missing = np.flatnonzero(~np.isin(_keys(pieces, count), _keys(edges, count)))
        if len(missing):
            at = _in_the_way(points, pieces[missing])
        else:
            rounds += 1
            at, missing, inner = _feet(points, triangles, pieces)
            if rounds > ROUNDS or not len(at) + len(inner):
                break
            points = np.concatenate([points, inner])
        new = len(points) + np.arange(len(missing))
        first, last = pieces[missing].T
        points = np.concatenate([points, at])
        pieces = np.concatenate([
            np.delete(pieces, missing, axis=0), np.column_stack([first, new]), np.column_stack([new, last])
        ])  # fmt: skip
    return points * size + low, triangles


def _keys(pairs: np.ndarray, count: int) -> np.ndarray:
    found: np.ndarray = pairs.min(axis=1).astype(np.int64) * count + pairs.max(axis=1)
    return found


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
    found: np.ndarray = np.where(a == b, a, a + along[:, None] * (b - a))
    return found


def _feet(points: np.ndarray, triangles: np.ndarray, pieces: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Where heights of triangles with wide angles stand: on pieces (n, 2), which pieces these are (n,), and elsewhere
    (m, 2); one for each edge."""
    corners = points[triangles]
    sides = np.linalg.norm(np.roll(corners, -1, axis=1) - np.roll(corners, 1, axis=1), axis=2)
    longest = sides.argmax(axis=1)
    c = sides.max(axis=1)
    a, b = (sides[np.arange(len(sides)), (longest + k) % 3] for k in (1, 2))
    wide = np.flatnonzero((a**2 + b**2 - c**2) / (2 * a * b) < np.cos(WIDEST))
    apex, *ends = (triangles[wide, (longest[wide] + k) % 3] for k in range(3))
    both = np.column_stack(ends)
    keys, first = np.unique(_keys(both, len(points)), return_index=True)
    at = _foot(points[apex[first]], points[both[first, 0]], points[both[first, 1]])
    known = _keys(pieces, len(points))
    order = np.argsort(known)
    place = order[np.searchsorted(known[order], keys).clip(max=len(known) - 1)]
    on = known[place] == keys
    return at[on], place[on], at[~on]


def _needs(
    parts: np.ndarray,
    points: np.ndarray,
    triangles: np.ndarray,
    at: list[np.ndarray],
    columns: np.ndarray,
    grid: Grid,
    plan: tuple[int, int],
) -> np.ndarray:
    """(points, planes): which planes the chain of each point has: where the owner changes over a triangle around it,
    and where a part ends that covers the triangle or, if it is a sheet that stands upright, has the point."""
    padded = np.pad(columns, [(0, 0), (1, 1)], constant_values=VOID)
    of_triangles = padded[:, 1:] != padded[:, :-1]
    found = np.zeros((len(points), of_triangles.shape[1]), bool)
    for (x0, x1), (y0, y1), ends in parts:
        if x0 < x1 and y0 < y1:
            over = (at[0] >= x0) & (at[0] < x1) & (at[1] >= y0) & (at[1] < y1)
            for plane in ends:
                beside = padded[over][:, [plane, plane + 1]] != VOID
                of_triangles[np.flatnonzero(over)[beside.any(axis=1)], plane] = True
        else:
            on = np.ones(len(points), bool)
            for e, (low, high) in enumerate(((x0, x1), (y0, y1))):
                breaks = grid.breaks[plan[e]]
                small = grid.small(plan[e])
                on &= (points[:, e] >= breaks[low] - small) & (points[:, e] <= breaks[high] + small)
            found[np.ix_(on, np.unique(ends))] = True
    for corner in triangles.T:
        np.logical_or.at(found, corner, of_triangles)
    return found


def _climbed(triangles: np.ndarray, columns: np.ndarray, needs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Nodes (n, 2), as point and plane, and the tetrahedra (m, 4) of them that a box owns."""
    solid = columns != VOID
    lowest, highest = solid.argmax(axis=1), solid.shape[1] - solid[:, ::-1].argmax(axis=1)
    planes = np.arange(needs.shape[1])
    steps = []
    for chain in range(3):
        there = needs[triangles[:, chain]] & (planes > lowest[:, None]) & (planes <= highest[:, None])
        triangle, plane = np.nonzero(there)
        steps.append(np.column_stack([triangle, plane, triangles[triangle, chain], np.full(len(plane), chain)]))
    every = np.concatenate(steps)
    triangle, plane, point, climbing = every[np.lexsort(every[:, 2::-1].T)].T
    far = len(planes) + 1
    start = triangle * far + lowest[triangle]
    corners = [point * far + plane]
    for chain in range(3):
        own = np.where(climbing == chain, triangle * far + plane, start)
        reached = np.maximum(np.concatenate([[0], np.maximum.accumulate(own)[:-1]]), start) - triangle * far
        corners.append(triangles[triangle, chain] * far + reached)
    cells = np.column_stack(corners)[columns[triangle, plane - 1] != VOID]
    numbers, cells = np.unique(cells, return_inverse=True)
    return np.column_stack([numbers // far, numbers % far]), cells.reshape(-1, 4)
