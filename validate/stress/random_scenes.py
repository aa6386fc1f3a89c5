"""Random scenes: connected boxes of random sizes and materials, heated in one or more ways, cooled somewhere.

Boxes are cells of a random grid of up to three by three by two, with voids between, re-entrant edges and corners, thin
layers; one or two materials conduct, and the underside is held at a temperature. Three of twenty scenes run over time,
under steps and ramps. Everything follows from a seed.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import combinations, product
from typing import NamedTuple

import numpy as np

from scenes.model import Boundary, Box, Material, Point, Probe, Scene, Schedule

ROOM, RISE = 293.0, 10.0
MATERIALS = (
    Material("silicon", 130.0, 2330.0, 712.0, 6e-5, 5e-4), Material("gold", 317.0, 19300.0, 129.0, 2.2e-8, 3.4e-3),
    Material("oxide", 1.38, 2200.0, 703.0), Material("nitride", 20.0, 3100.0, 700.0),
    Material("polysilicon", 30.0, 2330.0, 712.0, 2e-5, 1e-3), Material("polymer", 0.15, 970.0, 1460.0),
    Material("heater", 60.0, 8000.0, 500.0, 1e-6, 1e-4), Material("metal", 240.0, 2700.0, 900.0, 2.8e-8, 4e-3),
)  # fmt: skip
Cell = tuple[int, int, int]


@dataclass(frozen=True)
class Drawn:
    """A random scene, and what was drawn: ``heats`` lists "current", "source", "flux"."""

    seed: int
    scene: Scene
    heats: tuple[str, ...]


def draw(seed: int, accuracy: float = 1e-2) -> Drawn:
    """The scene of a seed."""
    # What is drawn of the second generator leaves the rest as it is.
    rng, more = np.random.default_rng(seed), np.random.default_rng([seed, 1])
    base = 10 ** float(rng.uniform(-5.5, -4))
    planes = [_planes(rng, int(rng.integers(1, 4)), base) for _ in range(2)]
    planes.append(_planes(rng, int(rng.integers(1, 3)), base * 10 ** float(rng.uniform(-2, 0))))
    cells = _connected(rng, [len(p) - 1 for p in planes], int(rng.integers(2, 6)))
    conductors = [m for m in MATERIALS if m.resistivity is not None]
    insulators = [m for m in MATERIALS if m.resistivity is None]
    palette = [
        conductors[int(rng.integers(len(conductors)))],
        *rng.permutation(np.array(insulators, object))[: int(rng.integers(0, 3))],
    ]
    boxes = [
        Box(f"box {i}", palette[int(rng.integers(len(palette)))], *_corners(planes, cell))
        for i, cell in enumerate(cells)
    ]
    other = conductors[int(more.integers(len(conductors)))]
    for i in np.flatnonzero(more.random(len(boxes)) < 0.3).tolist():
        if boxes[i].material is palette[0]:
            boxes[i] = replace(boxes[i], material=other)
    free = _free_faces(cells)
    rng.shuffle(free)
    boundaries, heats = [], []
    # The underside at a given temperature, and sometimes a film, so that the heat can leave.
    far = planes[0][-1], planes[1][-1], 0.0
    boundaries.append(Boundary("cold", "temperature", (0.0, 0.0, 0.0), far, ROOM))
    free = [at for at in free if not (at[1:] == (2, 0) and cells[at[0]][2] == 0)]
    if rng.random() < 0.4 and free:
        film = free.pop()
        h = 10 ** float(rng.uniform(1, 5))
        boundaries.append(Boundary("film", "convection", *_face(planes, cells[film[0]], *film[1:]), h, ROOM))
        behind = film[0], film[1], 1 - film[2]
        if behind in free and more.random() < 0.7:
            free.remove(behind)
            h *= 10 ** float(more.uniform(-1, 1))
            boundaries.append(Boundary("back", "convection", *_face(planes, cells[film[0]], *behind[1:]), h, ROOM))
    strength = _strength(planes, boxes)
    ends = _electrodes(boxes, cells, free) if rng.random() < 0.7 else None
    inner = ""
    if ends is not None:
        for at in ends:
            free.remove(at)
        inside = _inside(boxes, cells, ends[1])
        if inside and more.random() < 0.4:
            inner, ends = "plus", (inside[int(more.integers(len(inside)))], ends[1])
        for name, at, volts in zip(("plus", "minus"), ends, (strength.voltage, 0.0), strict=True):
            boundaries.append(Boundary(name, "voltage", *_face(planes, cells[at[0]], *at[1:]), volts))
        heats.append("current")
    if (rng.random() < 0.4 or not heats) and free:
        hot = free.pop()
        boundaries.append(Boundary("flux", "heat_flux", *_face(planes, cells[hot[0]], *hot[1:]), strength.flux))
        heats.append("flux")
    if rng.random() < 0.4 or not heats:
        i = int(rng.integers(len(boxes)))
        boxes[i] = Box(boxes[i].name, boxes[i].material, boxes[i].lower, boxes[i].upper, strength.source)
        heats.append("source")
    probes = [Probe(f"mean {i}", box.lower, box.upper) for i, box in enumerate(boxes[:3])]
    probes += [
        Probe(f"into {b.name}", b.lower, b.upper, "current" if b.kind == "voltage" else "heat_flow")
        for b in boundaries
        if b.name != inner
    ]
    scene = Scene(f"random {seed}", tuple(boxes), tuple(boundaries), tuple(probes), ROOM, 1.0, accuracy, True)
    if seed % 20 >= 17:
        scene = _over_time(more, scene, max(p[-1] - p[0] for p in planes))
    return Drawn(seed, scene, tuple(heats))


def _over_time(rng: np.random.Generator, scene: Scene, size: float) -> Scene:
    """The scene from rest over a time in which heat crosses some of the first box's material: what heats it steps and
    ramps, up, down and to the other sign; sometimes the cold temperature steps too."""
    material = scene.boxes[0].material
    end = 10 ** float(rng.uniform(-2, 0.5)) * size**2 * material.heat_capacity / material.thermal_conductivity

    def varied(value: float) -> Schedule:
        times, factors = np.sort(rng.uniform(0, end, 3)), rng.uniform(-1, 1, 3)
        at, levels = [0.0, times[0], times[0], times[1], times[2]], [1.0, 1.0, factors[0], factors[1], factors[2]]
        return Schedule(tuple(map(float, at)), tuple(value * float(f) for f in levels))

    boundaries = tuple(
        replace(b, value=varied(float(b.value))) if b.name in ("plus", "flux") else b  # type: ignore[arg-type]
        for b in scene.boundaries
    )
    if rng.random() < 0.3:
        step = Schedule((0.0, 0.37 * end, 0.37 * end), (ROOM, ROOM, ROOM + RISE / 2))
        boundaries = (replace(boundaries[0], value=step), *boundaries[1:])
    boxes = tuple(replace(b, heat_source=varied(b.heat_source)) if b.heat_source else b for b in scene.boxes)  # type: ignore[arg-type]
    instants = tuple((end * np.linspace(0.05, 1.0, 20)).tolist())
    return replace(scene, boxes=boxes, boundaries=boundaries, steady=False, end_time=end, output_times=instants)


class _Strength(NamedTuple):
    """Heating of some ten kelvin: W/m2, W/m3, V."""

    flux: float
    source: float
    voltage: float


def _strength(planes: list[list[float]], boxes: list[Box]) -> _Strength:
    """From the worst conductor of heat over the size of the whole, as an order of magnitude."""
    size = max(p[-1] - p[0] for p in planes)
    k = min(box.material.thermal_conductivity for box in boxes)
    rho = min((box.material.resistivity for box in boxes if box.material.resistivity), default=1.0)
    return _Strength(RISE * k / size, RISE * k / size**2, float(np.sqrt(8 * RISE * k * rho)))


def _planes(rng: np.random.Generator, intervals: int, base: float) -> list[float]:
    """Planes with intervals of a third to three times a base length (m)."""
    sizes = base * 10 ** rng.uniform(-0.5, 0.5, intervals)
    planes: list[float] = np.concatenate([[0.0], np.cumsum(sizes)]).tolist()
    return planes


def _connected(rng: np.random.Generator, shape: list[int], count: int) -> list[Cell]:
    """Cells of a grid, each after the first a neighbour of an earlier one."""
    found: list[Cell] = [(0, 0, 0)]
    while len(found) < count:
        around = sorted({n for cell in found for n in _neighbours(cell, shape)} - set(found))
        if not around:
            break
        found.append(around[int(rng.integers(len(around)))])
    # Cells that meet along an edge or in a point alone, a contact of no area, go again.
    while any(not _by_faces(found, a, b) for a, b in combinations(found, 2)):
        found.pop()
    return found


def _by_faces(cells: list[Cell], a: Cell, b: Cell) -> bool:
    """Whether two cells that touch are joined by faces of cells around the place where they do."""
    if max(abs(p - q) for p, q in zip(a, b, strict=True)) > 1:
        return True
    low, high = np.minimum(a, b), np.maximum(a, b)
    near = {c for c in cells if (low <= c).all() and (high >= c).all()}
    reached, edge = {a}, [a]
    while edge:
        one = edge.pop()
        new = {c for c in near - reached if sum(abs(p - q) for p, q in zip(c, one, strict=True)) == 1}
        reached |= new
        edge += sorted(new)
    return b in reached


def _neighbours(cell: Cell, shape: list[int]) -> list[Cell]:
    found = []
    for d, step in product(range(3), (-1, 1)):
        other = [*cell]
        other[d] += step
        if 0 <= other[d] < shape[d]:
            found.append((other[0], other[1], other[2]))
    return found


def _free_faces(cells: list[Cell]) -> list[tuple[int, int, int]]:
    """(cell's number, axis, side) of all faces on the surface."""
    found = []
    for number, cell in enumerate(cells):
        for d, side in product(range(3), (0, 1)):
            other = [*cell]
            other[d] += 2 * side - 1
            if tuple(other) not in cells:
                found.append((number, d, side))
    return found


def _electrodes(
    boxes: list[Box], cells: list[Cell], free: list[tuple[int, int, int]]
) -> tuple[tuple[int, int, int], tuple[int, int, int]] | None:  # fmt: skip
    """Two faces on one conducting piece that don't touch, as far apart as any two."""
    conducting = {i for i, box in enumerate(boxes) if box.material.resistivity is not None}
    piece = _piece(cells, conducting)
    able = [at for at in free if at[0] in piece]
    apart = [
        (sum(abs(a - b) for a, b in zip(cells[p[0]], cells[q[0]], strict=True)), p, q)
        for p in able for q in able
        if p[1] == q[1] and p[2] != q[2] and cells[p[0]][p[1]] + p[2] != cells[q[0]][q[1]] + q[2]
    ]  # fmt: skip
    return max(apart)[1:] if apart else None


def _inside(boxes: list[Box], cells: list[Cell], minus: tuple[int, int, int]) -> list[tuple[int, int, int]]:
    """The faces between cells of one conducting piece that are parallel to an electrode on it, in another plane."""
    number, d, side = minus
    piece = _piece(cells, {i for i, box in enumerate(boxes) if box.material.resistivity is not None})
    found = []
    for i in sorted(piece):
        above = tuple(c + (e == d) for e, c in enumerate(cells[i]))
        if above in cells and cells.index(above) in piece and cells[i][d] + 1 != cells[number][d] + side:
            found.append((i, d, 1))
    return found


def _piece(cells: list[Cell], conducting: set[int]) -> set[int]:
    """The largest set of conducting cells joined by faces."""
    left, best = set(conducting), set[int]()
    while left:
        piece, edge = set[int](), [left.pop()]
        while edge:
            one = edge.pop()
            piece.add(one)
            near = {i for i in left if sum(abs(a - b) for a, b in zip(cells[i], cells[one], strict=True)) == 1}
            left -= near
            edge += sorted(near)
        best = max(best, piece, key=len)
    return best


def _corners(planes: list[list[float]], cell: Cell) -> tuple[Point, Point]:
    low = tuple(p[i] for p, i in zip(planes, cell, strict=True))
    high = tuple(p[i + 1] for p, i in zip(planes, cell, strict=True))
    return (low[0], low[1], low[2]), (high[0], high[1], high[2])


def _face(planes: list[list[float]], cell: Cell, axis: int, side: int) -> tuple[Point, Point]:
    lower, upper = (list(corner) for corner in _corners(planes, cell))
    lower[axis] = upper[axis] = (lower, upper)[side][axis]
    return (lower[0], lower[1], lower[2]), (upper[0], upper[1], upper[2])
