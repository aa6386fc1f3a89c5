"""Mirror symmetry of a scene: solve the smallest part that determines the rest.

A scene is symmetric about a plane through the middle of its boxes if the mirror maps materials, sources, thermal
conditions and probes onto themselves, and electrodes either onto electrodes of the same voltage (even: the plane is
insulated) or onto electrodes whose voltages add to a constant (odd: the plane is at half of it).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from scenes.model import Boundary, Box, Point, Probe, Scene, Schedule, Value
from scenes.plan import Step

Corners = tuple[Point, Point]


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
    whole. ``flows`` maps each boundary of the whole scene to the kept boundary that stands for it; ``box_copies`` says
    how many times a kept box is in the box it was cut from. ``probes`` takes what a probe reads in the part to what it
    reads in the whole: a factor, and values to add.
    """

    scene: Scene
    planes: tuple[tuple[int, float, str], ...]
    copies: int
    flows: dict[str, Flow]
    box_copies: dict[str, float]
    probes: dict[str, tuple[float, tuple[Value, ...]]]

    def mirrored(self, points: np.ndarray) -> np.ndarray:
        """Points (n, 3) of the whole scene, moved to where the part holds their value."""
        found = np.array(points, dtype=float)
        for axis, middle, _ in self.planes:
            found[:, axis] = np.minimum(found[:, axis], 2 * middle - found[:, axis])
        return found

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
    flows = {b.name: Flow(b.name, 1.0, 1.0) for b in scene.boundaries}
    probes: dict[str, tuple[float, tuple[Value, ...]]] = {p.name: (1.0, ()) for p in scene.probes}
    for axis in range(3):
        middle = _middle(part, axis)
        parity = _parity(part, axis, middle)
        if parity is None:
            continue
        part, step, read = _cut(part, axis, middle, parity)
        # Outer planes come first: what this plane adds is seen through their factors.
        probes = {
            n: (f * read[n][0], (*added, *(_times(f, v) for v in read[n][1]))) for n, (f, added) in probes.items()
        }
        planes.append((axis, middle, parity))
        flows = {
            name: Flow(step[f.boundary].boundary, f.heat * step[f.boundary].heat, f.current * step[f.boundary].current)
            for name, f in flows.items()
        }
    whole = {b.name: _volume(b) for b in scene.boxes}
    copies = {b.name: whole[b.name] / _volume(b) for b in part.boxes}
    return Symmetry(part, tuple(planes), 2 ** len(planes), flows, copies, probes)


def uncut(scene: Any, bodies: Iterable[str]) -> Symmetry:
    """A scene that is solved whole, with the names of its bodies."""
    flows = {b.name: Flow(b.name, 1.0, 1.0) for b in scene.boundaries}
    return Symmetry(scene, (), 1, flows, dict.fromkeys(bodies, 1.0), {p.name: (1.0, ()) for p in scene.probes})


def _volume(box: Box) -> float:
    return float(np.prod(np.subtract(box.upper, box.lower)))


def _middle(scene: Scene, axis: int) -> float:
    lower = min(b.lower[axis] for b in scene.boxes)
    return (lower + max(b.upper[axis] for b in scene.boxes)) / 2


def _extent(scene: Scene) -> float:
    return max(max(b.upper[d] for b in scene.boxes) - min(b.lower[d] for b in scene.boxes) for d in range(3))


def _mirror(item: Box | Boundary | Probe, axis: int, middle: float) -> Corners:
    lower, upper = list(item.lower), list(item.upper)
    lower[axis], upper[axis] = 2 * middle - item.upper[axis], 2 * middle - item.lower[axis]
    return (lower[0], lower[1], lower[2]), (upper[0], upper[1], upper[2])


