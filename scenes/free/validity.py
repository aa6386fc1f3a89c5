"""Whether a free scene can be solved: every refusal that needs no numerics, each one sentence that names the part."""

from __future__ import annotations

from scenes.model import Scene


def check(scene: Scene) -> Scene:
    """The scene with corners that differ by rounding made equal, and flat boxes cut to the extent of the solid.

    Raises SceneError for boxes without volume or entirely covered by later ones; boundaries that are not flat, or that
    touch nothing they could act on, or that contradict each other; probes of what is not there; parts that are left
    floating, and what nothing drives. Lengths below 1e-9 of the extent count as nothing.
    """
    from scenes.free import boxes, conditions, drives, parts, probes
    from scenes.free.grid import grid_of
    from scenes.free.tidy import tidy

    boxes.check_extents(scene)
    grid = grid_of(scene)
    boxes.check_hidden(scene, grid)
    boxes.check_resistivity(scene)
    conditions.check(scene, grid)
    probes.check(scene, grid)
    parts.check(scene, grid)
    drives.check(scene, grid)
    return tidy(scene, grid)
