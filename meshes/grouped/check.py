"""Checks that a scene fits its mesh: refusals by name, and warnings."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from meshes.grouped.model import GroupedMesh, locate
from meshes.grouped.place import Placed
from scenes import physics, readouts
from scenes.errors import SceneError, did_you_mean, listed, quoted
from scenes.free import contacts
from scenes.free.rules import UNFIXED, Acting, check_conditions, refuse_idle, refuse_part
from scenes.model import FLOWS, Contact, GroupProbe, MeshScene, is_zero
from scenes.physics import heats, is_exit


def check(scene: MeshScene, mesh: GroupedMesh) -> Placed:
    """Place a scene on its mesh.

    Raises SceneError for missing groups or groups of the wrong kind, cells without a material or with two, conditions
    that act on nothing or contradict each other, probes outside the solid, floating parts, and scenes at rest.
    """
    named(scene, mesh)
    placed = Placed(scene, mesh)
    materials(placed)
    with _blaming_separate_parts(mesh):
        joints(placed)
    boundaries(placed)
    probes(placed)
    with _blaming_separate_parts(mesh):
        parts(placed)
    return placed


CONFORMING = "make the mesh conforming (in Gmsh: BooleanFragments, or Coherence)"


def remarks(mesh: GroupedMesh) -> list[str]:
    """Return warnings about a mesh that may not be meant as it is."""
    count = _unjoined_corners(mesh)
    return [
        f"{count} corners of the mesh lie where another one is without being joined to it, so that neither heat nor "
        f"current passes there; if the parts should touch, {CONFORMING}"
    ] * (count > 0)


def _unjoined_corners(mesh: GroupedMesh) -> int:
    """Return how many corners lie where another one is."""
    points = mesh.mesh.doflocs[:, : mesh.mesh.nvertices].T
    size = float(np.ptp(points, axis=0).max())
    rounded = np.rint((points - points.min(axis=0)) / (1e-9 * size)).astype(np.int64)
    return len(points) - len(np.unique(rounded, axis=0))


@contextmanager
def _blaming_separate_parts(mesh: GroupedMesh) -> Iterator[None]:
    """Add to a refusal that parts of the mesh are not joined, which may be its cause."""
    try:
        yield
    except SceneError as error:
        parts, corners = int(mesh.parts(np.ones(mesh.count, bool)).max()), _unjoined_corners(mesh)
        if parts == 1 and not corners:
            raise
        where = f" ({corners} corners lie where another one is without being joined to it)" if corners else ""
        raise SceneError(
            f"the mesh has {parts} {'parts' if parts > 1 else 'part'} that share no faces{where}, so that neither heat "
            f"nor current passes between them: if they should touch, {CONFORMING}; as it is, {error}"
        ) from None


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
    physics.check_resistivities(scene)


def joints(placed: Placed) -> None:
    """Refuses contacts as those of boxes are (`scenes.free.contacts.refuse`), and groups of one that have cells in
    common."""
    volumes = placed.mesh.volumes
    for contact in placed.scene.contacts:
        one, other = contact.between
        if one != other and np.isin(volumes[one], volumes[other]).any():
            raise SceneError(
                f"contact {quoted(contact.name)} is between volume groups {quoted(one)} and {quoted(other)}, which "
                "have cells in common: give two that touch"
            )
    insulators = {name for name, cells in volumes.items() if not placed.conducting[cells].any()}
    called = "volume group", "volume groups"
    contacts.refuse(
        placed.scene.contacts, called, sorted(volumes), lambda c: len(placed.between(c)) > 0, insulators
    )  # fmt: skip


def boundaries(placed: Placed) -> None:
    """Refuse conditions that act on nothing, lie on a contact, or contradict each other."""
    acting = []
    for b in placed.scene.boundaries:
        facets = placed.acting(b)
        for contact in placed.scene.contacts if b.kind in ("voltage", "temperature") else ():
            jumps = contact.electrical_resistance if b.kind == "voltage" else contact.thermal_resistance
            if jumps and np.isin(facets, placed.between(contact)).any():
                raise SceneError(contacts.on_one(b, contact, "a group"))
        pairs = placed.mesh.mesh.f2t[:, facets]
        between = bool((placed.conducting[pairs] & (pairs >= 0)).all(axis=0).any())
        acting.append(Acting(b, facets, np.unique(placed.mesh.mesh.facets[:, facets]), between))
    check_conditions(acting, "groups")
    with _blaming_separate_parts(placed.mesh):
        physics.refuse_ungrounded(placed.scene.boundaries, placed.joined().values())
        readouts.pairs(placed.scene, placed.joined().values())


def probes(placed: Placed) -> None:
    """Refuses probes where there is no solid, or nothing that conducts, those on a contact that say no side of it, and
    flows through what is ambiguous."""
    for probe in placed.scene.probes:
        where = f"probe {quoted(probe.name)}"
        if probe.quantity in ("temperature", "potential"):
            _check_side(placed, probe)
        if probe.at is not None:
            inside = placed.fixed if probe.quantity == "potential" else np.ones(placed.mesh.count, bool)
            inside = inside & placed.part(probe.side) if probe.side else inside
            if locate(placed.mesh, np.array(probe.at), inside) is None:
                if (
                    probe.quantity == "potential"
                    and locate(placed.mesh, np.array(probe.at), placed.conducting) is not None
                ):
                    with _blaming_separate_parts(placed.mesh):
                        raise SceneError(f"{where} {UNFIXED.format('potential')}")
                if probe.quantity == "potential" and locate(placed.mesh, np.array(probe.at)) is not None:
                    raise SceneError(
                        f"{where} asks for the potential where nothing conducts: give a place in a conductor"
                    )
                shown = ", ".join(f"{c:g} m" for c in probe.at)
                raise SceneError(f"{where} lies outside the solid: no cell of the mesh is at [{shown}]")
        elif probe.quantity in ("potential", "current") and not _conducts(placed, probe, placed.conducting):
            raise SceneError(f"{where} asks for a {probe.quantity} where nothing conducts: give a group on a conductor")
        elif probe.quantity in ("potential", "current") and not _conducts(placed, probe, placed.fixed):
            with _blaming_separate_parts(placed.mesh):
                raise SceneError(f"{where} {UNFIXED.format(probe.quantity)}")
        if probe.quantity == "power" and not placed.conducting[placed.mesh.volumes[probe.group or ""]].any():
            raise SceneError(f"{where} asks for a power where nothing conducts: give the group of a conductor")
        if probe.quantity in FLOWS:
            _refuse_mixed(placed, probe)


def _check_side(placed: Placed, probe: GroupProbe) -> None:
    """Refuses a probe on a contact that doesn't say on which side, and one of a side that isn't all there."""
    if probe.groups:
        return
    if probe.side:
        if not _covered(placed, probe, placed.part(probe.side)):
            raise SceneError(
                f"probe {quoted(probe.name)}.side = {quoted(probe.side)} isn't everywhere at the probe: give a place "
                "in it or on its faces"
            )
        return
    for contact in placed.scene.contacts:
        jumps = contact.electrical_resistance if probe.quantity == "potential" else contact.thermal_resistance
        if jumps and _lies_on(placed, probe, contact):
            one, other = map(quoted, contact.between)
            raise SceneError(
                f"probe {quoted(probe.name)} lies on contact {quoted(contact.name)}, where the {probe.quantity} jumps: "
                f"say on which side by side = {one} or side = {other}"
            )


def _covered(placed: Placed, probe: GroupProbe, inside: np.ndarray) -> bool:
    """Whether some cells (cells,) are everywhere at a probe."""
    mesh, group = placed.mesh, probe.group or ""
    if probe.at is not None:
        return locate(mesh, np.array(probe.at), inside) is not None
    if group in mesh.volumes:
        return bool(inside[mesh.volumes[group]].all())
    return len(mesh.borders(placed.facets(probe), inside)) == len(placed.facets(probe))


def _lies_on(placed: Placed, probe: GroupProbe, contact: Contact) -> bool:
    """Whether some of a surface probe, or a point, is on a contact."""
    mesh, facets = placed.mesh, placed.between(contact)
    if probe.at is None:
        return probe.group not in mesh.volumes and bool(np.isin(placed.facets(probe), facets).any())
    beside = np.isin(np.arange(mesh.count), mesh.beside(facets))
    return all(_covered(placed, probe, beside & placed.part(group)) for group in contact.between)


def _conducts(placed: Placed, probe: GroupProbe, inside: np.ndarray) -> bool:
    """Whether a potential is defined all over a group, or a current may pass through some of it, in conductors
    ``inside`` (cells,)."""
    if probe.quantity == "potential":
        return _covered(placed, probe, inside & placed.part(probe.side) if probe.side else inside)
    return len(placed.mesh.borders(placed.facets(probe), inside)) > 0


def _refuse_mixed(placed: Placed, probe: GroupProbe) -> None:
    mesh = placed.mesh
    facets = placed.facets(probe)
    uncovered = ~mesh.exposed(facets)
    for b in placed.covered(probe):
        acting = placed.acting(b)
        if not np.isin(acting, facets).all():
            raise SceneError(
                f"probe {quoted(probe.name)} covers boundary {quoted(b.name)} in part: give a surface group with all "
                "of its faces or none"
            )
        uncovered &= ~np.isin(facets, acting)
    if uncovered.any() and placed.covered(probe):
        raise SceneError(
            f"probe {quoted(probe.name)} lies partly inside the solid, where it counts along its normals, and partly "
            f"on boundary {quoted(placed.covered(probe)[0].name)}, where it counts into the solid: give one probe each"
        )


def parts(placed: Placed) -> None:
    """Refuses conductors without a fixed voltage, floating parts, parts without an exit, and scenes at rest."""
    scene, mesh = placed.scene, placed.mesh
    labels = mesh.parts(np.ones(mesh.count, bool))
    acted = placed.touched(labels, scene.boundaries)
    for source in scene.sources:
        if not is_zero(source.heat_source):
            acted |= set(labels[mesh.volumes[source.group]].tolist())
    _refuse_parts(placed, labels, acted, False)
    if scene.steady and physics.heat(scene):
        _refuse_parts(placed, labels, placed.touched(labels, [b for b in scene.boundaries if is_exit(b)]), True)
    if any(heats(b, scene.initial_temperature) for b in scene.boundaries):
        return
    if any(not is_zero(s.heat_source) for s in scene.sources) or placed.conductors[0].any():
        return
    refuse_idle(scene)


def _refuse_parts(placed: Placed, labels: np.ndarray, fine: set[int], kept: bool) -> None:
    for part in set(range(1, int(labels.max(initial=0)) + 1)) - fine:
        names = [name for name, cells in placed.mesh.volumes.items() if (labels[cells] == part).any()]
        refuse_part(names, "volume group", kept)
