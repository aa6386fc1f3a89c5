"""The plan of a scene, seen along one axis, in *tiles*: rectangles along the two axes, each cut into triangles.

Tiles end where they are needed: along an outline they get thin and stay long. Where other tiles have corners on the
sides of one, it is cut into triangles that have these corners too. Tiles that would get wide angles are cut:
interpolation degrades with the sine of the largest angle alone (Babuska and Aziz, SIAM J. Numer. Anal. 13, 1976).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from scenes.errors import NumericsError
from scenes.model import ROUNDING

WIDEST = np.radians(140.0)  # angle of a triangle
# A tile with a sharp edge at one end is cut so far from that end, over its length: degree 3 then leaves as much of a
# power of the distance on either part, so that half as many cuts reach as near
# (`validate stress`: "constants").
NEAR = 0.25
UNIT = 1 << 36  # from one plane to the next: coordinates are whole numbers, of which equal ones are the same
ROUGHLY = UNIT >> 10  # multiples of which the middles of tiles are that several planes cross

Spans = tuple[tuple[int, int], tuple[int, int]]
"""The planes between which a tile lies, along both axes."""


@dataclass(frozen=True, eq=False)
class Tiles:
    """Tiles from ``low`` to ``high`` (n, 2), where each of the planes ``breaks`` (m) of the two axes is a `UNIT`
    further than the one before."""

    breaks: tuple[np.ndarray, ...]
    low: np.ndarray
    high: np.ndarray

    @staticmethod
    def of(breaks: tuple[np.ndarray, ...], rectangles: np.ndarray) -> Tiles:
        """Cover all ``rectangles`` (n, 2, 2), in numbers of planes, lines and points too, by the fewest tiles.

        A tile is halved along the line that outlines cover most, until no outline crosses a tile.
        """
        walls = [np.zeros((len(breaks[e]), len(breaks[1 - e]) - 1), bool) for e in range(2)]
        for ends in rectangles.tolist():
            for e, wall in enumerate(walls):
                first, last = ends[1 - e]
                # A point there stands at the end of a wall.
                first = min(first, wall.shape[1] - 1)
                wall[ends[e], first : max(last, first + 1)] = True
        sizes = [np.diff(b) for b in breaks]
        tiles, rest = list[Spans](), [((0, len(sizes[0])), (0, len(sizes[1])))]
        while rest:
            spans, shares = rest.pop(), []
            for e, (a, b) in enumerate(spans):
                lengths = sizes[1 - e][slice(*spans[1 - e])]
                shares.append(walls[e][a + 1 : b, slice(*spans[1 - e])] @ lengths / lengths.sum())
            most = [float(share.max(initial=0.0)) for share in shares]
            if not any(most):
                tiles.append(spans)
                continue
            e = int(most[1] > most[0])
            best = np.flatnonzero(shares[e] >= most[e] * (1 - 1e-9))
            (a, b), middle = spans[e], (len(shares[e]) - 1) / 2
            cut = a + 1 + int(best[np.abs(best - middle).argmin()])
            rest += [(half, spans[1]) if e == 0 else (spans[0], half) for half in ((a, cut), (cut, b))]
        corners = np.array(tiles, np.int64) * UNIT
        low, high = corners[..., 0], corners[..., 1]
        return Tiles(breaks, low, high).finer(np.zeros(low.shape, bool))[0]

    @property
    def _sizes(self) -> np.ndarray:
        """(tiles, 2): in m."""
        ends = zip(self.breaks, self.low.T, self.high.T, strict=True)
        return np.column_stack([metres(b, high) - metres(b, low) for b, low, high in ends])

    @cached_property
    def _corners(self) -> tuple[list[np.ndarray], list[np.ndarray], np.ndarray]:
        """Per axis the coordinates of all corners, and the corners in the order of the other axis, then this one, as a
        number made of their places among these; and (corners, 2) the places in the order of the first axis."""
        values = [np.unique(np.concatenate([self.low[:, e], self.high[:, e]])) for e in range(2)]
        ends = (self.low, self.high)
        x, y = (np.column_stack([np.searchsorted(v, s[:, e]) for s in ends]) for e, v in enumerate(values))
        width, height = len(values[0]), len(values[1])
        along = np.unique((y[:, [0, 0, 1, 1]] * width + x[:, [0, 1, 0, 1]]).ravel())
        places = np.column_stack([along % width, along // width])
        return values, [along, np.sort(places[:, 0] * height + places[:, 1])], places

    @property
    def places(self) -> np.ndarray:
        """(points, 2): all corners."""
        values, _, order = self._corners
        return np.column_stack([values[e][order[:, e]] for e in range(2)])

    @cached_property
    def points(self) -> np.ndarray:
        """(points, 2): all corners, in m."""
        return np.column_stack([metres(b, self.places[:, e]) for e, b in enumerate(self.breaks)])

    def _on_sides(self, axis: int) -> np.ndarray:
        """(tiles, 2 sides, 2): the first corner inside each side along an axis, and the next after the last."""
        values, keys, _ = self._corners
        ends = [np.searchsorted(values[axis], each[:, axis]) for each in (self.low, self.high)]
        across = [np.searchsorted(values[1 - axis], each[:, 1 - axis]) for each in (self.low, self.high)]
        at = np.array([[a * len(values[axis]) + e for e in ends] for a in across])
        return np.moveaxis(np.searchsorted(keys[axis], at) + np.array([1, 0])[:, None], 2, 0)

    def _cut(self, axis: int, which: np.ndarray, at: np.ndarray | float, part: float) -> tuple[Tiles, np.ndarray]:
        """Cut some tiles (n,) across an axis; return the tiles, and (tiles,) their parents.

        The cut is at the distance ``at`` (n,), or for all, from the low side, over the length, or at the nearest corner
        on the sides of the tile, if it is nearer than a ``part`` of the way to either end.
        """
        values, keys, _ = self._corners
        count = len(values[axis])
        ends = np.array([metres(self.breaks[axis], each[which, axis]) for each in (self.low, self.high)])
        middle = ends[0] + at * (ends[1] - ends[0])
        whole = self.low[which, axis] // UNIT == (self.high[which, axis] - 1) // UNIT
        number = np.interp(middle, self.breaks[axis], np.arange(len(self.breaks[axis])))
        rough = (np.round(number * (UNIT // ROUGHLY)) * ROUGHLY).astype(np.int64)
        rough = rough.clip(self.low[which, axis] + 1, self.high[which, axis] - 1)
        within = self.low[which, axis] + ((self.high[which, axis] - self.low[which, axis]) * at).astype(np.int64)
        best = np.where(whole, within, rough)
        off = part * np.minimum(at, 1 - at) * (ends[1] - ends[0])
        place = np.searchsorted(values[axis], best)
        for side in self._on_sides(axis)[which].swapaxes(0, 1):
            line = np.minimum(side[:, 0] - 1, len(keys[axis]) - 1)
            start = keys[axis][line] // count * count
            beside = np.searchsorted(keys[axis], start + place)
            for near in (beside - 1, beside):
                valid = (near >= side[:, 0]) & (near < side[:, 1])
                value = values[axis][keys[axis][near.clip(0, len(keys[axis]) - 1)] % count]
                distance = np.where(valid, np.abs(metres(self.breaks[axis], value) - middle), np.inf)
                best, off = np.where(distance < off, value, best), np.minimum(distance, off)
        low, high = self.low.copy(), self.high.copy()
        high[which, axis] = best
        second = low[which]
        second[:, axis] = best
        parents = np.concatenate([np.arange(len(low)), which])
        return Tiles(self.breaks, np.concatenate([low, second]), np.concatenate([high, self.high[which]])), parents

    def finer(self, cut: np.ndarray, near: np.ndarray | None = None) -> tuple[Tiles, np.ndarray]:
        """Cut tiles along each axis (tiles, 2), ``near`` either end (tiles, 2, 2) or in the middle.

        Neighbours are cut until all triangles are fit. Return the tiles, and (tiles,) their parents.
        """
        tiles, parents = self, np.arange(len(self.low))
        at = np.full(cut.shape, 0.5) if near is None else share(near)
        for axis in range(2):
            which = np.flatnonzero(cut[parents, axis])
            if len(which):
                # At a corner of another tile, if that is less than half the way to an end away.
                tiles, parent = tiles._cut(axis, which, at[parents[which], axis], 0.5)
                parents = parents[parent]
        for _ in range(200):  # rounds of cuts that follow from others
            wrong = tiles._wrong()
            if not (wrong >= 0).any():
                return tiles, parents
            for axis in range(2):
                which = np.flatnonzero(wrong == axis)
                if len(which):
                    wrong[which] = -1
                    tiles, parent = tiles._cut(axis, which, 0.5, 1.0)
                    wrong, parents = wrong[parent], parents[parent]
        raise NumericsError(
            "the outlines of boxes lie so close to one another that no triangles are found between them"
        )

    def _wrong(self) -> np.ndarray:
        """(tiles,): along which axis each is to be cut, as a triangle has a wide angle; -1 for none."""
        triangles, tiles = self.triangles
        corners = self.points[triangles]
        sides = np.linalg.norm(np.roll(corners, -1, axis=1) - np.roll(corners, 1, axis=1), axis=2)
        sides.sort(axis=1)
        a, b, c = sides.T
        wide = np.unique(tiles[(a**2 + b**2 - c**2) / (2 * a * b) < np.cos(WIDEST)])
        wrong = np.full(len(self.low), -1)
        wrong[wide] = self._sizes[wide].argmax(axis=1)
        return wrong

    @cached_property
    def triangles(self) -> tuple[np.ndarray, np.ndarray]:
        """The triangles (n, 3), in numbers of `points`, and the tile (n,) of each."""
        values, _, places = self._corners
        numbers = np.arange(len(places)), np.argsort(places[:, 0] * len(values[1]) + places[:, 1])
        sides = [self._on_sides(e) for e in range(2)]
        every = np.arange(1 + max(int(np.ptp(s, axis=2).max()) for s in sides))
        chains = []
        # Around each tile, from one of its corners to the next without this.
        for axis, side, step in ((0, 0, 1), (1, 1, 1), (0, 1, -1), (1, 0, -1)):
            first, last = sides[axis][:, side].T
            inside = every <= (last - first)[:, None]
            at = (first - 1 if step == 1 else last)[:, None] + step * every
            chains.append(np.where(inside, numbers[axis][np.where(inside, at, 0)], -1))
        rings = np.concatenate(chains, axis=1)
        rings = np.take_along_axis(rings, np.argsort(rings < 0, axis=1, kind="stable"), axis=1)
        return _clipped(self.points, rings, self._sizes.prod(axis=1))


def metres(planes: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Coordinates in m along an axis with these ``planes``."""
    return np.asarray(np.interp(at, np.arange(len(planes)) * float(UNIT), planes))


