"""A scene on a mesh file as a domain: which cells and facets of the mesh its groups are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fem3d.spaces.domain import with_contacts
from fem3d.spaces.mapped import MappedSpace
from fem3d.spaces.mapped_domain import MappedDomain
from meshes.grouped.model import GroupedMesh
from meshes.grouped.place import Placed
from scenes.model import GroupBoundary, GroupProbe, Point


@dataclass(frozen=True, eq=False)
class Groups(MappedDomain):
    """A scene on a mesh with groups."""

    placed: Placed

    conditions_first = True

    def facets(self, item: GroupBoundary | GroupProbe) -> np.ndarray:
        """The facets of a group."""
        return self.placed.faces(item)

    def directions(self, item: GroupBoundary | GroupProbe) -> np.ndarray:
        """(facets,): 1 where the group's facets point out of their first cell, else -1."""
        return 1 - 2 * self.placed.mesh.surfaces[item.group or ""][1]

    @property
    def grouped(self) -> GroupedMesh:
        """That of the file."""
        return self.placed.mesh

    def part(self, name: str) -> np.ndarray:
        """(cells,): those of a volume group."""
        return self.placed.part(name)

    def read_in(self, probe: GroupProbe) -> tuple[str, ...]:
        """The volume group that it names."""
        return (probe.side,) if probe.side else ()

    def point(self, probe: GroupProbe) -> Point | None:
        """What the scene says."""
        return probe.at

    def cells(self, probe: GroupProbe) -> np.ndarray | None:
        """The cells of a probe's group: of a name that is a surface's too, unless a potential is asked for and not all
        of them conduct."""
        if probe.groups:
            return np.flatnonzero(self.parts(probe.groups))
        cells = self.placed.mesh.volumes.get(probe.group or "")
        conducts = cells is not None and (probe.quantity != "potential" or self.placed.conducting[cells].all())
        return cells if conducts else None


def groups(placed: Placed, degree: int = 3) -> Groups:
    """Return the domain of a scene on its mesh, with tetrahedra of a degree."""
    scene, mesh = placed.scene, placed.mesh
    space = MappedSpace(mesh.mesh, degree)
    return with_contacts(Groups(
        scene, space, placed.body, tuple(m.name for m in placed.materials), tuple(placed.materials),
        tuple((s.heat_source, mesh.volumes[s.group]) for s in scene.sources),
        placed.live, placed.still, placed.anchored, placed,
    ))  # fmt: skip
