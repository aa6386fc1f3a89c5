"""Mirror symmetry of a scene: solve the smallest part that determines the rest.

A scene is symmetric about a plane through the middle of its boxes if the mirror maps materials, sources, thermal
conditions and probes onto themselves, and electrodes either onto electrodes of the same voltage (even: the plane is
insulated) or onto electrodes whose voltages add to a constant (odd: the plane is at half of the constant).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from math import inf
from typing import Any

import numpy as np

from meshes.grid import distinct, scene_planes
from scenes.free.grid import Grid, grid_on
from scenes.model import Boundary, Box, Point, Probe, Scene, Schedule, Value
from scenes.result import Step

Corners = tuple[Point, Point]
Item = Box | Boundary | Probe
Readings = dict[str, tuple[float, tuple[Value, ...]]]
"""The reading of each probe in the whole from its reading in a part: a factor, and values to add."""


@dataclass(frozen=True)
class Flow:
    """How much of an original boundary's heat flow and current one kept boundary carries."""

    boundary: str
    heat: float
    current: float


@dataclass(frozen=True)
class Symmetry:
    """The part of a scene that is solved.

    ``planes`` are (axis, coordinate, "even" | "odd"); the part is the lower side of each, ``copies`` times in the
    whole. ``flows`` maps each boundary of the whole scene to the kept boundary that stands for it; ``box_copies``
    counts how often a kept box fits into the original.
    """

    scene: Scene
    planes: tuple[tuple[int, float, str], ...]
    copies: int
    flows: dict[str, Flow]
    box_copies: dict[str, float]
    probes: Readings

    def mirrored(self, points: np.ndarray) -> np.ndarray:
        """Points (n, 3) of the whole scene, moved into the part that is solved."""
        moved = np.array(points, dtype=float)
        for axis, middle, _ in self.planes:
            moved[:, axis] = np.minimum(moved[:, axis], 2 * middle - moved[:, axis])
        return moved

    @property
    def part(self) -> str:
        """In words."""
        return {1: "the whole", 2: "the half", 4: "the quarter", 8: "the eighth"}[self.copies]

    @property
    def step(self) -> Step:
        """The line of a plan."""
        if not self.planes:
            return Step("symmetry", "skipped", "the scene has no mirror plane; the whole is solved")
        names = " and ".join(f"{'xyz'[axis]} ({parity})" for axis, _, parity in self.planes)
        return Step("symmetry", "done", f"{self.part} is solved: mirror planes across {names}")


def reduce(scene: Scene) -> Symmetry:
    """The part of a scene that its mirror symmetries leave to be solved."""
    part, planes = scene, []
    flows, probes = _untouched(scene)
    for axis in range(3):
        mirror = _Mirror.of(part, axis)
        if mirror is None:
            continue
        part, step, read = mirror.cut(part)
        # Outer planes come first: the values that this plane adds are multiplied by their factors.
        probes = {
            n: (f * read[n][0], (*added, *(_times(f, v) for v in read[n][1]))) for n, (f, added) in probes.items()
        }
        planes.append((axis, mirror.middle, "even" if mirror.level is None else "odd"))
        flows = {
            name: Flow(step[f.boundary].boundary, f.heat * step[f.boundary].heat, f.current * step[f.boundary].current)
            for name, f in flows.items()
        }
    whole, kept = ({b.name: float(np.prod(np.subtract(b.upper, b.lower))) for b in s.boxes} for s in (scene, part))
    copies = {name: whole[name] / volume for name, volume in kept.items()}
    return Symmetry(part, tuple(planes), 2 ** len(planes), flows, copies, probes)


def uncut(scene: Any, bodies: Iterable[str]) -> Symmetry:
    """A scene that is solved whole, with the names of its bodies."""
    flows, probes = _untouched(scene)
    return Symmetry(scene, (), 1, flows, dict.fromkeys(bodies, 1.0), probes)


def _untouched(scene: Any) -> tuple[dict[str, Flow], Readings]:
    return {b.name: Flow(b.name, 1.0, 1.0) for b in scene.boundaries}, {p.name: (1.0, ()) for p in scene.probes}


