"""Check a scene of boxes: the extents of its items, and the rules of `scenes.free.rules` on its grid."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations
from typing import TypeVar

import numpy as np

from scenes.errors import SceneError, quoted
from scenes.free import rules
from scenes.free.grid import Grid, grid_of
from scenes.free.structure import gaps
from scenes.model import FLOWS, ROUNDING, Boundary, Box, Point, Probe, Scene
from scenes.units import extent

T = TypeVar("T", Box, Boundary, Probe)


def check(scene: Scene) -> Scene:
    """Return the scene with nearly equal corners made equal, and flat boxes cut to the extent of the solid.

    Raises SceneError for boxes without volume or covered by later boxes, for boundaries and probes without the extent
    that they need, for flows that are infinite, and where `rules.check` does.
    """
    for axis in range(3):
        low, high = min(b.lower[axis] for b in scene.boxes), max(b.upper[axis] for b in scene.boxes)
        for box in scene.boxes:
            if not box.upper[axis] - box.lower[axis] > ROUNDING * (high - low):
                _refuse_extent("box", box, "no" if box.upper[axis] >= box.lower[axis] else "a negative", axis)
    grid = grid_of(scene)
    visible = set(np.unique(grid.owner).tolist())
    if hidden := [box.name for number, box in enumerate(scene.boxes) if number not in visible]:
        raise SceneError(
            f"box {quoted(hidden[0])} is entirely covered by later ones, which win: leave it out, or put it after them"
        )
    for b in scene.boundaries:
        _check_extent(grid, "boundary", b)
        if len(grid.flat(b.lower, b.upper)) != 1:
            raise SceneError(
                f"boundary {quoted(b.name)} is not flat: give corners that are equal along exactly one of x, y, z"
            )
        if not (grid.sides(grid.faces(b)) >= 0).any():
            raise SceneError(
                f"boundary {quoted(b.name)} touches no solid: give corners on a face of a box, or inside one"
            )
    for probe in scene.probes:
        _check_probe(grid, probe)
    rules.check(grid, lambda sentence: "; ".join([sentence, *gaps(grid)[:1]]))
    return tidy(grid)


def _check_extent(grid: Grid, kind: str, item: Boundary | Probe) -> None:
    for axis in range(3):
        if item.upper[axis] - item.lower[axis] < -grid.small[axis] * (kind == "boundary"):
            _refuse_extent(kind, item, "a negative", axis)


def _refuse_extent(kind: str, item: Box | Boundary | Probe, has: str, axis: int) -> None:
    raise SceneError(
        f"{kind} {quoted(item.name)} has {has} extent, {extent(axis, item.lower, item.upper)}: give an upper corner "
        "above the lower one"
    )


def _check_probe(grid: Grid, probe: Probe) -> None:
    """Refuse a probe of the wrong extent, flows of two directions, and flows past an edge of infinite flux."""
    _check_extent(grid, "probe", probe)
    flat = grid.flat(probe.lower, probe.upper)
    if probe.quantity == "power" and flat:
        raise SceneError(f"probe {quoted(probe.name)} asks for a power in what is no volume: give corners of one")
    if probe.quantity not in FLOWS:
        return
    if len(flat) != 1:
        raise SceneError(
            f"probe {quoted(probe.name)} asks for a {probe.quantity.replace('_', ' ')} through what is not flat: give "
            "lower and upper corners that are equal along exactly one of x, y, z"
        )
    faces, electric = grid.faces(probe), probe.quantity == "current"
    wanted = faces[grid.bordering(faces, grid.conducting if electric else grid.solid)]
    below, above = grid.sides(wanted) >= 0
    # Inside the solid a flow counts along the axis, on a condition that faces along the axis against it.
    for b in grid.scene.boundaries if (below & above).any() else ():
        if (b.kind == "voltage") == electric and np.isin(wanted[below & ~above], grid.faces(b)).any():
            raise SceneError(
                f"probe {quoted(probe.name)} lies partly inside the solid, where it counts along the axis, and partly "
                f"on boundary {quoted(b.name)}, where it counts into the solid: give one probe for each"
            )
    if not electric:
        _refuse_infinite(grid, probe, wanted)


def _refuse_infinite(grid: Grid, probe: Probe, faces: np.ndarray) -> None:
    """Refuse a flow past the edge at which two fixed temperatures meet, which is infinite.

    Near the edge the flux grows like one over the distance; the flow through both boundaries together is finite.
    """
    held = [(b, grid.acting(b)) for b in grid.scene.boundaries if b.kind == "temperature"]
    for (a, of_a), (b, of_b) in combinations(held, 2):
        edges = np.intersect1d(np.intersect1d(grid.edges(of_a), grid.edges(of_b)), grid.edges(faces))
        around = [of[np.isin(grid.edges(of), edges).any(axis=0)] for of in (of_a, of_b)]
        if a.value != b.value and not np.isin(np.concatenate(around), faces).all():
            raise SceneError(
                f"probe {quoted(probe.name)} reaches the edge at which boundaries {quoted(a.name)} and "
                f"{quoted(b.name)} meet with different temperatures, where infinite heat flows: leave a gap "
                "between them, or give corners short of that edge, or such that cover both"
            )


def tidy(grid: Grid) -> Scene:
    """Return the scene with its corners on the planes of the grid, where they are within rounding, and none beyond the
    solid. A tidy scene stays as it is."""

    def coordinate(axis: int, c: float) -> float:
        planes = grid.planes[axis]
        nearest = float(planes[abs(planes - c).argmin()])
        if abs(nearest - c) <= 1.5 * grid.small[axis]:
            return nearest
        return min(max(c, float(planes[0])), float(planes[-1]))

    def corner(at: Point) -> Point:
        x, y, z = (coordinate(axis, c) for axis, c in enumerate(at))
        return x, y, z

    def tidied(items: tuple[T, ...]) -> tuple[T, ...]:
        return tuple(replace(item, lower=corner(item.lower), upper=corner(item.upper)) for item in items)

    scene = grid.scene
    return replace(
        scene, boxes=tidied(scene.boxes), boundaries=tidied(scene.boundaries), probes=tidied(scene.probes)
    )  # fmt: skip
