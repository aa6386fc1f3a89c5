"""A scene on the cells and facets of its mesh."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from meshes.connected import between
from meshes.grouped.model import GroupedMesh, locate
from scenes.free.graph import CellGraph
from scenes.model import Contact, GroupBoundary, GroupProbe, Material, MeshScene, is_zero


@dataclass(frozen=True, eq=False)
class Placed(CellGraph):
    """A scene and its mesh with all groups that the scene names."""

    scene: MeshScene
    mesh: GroupedMesh

    part_word, place_word, side_key = "volume group", "a surface group", "side"

    @cached_property
    def body(self) -> np.ndarray:
        """Number of the body of each cell (cells,), -1 for none."""
        bodies = np.full(self.mesh.count, -1)
        for number, body in enumerate(self.scene.bodies):
            for group in body.groups:
                bodies[self.mesh.volumes[group]] = number
        return bodies

    @property
    def materials(self) -> list[Material]:
        """Material of each body."""
        return [body.material for body in self.scene.bodies]

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
        part = np.zeros(self.mesh.count, bool)
        part[self.mesh.volumes[name]] = True
        return part

    def faces(self, item: GroupBoundary | GroupProbe) -> np.ndarray:
        """Return the facets of the group of a condition or a flat probe."""
        return self.mesh.surfaces[item.group or ""][0]

    def sides(self, faces: np.ndarray) -> np.ndarray:
        """Return (2, facets) the cells beside each facet, -1 for none."""
        cells: np.ndarray = self.mesh.mesh.f2t[:, faces]
        return cells

    def nodes(self, faces: np.ndarray) -> np.ndarray:
        """Return (corners, facets) the corners of each facet."""
        corners: np.ndarray = self.mesh.mesh.facets[:, faces]
        return corners

    def between(self, contact: Contact) -> np.ndarray:
        """Return the facets of a contact."""
        return between(self.mesh.mesh.f2t, *map(self.part, contact.between))

    def covered(self, probe: GroupProbe, mask: np.ndarray) -> np.ndarray:
        """Return (places,) whether each place of a probe, its point, facets or cells, touches a chosen cell."""
        if probe.at is not None:
            return np.array([locate(self.mesh, np.array(probe.at), mask) is not None])
        if volumes := [self.mesh.volumes[g] for g in probe.groups or (probe.group or "",) if g in self.mesh.volumes]:
            return mask[np.concatenate(volumes)]
        return self.bordering(self.faces(probe), mask)

    def conditions(self, probe: GroupProbe) -> list[GroupBoundary]:
        """Return the boundaries of the probe's kind, thermal or electric, with facets in its group."""
        electric, facets = probe.quantity == "current", self.faces(probe)
        return [
            b for b in self.scene.boundaries
            if (b.kind == "voltage") == electric and np.isin(self.acting(b), facets).any()
        ]  # fmt: skip

    def parts(self, mask: np.ndarray, cuts: np.ndarray | None = None) -> np.ndarray:
        """Return `GroupedMesh.parts`."""
        return self.mesh.parts(mask, cuts)

    def explain_separation(self, sentence: str) -> str:
        """Return a refusal with the count of parts and of corners that are not joined, where there are any."""
        count, corners = int(self.parts(self.solid).max()), self.mesh.unjoined_corners()
        if count == 1 and not corners:
            return sentence
        where = f" ({corners} corners lie where another one is without being joined to it)" if corners else ""
        return (
            f"the mesh has {count} {'parts' if count > 1 else 'part'} that share no faces{where}, so that neither heat "
            f"nor current passes between them: if they should touch, {CONFORMING}; as it is, {sentence}"
        )


CONFORMING = "make the mesh conforming (in Gmsh: BooleanFragments, or Coherence)"