def _parity(scene: Scene, axis: int, middle: float) -> str | None:
    """ "even", "odd", or None where the scene isn't symmetric about the plane."""
    small = 1e-9 * _extent(scene)

    def same(a: Corners, b: Corners) -> bool:
        return _close(a, b, small)

    if not _same_solid(scene, axis, middle, small):
        return None
    thermal = [b for b in scene.boundaries if b.kind != "voltage"]
    if not all(
        any(
            (b.kind, b.value, b.ambient) == (c.kind, c.value, c.ambient)
            and same(_mirror(b, axis, middle), (c.lower, c.upper))
            for c in thermal
        )
        for b in thermal
    ):
        return None
    for probe in scene.probes:
        crosses = probe.lower[axis] < middle - small and probe.upper[axis] > middle + small
        if crosses and not same(_mirror(probe, axis, middle), (probe.lower, probe.upper)):
            return None
        lies_in_it = abs(probe.lower[axis] - middle) <= small and abs(probe.upper[axis] - middle) <= small
        if lies_in_it and probe.quantity in ("heat_flow", "current"):
            return None
    electrodes = [b for b in scene.boundaries if b.kind == "voltage"]
    pairs = [
        (b.value, c.value) for b in electrodes for c in electrodes if same(_mirror(b, axis, middle), (c.lower, c.upper))
    ]
    if len(pairs) != len(electrodes):
        return None
    if all(a == b for a, b in pairs):
        return "even"
    # A largest potential on one side is a smallest one on the other.
    if any(p.quantity == "potential" and p.reduce != "mean" for p in scene.probes):
        return None
    sums = {_sum(a, b) for a, b in pairs}
    return "odd" if len(sums) == 1 and None not in sums else None


def _sum(a: Value, b: Value) -> Value | None:
    """The sum of two values; None for two schedules of different times, where it isn't worked out."""
    if isinstance(a, Schedule) and isinstance(b, Schedule):
        if a.times != b.times:
            return None
        values = tuple(p + q for p, q in zip(a.values, b.values, strict=True))
        return values[0] if len(set(values)) == 1 else Schedule(a.times, values)
    if isinstance(a, Schedule):
        assert not isinstance(b, Schedule)
        return Schedule(a.times, tuple(p + b for p in a.values))
    return _sum(b, a) if isinstance(b, Schedule) else a + b


def _close(a: Corners, b: Corners, small: float) -> bool:
    return all(abs(p - q) <= small for u, v in zip(a, b, strict=True) for p, q in zip(u, v, strict=True))


def _times(factor: float, value: Value) -> Value:
    if isinstance(value, Schedule):
        return Schedule(value.times, tuple(factor * v for v in value.values))
    return factor * value


def _same_solid(scene: Scene, axis: int, middle: float, small: float) -> bool:
    """Whether the mirror maps every cell of the boxes' grid onto a cell of the same material and source."""
    breaks = []
    for d in range(3):
        found = [c for b in scene.boxes for c in (b.lower[d], b.upper[d])]
        if d == axis:
            found += [2 * middle - c for c in found]
        found.sort()
        breaks.append(np.array([c for i, c in enumerate(found) if i == 0 or c - found[i - 1] > small]))
    x, y, z = ((b[:-1] + b[1:]) / 2 for b in breaks)
    kinds: list[tuple[object, Value]] = []
    cells = np.full((len(x), len(y), len(z)), -1)
    for box in scene.boxes:
        kind = (box.material, box.heat_source)
        if kind not in kinds:
            kinds.append(kind)
        inside = [(c > box.lower[d]) & (c < box.upper[d]) for d, c in enumerate((x, y, z))]
        cells[np.ix_(*inside)] = kinds.index(kind)
    return bool((cells == np.flip(cells, axis)).all())


