"""A scene on a mesh file as a domain: which cells and facets of the mesh its groups are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fem3d.spaces.domain import Domain, Patch
from fem3d.spaces.mapped import MappedSpace
from meshes.grouped.locate import locate
from meshes.grouped.place import Placed
from scenes.model import GroupBoundary, GroupProbe
from scenes.physics import is_exit


@dataclass(frozen=True, eq=False)
class Groups(Domain):
    """A scene on a mesh with groups."""

    space: MappedSpace
    placed: Placed

    conditions_first = True

    def facets(self, item: GroupBoundary | GroupProbe) -> np.ndarray:
        """The facets of a group."""
        return self.placed.facets(item)

    def directions(self, item: GroupBoundary | GroupProbe) -> np.ndarray:
        """(facets,): 1 where the group's facets point out of their first cell, else -1."""
        return 1 - 2 * self.placed.mesh.surfaces[item.group or ""][1]

    def mean(self, probe: GroupProbe, inside: np.ndarray | None = None) -> np.ndarray:
        """(functions,): what a function adds to the mean over a group, or to the value at a point."""
        if probe.at is not None:
            found, row = locate(self.placed.mesh, np.array(probe.at), inside), np.zeros(self.space.size)
            if found is not None:
                row[self.space.dofs[:, found[0]]] = self.space.at(found[1][:, None])[0]
            return row
        cells, facets = self._extent(probe)
        if cells is None:
            row = self.seen(facets, inside).load()
            return row / self.seen(facets).areas.sum()
        chosen = cells if inside is None else cells[inside[cells]]
        return self.space.on(chosen).load(np.ones((len(chosen), 1))) / self.space.on(cells).weights.sum()

    def patches(self, probe: GroupProbe, inside: np.ndarray | None = None) -> list[Patch]:
        """The cells, or the sides of cells, of a group."""
        cells, facets = self._extent(probe)
        if cells is not None:
            return [(cells if inside is None else cells[inside[cells]], np.zeros(3), np.eye(3))]
        mesh = self.space.mesh
        pairs = mesh.f2t[:, facets]
        fine = (pairs >= 0) if inside is None else (pairs >= 0) & inside[pairs]
        own = pairs[fine.argmax(axis=0), np.arange(len(facets))]
        local = (mesh.t2f[:, own] == facets).argmax(axis=0)
        found = []
        for side in np.unique(local[fine.any(axis=0)]):
            corners = mesh.refdom.p[:, mesh.refdom.facets[side]].T
            along = np.stack([corners[1] - corners[0], corners[-1] - corners[0]])
            found.append((own[(local == side) & fine.any(axis=0)], corners[0], along))
        return found

    def is_flat(self, probe: GroupProbe) -> bool:
        """Whether a probe is a surface."""
        return probe.at is None and self._extent(probe)[0] is None

    def _extent(self, probe: GroupProbe) -> tuple[np.ndarray | None, np.ndarray]:
        """The cells of a probe's group, or None and its facets: of a name that is both, the cells, unless a potential
        is asked for and not all of them conduct."""
        cells = self.placed.mesh.volumes.get(probe.group or "")
        if cells is not None and (probe.quantity != "potential" or self.placed.conducting[cells].all()):
            return cells, np.empty(0, int)
        return None, self.placed.facets(probe)


def groups(placed: Placed) -> Groups:
    """The domain of a scene on its mesh."""
    scene, mesh = placed.scene, placed.mesh
    parts = mesh.parts(np.ones(mesh.count, bool))
    exits = placed.touched(parts, [b for b in scene.boundaries if is_exit(b)])
    live, still = placed.conductors
    return Groups(
        scene, MappedSpace(mesh.mesh), placed.body, tuple(m.name for m in placed.materials), tuple(placed.materials),
        tuple((s.heat_source, mesh.volumes[s.group]) for s in scene.sources), live, still,
        len(exits) == parts.max(), placed,
    )  # fmt: skip
