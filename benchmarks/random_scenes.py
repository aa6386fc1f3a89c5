"""Random scenes of several kinds. Everything follows from the kind and a seed.

`boxes` draws up to five cells of a random grid with voids, re-entrant edges and thin layers, cold below and heated in
one or more ways. Three of twenty scenes run over time, under steps and ramps. In some the resistivity falls with the
temperature, over time fast enough for some to run away.

`laws` heats such boxes until their properties, powers and tables of the temperature, matter. Some boxes have contacts
between them, some faces radiate, and some voltages become a given current or stand behind a resistance. One of four
scenes is heated from rest, half of these in steps and ramps.

`plates` draws a plate with 10 to 60 pads that align with nothing, as drawings have them; most are solved on tetrahedra.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import combinations, product
from typing import Any

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.ndimage import binary_dilation, label

from fem3d.runs.scene import solve
from scenes import laws as properties
from scenes.errors import NumericsError
from scenes.laws import Law, PowerLaw, Property, Table
from scenes.model import Boundary, Box, Contact, Material, Probe, Scene, Schedule
from scenes.sink import face
from statespace.channels import channels, driven

ROOM, RISE, ACCURACY = 293.0, 10.0, 1e-2
AT_PLUS = "at plus"  # the probe of the potential of an electrode whose voltage is not given
MATERIALS = {
    m.name: m
    for m in (
        Material("silicon", 130.0, 2330.0, 712.0, 6e-5, 5e-4), Material("gold", 317.0, 19300.0, 129.0, 2.2e-8, 3.4e-3),
        Material("oxide", 1.38, 2200.0, 703.0), Material("nitride", 20.0, 3100.0, 700.0),
        Material("polysilicon", 30.0, 2330.0, 712.0, 2e-5, 1e-3), Material("polymer", 0.15, 970.0, 1460.0),
        Material("heater", 60.0, 8000.0, 500.0, 1e-6, 1e-4), Material("metal", 240.0, 2700.0, 900.0, 2.8e-8, 4e-3),
    )
}  # fmt: skip
CONDUCTORS = [m for m in MATERIALS.values() if m.resistivity is not None]
INSULATORS = [m for m in MATERIALS.values() if m.resistivity is None]
Cell = tuple[int, int, int]
Face = tuple[int, int, int]  # a box's number, axis and side
Rng = np.random.Generator


def of_materials(scene: Scene, change: Callable[[Material], Material]) -> Scene:
    """The scene with its materials changed."""
    return replace(scene, boxes=tuple(replace(b, material=change(b.material)) for b in scene.boxes))


def scaled(scene: Scene, **factors: float) -> Scene:
    """The scene with its constant inputs multiplied by factors of their kinds."""
    stronger: Scene = driven(scene, {c.name: c.largest * factors[c.kind] for c in channels(scene) if c.kind in factors})
    return stronger


def boxes(seed: int) -> Scene:
    """Draw connected boxes, steady or over time."""
    rng = np.random.default_rng([seed, 0])
    scene = _steady_boxes(rng, f"boxes {seed}")
    over_time = seed % 20 >= 17
    if rng.random() < (0.3 if over_time else 0.1):
        coefficient = -(10 ** float(rng.uniform(-4, -1.3)))
        scene = of_materials(scene, lambda m: replace(m, temperature_coefficient=coefficient * bool(m.resistivity)))
    return _varied(rng, _timed(rng, scene, 20)) if over_time else scene


def _steady_boxes(rng: Rng, name: str, larger: float = 1.0) -> Scene:
    """A steady scene of boxes of some 3 to 100 um, times a factor."""
    base, thin = larger * 10 ** rng.uniform(-5.5, -4), 10 ** rng.uniform(-2, 0)
    planes = [
        (size * np.concatenate([[0.0], np.cumsum(10 ** rng.uniform(-0.5, 0.5, int(count)))])).tolist()
        for count, size in zip(rng.integers(1, (4, 4, 3)), (base, base, thin * base), strict=True)
    ]
    solid = _grown(rng, [len(p) - 1 for p in planes])
    cells: list[Cell] = [(int(i), int(j), int(k)) for i, j, k in np.argwhere(solid)]
    main, other = (CONDUCTORS[i] for i in rng.permutation(len(CONDUCTORS))[:2])
    insulators = [INSULATORS[i] for i in rng.permutation(len(INSULATORS))[: rng.integers(0, 3)]]
    made = []
    for number, cell in enumerate(cells):
        material = [main, *insulators][int(rng.integers(1 + len(insulators)))]
        material = other if material is main and rng.random() < 0.3 else material
        (x, far_x), (y, far_y), (z, far_z) = (p[i : i + 2] for p, i in zip(planes, cell, strict=True))
        made.append(Box(f"box {number}", material, (x, y, z), (far_x, far_y, far_z)))
    size, k = max(p[-1] for p in planes), min(box.material.thermal_conductivity for box in made)  # type: ignore[type-var]
    rho = min((float(b.material.resistivity) for b in made if b.material.resistivity), default=1.0)  # type: ignore[arg-type]
    # Of a rise of some ten kelvin, by the worst conductor of heat.
    flux, source, voltage = RISE * k / size, RISE * k / size**2, math.sqrt(8 * RISE * k * rho)  # type: ignore[operator]
    boundaries = [Boundary("cold", "temperature", (0.0, 0.0, 0.0), (planes[0][-1], planes[1][-1], 0.0), ROOM)]
    free = _free_faces(made)
    rng.shuffle(free)

    def add(name: str, kind: Any, at: Face, value: float) -> None:
        boundaries.append(Boundary(name, kind, *face(made[at[0]], *at[1:]), value, ROOM))

    inner = ""
    if rng.random() < 0.4 and free:
        add("film", "convection", free.pop(), 10 ** float(rng.uniform(1, 5)))
    piece = _conducting(solid, made)
    ends = _electrodes(cells, [at for at in free if at[0] in piece]) if rng.random() < 0.7 else None
    if ends is not None:
        plus, minus = ends
        free = [at for at in free if at not in ends]
        axis, (end, _) = minus[1], face(made[minus[0]], *minus[1:])
        starts = [face(made[i], axis, 0) for i in piece]
        inside = [(i, axis, 1) for i in piece if face(made[i], axis, 1) in starts and made[i].upper[axis] != end[axis]]
        if inside and rng.random() < 0.4:
            inner, plus = "plus", inside[int(rng.integers(len(inside)))]
        add("plus", "voltage", plus, voltage)
        add("minus", "voltage", minus, 0.0)
    if (rng.random() < 0.4 or ends is None) and free:
        add("flux", "heat_flux", free.pop(), flux)
    if rng.random() < 0.4 or not {"minus", "flux"} & {b.name for b in boundaries}:
        number = int(rng.integers(len(made)))
        made[number] = replace(made[number], heat_source=source)
    probes = [Probe(f"mean {i}", box.lower, box.upper) for i, box in enumerate(made[:3])]
    probes += [
        Probe(f"into {b.name}", b.lower, b.upper, "current" if b.kind == "voltage" else "heat_flow")
        for b in boundaries
        if b.name != inner
    ]
    return Scene(name, tuple(made), tuple(boundaries), tuple(probes), ROOM, accuracy=ACCURACY, steady=True)


def _grown(rng: Rng, shape: list[int]) -> np.ndarray:
    """The solid cells of a grid: from the first one on, up to four neighbours of earlier ones."""
    solid = np.zeros(shape, bool)
    solid[0, 0, 0] = True
    for _ in range(rng.integers(1, 5)):
        around = [tuple(cell) for cell in rng.permutation(np.argwhere(binary_dilation(solid) & ~solid))]
        for cell in around:
            solid[cell] = True
            if _meet_by_faces(solid):
                break
            solid[cell] = False
    return solid


def _meet_by_faces(solid: np.ndarray) -> bool:
    """Return whether no cells meet along an edge or in a corner alone, a contact of no area."""
    shapes = ((1, 2, 2), (2, 1, 2), (2, 2, 1), (2, 2, 2))
    blocks = (block for s in shapes for block in sliding_window_view(np.pad(solid, 1), s).reshape(-1, *s))
    return all(label(block)[1] <= 1 for block in blocks)


def _free_faces(made: Sequence[Box]) -> list[Face]:
    """The faces at which no other box touches, but for the cold ones below."""

    def is_free(number: int, axis: int, side: int) -> bool:
        lower, upper = face(made[number], axis, side)
        flat, others = replace(made[number], lower=lower, upper=upper), (*made[:number], *made[number + 1 :])
        return upper[2] > 0.0 and all(_touching(flat, other) is None for other in others)

    return [at for at in product(range(len(made)), range(3), (0, 1)) if is_free(*at)]


def _conducting(solid: np.ndarray, made: list[Box]) -> list[int]:
    """The numbers of the boxes of the largest piece that conducts."""
    able = solid.copy()
    able[solid] = [box.material.resistivity is not None for box in made]
    pieces = label(able)[0][solid]
    sizes = np.bincount(pieces[pieces > 0])
    return [i for i, piece in enumerate(pieces) if piece and piece == sizes.argmax()]


def _electrodes(cells: list[Cell], free: list[Face]) -> tuple[Face, Face] | None:
    """Two parallel faces that don't touch, as far apart as any two."""
    apart = [
        (sum(abs(a - b) for a, b in zip(cells[p[0]], cells[q[0]], strict=True)), p, q)
        for p, q in product(free, repeat=2)
        if p[1] == q[1] and p[2] != q[2] and cells[p[0]][p[1]] + p[2] != cells[q[0]][q[1]] + q[2]
    ]
    return max(apart)[1:] if apart else None


