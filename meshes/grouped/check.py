"""Check that a scene fits its mesh: the groups, the materials, and the rules of `scenes.free.rules`."""

from __future__ import annotations

from typing import Any

import numpy as np

from meshes.grouped.model import GroupedMesh
from meshes.grouped.place import CONFORMING, Placed
from scenes.errors import SceneError, did_you_mean, listed, quoted
from scenes.free import rules
from scenes.model import FLOWS, GroupProbe, MeshScene


def check(scene: MeshScene, mesh: GroupedMesh) -> Placed:
    """Place a scene on its mesh.

    Raises SceneError for missing groups or groups of the wrong kind, cells without a material or with two, flows
    through a part of a condition, and where `rules.check` does.
    """
    named(scene, mesh)
    placed = Placed(scene, mesh)
    materials(placed)
    rules.check(placed, placed.explain_separation)
    for probe in scene.probes:
        if probe.quantity in FLOWS:
            _refuse_mixed(placed, probe)
    return placed


def remarks(mesh: GroupedMesh) -> list[str]:
    """Return warnings about a mesh that may not be meant as it is."""
    count = mesh.unjoined_corners()
    return [
        f"{count} corners of the mesh lie where another one is without being joined to it, so that neither heat nor "
        f"current passes there; if the parts should touch, {CONFORMING}"
    ] * (count > 0)


def named(scene: MeshScene, mesh: GroupedMesh) -> None:
    """Refuse missing groups and groups of the wrong dimension."""
    for body in scene.bodies:
        for group in body.groups:
            _refuse(mesh, f"material {quoted(body.material.name)}.groups", group, ("volume",))
    for source in scene.sources:
        _refuse(mesh, f"source {quoted(source.name)}.group", source.group, ("volume",))
    for boundary in scene.boundaries:
        _refuse(mesh, f"boundary {quoted(boundary.name)}.group", boundary.group, ("surface",))
    for contact in scene.contacts:
        for group in contact.between:
            _refuse(mesh, f"contact {quoted(contact.name)}.between", group, ("volume",))
    for probe in scene.probes:
        for group in probe.groups:
            _refuse(mesh, f"probe {quoted(probe.name)}.groups", group, ("volume",))
        if probe.group is not None:
            kinds = _KINDS.get(probe.quantity, ("volume", "surface"))
            _refuse(mesh, f"probe {quoted(probe.name)}.group", probe.group, kinds)
        if probe.side:
            _refuse(mesh, f"probe {quoted(probe.name)}.side", probe.side, ("volume",))


_KINDS: dict[str, tuple[str, ...]] = {**dict.fromkeys((*FLOWS, "resistance"), ("surface",)), "power": ("volume",)}


def _refuse(mesh: GroupedMesh, path: str, group: str, kinds: tuple[str, ...]) -> None:
    has: dict[str, dict[str, Any]] = {"volume": mesh.volumes, "surface": mesh.surfaces}
    if any(group in has[kind] for kind in kinds):
        return
    wanted = " or ".join(kinds)
    if group in mesh.others or any(group in groups for groups in has.values()):
        what = mesh.others.get(group) or ("a volume group" if group in mesh.volumes else "a surface group")
        raise SceneError(f"{path} = {quoted(group)} is {what}, not a {wanted} group: {_known(mesh, kinds)}")
    names = [name for kind in kinds for name in has[kind]]
    hint = did_you_mean(group, names)
    raise SceneError(f"{path} = {quoted(group)} is no group of the mesh: {_known(mesh, kinds)}{hint}")


def _known(mesh: GroupedMesh, kinds: tuple[str, ...]) -> str:
    parts = []
    for kind in kinds:
        names = sorted(mesh.volumes if kind == "volume" else mesh.surfaces)
        parts.append(f"the {kind} groups are {listed(names)}" if names else f"it has no {kind} groups")
    return " and ".join(parts)


def materials(placed: Placed) -> None:
    """Refuse cells without a material or with two, and resistivities that are not positive at the start."""
    mesh, scene = placed.mesh, placed.scene
    owner = np.full(mesh.count, -1)
    for number, body in enumerate(scene.bodies):
        for group in body.groups:
            cells = mesh.volumes[group]
            taken = owner[cells]
            if ((taken >= 0) & (taken != number)).any():
                other = scene.bodies[taken[(taken >= 0) & (taken != number)][0]].material.name
                raise SceneError(
                    f"material {quoted(body.material.name)}.groups: cells of {quoted(group)} are of material "
                    f"{quoted(other)} too: give every volume cell one material"
                )
            owner[cells] = number
    bare = owner < 0
    if bare.any():
        names = [name for name, cells in mesh.volumes.items() if bare[cells].any()]
        where = f" (in {listed(names)})" if names else ", which are in no group"
        raise SceneError(
            f"{int(bare.sum())} volume cells of {len(owner)} have no material{where}: give a [[material]] whose groups "
            "hold them"
        )


def _refuse_mixed(placed: Placed, probe: GroupProbe) -> None:
    """Refuse a flow through a part of a condition, or through a condition and the solid beside it."""
    facets, conditions = placed.faces(probe), placed.conditions(probe)
    uncovered = ~placed.exposed(facets)
    for b in conditions:
        acting = placed.acting(b)
        if not np.isin(acting, facets).all():
            raise SceneError(
                f"probe {quoted(probe.name)} covers boundary {quoted(b.name)} in part: give a surface group with all "
                "of its faces or none"
            )
        uncovered &= ~np.isin(facets, acting)
    if uncovered.any() and conditions:
        raise SceneError(
            f"probe {quoted(probe.name)} lies partly inside the solid, where it counts along its normals, and partly "
            f"on boundary {quoted(conditions[0].name)}, where it counts into the solid: give one probe each"
        )
