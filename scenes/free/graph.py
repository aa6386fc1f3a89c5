"""A scene on cells that faces join: the parts of its solid, its conductors, and the cells and faces of its conditions.

The boxes of a scene (`scenes.free.grid`) and the groups of a mesh file (`meshes.grouped.check`) are both such graphs.
Cells and faces have numbers; a mask (cells,) chooses cells, a label (cells,) numbers connected parts from 1 on.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable
from functools import cached_property
from itertools import pairwise
from math import inf
from typing import Any, ClassVar

import numpy as np

from scenes import physics
from scenes.errors import SceneError, listed, quoted
from scenes.model import ROUNDING, AnyScene, Contact, Schedule, Value


class CellGraph(ABC):
    """A scene on cells.

    Attributes
    ----------
    scene : a `Scene` or a `MeshScene`
    f2t : (2, faces) the solid cells beside each face, -1 for none
    solid, conducting, heated : (cells,) whether each cell belongs to the solid, conducts, has a heat source
    part_names : names of all boxes, or of all volume groups
    part_word, place_word, side_key : the word for a part and for a place in a scene file, and the key that names the
        part in which a probe is read
    """

    scene: Any
    f2t: Any
    solid: Any
    conducting: Any
    heated: Any
    part_names: Any
    part_word: ClassVar[str]
    place_word: ClassVar[str]
    side_key: ClassVar[str]

    @abstractmethod
    def part(self, name: str) -> np.ndarray:
        """Return whether each cell (cells,) belongs to a box or a volume group."""

    @abstractmethod
    def faces(self, item: Any) -> np.ndarray:
        """Return the faces of a condition or of a flat probe."""

    @abstractmethod
    def nodes(self, faces: np.ndarray) -> np.ndarray:
        """Return (corners, faces) the corners of each face."""

    @abstractmethod
    def covered(self, probe: Any, mask: np.ndarray) -> np.ndarray:
        """Return (places,) whether each place of a probe, its point, faces or cells, touches a chosen cell."""

    @cached_property
    def _inner(self) -> np.ndarray:
        """The faces with a cell on either side."""
        return np.flatnonzero((self.f2t[0] >= 0) & (self.f2t[1] >= 0))

    def between(self, contact: Contact) -> np.ndarray:
        """Return the faces of a contact, none where one of its parts is missing."""
        if not set(self.part_names) >= set(contact.between):
            return np.empty(0, int)
        return between(self.f2t, *map(self.part, contact.between))

    def parts(self, mask: np.ndarray, cuts: np.ndarray | None = None) -> np.ndarray:
        """Return (cells,) labels of the chosen cells that faces join, except the faces ``cuts``; 0 elsewhere."""
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import connected_components

        faces = np.setdiff1d(self._inner, [] if cuts is None else cuts, assume_unique=True)
        number, count = np.cumsum(mask, dtype=np.int32) - 1, int(mask.sum())
        first, second = number[self.f2t[:, faces[mask[self.f2t[:, faces]].all(axis=0)]]]
        graph = coo_array((np.ones(len(first), bool), (first, second)), shape=(count, count))
        labels = np.zeros(len(mask), np.int32)
        labels[mask] = 1 + connected_components(graph, directed=False)[1]
        return labels

    def names(self, mask: np.ndarray) -> list[str]:
        """Return the boxes or volume groups with some of the chosen cells."""
        return [name for name in self.part_names if (self.part(name) & mask).any()]

    def bordering(self, faces: np.ndarray, mask: np.ndarray) -> np.ndarray:
        """Return (faces,) whether each face is a side of a chosen cell."""
        cells = self.f2t[:, faces]
        touches: np.ndarray = ((cells >= 0) & mask[cells]).any(axis=0)
        return touches

    def exposed(self, faces: np.ndarray) -> np.ndarray:
        """Return (faces,) whether each face has solid on one side only."""
        solid = self.f2t[:, faces] >= 0
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
            cells = self.f2t[:, self.acting(b)]
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


def between(f2t: np.ndarray, one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return the faces between some cells (cells,) and others, by the two cells ``f2t`` (2, faces) of each face."""
    inside = np.flatnonzero((f2t >= 0).all(axis=0))
    pairs = f2t[:, inside]
    return inside[(one[pairs] & other[pairs[::-1]]).any(axis=0)]


Pair = tuple[Any, Any]
"""An electrode, and the other one of its conductor: boundaries."""


def pairs(graph: CellGraph) -> dict[str, Pair]:
    """Return the electrode and the other one for each probe of a resistance, by its name.

    Raises SceneError for a probe on no electrode, for a conductor with one or several others, and where no current
    passes for some time.
    """
    return {p.name: _pair(graph, p) for p in graph.scene.probes if p.quantity == "resistance"}


def resistance(between: np.ndarray, current: np.ndarray, time: np.ndarray) -> np.ndarray:
    """Return the resistance (ohm) at times (s) with these voltages and currents; 0 without any current, and between
    the times beside it where none passes for some time."""
    passing = np.abs(current) > ROUNDING * np.abs(current).max()
    if not passing.any():
        return np.zeros(current.shape)
    if passing.all():
        return between / current
    return np.interp(time, time[passing], between[passing] / current[passing])


def _pair(graph: CellGraph, probe: Any) -> Pair:
    said, conductors = f"probe {quoted(probe.name)} asks for a resistance", graph.joined().values()
    electrodes = {b.name: b for b in graph.scene.boundaries if b.kind == "voltage"}
    electrode = next((b for b in electrodes.values() if np.array_equal(graph.faces(probe), graph.faces(b))), None)
    if electrode is None:
        one = f"give {graph.place_word} of one, of {listed(list(electrodes))}"
        raise SceneError(f"{said}, and no electrode is there: {one}")
    others = {n for names in conductors if electrode.name in names for n in names} - {electrode.name}
    if len(others) != 1:
        has = f"{len(others)} others, {listed(sorted(others))}" if others else "no other"
        whose = f"the conductor of {quoted(electrode.name)} has {has}"
        raise SceneError(f"{said}, which is between two electrodes, and {whose}: give one of a conductor with two")
    partner = electrodes[others.pop()]
    if _idle(graph.scene, electrode, partner):
        by_current = inf in (electrode.series_resistance, partner.series_resistance)
        flows = "current passes" if by_current else "voltage drives one"
        where = f"{flows} between {quoted(electrode.name)} and {quoted(partner.name)}"
        raise SceneError(f"{said}, and for some time no {where}: give a small one, as one would to measure")
    return electrode, partner


def _idle(scene: AnyScene, electrode: Any, partner: Any) -> bool:
    """Whether nothing drives a current from one electrode to the other, always or for some time."""
    by_current = [b for b in (electrode, partner) if b.series_resistance == inf]
    plus, minus = (by_current[0].value, 0.0) if by_current else (electrode.value, partner.value)
    end = 0.0 if scene.steady else scene.end_time
    times = sorted({0.0, end, *(t for v in (plus, minus) if isinstance(v, Schedule) for t in v.times if t < end)})
    # A line that is zero at two places between its ends is zero.
    places = np.array([a + part * (b - a) for a, b in pairwise(times) for part in (1 / 3, 2 / 3)] or [0.0, 0.0])
    rows = [(v.times, v.values) if isinstance(v, Schedule) else ((0.0,), (v,)) for v in (plus, minus)]
    drops = np.interp(places, *rows[0]) - np.interp(places, *rows[1])
    return bool((drops.reshape(-1, 2) == 0).all(axis=1).any())
