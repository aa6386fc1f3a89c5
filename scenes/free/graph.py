"""A scene on cells that faces join: the parts of its solid, and the cells and faces of its conditions and probes.

The boxes of a scene (`scenes.free.grid`) and the groups of a mesh file (`meshes.grouped.place`) are both such graphs.
Cells and faces have numbers; a mask (cells,) chooses cells, a label (cells,) numbers connected parts from 1 on.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from scenes import physics
from scenes.model import Contact, Value


class CellGraph(ABC):
    """A scene on cells.

    Attributes
    ----------
    scene : a `Scene` or a `MeshScene`
    part_word, place_word, side_key : the word for a part and for a place in a scene file, and the key that names the
        part in which a probe is read
    """

    scene: Any
    part_word: ClassVar[str]
    place_word: ClassVar[str]
    side_key: ClassVar[str]

    @property
    @abstractmethod
    def solid(self) -> np.ndarray:
        """Whether each cell (cells,) belongs to the solid."""

    @property
    @abstractmethod
    def conducting(self) -> np.ndarray:
        """Whether each cell (cells,) conducts electricity."""

    @property
    @abstractmethod
    def heated(self) -> np.ndarray:
        """Whether each cell (cells,) has a heat source."""

    @property
    @abstractmethod
    def part_names(self) -> list[str]:
        """Names of all boxes, or of all volume groups."""

    @abstractmethod
    def part(self, name: str) -> np.ndarray:
        """Return whether each cell (cells,) belongs to a box or a volume group."""

    @abstractmethod
    def faces(self, item: Any) -> np.ndarray:
        """Return the faces of a condition or of a flat probe."""

    @abstractmethod
    def sides(self, faces: np.ndarray) -> np.ndarray:
        """Return (2, faces) the cells beside each face, -1 for none."""

    @abstractmethod
    def nodes(self, faces: np.ndarray) -> np.ndarray:
        """Return (corners, faces) the corners of each face."""

    @abstractmethod
    def between(self, contact: Contact) -> np.ndarray:
        """Return the faces of a contact."""

    @abstractmethod
    def covered(self, probe: Any, mask: np.ndarray) -> np.ndarray:
        """Return (places,) whether each place of a probe, its point, faces or cells, touches a chosen cell."""

    @abstractmethod
    def parts(self, mask: np.ndarray, cuts: np.ndarray | None = None) -> np.ndarray:
        """Return (cells,) labels of the chosen cells that faces join, except the faces ``cuts``; 0 elsewhere."""

    def names(self, mask: np.ndarray) -> list[str]:
        """Return the boxes or volume groups with some of the chosen cells."""
        return [name for name in self.part_names if (self.part(name) & mask).any()]

    def bordering(self, faces: np.ndarray, mask: np.ndarray) -> np.ndarray:
        """Return (faces,) whether each face is a side of a chosen cell."""
        cells = self.sides(faces)
        touches: np.ndarray = ((cells >= 0) & mask[cells]).any(axis=0)
        return touches

    def exposed(self, faces: np.ndarray) -> np.ndarray:
        """Return (faces,) whether each face has solid on one side only."""
        solid = self.sides(faces) >= 0
        return solid[0] ^ solid[1]

    def acting(self, boundary: Any) -> np.ndarray:
        """Return the faces on which a condition acts: of conductors for a voltage, exposed faces for a flux."""
        faces = self.faces(boundary)
        if boundary.kind in ("voltage", "temperature"):
            return faces[self.bordering(faces, self.conducting if boundary.kind == "voltage" else self.solid)]
        return faces[self.exposed(faces)]

    def touched(self, labels: np.ndarray, boundaries: Iterable[Any]) -> set[int]:
        """Return the labels of the parts on which some conditions act."""
        touched = set[int]()
        for b in boundaries:
            cells = self.sides(self.acting(b))
            touched |= set(labels[cells[cells >= 0]].tolist())
        return touched - {0}

    @cached_property
    def _electrodes(self) -> tuple[np.ndarray, list[tuple[Any, set[int]]]]:
        """Labels of the conductors, which end at electrodes, and each electrode with the labels that it touches."""
        electrodes = [b for b in self.scene.boundaries if b.kind == "voltage"]
        labels = self.parts(self.conducting, np.concatenate([np.empty(0, int), *map(self.acting, electrodes)]))
        return labels, [(b, self.touched(labels, [b])) for b in electrodes]

    def joined(self) -> dict[int, set[str]]:
        """Return the names of the electrodes of each conductor, by its label."""
        names = dict[int, set[str]]()
        for b, labels in self._electrodes[1]:
            for label in labels:
                names.setdefault(label, set()).add(b.name)
        return names

    @cached_property
    def potentials(self) -> tuple[np.ndarray, dict[int, set[Value | str]]]:
        """Labels of the conductors, and the potentials (`scenes.physics.potential_of`) of the electrodes of each."""
        labels, touched = self._electrodes
        potentials = dict[int, set[Value | str]]()
        for b, parts in touched:
            for label in parts:
                potentials.setdefault(label, set()).add(physics.potential_of(b))
        physics.share_terminals(potentials, touched)
        return labels, potentials

    @cached_property
    def live(self) -> np.ndarray:
        """Whether each cell (cells,) lies in a conductor between electrodes of two potentials."""
        labels, potentials = self.potentials
        return np.isin(labels, [label for label, values in potentials.items() if len(values) > 1])

    @cached_property
    def still(self) -> tuple[tuple[np.ndarray, Value | str], ...]:
        """Cells (cells,) of each conductor without a current, and its potential, or its electrode's name if unknown."""
        labels, potentials = self.potentials
        alone = ((label, next(iter(values))) for label, values in potentials.items() if len(values) == 1)
        return tuple((labels == label, value) for label, value in alone)

    @cached_property
    def fixed(self) -> np.ndarray:
        """Whether each cell (cells,) lies in a conductor with an electrode, which determines its potential."""
        labels, potentials = self.potentials
        return np.isin(labels, list(potentials))

    @cached_property
    def anchored(self) -> bool:
        """Whether heat can leave every connected part of the solid."""
        labels = self.parts(self.solid)
        exits = self.touched(labels, filter(physics.is_exit, self.scene.boundaries))
        return len(exits) == labels.max(initial=0)