def _timed(rng: Rng, scene: Scene, instants: int) -> Scene:
    """The scene from rest, over a time in which heat crosses a part of it."""
    material, size = scene.boxes[0].material, max(max(np.subtract(b.upper, b.lower)) for b in scene.boxes)
    conductivity, heat = (properties.at(p, ROOM) for p in (material.thermal_conductivity, material.specific_heat))
    crossing = size**2 * material.density * float(np.max(heat)) / float(np.max(conductivity))
    end = 10 ** float(rng.uniform(-2, 0.5)) * crossing
    times = tuple((end * np.arange(1, instants + 1) / instants).tolist())
    return replace(scene, steady=False, end_time=end, output_times=times)


def _varied(rng: Rng, scene: Scene) -> Scene:
    """The scene whose heaters step and ramp, up, down and to the other sign; sometimes the cold temperature steps."""
    end = scene.end_time

    def varied(value: float) -> Schedule:
        a, b, c = np.sort(rng.uniform(0, end, 3)).tolist()
        return Schedule((0.0, a, a, b, c), tuple(value * f for f in (1.0, 1.0, *rng.uniform(-1, 1, 3).tolist())))

    step = Schedule((0.0, 0.37 * end, 0.37 * end), (ROOM, ROOM, ROOM + RISE / 2))
    driving = replace(scene, boundaries=tuple(b for b in scene.boundaries if b.kind != "radiation"))
    heaters = [c for c in channels(driving) if c.item in ("plus", "flux") or c.kind == "heat_source"]
    values = {"cold.temperature": step} if rng.random() < 0.3 else {}
    changing: Scene = driven(scene, values | {c.name: varied(c.largest) for c in heaters})
    return changing


