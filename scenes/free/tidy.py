"""Corners that differ by rounding only, made equal; flat boxes cut to the extent of the solid."""

from __future__ import annotations

from dataclasses import replace
from typing import TypeVar

import numpy as np

from scenes.free.grid import Grid
from scenes.model import Boundary, Box, Point, Probe, Scene

T = TypeVar("T", Box, Boundary, Probe)


def tidy(scene: Scene, grid: Grid) -> Scene:
    """The same scene with every corner that is within rounding of a plane of the grid on it, and none beyond the
    extent of the solid. What has been checked on the grid holds for it, and tidying it again changes nothing."""
    return replace(
        scene,
        boxes=tuple(_tidy(grid, box) for box in scene.boxes),
        boundaries=tuple(_tidy(grid, boundary) for boundary in scene.boundaries),
        probes=tuple(_tidy(grid, probe) for probe in scene.probes),
    )


def _tidy(grid: Grid, item: T) -> T:
    return replace(item, lower=_corner(grid, item.lower), upper=_corner(grid, item.upper))


def _corner(grid: Grid, corner: Point) -> Point:
    x, y, z = (_coordinate(grid, axis, c) for axis, c in enumerate(corner))
    return x, y, z


def _coordinate(grid: Grid, axis: int, c: float) -> float:
    planes = grid.planes[axis]
    nearest = float(planes[np.abs(planes - c).argmin()])
    if abs(nearest - c) <= 1.5 * grid.small[axis]:
        return nearest
    return min(max(c, float(planes[0])), float(planes[-1]))
