"""Parts of a mesh, and of its conductors, that nothing acts on or that heat cannot leave; scenes that stay at rest."""

from __future__ import annotations

import numpy as np

from meshes.grouped.place import Placed
from scenes import physics
from scenes.errors import SceneError, listed
from scenes.free.drives import heats
from scenes.free.parts import FLOATING, KEPT, UNFIXED, is_exit
from scenes.model import is_zero


def check(placed: Placed) -> None:
    """Refuses conductors without a fixed voltage, floating parts, parts without an exit, and scenes at rest."""
    scene, mesh = placed.scene, placed.mesh
    parts = mesh.parts(np.ones(mesh.count, bool))
    if physics.electric(scene):
        conductors = mesh.parts(placed.conducting)
        electrodes = [b for b in scene.boundaries if b.kind == "voltage"]
        _refuse(placed, conductors, placed.touched(conductors, electrodes), UNFIXED)
    acted = placed.touched(parts, scene.boundaries)
    for source in scene.sources:
        if not is_zero(source.heat_source):
            acted |= set(parts[mesh.volumes[source.group]].tolist())
    _refuse(placed, parts, acted, FLOATING)
    if scene.steady and physics.heat(scene):
        _refuse(placed, parts, placed.touched(parts, [b for b in scene.boundaries if is_exit(b)]), KEPT)
    if any(heats(b, scene.initial_temperature) for b in scene.boundaries):
        return
    if any(not is_zero(s.heat_source) for s in scene.sources) or placed.conductors[0].any():
        return
    raise SceneError(
        "nothing happens in this scene: it has no voltage across a conductor, no heat source, no flux, and no "
        f"temperature other than scene.initial_temperature = {scene.initial_temperature:g} K: give at least one"
    )


def _refuse(placed: Placed, parts: np.ndarray, fine: set[int], why: tuple[str, str]) -> None:
    for part in range(1, int(parts.max(initial=0)) + 1):
        if part not in fine:
            own = parts == part
            names = [name for name, cells in placed.mesh.volumes.items() if own[cells].any()]
            said = why[0].split("|")[0]
            raise SceneError(f"a part of {int(own.sum())} cells of group {listed(names)} {said}: {why[1]}")