def laws(seed: int) -> Scene:
    """Draw boxes whose properties follow the temperature.

    Raises NumericsError where the scene can't be solved with numbers in place of the laws.
    """
    rng = np.random.default_rng([seed, 1])
    radiates = rng.random() < 0.4
    # Radiation matters where solids are large or hot.
    scene = _steady_boxes(rng, f"laws {seed}", 10 ** float(rng.uniform(0, 3 * radiates)))
    # The largest mean rise of a box, solved roughly with numbers, becomes 20 to 500 K.
    rough = replace(scene, accuracy=0.1, probes=scene.means())
    linear = solve(of_materials(rough, lambda m: replace(m, temperature_coefficient=0.0)))
    factor = float(np.exp(rng.uniform(*np.log((20.0, 500.0))))) / max(m.value - ROOM for m in linear.steady.values())
    made = {material: _with_laws(rng, material) for material in dict.fromkeys(b.material for b in scene.boxes)}
    scene = of_materials(scaled(scene, heat_source=factor, heat_flux=factor, voltage=factor**0.5), made.__getitem__)
    if seed % 4 == 2:
        scene = _timed(rng, scene, 20)
    scene = replace(scene, contacts=tuple(_contacts(rng, scene)))
    scene = _supplied(rng, _radiating(rng, scene) if radiates else scene)
    return _varied(rng, scene) if seed % 8 == 6 else scene


