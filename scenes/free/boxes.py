"""Boxes that have no volume or no part in the solid, and materials that do not conduct as they say."""

from __future__ import annotations

import numpy as np

from scenes import physics
from scenes.dimensions import extent
from scenes.errors import SceneError, quoted
from scenes.free.grid import ROUNDING, Grid
from scenes.model import Scene


def check_extents(scene: Scene) -> None:
    """Refuses boxes of no or negative extent."""
    for axis in range(3):
        low, high = min(b.lower[axis] for b in scene.boxes), max(b.upper[axis] for b in scene.boxes)
        for box in scene.boxes:
            if not box.upper[axis] - box.lower[axis] > ROUNDING * (high - low):
                kind = "no" if box.upper[axis] >= box.lower[axis] else "a negative"
                raise SceneError(
                    f"box {quoted(box.name)} has {kind} extent, {extent(axis, box.lower, box.upper)}: give an upper "
                    "corner above the lower one"
                )


def check_hidden(scene: Scene, grid: Grid) -> None:
    """Refuses boxes of which later ones leave nothing."""
    seen = set(np.unique(grid.owner).tolist())
    for number, box in enumerate(scene.boxes):
        if number not in seen:
            raise SceneError(
                f"box {quoted(box.name)} is entirely covered by later ones, which win: leave it out, or put it "
                "after them"
            )


def check_resistivity(scene: Scene) -> None:
    """Refuses resistivities that are not positive at the initial temperature."""
    if not physics.electric(scene):
        return
    for material in dict.fromkeys(box.material for box in scene.boxes):
        factor = 1 + material.temperature_coefficient * (scene.initial_temperature - material.reference_temperature)
        if material.resistivity is not None and factor <= 0:
            raise SceneError(
                f"material {quoted(material.name)}.temperature_coefficient = {material.temperature_coefficient:g} 1/K "
                f"makes the resistivity {factor:.3g} times its reference value at scene.initial_temperature = "
                f"{scene.initial_temperature:g} K: give values that keep 1 + coefficient * (that - reference "
                "temperature) above 0"
            )


def conducting(scene: Scene) -> np.ndarray:
    """(boxes + 1,): which boxes conduct, and False for VOID, by the owner's number."""
    return np.array([*(box.material.resistivity is not None for box in scene.boxes), False])


def solid(scene: Scene) -> np.ndarray:
    """(boxes + 1,): True for every box, False for VOID."""
    return np.array([True] * len(scene.boxes) + [False])