def share(near: np.ndarray) -> np.ndarray:
    """(...): how far from its low end something is cut, over its length: `NEAR` one end or the other (..., 2), or in
    the middle where neither or both ask for it."""
    low, high = near[..., 0], near[..., 1]
    return np.where(low == high, 0.5, np.where(low, NEAR, 1 - NEAR))


def _clipped(points: np.ndarray, rings: np.ndarray, areas: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Triangles (n, 3) of convex ``rings`` (m, corners) of points, -1 after the last, some in line, of ``areas`` (m,),
    and (n,) the ring of each: the corner whose triangle has the least widest angle is cut off first."""
    triangles, owners, number, count = [], [], np.arange(len(rings)), (rings >= 0).sum(axis=1)
    whole = 2 * areas
    while True:
        done = count == 3
        triangles.append(rings[done, :3])
        owners.append(number[done])
        rings, number, count, whole = rings[~done], number[~done], count[~done], whole[~done]
        if not len(rings):
            return np.concatenate(triangles), np.concatenate(owners)
        rings = rings[:, : count.max()]
        i = np.arange(rings.shape[1])
        before = np.where(i > 0, i - 1, count[:, None] - 1)
        after = np.where(i + 1 < count[:, None], i + 1, 0)
        a, p, b = (points[np.take_along_axis(rings, at, axis=1)] for at in (before, i[None] + 0 * before, after))
        to_a, to_b, across = a - p, b - p, b - a
        area = to_b[..., 0] * to_a[..., 1] - to_b[..., 1] * to_a[..., 0]
        area[i >= count[:, None]] = 0.0
        squares = np.sort([(s**2).sum(axis=-1) for s in (to_a, to_b, across)], axis=0)
        with np.errstate(divide="ignore", invalid="ignore"):
            widest = (squares[2] - squares[0] - squares[1]) / (2 * np.sqrt(squares[0] * squares[1]))
            # The smallest triangle among equals.
            score = widest + 1e-3 * squares[2] / squares[2].max(axis=1, keepdims=True)
        least = ROUNDING * whole[:, None]
        score[(area <= least) | (whole[:, None] - area <= least)] = np.inf
        rows, best = np.arange(len(rings)), score.argmin(axis=1)
        three = (before[rows, best], best, after[rows, best])
        triangles.append(np.column_stack([rings[rows, at] for at in three]))
        owners.append(number)
        whole = whole - area[rows, best]
        rings = rings[i[None] != best[:, None]].reshape(len(rings), -1)
        count = count - 1
