"""Mirror symmetry of a scene: solve the smallest part that determines the rest.

A scene is symmetric about a plane through the middle of its boxes if the mirror maps materials, sources, thermal
conditions and probes onto themselves, and electrodes either onto electrodes of the same voltage (even: the plane is
insulated) or onto electrodes whose voltages add to a constant (odd: the plane is at half of the constant).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from math import inf
from typing import Any, TypeVar

import numpy as np

from meshes.grid import graph
from scenes.free.grid import distinct, grid_on
from scenes.model import FLOWS, Boundary, Box, Point, Probe, Scene, Schedule, Value, values
from scenes.result import Step

Item = TypeVar("Item", Box, Boundary, Probe)
Reading = tuple[float, tuple[Value, ...]]
"""The reading of a probe in the whole from its reading in a part: a factor, and values to add."""


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
    probes: dict[str, Reading]

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
    part, planes, whole = scene, [], uncut(scene, ())
    flows, probes = whole.flows, whole.probes
    for axis in range(3):
        if (mirror := _Mirror.of(part, axis)) is None:
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
    full, kept = ({b.name: float(np.prod(np.subtract(b.upper, b.lower))) for b in s.boxes} for s in (scene, part))
    copies = {name: full[name] / volume for name, volume in kept.items()}
    return Symmetry(part, tuple(planes), 2 ** len(planes), flows, copies, probes)


def uncut(scene: Any, bodies: Iterable[str]) -> Symmetry:
    """A scene that is solved whole, with the names of its bodies."""
    flows = {b.name: Flow(b.name, 1.0, 1.0) for b in scene.boundaries}
    return Symmetry(scene, (), 1, flows, dict.fromkeys(bodies, 1.0), {p.name: (1.0, ()) for p in scene.probes})


@dataclass(frozen=True)
class _Mirror:
    """A mirror plane across an axis.

    Attributes
    ----------
    middle : coordinate of the plane (m)
    small : lengths below this count as nothing (m)
    level : potential of an odd plane (V); None of an even one
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
        twins = mirror._twins(scene)
        if twins is None or not mirror._keeps_cells(scene) or None in (mirror.read(p, scene) for p in scene.probes):
            return None
        pairs = [(b, twins[b.name]) for b in scene.boundaries if b.kind == "voltage"]
        if all(b.series_resistance == c.series_resistance and b.value == c.value for b, c in pairs):
            return mirror
        readings = [p.reduce for p in scene.probes if p.quantity == "potential"]
        if any(b.series_resistance for b, _ in pairs):
            # Of two electrodes the current is odd; the potential of the plane, which no probe reads, is called zero.
            return None if readings or len(pairs) != 2 or pairs[0] == pairs[0][::-1] else mirror._driven(*pairs[0])
        # A largest potential on one side is a smallest one on the other.
        if readings.count("mean") < len(readings):
            return None
        sums = {_sum(b.value, c.value) for b, c in pairs}
        total = sums.pop()
        return None if sums or total is None else replace(mirror, level=_times(0.5, total))

    def _driven(self, one: Boundary, other: Boundary) -> _Mirror | None:
        """The odd plane between two electrodes of unknown potential; half the circuit drives the lower one."""
        low, high = sorted((one, other), key=lambda b: b.lower[self.axis])
        if inf in (low.series_resistance, high.series_resistance):
            current = low.value if low.series_resistance == inf else _times(-1.0, high.value)
            return replace(self, level=0.0, half=(current, inf))
        across = _sum(low.value, _times(-1.0, high.value))
        resistance = (low.series_resistance + high.series_resistance) / 2
        return None if across is None else replace(self, level=0.0, half=(_times(0.5, across), resistance))

    def _side(self, item: Item) -> int:
        """1 for an item above the plane, 0 for one that crosses it, -1 for one below or in the plane."""
        if item.upper[self.axis] <= self.middle + self.small:
            return -1
        return 0 if item.lower[self.axis] < self.middle - self.small else 1

    def _between(self, item: Item, low: float, high: float) -> Item:
        """An item moved to other coordinates along the axis."""
        corners = np.array([item.lower, item.upper])
        corners[:, self.axis] = low, high
        lower, upper = map(tuple, corners.tolist())
        return replace(item, lower=lower, upper=upper)

    def image(self, item: Item) -> Item:
        """The mirror image of an item."""
        return self._between(item, *(2 * self.middle - c[self.axis] for c in (item.upper, item.lower)))

    def _below(self, item: Item) -> Item:
        """The part of an item on the lower side, or in the plane."""
        return self._between(item, *(min(c[self.axis], self.middle) for c in (item.lower, item.upper)))

    def maps(self, item: Item, onto: Item) -> bool:
        """Whether the image of one item lies where the other one does."""
        ends = [*zip(item.lower, item.upper, strict=True)]
        ends[self.axis] = 2 * self.middle - item.upper[self.axis], 2 * self.middle - item.lower[self.axis]
        pairs = zip(ends, onto.lower, onto.upper, strict=True)
        return all(max(abs(a - c), abs(b - d)) <= self.small for (a, b), c, d in pairs)

    def _twins(self, scene: Scene) -> dict[str, Boundary] | None:
        """The boundary of the same kind, with the same thermal condition, that each is mapped onto; None where one is
        missing."""

        def kind(b: Boundary) -> tuple[object, ...]:
            return b.kind, b.contact_resistance, *(() if b.kind == "voltage" else (b.value, b.ambient))

        left, twins = list(scene.boundaries), dict[str, Boundary]()
        for b in scene.boundaries:
            image = next((c for c in left if kind(b) == kind(c) and self.maps(b, c)), None)
            if image is None:
                return None
            left.remove(image)
            twins[b.name] = image
        return twins

    def _keeps_cells(self, scene: Scene) -> bool:
        """Whether the mirror maps every cell between the scene's planes onto one of the same material and source, and
        every face with a contact onto one that is the same; none lies in its plane, where half of one would be left."""
        planes = list(graph(scene).planes)
        along = planes[self.axis]
        planes[self.axis] = np.array(distinct([*along, *(2 * self.middle - along)], self.small))
        grid = grid_on(scene, tuple(planes))
        kinds = list(dict.fromkeys((b.material, b.heat_source) for b in scene.boxes))
        marks = [np.array([*(kinds.index((b.material, b.heat_source)) for b in scene.boxes), -1])[grid.owner]]
        for key in ("thermal_resistance", "electrical_resistance") if scene.contacts else ():
            marks += grid.jumps(key)
            inner = np.moveaxis(marks[self.axis - 3], self.axis, 0)
            if len(inner) % 2 and inner[len(inner) // 2].any():
                return False
        return all((m == np.flip(m, self.axis)).all() for m in marks)

    def read(self, probe: Probe, scene: Scene) -> tuple[Probe, Reading] | None:
        """The probe on the lower side in whose place it is read, and its reading.

        None where the probe crosses the plane unevenly, or reads a flow through the plane.
        """
        side, extent = self._side(probe), np.subtract(probe.upper, probe.lower)
        in_plane = side < 0 and probe.lower[self.axis] >= self.middle - self.small
        if (side == 0 and not self.maps(probe, probe)) or (in_plane and probe.quantity in FLOWS):
            return None
        names = probe.boxes
        boxes = [b for b in scene.boxes if b.name in names]
        images = tuple(next((b.name for b in scene.boxes if self.maps(box, b)), "") for box in boxes)
        if side == 1:
            names = images
        # A volume on both sides has the same boxes on either.
        if "" in names or (side == 0 and (extent > 0).all() and set(images) != set(names)):
            return None
        part = self.image(probe) if side == 1 else self._below(probe)
        return replace(part, boxes=names), self._reading(probe, side, scene)

    def _reading(self, probe: Probe, side: int, scene: Scene) -> Reading:
        """The reading of a probe on a side in the whole: a factor of its reading in the part, and a value to add."""
        if probe.quantity == "temperature" or side == -1 or (probe.quantity == "potential" and self.level is None):
            return 1.0, ()
        if self.level is not None and probe.quantity == "potential":
            # The potential of the other side is twice the plane's less this side's.
            return (0.0, (self.level,)) if side == 0 else (-1.0, (_times(2.0, self.level),))
        turns = probe.quantity == "current" and self.level is not None
        if side == 0:
            # Both halves carry the same heat; the current of the other half is the same or the opposite.
            return 0.0 if turns else 2.0, ()
        # Inside the solid a flow counts along the axis, which the mirror turns.
        across = probe.lower[self.axis] == probe.upper[self.axis]
        inside = across and not (grid := graph(scene)).exposed(grid.faces(probe)).any()
        return -1.0 if inside != turns else 1.0, ()

    def cut(self, scene: Scene) -> tuple[Scene, dict[str, Flow], dict[str, Reading]]:
        """The lower side of a scene, which kept boundary stands for each, and how each probe is read."""
        kept, twins, flows = dict[str, Boundary](), self._twins(scene) or {}, dict[str, Flow]()
        for b in scene.boundaries:
            side = self._side(b)
            if side == 1:
                flows[b.name] = Flow(twins[b.name].name, 1.0, 1.0 if self.level is None else -1.0)
                continue
            kept[b.name] = self._below(b)
            copies = 2.0 if side == 0 else 1.0
            flows[b.name] = Flow(b.name, copies, copies)
            if b.kind == "voltage" and self.half is not None:
                kept[b.name] = replace(kept[b.name], value=self.half[0], series_resistance=self.half[1])
            elif b.series_resistance and side == 0:
                # Half of an electrode has half of a given current, or twice the resistance in series.
                value = _times(0.5, b.value) if b.series_resistance == inf else b.value
                kept[b.name] = replace(kept[b.name], value=value, series_resistance=2 * b.series_resistance)
        if self.level is not None:
            name = f"symmetry-{'xyz'[self.axis]}"
            whole = Boundary(name, "voltage", *_corners(scene), self.level)
            kept[name] = self._between(whole, self.middle, self.middle)
        boxes = tuple(self._below(b) for b in scene.boxes if self._side(b) < 1)
        read = [found for probe in scene.probes if (found := self.read(probe, scene))]
        part = replace(scene, boxes=boxes, boundaries=tuple(kept.values()), probes=tuple(probe for probe, _ in read))
        return part, flows, {probe.name: reading for probe, reading in read}


def _corners(scene: Scene) -> tuple[Point, Point]:
    """The lowest and the highest corner of the boxes."""
    low, high = np.min([b.lower for b in scene.boxes], axis=0), np.max([b.upper for b in scene.boxes], axis=0)
    return tuple(low.tolist()), tuple(high.tolist())


def _sum(a: Value, b: Value) -> Value | None:
    """The sum of two values; None for two schedules of different times, where it isn't worked out."""
    times = {value.times for value in (a, b) if isinstance(value, Schedule)}
    total = np.add(values(a), values(b)).tolist() if len(times) < 2 else []
    if len(set(total)) < 2:
        return total[0] if total else None
    return Schedule(times.pop(), tuple(total))


def _times(factor: float, value: Value) -> Value:
    if isinstance(value, Schedule):
        return Schedule(value.times, tuple(factor * v for v in value.values))
    return factor * value
