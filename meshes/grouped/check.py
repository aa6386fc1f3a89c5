"""Check that a scene fits its mesh, and lay it on the cells and facets.

The checks are of groups and materials, and the rules of `scenes.free.rules`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from meshes.grouped.model import GroupedMesh, locate
from scenes.errors import SceneError, did_you_mean, listed, quoted
from scenes.free import rules
from scenes.free.graph import CellGraph
from scenes.model import FLOWS, GroupBoundary, GroupProbe, Material, MeshScene, is_zero


def check(scene: MeshScene, mesh: GroupedMesh) -> Placed:
    """Place a scene on its mesh.

    Raises SceneError for missing groups or groups of the wrong kind, cells without a material or with two, flows
    through a part of a condition, and where `rules.check` does.
    """
    for path, group, kinds in _named(scene):
        _check_group(mesh, f"{path} = {quoted(group)}", group, kinds)
    placed = Placed(scene, mesh)
    bare = placed.body < 0
    if bare.any():
        names = [name for name, cells in mesh.volumes.items() if bare[cells].any()]
        where = f" (in {listed(names)})" if names else ", which are in no group"
        raise SceneError(
            f"{int(bare.sum())} volume cells of {len(bare)} have no material{where}: give a [[material]] whose groups "
            "hold them"
        )
    rules.check(placed, placed.explain_separation)
    for probe in scene.probes:
        if probe.quantity in FLOWS:
            _refuse_mixed(placed, probe)
    return placed


def _named(scene: MeshScene) -> Iterator[tuple[str, str, tuple[str, ...]]]:
    """Yield each place in a scene that names a group, the group, and the kinds that it may be of."""
    volume, surface = ("volume",), ("surface",)
    for body in scene.bodies:
        yield from ((f"material {quoted(body.material.name)}.groups", group, volume) for group in body.groups)
    for source in scene.sources:
        yield f"source {quoted(source.name)}.group", source.group, volume
    for boundary in scene.boundaries:
        yield f"boundary {quoted(boundary.name)}.group", boundary.group, surface
    for contact in scene.contacts:
        yield from ((f"contact {quoted(contact.name)}.between", group, volume) for group in contact.between)
    for probe in scene.probes:
        at, flat = f"probe {quoted(probe.name)}", probe.quantity in (*FLOWS, "resistance")
        yield from ((f"{at}.groups", group, volume) for group in probe.groups)
        if probe.group is not None:
            yield f"{at}.group", probe.group, surface if flat else volume + surface * (probe.quantity != "power")
        if probe.side:
            yield f"{at}.side", probe.side, volume


def _check_group(mesh: GroupedMesh, said: str, group: str, kinds: tuple[str, ...]) -> None:
    """Refuse a name that is no group of the wanted kinds."""
    groups: dict[str, dict[str, Any]] = {"volume": mesh.volumes, "surface": mesh.surfaces}
    if any(group in groups[kind] for kind in kinds):
        return
    given = " and ".join(
        f"the {kind} groups are {listed(sorted(groups[kind]))}"
        if groups[kind]
        else f"it has no {kind} groups (save it with physical groups, properties, or element sets)"
        for kind in kinds
    )
    others = mesh.others | {name: f"a {kind} group" for kind in ("surface", "volume") for name in groups[kind]}
    if group in others:
        raise SceneError(f"{said} is {others[group]}, not a {' or '.join(kinds)} group: {given}")
    hint = did_you_mean(group, [name for kind in kinds for name in sorted(groups[kind])])
    raise SceneError(f"{said} is no group of the mesh: {given}{hint}")


def _refuse_mixed(placed: Placed, probe: GroupProbe) -> None:
    """Refuse a flow through a part of a condition, or through a condition and the solid beside it."""
    facets, electric = placed.faces(probe), probe.quantity == "current"
    uncovered, conditions = ~placed.exposed(facets), list[str]()
    for b in placed.scene.boundaries:
        acting = placed.acting(b)
        inside = np.isin(acting, facets)
        if (b.kind == "voltage") != electric or not inside.any():
            continue
        conditions.append(b.name)
        if not inside.all():
            raise SceneError(
                f"probe {quoted(probe.name)} covers boundary {quoted(b.name)} in part: give a surface group with all "
                "of its faces or none"
            )
        uncovered &= ~np.isin(facets, acting)
    if uncovered.any() and conditions:
        raise SceneError(
            f"probe {quoted(probe.name)} lies partly inside the solid, where it counts along its normals, and partly "
            f"on boundary {quoted(conditions[0])}, where it counts into the solid: give one probe each"
        )


@dataclass(frozen=True, eq=False)
class Placed(CellGraph):
    """A scene and its mesh with all groups that the scene names."""

    scene: MeshScene
    mesh: GroupedMesh

    part_word, place_word, side_key = "volume group", "a surface group", "side"

    @cached_property
    def body(self) -> np.ndarray:
        """Number of the body of each cell (cells,), -1 for none. Raises SceneError for cells of two."""
        owner, bodies = np.full(self.mesh.count, -1), self.scene.bodies
        for number, body in enumerate(bodies):
            for group in body.groups:
                taken = np.setdiff1d(owner[self.mesh.volumes[group]], [-1, number])
                if len(taken):
                    raise SceneError(
                        f"material {quoted(body.material.name)}.groups: cells of {quoted(group)} are of material "
                        f"{quoted(bodies[taken[0]].material.name)} too: give every volume cell one material"
                    )
                owner[self.mesh.volumes[group]] = number
        return owner

    @property
    def materials(self) -> list[Material]:
        """Material of each body."""
        return [body.material for body in self.scene.bodies]

    @property
    def f2t(self) -> np.ndarray:
        """(2, facets) the cells beside each facet, -1 for none."""
        return np.asarray(self.mesh.mesh.f2t)

    @cached_property
    def solid(self) -> np.ndarray:
        """True for each cell (cells,)."""
        return np.ones(self.mesh.count, bool)

    @cached_property
    def conducting(self) -> np.ndarray:
        """Whether each cell (cells,) conducts electricity."""
        return np.array([m.resistivity is not None for m in self.materials])[self.body]

    @property
    def heated(self) -> np.ndarray:
        """Whether each cell (cells,) has a heat source."""
        sources = [self.part(s.group) for s in self.scene.sources if not is_zero(s.heat_source)]
        return np.any([~self.solid, *sources], axis=0)

    @property
    def part_names(self) -> list[str]:
        """Names of the volume groups."""
        return sorted(self.mesh.volumes)

    def part(self, name: str) -> np.ndarray:
        """Return whether each cell (cells,) is in a volume group."""
        return np.isin(np.arange(self.mesh.count), self.mesh.volumes[name])

    def faces(self, item: GroupBoundary | GroupProbe) -> np.ndarray:
        """Return the facets of the group of a condition or a flat probe."""
        return self.mesh.surfaces[item.group or ""][0]

    def nodes(self, faces: np.ndarray) -> np.ndarray:
        """Return (corners, facets) the corners of each facet."""
        return np.asarray(self.mesh.mesh.facets[:, faces])

    def covered(self, probe: GroupProbe, mask: np.ndarray) -> np.ndarray:
        """Return (places,) whether each place of a probe, its point, facets or cells, touches a chosen cell."""
        if probe.at is not None:
            return np.array([locate(self.mesh.mesh, np.array(probe.at), mask) is not None])
        if volumes := [self.mesh.volumes[g] for g in probe.groups or (probe.group or "",) if g in self.mesh.volumes]:
            return mask[np.concatenate(volumes)]
        return self.bordering(self.faces(probe), mask)

    @cached_property
    def separation(self) -> str:
        """A sentence on parts and corners of the mesh that are not joined, "" where there are none."""
        points = self.mesh.mesh.doflocs[:, : self.mesh.mesh.nvertices].T
        rounded = np.rint((points - points.min(axis=0)) / (1e-9 * np.ptp(points, axis=0).max())).astype(np.int64)
        count, corners = int(self.parts(self.solid).max()), len(points) - len(np.unique(rounded, axis=0))
        said = [f"{count} parts that share no faces"] * (count > 1)
        said += [f"{corners} corners that lie where another one is without being joined to it"] * (corners > 0)
        return (
            f"the mesh has {' and '.join(said)}, so that neither heat nor current passes there: if they should touch, "
            "make the mesh conforming (in Gmsh: BooleanFragments, or Coherence)"
        ) * bool(said)

    def explain_separation(self, sentence: str) -> str:
        """Return a refusal with the parts and corners that are not joined, where there are any."""
        return f"{self.separation}; as it is, {sentence}" if self.separation else sentence
