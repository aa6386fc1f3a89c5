"""Random scenes: connected boxes of random sizes and materials, heated in one or more ways, cooled somewhere.

Boxes are cells of a random grid of up to three by three by two, with voids between, re-entrant edges and corners, thin
layers; one or two materials conduct, and the underside is held at a temperature. Three of twenty scenes run over time,
under steps and ramps. In some scenes the resistivity falls with the temperature, over time fast enough for some to run
away. Everything follows from a seed.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, product
from types import MappingProxyType
from typing import Any

import numpy as np
from scipy.sparse.csgraph import connected_components

from scenes.model import Boundary, Box, Material, Point, Probe, Scene, Schedule, Value

ROOM, RISE = 293.0, 10.0
AT_PLUS = "at plus"  # the probe of the potential of an electrode whose voltage is not given
FALLING_STEADY, FALLING_OVER_TIME = 0.1, 0.3  # of scenes, whose resistivity falls with the temperature
MATERIALS = (
    Material("silicon", 130.0, 2330.0, 712.0, 6e-5, 5e-4), Material("gold", 317.0, 19300.0, 129.0, 2.2e-8, 3.4e-3),
    Material("oxide", 1.38, 2200.0, 703.0), Material("nitride", 20.0, 3100.0, 700.0),
    Material("polysilicon", 30.0, 2330.0, 712.0, 2e-5, 1e-3), Material("polymer", 0.15, 970.0, 1460.0),
    Material("heater", 60.0, 8000.0, 500.0, 1e-6, 1e-4), Material("metal", 240.0, 2700.0, 900.0, 2.8e-8, 4e-3),
)  # fmt: skip
Cell = tuple[int, int, int]
Face = tuple[int, int, int]  # a cell's number, axis and side


@dataclass(frozen=True)
class Drawn:
    """A random scene; ``heats`` lists its heaters: "current", "source", "flux"."""

    seed: int
    scene: Scene
    heats: tuple[str, ...]


def face(lower: Point, upper: Point, axis: int, side: int) -> tuple[Point, Point]:
    """Return the flat box of a brick's lower (0) or upper (1) face along an axis."""
    low, high = list(lower), list(upper)
    low[axis] = high[axis] = (lower, upper)[side][axis]
    return (low[0], low[1], low[2]), (high[0], high[1], high[2])


def changed(
    scene: Scene, factors: Mapping[str, float] = MappingProxyType({}),
    material: Callable[[Material], Material] = lambda m: m,
    move: Callable[[Point, Point], tuple[Point, Point]] = lambda lower, upper: (lower, upper),
) -> Scene:  # fmt: skip
    """The scene with its heat sources and values by kind multiplied, of other materials, at other places."""

    def at(thing: Box | Boundary | Probe) -> dict[str, Any]:
        return dict(zip(("lower", "upper"), move(thing.lower, thing.upper), strict=True))

    def times(value: Value, kind: str) -> Value:
        return float(value) * factors[kind] if kind in factors else value  # type: ignore[arg-type]

    made = {box.material: material(box.material) for box in scene.boxes}
    boxes = tuple(
        replace(b, material=made[b.material], heat_source=times(b.heat_source, "heat_source"), **at(b))
        for b in scene.boxes
    )
    boundaries = tuple(replace(b, value=times(b.value, b.kind), **at(b)) for b in scene.boundaries)
    return replace(scene, boxes=boxes, boundaries=boundaries, probes=tuple(replace(p, **at(p)) for p in scene.probes))


def draw(seed: int, accuracy: float = 1e-2) -> Drawn:
    """Return the scene of a seed."""
    # Draws of the second generator do not change the first.
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
    far = planes[0][-1], planes[1][-1], 0.0
    # The underside at a given temperature, and sometimes a film, so that the heat can leave.
    boundaries, heats = [Boundary("cold", "temperature", (0.0, 0.0, 0.0), far, ROOM)], []
    free = [at for at in free if not (at[1:] == (2, 0) and cells[at[0]][2] == 0)]

    def add(name: str, kind: Any, at: Face, value: float) -> None:
        where = face(*_corners(planes, cells[at[0]]), *at[1:])
        boundaries.append(Boundary(name, kind, *where, value, ROOM))

    if rng.random() < 0.4 and free:
        film = free.pop()
        h = 10 ** float(rng.uniform(1, 5))
        add("film", "convection", film, h)
        behind = film[0], film[1], 1 - film[2]
        if behind in free and more.random() < 0.7:
            free.remove(behind)
            add("back", "convection", behind, h * 10 ** float(more.uniform(-1, 1)))
    flux, source, voltage = _strength(planes, boxes)
    ends = _electrodes(boxes, cells, free) if rng.random() < 0.7 else None
    inner = ""
    if ends is not None:
        plus, minus = ends
        free = [at for at in free if at not in ends]
        inside = _inside(boxes, cells, minus)
        if inside and more.random() < 0.4:
            inner, plus = "plus", inside[int(more.integers(len(inside)))]
        add("plus", "voltage", plus, voltage)
        add("minus", "voltage", minus, 0.0)
        heats.append("current")
    if (rng.random() < 0.4 or not heats) and free:
        add("flux", "heat_flux", free.pop(), flux)
        heats.append("flux")
    if rng.random() < 0.4 or not heats:
        i = int(rng.integers(len(boxes)))
        boxes[i] = replace(boxes[i], heat_source=source)
        heats.append("source")
    probes = [Probe(f"mean {i}", box.lower, box.upper) for i, box in enumerate(boxes[:3])]
    probes += [
        Probe(f"into {b.name}", b.lower, b.upper, "current" if b.kind == "voltage" else "heat_flow")
        for b in boundaries
        if b.name != inner
    ]
    scene = Scene(f"random {seed}", tuple(boxes), tuple(boundaries), tuple(probes), ROOM, 1.0, accuracy, True)
    falling = np.random.default_rng([seed, 2])
    if falling.random() < (FALLING_STEADY, FALLING_OVER_TIME)[seed % 20 >= 17]:
        coefficient = -(10 ** float(falling.uniform(-4, -1.3)))
        scene = changed(scene, material=lambda m: replace(m, temperature_coefficient=coefficient * bool(m.resistivity)))
    if seed % 20 >= 17:
        scene = _over_time(more, scene, max(p[-1] - p[0] for p in planes))
    return Drawn(seed, scene, tuple(heats))


