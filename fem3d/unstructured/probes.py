"""How each probe of a scene on a mesh is read off fields at the nodes."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from fem3d.unstructured.conductor import two_sided
from fem3d.unstructured.extreme import Extreme
from fem3d.unstructured.heat import Heat
from fem3d.unstructured.space import FaceSpace
from meshes.grouped import shapes
from meshes.grouped.locate import locate
from scenes.meshed.model import GroupProbe


@dataclass(frozen=True, eq=False)
class Reading:
    """``row`` (all nodes,) times the field, or its ``extreme``; of a flow, those of ``boundaries`` are added."""

    row: np.ndarray | None = None
    extreme: Extreme | None = None
    boundaries: tuple[str, ...] = field(default=())


def reading(heat: Heat, probe: GroupProbe) -> Reading:
    """How a probe is read off a rise or, for an electric one, a potential; worked out once."""
    if probe.name not in heat.memo:
        heat.memo[probe.name] = _reading(heat, probe)
    found: Reading = heat.memo[probe.name]
    return found


def _reading(heat: Heat, probe: GroupProbe) -> Reading:
    placed, space = heat.placed, heat.space
    if probe.at is not None:
        inside = placed.conducting if probe.quantity == "potential" else None
        found = locate(space.mesh, np.array(probe.at), inside)
        assert found is not None, "points outside are refused before"
        row = np.zeros(space.size)
        row[space.dofs[found[0]]] = shapes.values(space.kind, space.degree, found[1][None])[0]
        return Reading(row)
    group = probe.group or ""
    if probe.quantity in ("heat_flow", "current"):
        covered = tuple(b.name for b in placed.covered(probe))
        return Reading(None if covered or probe.quantity == "current" else _through(heat, group), boundaries=covered)
    volume = group in placed.mesh.volumes and (probe.quantity != "potential" or _conducts(heat, group))
    faces, cells = None, np.empty(0, int)
    if volume:
        cells = placed.mesh.volumes[group]
    else:
        faces = placed.mesh.surfaces[group]
        if probe.quantity == "potential":
            faces = placed.beside(faces, placed.conducting)
    if probe.reduce != "mean":
        return Reading(extreme=Extreme(space, 1.0 if probe.reduce == "max" else -1.0, cells, faces))
    row = space.load(np.ones(1), cells) if faces is None else FaceSpace(space, faces).load()
    return Reading(row / row.sum())


def _conducts(heat: Heat, group: str) -> bool:
    return bool(heat.placed.conducting[heat.placed.mesh.volumes[group]].all())


def _through(heat: Heat, group: str) -> np.ndarray:
    """(all nodes,): the heat (W) that passes a surface along its normals, per rise: the mean of what both sides say."""
    placed = heat.placed
    conductivity = placed.per_cell("thermal_conductivity")
    found = np.zeros(heat.size)
    for faces, sign in two_sided(placed, placed.mesh.surfaces[group], np.ones(len(placed.mesh.cells), bool)):
        found += sign * FaceSpace(heat.space, faces).flux(conductivity[faces[:, :1]])
    return found
