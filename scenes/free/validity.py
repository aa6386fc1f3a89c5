"""Whether a free scene can be solved: every refusal that needs no numerics, each one sentence that names the part."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, TypeVar

from scenes import physics
from scenes.dimensions import extent
from scenes.errors import SceneError, quoted
from scenes.model import Boundary, Box, Point, Probe, Scene

if TYPE_CHECKING:
    from scenes.free.grid import Grid

T = TypeVar("T", Box, Boundary, Probe)


def check(scene: Scene) -> Scene:
    """The scene with corners that differ by rounding made equal, and flat boxes cut to the extent of the solid.

    Raises SceneError for boxes without volume or entirely covered by later ones; boundaries that are not flat, or that
    touch nothing they could act on, or that contradict each other; probes of what is not there; parts that are left
    floating, and what nothing drives. Lengths below 1e-9 of the extent count as nothing.
    """
    from scenes.free import conditions, parts, probes
    from scenes.free.grid import grid_of

    _check_extents(scene)
    grid = grid_of(scene)
    _check_hidden(scene, grid)
    if physics.electric(scene):
        for material in dict.fromkeys(physics.materials(scene)):
            label = f"material {quoted(material.name)}"
            where = f"scene.initial_temperature = {scene.initial_temperature:g} K"
            physics.check_resistivity(material, label, where, scene.initial_temperature)
    conditions.check(scene, grid)
    probes.check(scene, grid)
    parts.check(scene, grid)
    parts.check_driven(scene, grid)
    return _tidy(scene, grid)


def _check_extents(scene: Scene) -> None:
    """Refuses boxes of no or negative extent."""
    from scenes.free.grid import ROUNDING

    for axis in range(3):
        low, high = min(b.lower[axis] for b in scene.boxes), max(b.upper[axis] for b in scene.boxes)
        for box in scene.boxes:
            if not box.upper[axis] - box.lower[axis] > ROUNDING * (high - low):
                kind = "no" if box.upper[axis] >= box.lower[axis] else "a negative"
                raise SceneError(
                    f"box {quoted(box.name)} has {kind} extent, {extent(axis, box.lower, box.upper)}: give an upper "
                    "corner above the lower one"
                )


def _check_hidden(scene: Scene, grid: Grid) -> None:
    """Refuses boxes of which later ones leave nothing."""
    import numpy as np

    seen = set(np.unique(grid.owner).tolist())
    for number, box in enumerate(scene.boxes):
        if number not in seen:
            raise SceneError(
                f"box {quoted(box.name)} is entirely covered by later ones, which win: leave it out, or put it "
                "after them"
            )


def _tidy(scene: Scene, grid: Grid) -> Scene:
    """The same scene with every corner that is within rounding of a plane of the grid on it, and none beyond the
    extent of the solid. What has been checked on the grid holds for it, and tidying it again changes nothing."""
    return replace(
        scene,
        boxes=tuple(_tidied(grid, box) for box in scene.boxes),
        boundaries=tuple(_tidied(grid, boundary) for boundary in scene.boundaries),
        probes=tuple(_tidied(grid, probe) for probe in scene.probes),
    )


def _tidied(grid: Grid, item: T) -> T:
    return replace(item, lower=_corner(grid, item.lower), upper=_corner(grid, item.upper))


def _corner(grid: Grid, corner: Point) -> Point:
    x, y, z = (_coordinate(grid, axis, c) for axis, c in enumerate(corner))
    return x, y, z


def _coordinate(grid: Grid, axis: int, c: float) -> float:
    planes = grid.planes[axis]
    nearest = float(planes[abs(planes - c).argmin()])
    if abs(nearest - c) <= 1.5 * grid.small[axis]:
        return nearest
    return min(max(c, float(planes[0])), float(planes[-1]))