def _over_time(rng: np.random.Generator, scene: Scene, size: float) -> Scene:
    """The scene from rest over a time in which heat crosses a part of it. The heaters step and ramp, up, down and to
    the other sign; sometimes the cold temperature steps too."""
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


def _strength(planes: list[list[float]], boxes: list[Box]) -> tuple[float, float, float]:
    """The flux, source and voltage (W/m2, W/m3, V) for a rise of some ten kelvin, by the worst conductor of heat."""
    size = max(p[-1] - p[0] for p in planes)
    k = min(box.material.thermal_conductivity for box in boxes)
    rho = min((box.material.resistivity for box in boxes if box.material.resistivity), default=1.0)
    return RISE * k / size, RISE * k / size**2, float(np.sqrt(8 * RISE * k * rho))


def _planes(rng: np.random.Generator, intervals: int, base: float) -> list[float]:
    """Planes with intervals of a third to three times a base length (m)."""
    sizes = base * 10 ** rng.uniform(-0.5, 0.5, intervals)
    planes: list[float] = np.concatenate([[0.0], np.cumsum(sizes)]).tolist()
    return planes


def _connected(rng: np.random.Generator, shape: list[int], count: int) -> list[Cell]:
    """Cells of a grid, each after the first a neighbour of an earlier one."""
    cells: list[Cell] = [(0, 0, 0)]
    x, y, z = map(range, shape)
    everywhere = list(product(x, y, z))
    while len(cells) < count:
        around = [c for c in everywhere if c not in cells and any(_steps(c, other) == 1 for other in cells)]
        if not around:
            break
        cells.append(around[int(rng.integers(len(around)))])
    # Cells that meet along an edge or in a point alone, a contact of no area, go again.
    while any(not _by_faces(cells, a, b) for a, b in combinations(cells, 2)):
        cells.pop()
    return cells


def _steps(a: Cell, b: Cell) -> int:
    """From one cell to another through faces, were there no voids."""
    return sum(abs(p - q) for p, q in zip(a, b, strict=True))


def _by_faces(cells: list[Cell], a: Cell, b: Cell) -> bool:
    """Return whether two cells that touch are joined by faces of the cells around that place."""
    low, high = np.minimum(a, b), np.maximum(a, b)
    near = [c for c in cells if (low <= c).all() and (high >= c).all()]
    return bool((high - low).max() > 1 or any({near.index(a), near.index(b)} <= piece for piece in _joined(near)))


def _joined(cells: Sequence[Cell]) -> list[set[int]]:
    """The numbers of cells that are joined by faces, piece by piece, in the order of the first of each."""
    touching = [[_steps(a, b) == 1 for b in cells] for a in cells]
    count, labels = connected_components(np.array(touching))
    return [set(np.flatnonzero(labels == piece).tolist()) for piece in range(count)]


def _conducting(boxes: list[Box], cells: list[Cell]) -> set[int]:
    """The largest set of conducting cells joined by faces."""
    able = [i for i, box in enumerate(boxes) if box.material.resistivity is not None]
    return {able[i] for i in max(_joined([cells[i] for i in able]), key=len)} if able else set()


def _free_faces(cells: list[Cell]) -> list[Face]:
    return [
        (number, d, side)
        for number, (d, side) in product(range(len(cells)), product(range(3), (0, 1)))
        if _beside(cells[number], d, 2 * side - 1) not in cells
    ]


def _beside(cell: Cell, axis: int, step: int) -> Cell:
    x, y, z = (c + step * (d == axis) for d, c in enumerate(cell))
    return x, y, z


def _electrodes(boxes: list[Box], cells: list[Cell], free: list[Face]) -> tuple[Face, Face] | None:
    """Two faces on one conducting piece that don't touch, as far apart as any two."""
    piece = _conducting(boxes, cells)
    apart = [
        (_steps(cells[p[0]], cells[q[0]]), p, q)
        for p, q in product([at for at in free if at[0] in piece], repeat=2)
        if p[1] == q[1] and p[2] != q[2] and cells[p[0]][p[1]] + p[2] != cells[q[0]][q[1]] + q[2]
    ]
    return max(apart)[1:] if apart else None


def _inside(boxes: list[Box], cells: list[Cell], minus: Face) -> list[Face]:
    """The faces between cells of one conducting piece that are parallel to an electrode on it, in another plane."""
    number, d, side = minus
    piece = _conducting(boxes, cells)
    joined = {cells[i] for i in piece}
    plane = cells[number][d] + side
    return [(i, d, 1) for i in sorted(piece) if _beside(cells[i], d, 1) in joined and cells[i][d] + 1 != plane]


def _corners(planes: list[list[float]], cell: Cell) -> tuple[Point, Point]:
    (x, far_x), (y, far_y), (z, far_z) = (p[i : i + 2] for p, i in zip(planes, cell, strict=True))
    return (x, y, z), (far_x, far_y, far_z)
