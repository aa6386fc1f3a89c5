"""Cells and facets of the materials, sources, conditions and probes of a scene on its mesh."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from meshes.connected import between
from meshes.grouped.model import GroupedMesh
from scenes import physics
from scenes.model import Contact, GroupBoundary, GroupProbe, Material, MeshScene, Value


@dataclass(frozen=True, eq=False)
class Placed:
    """A scene and its mesh with all groups that the scene names."""

    scene: MeshScene
    mesh: GroupedMesh

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
    def conducting(self) -> np.ndarray:
        """Whether each cell (cells,) conducts electricity."""
        return np.array([m.resistivity is not None for m in self.materials])[self.body]

    @cached_property
    def fixed(self) -> np.ndarray:
        """Whether each cell (cells,) is in a conductor with an electrode, so that its potential is determined."""
        live, still = self.conductors
        return np.any([live, *(cells for cells, _ in still)], axis=0)

    def part(self, group: str) -> np.ndarray:
        """Return whether each cell (cells,) is in a volume group."""
        part = np.zeros(self.mesh.count, bool)
        part[self.mesh.volumes[group]] = True
        return part

    def between(self, contact: Contact) -> np.ndarray:
        """Return the facets of a contact."""
        return between(self.mesh.mesh.f2t, *map(self.part, contact.between))

    def facets(self, item: GroupBoundary | GroupProbe) -> np.ndarray:
        """Return the facets of the group of a condition or a flat probe."""
        return self.mesh.surfaces[item.group or ""][0]

    def acting(self, boundary: GroupBoundary) -> np.ndarray:
        """Return the facets on which a condition acts: of conductors for a voltage, exposed ones for a flux."""
        facets = self.facets(boundary)
        if boundary.kind == "voltage":
            return self.mesh.borders(facets, self.conducting)
        return facets if boundary.kind == "temperature" else facets[self.mesh.exposed(facets)]

    def covered(self, probe: GroupProbe) -> list[GroupBoundary]:
        """Return the boundaries of the probe's kind, thermal or electric, with facets in its group."""
        electric, facets = probe.quantity == "current", self.facets(probe)
        return [
            b for b in self.scene.boundaries
            if (b.kind == "voltage") == electric and np.isin(self.acting(b), facets).any()
        ]  # fmt: skip

    def touched(self, parts: np.ndarray, boundaries: Sequence[GroupBoundary]) -> set[int]:
        """Return the numbers of the parts (`GroupedMesh.parts`) on which some conditions act."""
        numbers: set[int] = set()
        for b in boundaries:
            numbers |= set(parts[self.mesh.beside(self.acting(b))].tolist())
        return numbers - {0}

    @cached_property
    def _parts(self) -> tuple[np.ndarray, list[GroupBoundary]]:
        """Number of the part of the conductors of each cell (cells,), and the electrodes, at which parts end."""
        electrodes = [b for b in self.scene.boundaries if b.kind == "voltage"]
        cuts = np.concatenate([np.empty(0, int), *(self.acting(b) for b in electrodes)])
        return self.mesh.parts(self.conducting, cuts), electrodes

    def joined(self) -> dict[int, set[str]]:
        """Return the names of the electrodes of each part of the conductors."""
        (parts, electrodes), names = self._parts, dict[int, set[str]]()
        for b in electrodes:
            for part in self.touched(parts, [b]):
                names.setdefault(part, set()).add(b.name)
        return names

    @cached_property
    def conductors(self) -> tuple[np.ndarray, tuple[tuple[np.ndarray, Value | str], ...]]:
        """Cells (cells,) of conductors between electrodes of two voltages, and of each conductor with one voltage.

        The latter come with the voltage, or the name of the electrode if its potential is unknown.
        """
        parts, electrodes = self._parts
        voltages: dict[int, set[Value | str]] = {}
        touched = [(b, self.touched(parts, [b])) for b in electrodes]
        for b, of_one in touched:
            for part in of_one:
                voltages.setdefault(part, set()).add(physics.potential_of(b))
        physics.share_terminals(voltages, touched)
        live = np.isin(parts, [part for part, potentials in voltages.items() if len(potentials) > 1])
        alone = ((part, next(iter(potentials))) for part, potentials in voltages.items() if len(potentials) == 1)
        return live, tuple((parts == part, value) for part, value in alone)
