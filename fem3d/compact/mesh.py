"""The problem that a compact model is projected from, on a mesh for the responses to all inputs at once."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from fem3d.adaptivity.adapt import adapt
from fem3d.problems.current import Conductor
from fem3d.problems.heat import HeatProblem
from fem3d.results.outputs import Outputs
from fem3d.runs import probe_quantities
from fem3d.runs import scene as scene_run
from meshes.symmetry import Symmetry
from scenes import physics
from scenes.model import AnyScene, MeshScene, Value
from statespace.channels import Channel, apart, driven

# The step of each given temperature is this fraction of the one before, and of the other sign: equal steps would cancel
# out.
LESS = 0.8
FARTHEST = 0.2  # a step of a temperature changes a resistivity by at most this fraction


def problem(
    scene: AnyScene, channels: tuple[Channel, ...], accuracy: float, rise: float, scales: dict[str, float]
) -> tuple[HeatProblem, Conductor | None, Symmetry]:
    """The heat problem and the conductor with a channel for each input, where they hold ``accuracy`` for inputs that
    together make rises of the size ``rise`` (K), relative to ``scales`` or more, as such rises may cancel out in a
    probe; and the part that is solved."""
    named = apart(scene, channels)
    start, mixed = None, _mixed(scene, channels, rise)
    if isinstance(named, MeshScene):
        part, start = scene_run.part_of(named, True), scene_run.on_file(named)
        start = start.with_scene(replace(driven(named, mixed), accuracy=accuracy))
    else:
        start = scene_run.start(replace(driven(named, mixed), accuracy=accuracy))[1]
        start = start if start.whole else None
        part = scene_run.part_of(named, start is not None)
    mixed_scene = replace(driven(scene, mixed), accuracy=accuracy)
    mixed_part = replace(part, scene=replace(driven(part.scene, mixed), accuracy=accuracy))

    def largest(out: Outputs) -> dict[str, float]:
        return {name: max(scale, scales[name]) for name, scale in probe_quantities.scales(mixed_scene, out, {}).items()}

    study = replace(
        probe_quantities.study(mixed_scene, mixed_part),
        field=None,
        extrapolated=False,
        steady_scales=largest,
        trace_scales=largest,
    )
    mesh: Any = adapt(study, not scene.steady, mesh=start, with_steady=scene.steady).mesh
    given = mesh.with_scene(replace(part.scene, accuracy=accuracy)).problems()
    return given.heat, given.conductor, part


def _mixed(scene: AnyScene, channels: tuple[Channel, ...], rise: float) -> dict[str, Value]:
    """A value for each input: voltages, sources and fluxes as they are in the scene, temperatures apart."""
    conductors = (m for m in physics.materials(scene) if m.resistivity is not None)
    steepest = max((abs(m.temperature_coefficient) for m in conductors), default=0.0)
    size = min(max(rise, 1.0), FARTHEST / max(steepest, 1e-300))
    values: dict[str, Value] = {}
    for c in channels:
        if c.kind in ("temperature", "ambient"):
            values[c.name] = c.rest + size
            size *= -LESS
        else:
            values[c.name] = c.largest
    return values
