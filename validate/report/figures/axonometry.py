"""A scene of boxes as a drawing: its visible faces and edges on paper, in the order in which they cover each other, and
where on paper each box can be seen.

The view is parallel, from the front right and from above. Each axis is stretched so that nothing is too thin to be
seen: by a round factor as a whole, and between two neighbouring faces of boxes to a least width.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from scenes.free.grid import VOID, grid_of
from scenes.model import Point, Scene

AZIMUTH, ELEVATION = np.radians(24.0), np.radians(32.0)
SLENDER = 0.16
"""The least extent of an axis on paper, relative to the longest horizontal one."""
THIN, SHARE = 0.028, 0.35
"""The least gap between faces, relative to the longest extent, and the part of it that all gaps take at most."""
ROUND = (1.0, 1.5, 2.0, 3.0, 5.0, 7.0, 10.0)
"""Factors by which an axis is stretched, times powers of ten."""
PIXELS = 700
"""Width of the hidden picture by which visible parts of boxes are found."""
SEEN = 12
"""The least number of its pixels for a box to count as visible."""
_SIDES = {"front": (1, -1), "right": (0, 1), "top": (2, 1)}
"""The visible sides: their axis on paper, and direction."""


@dataclass(frozen=True)
class Drawing:
    """A scene on paper. ``axes``: which of x, y, z goes to the right, away and up; ``planes`` (m) of boxes along each
    of these, ascending on paper, and where they are ``drawn``; ``factors`` by which these are stretched as a whole, and
    whether ``thickened`` is any gap beyond that."""

    scene: Scene
    axes: tuple[int, int, int]
    planes: tuple[np.ndarray, ...]
    drawn: tuple[np.ndarray, ...]
    factors: tuple[float, float, float]
    thickened: bool
    owner: np.ndarray

    def place(self, points: np.ndarray) -> np.ndarray:
        """(n, 2): where points (n, 3) of the scene (m) are on paper; those outside of it at its rim."""
        return _on_paper(self.stretched(points))

    def stretched(self, points: np.ndarray) -> np.ndarray:
        """(n, 3): how far points of the scene (m) are to the right, away and up, over the longest horizontal extent."""
        three = []
        for axis, planes, drawn in zip(self.axes, self.planes, self.drawn, strict=True):
            order = np.argsort(planes)
            three.append(np.interp(points[:, axis], planes[order], drawn[order]))
        return np.column_stack(three)

    def facing(self, lower: Point, upper: Point) -> bool:
        """Whether a flat box lies on sides of boxes that are turned to the eye."""
        near, far = list[Any](), list[Any]()
        for place, (axis, planes) in enumerate(zip(self.axes, self.planes, strict=True)):
            sign = 1 if planes[-1] > planes[0] else -1
            ends = sorted(sign * c for c in (lower[axis], upper[axis]))
            middles = sign * (planes[1:] + planes[:-1]) / 2
            if ends[0] < ends[1]:
                between = np.flatnonzero((middles > ends[0]) & (middles < ends[1])) + 1
                near.append(between)
                far.append(between)
                continue
            # Cells are counted from 1 on, those outside being void; of two beside a plane the one before it is nearer
            # where the axis goes away.
            before = int(np.abs(sign * planes - ends[0]).argmin())
            near.append(np.array([before + (place != 1)]))
            far.append(np.array([before + (place == 1)]))
        owner = np.pad(self.owner, 1, constant_values=VOID)
        return bool(((owner[np.ix_(*far)] != VOID) & (owner[np.ix_(*near)] == VOID)).any())

    @cached_property
    def extent(self) -> tuple[np.ndarray, np.ndarray]:
        """The lower left and the upper right corner of the drawing."""
        corners = self.faces.corners.reshape(-1, 2)
        return corners.min(axis=0), corners.max(axis=0)

    @cached_property
    def faces(self) -> Faces:
        return _faces(self)

    @cached_property
    def seen(self) -> dict[int, np.ndarray]:
        """A place (2,) on paper in the visible part of a box (by number), as far from its rim as can be."""
        from PIL import Image, ImageDraw
        from scipy.ndimage import distance_transform_edt, find_objects

        faces, (low, high) = self.faces, self.extent
        scale = PIXELS / float(max(high - low))
        wide, tall = ((high - low) * scale).astype(int).tolist()
        image = Image.new("I", (wide + 3, tall + 3), 0)
        draw = ImageDraw.Draw(image)
        for corners, owner in zip((faces.corners - low) * scale + 1, faces.owner.tolist(), strict=True):
            draw.polygon([tuple(c) for c in corners.tolist()], fill=owner + 1)
        pixels = np.asarray(image)
        places = {}
        for number, window in enumerate(find_objects(pixels)):
            mask = np.pad(pixels[window] == number + 1, 1) if window else np.zeros(0)
            if mask.sum() >= SEEN:
                row, column = np.unravel_index(int(distance_transform_edt(mask).argmax()), mask.shape)
                place = np.array([window[1].start + column, window[0].start + row])
                places[number] = low + (place - 1.5) / scale
        return places


@dataclass(frozen=True)
class Faces:
    """Visible faces from far to near: ``corners`` (n, 4, 2) on paper, the box's number (``owner``), the ``side`` (of
    `_SIDES`), and which of the four edges are edges of the box (n, 4)."""

    corners: np.ndarray
    owner: np.ndarray
    side: np.ndarray
    edges: np.ndarray


def drawing(scene: Scene) -> Drawing:
    """The drawing of a scene that was checked."""
    grid = grid_of(replace(scene, boundaries=(), probes=()))
    extents = [float(np.ptp(planes)) for planes in grid.planes]
    along = 0 if extents[0] >= extents[1] else 1
    # With y to the right it is -x that goes away, so that the three stay a right-handed system.
    axes, signs = ((0, 1, 2), (1, 1, 1)) if along == 0 else ((1, 0, 2), (1, -1, 1))
    length = extents[along]
    planes, drawn, factors, thickened = [], [], [], False
    owner = grid.owner.transpose(axes)
    for place, (axis, sign) in enumerate(zip(axes, signs, strict=True)):
        axis_planes = grid.planes[axis][::sign]
        factor = _round_up(SLENDER * length / extents[axis])
        gaps = np.abs(np.diff(axis_planes)) * factor
        least = min(THIN, SHARE / len(gaps)) * length
        thickened |= bool((gaps < 0.98 * least).any())
        gaps = np.maximum(gaps, least)
        planes.append(axis_planes)
        drawn.append(np.concatenate([[0.0], np.cumsum(gaps)]) / length)
        factors.append(factor)
        owner = owner if sign == 1 else np.flip(owner, axis=place)
    return Drawing(scene, axes, tuple(planes), tuple(drawn), (factors[0], factors[1], factors[2]), thickened, owner)


def _round_up(factor: float) -> float:
    """A round number that is not smaller, 1 at least."""
    power = 10.0 ** max(np.floor(np.log10(factor)), 0.0)
    return float(next(r * power for r in ROUND if r * power >= 0.999 * factor))


def _on_paper(three: np.ndarray) -> np.ndarray:
    """(..., 2): of points (..., 3) that go to the right, away and up."""
    right, away, up = np.moveaxis(three, -1, 0)
    x = right * np.cos(AZIMUTH) + away * np.sin(AZIMUTH)
    y = (away * np.cos(AZIMUTH) - right * np.sin(AZIMUTH)) * np.sin(ELEVATION) + up * np.cos(ELEVATION)
    return np.stack([x, y], axis=-1)


def _faces(drawing: Drawing) -> Faces:
    owner, solid = drawing.owner, drawing.owner != VOID
    parts = []
    for side, (axis, direction) in enumerate(_SIDES.values()):
        first, second = (a for a in range(3) if a != axis)
        bare = solid & ~_shifted(solid, axis, direction, 0)
        cells = np.argwhere(bare)
        if not len(cells):
            continue
        at = cells.copy()
        at[:, axis] += direction > 0
        turns = [(0, 0), (1, 0), (1, 1), (0, 1)]
        corners = np.repeat(at[:, None, :], 4, axis=1)
        for n, (a, b) in enumerate(turns):
            corners[:, n, first] += a
            corners[:, n, second] += b
        three = np.stack([drawing.drawn[a][corners[..., a]] for a in range(3)], axis=-1)
        rims = []
        for along, step in ((first, -1), (second, -1), (first, 1), (second, 1)):
            same = _shifted(bare, along, step, 0) & (_shifted(owner, along, step, VOID) == owner)
            rims.append(~same[tuple(cells.T)])
        parts.append((cells, _on_paper(three), owner[tuple(cells.T)], np.full(len(cells), side), np.column_stack(rims)))
    cells, corners, owners, sides, edges = (np.concatenate(each) for each in zip(*parts, strict=True))
    order = np.lexsort((cells[:, 2], cells[:, 0], -cells[:, 1]))
    return Faces(corners[order], owners[order], sides[order], edges[order])


def _shifted(values: np.ndarray, axis: int, step: int, outside: int) -> np.ndarray:
    """What each cell's neighbour has, one step along an axis."""
    padded = np.pad(values, [(1, 1) if a == axis else (0, 0) for a in range(3)], constant_values=outside)
    return np.take(padded, np.arange(1, values.shape[axis] + 1) + step, axis=axis)