def _with_laws(rng: Rng, m: Material) -> Material:
    """The material with laws for some of its numbers, and no coefficient of a resistivity beside one."""
    k: Property = m.thermal_conductivity
    if rng.random() < 0.7:
        law, along = _law(rng, float(m.thermal_conductivity), -1.6), int(rng.integers(3))  # type: ignore[arg-type]
        one = tuple(law if d == along else k for d in range(3))
        k = one if rng.random() < 0.15 else law  # type: ignore[assignment]
    if m.resistivity is None or rng.random() >= 0.4:
        return replace(m, thermal_conductivity=k)
    # A resistivity that falls fast runs away, as in `boxes`.
    law = _law(rng, float(m.resistivity), -0.5)  # type: ignore[arg-type]
    return replace(m, thermal_conductivity=k, resistivity=law, temperature_coefficient=0.0)


def _law(rng: Rng, value: float, lowest: float) -> Law:
    """A power from the ``lowest`` to 1.5, or a table of two to five points between 250 and 900 K whose values go up
    and down as such powers do."""
    if rng.random() < 0.5:
        return PowerLaw(value, ROOM, float(rng.uniform(lowest, 1.5)))
    temperatures = np.sort(rng.uniform(250.0, 900.0, int(rng.integers(2, 6))))
    steps = np.diff(np.log([ROOM, *temperatures])) * rng.uniform(lowest, 1.5, len(temperatures))
    return Table(tuple(temperatures.tolist()), tuple((value * np.exp(np.cumsum(steps))).tolist()))


def _contacts(rng: Rng, scene: Scene) -> list[Contact]:
    """Contacts of some pairs of boxes that touch, with a resistance of 0.01 to 3 times a box's."""
    contacts = []
    for one, other in combinations(scene.boxes, 2):
        axis = _touching(one, other)
        if axis is None or rng.random() >= 0.4:
            continue
        thick, times = one.upper[axis] - one.lower[axis], 10 ** rng.uniform(-2.0, 0.5, 2)
        given = one.material.thermal_conductivity, one.material.resistivity
        k, rho = (float(np.max(properties.at(p, ROOM) or 0.0)) for p in given)  # type: ignore[arg-type]
        conduct = None not in (one.material.resistivity, other.material.resistivity)
        electrical = float(times[1] * thick * rho) if conduct and rng.random() < 0.5 else 0.0
        names = one.name, other.name
        contacts.append(Contact(" to ".join(names), names, float(times[0] * thick / k), electrical))
    return contacts


def _touching(one: Box, other: Box) -> int | None:
    """The axis across which two boxes share a face of some area."""
    low, high = np.maximum(one.lower, other.lower), np.minimum(one.upper, other.upper)
    flat = np.flatnonzero(low == high)
    return int(flat[0]) if len(flat) == 1 and (low <= high).all() else None


def _radiating(rng: Rng, scene: Scene) -> Scene:
    """The scene with a face, of a box that has one free, that radiates to up to 1,500 K."""
    taken = {(b.lower, b.upper) for b in scene.boundaries}
    free = [face(scene.boxes[number], axis, side) for number, axis, side in _free_faces(scene.boxes)]
    free = [at for at in free if at not in taken]
    if not free:
        return scene
    lower, upper = free[int(rng.integers(len(free)))]
    ambient = float(rng.uniform(ROOM, 1500.0)) if rng.random() < 0.5 else ROOM
    new = Boundary("radiant", "radiation", lower, upper, float(rng.uniform(0.05, 1.0)), ambient)
    probes = (*scene.probes, Probe("into radiant", lower, upper, "heat_flow"))
    return replace(scene, boundaries=(*scene.boundaries, new), probes=probes)


def _supplied(rng: Rng, scene: Scene) -> Scene:
    """The scene driven, in three of ten cases each, by the current that its voltage makes in the cold, or from behind a
    resistance of 0.1 to 3 times its own."""
    kind, factor = rng.random(), 10 ** float(rng.uniform(-1.0, 0.5))
    plus = next((b for b in scene.boundaries if b.name == "plus"), None)
    if plus is None or kind >= 0.6:
        return scene
    cold = of_materials(scene, lambda m: m.at(ROOM))
    minus = next(p for p in scene.probes if p.name == "into minus")
    only = tuple(b for b in scene.boundaries if b.kind == "voltage")
    bare = replace(cold, boundaries=only, probes=(minus,), accuracy=0.1, steady=True, output_times=())
    try:
        current = -solve(bare).steady["into minus"].value
    except NumericsError:  # such as an edge so sharp that the draw itself will be refused
        return scene
    new = replace(plus, value=current, series_resistance=math.inf)
    if kind >= 0.3:
        new = replace(plus, series_resistance=factor * float(plus.value) / current)  # type: ignore[arg-type]
    boundaries = tuple(new if b is plus else b for b in scene.boundaries)
    probes = (*scene.probes, Probe(AT_PLUS, plus.lower, plus.upper, "potential"))
    return replace(scene, boundaries=boundaries, probes=probes)