@dataclass(frozen=True)
class _Mirror:
    """A mirror plane across an axis.

    Attributes
    ----------
    middle : coordinate of the plane (m)
    small : lengths below this count as nothing (m)
    level : potential of an odd plane (V)
    half : value and series resistance that drive the kept electrode of two whose potentials are not all given
    """

    axis: int
    middle: float
    small: float
    level: Value | None = None
    half: tuple[Value, float] | None = None

    @staticmethod
    def of(scene: Scene, axis: int) -> _Mirror | None:
        """The plane through the middle of a scene; None where the scene isn't symmetric about it."""
        low, high = _corners(scene)
        mirror = _Mirror(axis, (low[axis] + high[axis]) / 2, 1e-9 * max(b - a for a, b in zip(low, high, strict=True)))
        fits = (
            mirror._keeps_solid(scene) and mirror._keeps_conditions(scene) and mirror._keeps_probes(scene)
            and (not scene.contacts or mirror._keeps_contacts(scene))
        )  # fmt: skip
        electrodes = [b for b in scene.boundaries if b.kind == "voltage"]
        twins = [(b, c) for b in electrodes for c in electrodes if mirror.maps(b, c)]
        pairs = [(b.value, c.value) for b, c in twins]
        if not fits or len(pairs) != len(electrodes):
            return None
        if any(b.contact_resistance != c.contact_resistance for b, c in twins):
            return None
        alike = all(b.series_resistance == c.series_resistance for b, c in twins)
        if alike and all(a == b for a, b in pairs):
            return mirror
        if any(b.series_resistance for b in electrodes):
            return mirror._between(scene, electrodes)
        # A largest potential on one side is a smallest one on the other.
        if any(p.quantity == "potential" and p.reduce != "mean" for p in scene.probes):
            return None
        sums = {_sum(a, b) for a, b in pairs}
        total = sums.pop()
        return None if sums or total is None else replace(mirror, level=_times(0.5, total))

    def _between(self, scene: Scene, electrodes: list[Boundary]) -> _Mirror | None:
        """The plane between two electrodes that map onto each other, at half of the sum of their unknown potentials.

        The current is odd, and the potential of the plane is called zero. None where a probe reads a potential.
        """
        if len(electrodes) != 2 or self.maps(electrodes[0], electrodes[0]):
            return None
        if any(p.quantity == "potential" for p in scene.probes):
            return None
        # The lower electrode is kept, and driven through half of the circuit.
        low, high = sorted(electrodes, key=lambda b: b.lower[self.axis])
        if inf in (low.series_resistance, high.series_resistance):
            current = low.value if low.series_resistance == inf else _times(-1.0, high.value)
            return replace(self, level=0.0, half=(current, inf))
        across = _sum(low.value, _times(-1.0, high.value))
        resistance = (low.series_resistance + high.series_resistance) / 2
        return None if across is None else replace(self, level=0.0, half=(_times(0.5, across), resistance))

    def image(self, item: Item) -> Corners:
        """The corners of a box's mirror image."""
        low, high = (2 * self.middle - c[self.axis] for c in (item.upper, item.lower))
        return self._at(item.lower, low), self._at(item.upper, high)

    def maps(self, item: Item, onto: Item) -> bool:
        """Whether the image of one box is the other."""
        pairs = zip(self.image(item), (onto.lower, onto.upper), strict=True)
        return all(abs(p - q) <= self.small for u, v in pairs for p, q in zip(u, v, strict=True))

    def _at(self, point: Point, coordinate: float) -> Point:
        x = list(point)
        x[self.axis] = coordinate
        return x[0], x[1], x[2]

    def _reaches_over(self, item: Item) -> bool:
        return item.upper[self.axis] > self.middle + self.small

    def _below(self, item: Item) -> Corners | None:
        """The part of a box on the lower side, or in the plane."""
        if item.lower[self.axis] >= self.middle - self.small and self._reaches_over(item):
            return None
        low, high = (min(c[self.axis], self.middle) for c in (item.lower, item.upper))
        return self._at(item.lower, low), self._at(item.upper, high)

    def _keeps_solid(self, scene: Scene) -> bool:
        """Whether the mirror maps every cell between the scene's planes onto one of the same material and source."""
        grid = self._both_sides(scene)
        kinds = list(dict.fromkeys((b.material, b.heat_source) for b in scene.boxes))
        cells = np.array([*(kinds.index((b.material, b.heat_source)) for b in scene.boxes), -1])[grid.owner]
        return bool((cells == np.flip(cells, self.axis)).all())

    def _both_sides(self, scene: Scene) -> Grid:
        """The grid of all planes of a scene and of their images."""
        planes = [np.array(scene_planes(scene, d)) for d in range(3)]
        along = planes[self.axis]
        planes[self.axis] = np.array(distinct([*along, *(2 * self.middle - along)], self.small))
        return grid_on(scene, tuple(planes))

    def _keeps_contacts(self, scene: Scene) -> bool:
        """Whether the mirror maps every face with a contact onto one that is the same, and none lies in its plane,
        where half of one would be left."""
        grid = self._both_sides(scene)
        count = grid.owner.shape[self.axis]
        for key in ("thermal_resistance", "electrical_resistance"):
            for axis, marks in enumerate(grid.jumps(key)):
                if (marks != np.flip(marks, self.axis)).any():
                    return False
                if axis == self.axis and count % 2 == 0 and np.take(marks, count // 2, axis=axis).any():
                    return False
        return True

    def _sides(self, scene: Scene, probe: Probe) -> tuple[str, ...] | None:
        """The names that the boxes of a probe have on the lower side, where it is read; None where these are others."""
        images = {
            box.name: next((b.name for b in scene.boxes if self.maps(box, b)), "")
            for box in scene.boxes
            if box.name in probe.boxes
        }
        if self._below(probe) is None:
            return None if "" in images.values() else tuple(images.values())
        volume = all(low < high for low, high in zip(probe.lower, probe.upper, strict=True))
        uneven = volume and self._reaches_over(probe) and set(images) != set(images.values())
        return None if uneven else probe.boxes

    def _keeps_conditions(self, scene: Scene) -> bool:
        """Whether the mirror maps every thermal condition onto one of its own that is the same."""
        thermal = [b for b in scene.boundaries if b.kind != "voltage"]
        images = list(thermal)
        for b in thermal:
            image = next((c for c in images if _thermal(b) == _thermal(c) and self.maps(b, c)), None)
            if image is None:
                return False
            images.remove(image)
        return True

    def _keeps_probes(self, scene: Scene) -> bool:
        """Whether no probe crosses the plane unevenly, or reads a flow through the plane."""
        for probe in scene.probes:
            low, high = probe.lower[self.axis] - self.middle, probe.upper[self.axis] - self.middle
            if low < -self.small and high > self.small and not self.maps(probe, probe):
                return False
            if max(abs(low), abs(high)) <= self.small and probe.quantity in ("heat_flow", "current"):
                return False
            if probe.boxes and self._sides(scene, probe) is None:
                return False
        return True

    def cut(self, scene: Scene) -> tuple[Scene, dict[str, Flow], Readings]:
        """The lower side of a scene, which kept boundary stands for each, and how each probe is read."""
        boxes = [replace(b, lower=c[0], upper=c[1]) for b in scene.boxes if (c := self._below(b))]
        kept = {b.name: self._driven(b, c) for b in scene.boundaries if (c := self._below(b))}
        flows = {}
        for b in scene.boundaries:
            if b.name in kept:
                copies = 2.0 if self._reaches_over(b) else 1.0
                flows[b.name] = Flow(b.name, copies, copies)
            else:
                twin = next(k for k in kept.values() if _thermal(b) == _thermal(k) and self.maps(b, k))
                flows[b.name] = Flow(twin.name, 1.0, 1.0 if self.level is None else -1.0)
        if self.level is not None:
            name, (low, high) = f"symmetry-{'xyz'[self.axis]}", _corners(scene)
            kept[name] = Boundary(name, "voltage", self._at(low, self.middle), self._at(high, self.middle), self.level)
        probes = []
        for probe in scene.probes:
            lower, upper = self._below(probe) or self.image(probe)
            probes.append(replace(probe, lower=lower, upper=upper, boxes=self._sides(scene, probe) or ()))
        read = {probe.name: self._reading(probe, scene) for probe in scene.probes}
        return replace(scene, boxes=tuple(boxes), boundaries=tuple(kept.values()), probes=tuple(probes)), flows, read

    def _driven(self, b: Boundary, corners: Corners) -> Boundary:
        """The kept part of a boundary; half of an electrode of unknown potential has half the current and twice the
        resistance."""
        boundary = replace(b, lower=corners[0], upper=corners[1])
        if b.kind == "voltage" and self.half is not None:
            return replace(boundary, value=self.half[0], series_resistance=self.half[1])
        if not b.series_resistance or not self._reaches_over(b):
            return boundary
        current = b.series_resistance == inf
        return replace(
            boundary, value=_times(0.5, b.value) if current else b.value, series_resistance=2 * b.series_resistance
        )  # fmt: skip

    def _reading(self, probe: Probe, scene: Scene) -> tuple[float, tuple[Value, ...]]:
        """The reading of a probe in the whole: a factor of its reading in the part, and a value to add."""
        mirrored = self._below(probe) is None
        crosses = not mirrored and self._reaches_over(probe)
        if probe.quantity == "temperature" or not (crosses or mirrored):
            return 1.0, ()
        if probe.quantity == "potential":
            if self.level is None:
                return 1.0, ()
            # The potential of the other side is twice the plane's less this side's.
            return (0.0, (self.level,)) if crosses else (-1.0, (_times(2.0, self.level),))
        turns = probe.quantity == "current" and self.level is not None
        if crosses:
            # Both halves carry the same heat; the current of the other half is the same or the opposite.
            return 0.0 if turns else 2.0, ()
        sign = -1.0 if probe.lower[self.axis] == probe.upper[self.axis] and self._inside(probe, scene) else 1.0
        return -sign if turns else sign, ()

    def _inside(self, probe: Probe, scene: Scene) -> bool:
        """Whether there is solid on both sides of a flat probe, so that a flow counts along the axis."""
        point = [(a + b) / 2 for a, b in zip(probe.lower, probe.upper, strict=True)]
        return all(
            any(all(b.lower[d] <= q[d] <= b.upper[d] for d in range(3)) for b in scene.boxes)
            for q in ([c + side * 1e3 * self.small * (d == self.axis) for d, c in enumerate(point)] for side in (-1, 1))
        )


def _thermal(b: Boundary) -> tuple[object, ...]:
    """The thermal condition of a boundary, empty for an electrode."""
    return () if b.kind == "voltage" else (b.kind, b.value, b.ambient, b.contact_resistance)


def _corners(scene: Scene) -> Corners:
    """The lowest and the highest corner of the boxes."""
    low, high = np.min([b.lower for b in scene.boxes], axis=0), np.max([b.upper for b in scene.boxes], axis=0)
    return tuple(low.tolist()), tuple(high.tolist())


def _sum(a: Value, b: Value) -> Value | None:
    """The sum of two values; None for two schedules of different times, where it isn't worked out."""
    if not isinstance(a, Schedule):
        return _sum(b, a) if isinstance(b, Schedule) else a + b
    if not isinstance(b, Schedule):
        return Schedule(a.times, tuple(p + b for p in a.values))
    if a.times != b.times:
        return None
    values = tuple(p + q for p, q in zip(a.values, b.values, strict=True))
    return values[0] if len(set(values)) == 1 else Schedule(a.times, values)


def _times(factor: float, value: Value) -> Value:
    if isinstance(value, Schedule):
        return Schedule(value.times, tuple(factor * v for v in value.values))
    return factor * value
