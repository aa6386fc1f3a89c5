"""What is to be found of a scene on a mesh, in the terms of `fem3d.probe_quantities`."""

from __future__ import annotations

from typing import Any

from fem3d.probe_quantities import CAUTION, EARLY, LATE, OF_GRADIENT, scales, values
from fem3d.study import Study
from meshes.grouped.place import Placed
from scenes.meshed.model import GroupProbe

_WHOLE: Any = None  # a study's part of boxes, which a mesh has none of


def study(placed: Placed) -> Study:
    """The quantities of a scene on its mesh, and how well they are to be known."""
    scene = placed.scene
    untyped: Any = scene
    thermal = tuple(p.name for p in scene.probes if p.quantity == "temperature")
    instants = tuple(t for t in scene.output_times if 0 < t <= scene.end_time)
    return Study(
        _WHOLE, scene.accuracy, 0.0, scene.end_time,
        min(*instants, LATE * scene.end_time) if instants else EARLY * scene.end_time, scene.output_times,
        goals={p.name: p.name for p in scene.probes}, rises=thermal, trace_rises=thermal, ratios={},
        caution={p.name: OF_GRADIENT / CAUTION for p in scene.probes if _is_gradient(placed, p)},
        steady=lambda out: values(untyped, out), traces=lambda out: values(untyped, out),
        steady_scales=lambda out: scales(untyped, out), trace_scales=lambda out: scales(untyped, out),
    )  # fmt: skip


def _is_gradient(placed: Placed, probe: GroupProbe) -> bool:
    """Whether a probe is a flow through the inside of the solid, where it is an integral of the gradient."""
    if probe.quantity not in ("heat_flow", "current") or placed.covered(probe):
        return False
    return not placed.mesh.exposed(placed.mesh.surfaces[probe.group or ""]).all()
