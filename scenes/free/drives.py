"""Scenes in which nothing happens."""

from __future__ import annotations

from scenes import physics
from scenes.errors import SceneError
from scenes.free.boxes import conducting
from scenes.free.grid import Grid
from scenes.free.parts import connected, labels_at
from scenes.model import Boundary, Box, GroupBoundary, Scene, Value, is_zero, values


def check(scene: Scene, grid: Grid) -> None:
    """Refuses a scene that stays as it starts: all at the initial temperature, and no voltage across a conductor."""
    if any(heats(b, scene.initial_temperature) for b in scene.boundaries) or any(_generates(b) for b in scene.boxes):
        return
    if _carries_current(scene, grid):
        return
    has = "no voltage across a conductor, " if physics.electric(scene) else ""
    raise SceneError(
        f"nothing happens in this scene: it has {has}no heat source, no flux, and no temperature other than "
        f"scene.initial_temperature = {scene.initial_temperature:g} K: give at least one"
    )


def heats(boundary: Boundary | GroupBoundary, initial: float) -> bool:
    """Whether a boundary changes a solid that is at an initial temperature (K)."""
    if boundary.kind == "temperature":
        return _other_than(boundary.value, initial)
    if boundary.kind == "heat_flux":
        return not is_zero(boundary.value)
    return boundary.kind == "convection" and boundary.value != 0 and _other_than(boundary.ambient, initial)


def _generates(box: Box) -> bool:
    return not is_zero(box.heat_source)


def _other_than(value: Value, fixed: float) -> bool:
    return any(v != fixed for v in values(value))


def _carries_current(scene: Scene, grid: Grid) -> bool:
    electrodes = [b for b in scene.boundaries if b.kind == "voltage"]
    if len({b.value for b in electrodes}) < 2:
        return False
    labels = connected(grid, conducting(scene))
    levels: dict[int, set[Value]] = {}
    for boundary in electrodes:
        for label in labels_at(scene, grid, labels, boundary):
            levels.setdefault(label, set()).add(boundary.value)
    return any(len(found) > 1 for found in levels.values())