def boxes_or_laws(seed: int) -> Scene:
    """Draw a steady, rough scene of `laws` in one of three cases, else a scene of `boxes`."""
    if seed % 3:
        return boxes(seed)
    return replace(laws(seed), accuracy=5 * ACCURACY, steady=True, output_times=())


def plates(seed: int) -> Scene:
    """Draw a plate of silicon or nitride, cold at one side, often warmer at the other and cooled from below, with pads
    of gold or oxide above and below it and caps on some of these."""
    rng = np.random.default_rng([seed, 2])
    size, thickness = float(rng.uniform(1e-4, 4e-4)), 1e-6 * float(rng.choice([1, 2, 5, 10, 20]))
    plate = Box("plate", MATERIALS[str(rng.choice(["silicon", "nitride"]))], (0.0, 0.0, 0.0), (size, size, thickness))
    made = [plate]
    for low, high in _places(rng, size, size / 20 if rng.random() < 0.3 else 0.0, int(rng.integers(9, 60))):
        material, height = MATERIALS[str(rng.choice(["gold", "oxide"]))], 1e-6 * float(rng.choice([0.2, 0.5, 1.0, 3.0]))
        below = rng.random() < 0.2
        ends = (-height, 0.0) if below else (thickness, thickness + height)
        source = float(rng.choice([1e12, 1e13])) if rng.random() < 0.4 or len(made) == 1 else 0.0
        made.append(Box(f"pad {len(made)}", material, (*low, ends[0]), (*high, ends[1]), source))
        if not below and rng.random() < 0.3:
            (x, y), (far_x, far_y) = low, high
            inner = x + 0.2 * (far_x - x), y + 0.3 * (far_y - y), ends[1]
            outer = x + 0.7 * (far_x - x), y + 0.8 * (far_y - y), ends[1] + height
            made.append(Box(f"cap {len(made)}", MATERIALS["oxide"], inner, outer))
    boundaries = [Boundary("cold", "temperature", (0.0, 0.0, 0.0), (0.0, size, thickness), ROOM)]
    if rng.random() < 0.5:
        boundaries.append(Boundary("warm", "temperature", (size, 0.0, 0.0), (size, size, thickness), ROOM + 7.0))
    if rng.random() < 0.4:
        boundaries.append(Boundary("air", "convection", (0.0, 0.0, 0.0), (size, size, 0.0), 1e3, ROOM))
    x, y, z = (rng.uniform(0.2, 0.8, 3) * (size, size, thickness)).tolist()
    pad = made[int(rng.integers(1, len(made)))]
    probes = [
        Probe("mean of a place", (x, y, z), (x, y, z)), Probe("mean of a pad", pad.lower, pad.upper),
        Probe("mean of the plate", plate.lower, plate.upper),
        *(Probe(f"into {b.name}", b.lower, b.upper, "heat_flow") for b in boundaries),
    ]  # fmt: skip
    scene = Scene(f"plate {seed}", tuple(made), tuple(boundaries), tuple(probes), ROOM, accuracy=ACCURACY, steady=True)
    return _timed(rng, scene, 10) if rng.random() < 0.1 else scene


def _places(rng: Rng, size: float, raster: float, most: int) -> list[tuple[tuple[float, float], tuple[float, float]]]:
    """The corners of at most so many rectangles that stay apart, on a ``raster`` (m) where that is not zero."""
    places: list[tuple[tuple[float, float], tuple[float, float]]] = []
    rim, gap = 0.02 * size, 0.004 * size
    for low, extent in zip(rng.uniform(rim, 0.9 * size, (5_000, 2)), rng.uniform(0.02, 0.12, (5_000, 2)), strict=True):
        corners = np.array([low, low + extent * size])
        if raster:
            corners = raster * np.round(corners / raster)
            corners[1] = np.maximum(corners[1], corners[0] + raster)
        (x, y), (far_x, far_y) = corners.tolist()
        clear = all(x > b[0] + gap or far_x < a[0] - gap or y > b[1] + gap or far_y < a[1] - gap for a, b in places)
        if clear and min(x, y) > 0 and max(far_x, far_y) < size - rim:
            places.append(((x, y), (far_x, far_y)))
        if len(places) == most:
            break
    return places
