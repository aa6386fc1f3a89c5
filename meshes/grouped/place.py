"""A scene laid on its mesh: which cells and faces its materials, sources, conditions and probes are on."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from meshes.grouped.model import Faces, GroupedMesh
from scenes.meshed.model import GroupBoundary, GroupProbe, MeshScene
from scenes.model import Material


@dataclass(frozen=True, eq=False)
class Placed:
    """A scene and its mesh, which has every group that the scene names."""

    scene: MeshScene
    mesh: GroupedMesh

    @cached_property
    def body(self) -> np.ndarray:
        """(cells,): the number of the body that each cell is of, -1 for none."""
        found = np.full(len(self.mesh.cells), -1)
        for number, body in enumerate(self.scene.bodies):
            for group in body.groups:
                found[self.mesh.volumes[group]] = number
        return found

    @property
    def materials(self) -> list[Material]:
        """The material of each body."""
        return [body.material for body in self.scene.bodies]

    @cached_property
    def conducting(self) -> np.ndarray:
        """(cells,): which cells conduct electricity."""
        return np.array([m.resistivity is not None for m in self.materials])[self.body]

    def per_cell(self, key: str) -> np.ndarray:
        """(cells,): a property of the materials."""
        return np.array([float(getattr(m, key)) for m in self.materials])[self.body]

    def faces(self, boundary: GroupBoundary) -> Faces:
        """The faces on which a condition acts: those of conductors for a voltage, exposed ones for a flux."""
        faces = self.mesh.surfaces[boundary.group]
        if boundary.kind == "voltage":
            return self.beside(faces, self.conducting)
        return faces if boundary.kind == "temperature" else faces[self.mesh.exposed(faces)]

    def beside(self, faces: Faces, cells: np.ndarray) -> Faces:
        """Those of some faces that a chosen cell (cells,) is at, each as the face of such a cell."""
        if cells[faces[:, 0]].all():
            return faces
        numbers = self.mesh.number(faces)
        cell, local = np.nonzero(np.isin(self.mesh.facets, numbers) & cells[:, None])
        own = np.stack([cell, local], axis=1)
        # Keep the side that the group has where it may be kept.
        given = faces[cells[faces[:, 0]]]
        rest = own[~np.isin(self.mesh.number(own), self.mesh.number(given))]
        first = np.unique(self.mesh.number(rest), return_index=True)[1]
        return np.concatenate([given, rest[first]])

    def covered(self, probe: GroupProbe) -> list[GroupBoundary]:
        """The boundaries of the probe's kind, thermal or electric, that have faces in its group."""
        assert probe.group is not None
        electric = probe.quantity == "current"
        own = self.mesh.number(self.mesh.surfaces[probe.group])
        return [
            b
            for b in self.scene.boundaries
            if (b.kind == "voltage") == electric and np.isin(self.mesh.number(self.faces(b)), own).any()
        ]