def _cut(
    scene: Scene, axis: int, middle: float, parity: str
) -> tuple[Scene, dict[str, Flow], dict[str, tuple[float, tuple[Value, ...]]]]:
    """The lower side of a plane, which kept boundary stands for each, and how each probe is read."""
    small = 1e-9 * _extent(scene)

    def below(item: Box | Boundary | Probe) -> Corners | None:
        if item.lower[axis] >= middle - small and item.upper[axis] > middle + small:
            return None
        lower, upper = list(item.lower), list(item.upper)
        lower[axis], upper[axis] = min(lower[axis], middle), min(upper[axis], middle)
        return (lower[0], lower[1], lower[2]), (upper[0], upper[1], upper[2])

    boxes = [replace(b, lower=c[0], upper=c[1]) for b in scene.boxes if (c := below(b))]
    kept = [replace(b, lower=c[0], upper=c[1]) for b in scene.boundaries if (c := below(b))]
    flows = {}
    for boundary in scene.boundaries:
        own = next((k for k in kept if k.name == boundary.name), None)
        if own is not None:
            copies = 2.0 if boundary.upper[axis] > middle + small else 1.0
            flows[boundary.name] = Flow(own.name, copies, copies)
        else:
            lower, upper = _mirror(boundary, axis, middle)
            twin = next(
                k
                for k in kept
                if (k.kind == "voltage") == (boundary.kind == "voltage")
                and all(abs(p - q) <= small for p, q in zip((*k.lower, *k.upper), (*lower, *upper), strict=True))
            )
            flows[boundary.name] = Flow(twin.name, 1.0, -1.0 if parity == "odd" else 1.0)
    level: Value = 0.0
    if parity == "odd":
        level = _level(scene, axis, middle)
        low = [min(b.lower[d] for b in scene.boxes) for d in range(3)]
        high = [max(b.upper[d] for b in scene.boxes) for d in range(3)]
        low[axis] = high[axis] = middle
        corners = (low[0], low[1], low[2]), (high[0], high[1], high[2])
        kept.append(Boundary(f"symmetry-{'xyz'[axis]}", "voltage", *corners, level))
    probes, read = [], {}
    for probe in scene.probes:
        here = below(probe)
        lower_upper = here if here is not None else _mirror(probe, axis, middle)
        probes.append(replace(probe, lower=lower_upper[0], upper=lower_upper[1]))
        crosses = here is not None and probe.upper[axis] > middle + small
        read[probe.name] = _reading(probe, axis, parity, level, crosses, mirrored=here is None, scene=scene)
    return replace(scene, boxes=tuple(boxes), boundaries=tuple(kept), probes=tuple(probes)), flows, read


def _level(scene: Scene, axis: int, middle: float) -> Value:
    """Half the sum of the voltages of an electrode and its mirror image: that of the plane."""
    small = 1e-9 * _extent(scene)
    electrodes = [b for b in scene.boundaries if b.kind == "voltage"]
    image = _mirror(electrodes[0], axis, middle)
    twin = next(b for b in electrodes if _close(image, (b.lower, b.upper), small))
    total = _sum(electrodes[0].value, twin.value)
    assert total is not None
    return _times(0.5, total)


def _reading(
    probe: Probe, axis: int, parity: str, level: Value, crosses: bool, mirrored: bool, scene: Scene
) -> tuple[float, tuple[Value, ...]]:
    """What a probe reads in the whole: a factor of what it reads in the part, and a value to add."""
    if probe.quantity == "temperature":
        return 1.0, ()
    if probe.quantity == "potential":
        if parity == "even" or not (crosses or mirrored):
            return 1.0, ()
        # The potential of the other side is twice the plane's less this side's.
        return (0.0, (level,)) if crosses else (-1.0, (_times(2.0, level),))
    if crosses:
        # Both halves carry the same heat; the current of the other half is that of this one, or its opposite.
        return (2.0 if probe.quantity == "heat_flow" or parity == "even" else 0.0), ()
    if not mirrored:
        return 1.0, ()
    sign = -1.0 if probe.lower[axis] == probe.upper[axis] and _inside(probe, axis, scene) else 1.0
    return sign * (-1.0 if probe.quantity == "current" and parity == "odd" else 1.0), ()


def _inside(probe: Probe, axis: int, scene: Scene) -> bool:
    """Whether there is solid on both sides of a flat probe, so that its sign is that of the axis."""
    small = 1e-6 * _extent(scene)
    point = [(a + b) / 2 for a, b in zip(probe.lower, probe.upper, strict=True)]
    return all(
        any(all(b.lower[d] <= q[d] <= b.upper[d] for d in range(3)) for b in scene.boxes)
        for q in ([c + side * small * (d == axis) for d, c in enumerate(point)] for side in (-1, 1))
    )
