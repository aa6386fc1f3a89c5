"""Random scenes whose properties follow the temperature, with contacts, radiation and other drives.

The boxes of `random_boxes` that are steady are heated until laws matter: conductivities and resistivities are powers of
the temperature or tables with bends, some along one axis alone. Some boxes have a contact between them, some faces
radiate to surroundings of up to 1,500 K, and some voltages become a given current or stand behind a resistance. One of
four scenes is heated from rest.
"""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import product

import numpy as np

from benchmarks import random_boxes
from benchmarks.random_boxes import AT_PLUS, ROOM, Drawn, changed, face
from fem3d.runs.scene import solve
from scenes import laws
from scenes.errors import NumericsError
from scenes.laws import Law, PowerLaw, Property, Table
from scenes.model import Boundary, Box, Contact, Material, Point, Probe, Scene

RISES = (20.0, 500.0)  # K: the range of the largest mean rise of a box, with numbers in place of the laws
OVER_TIME = 2  # the remainder, of seeds by four, of scenes over time
ROUGH = 0.1  # accuracy of the solution that sets the strength of the heat
LAW, RESISTIVITY, ALONG_ONE = 0.7, 0.4, 0.15  # of materials and conductors with a law; of laws along one axis
HOTTEST = 1500.0  # K, of the surroundings of a face that radiates
CONTACTS, RADIATION, CURRENT, BEHIND = (
    0.4,
    0.4,
    0.3,
    0.3,
)  # of touching pairs; of scenes; of voltages (both)
LARGER = 1e3  # times the lengths of a scene that radiates, at most: radiation matters where solids are large or hot
BETWEEN = (-2.0, 0.5)  # powers of ten: a contact's resistance over that of a box beside it
BEFORE = (-1.0, 0.5)  # powers of ten: a series resistance over that of the scene


def draw(seed: int, accuracy: float = 1e-2) -> Drawn:
    """Return the scene of a seed; raise NumericsError where it can't be solved with numbers in place of the laws."""
    drawn = _draw_steady(seed, accuracy)
    scene = drawn.scene
    if seed % 4 == OVER_TIME:
        scene = _over_time(np.random.default_rng([seed, 4]), scene)
    rng = np.random.default_rng([seed, 5])
    scene = replace(scene, contacts=tuple(_contacts(rng, scene)))
    if rng.random() < RADIATION:
        scene = _radiating(rng, _larger(scene, 10 ** float(rng.uniform(0, np.log10(LARGER)))))
    return replace(drawn, scene=_driven(rng, scene))


def _over_time(rng: np.random.Generator, scene: Scene) -> Scene:
    """The scene heated from rest, over a time in which heat crosses a part of it."""
    material, size = scene.boxes[0].material, max(max(np.subtract(b.upper, b.lower)) for b in scene.boxes)
    conductivity, heat = (laws.at(law, ROOM) for law in (material.thermal_conductivity, material.specific_heat))
    crossing = size**2 * material.density * float(np.max(heat)) / float(np.max(conductivity))
    end = 10 ** float(rng.uniform(-2, 0)) * crossing
    instants = tuple((end * np.linspace(0.05, 1.0, 20)).tolist())
    return replace(scene, steady=False, end_time=end, output_times=instants)


def _draw_steady(seed: int, accuracy: float = 1e-2) -> Drawn:
    """The boxes of a seed with laws and the heat that makes them matter."""
    # Three of twenty of `random_boxes` run over time.
    drawn = random_boxes.draw(seed // 17 * 20 + seed % 17, accuracy)
    rng, scene = np.random.default_rng([seed, 3]), drawn.scene
    rough = replace(scene, accuracy=ROUGH, probes=scene.means())
    linear = changed(rough, material=lambda m: replace(m, temperature_coefficient=0.0))
    rise = max(mean.value - ROOM for mean in solve(linear).steady.values())
    factor = float(np.exp(rng.uniform(*np.log(RISES)))) / rise
    made = {material: _with_laws(rng, material) for material in dict.fromkeys(b.material for b in scene.boxes)}
    factors = {"heat_source": factor, "voltage": factor**0.5, "heat_flux": factor}
    return replace(drawn, scene=replace(changed(scene, factors, made.__getitem__), name=f"laws {seed}"))


def _with_laws(rng: np.random.Generator, m: Material) -> Material:
    """The material with laws for some of its numbers, and no coefficient of a resistivity beside one."""
    k: Property = m.thermal_conductivity
    if rng.random() < LAW:
        law = _law(rng, float(m.thermal_conductivity))
        along = int(rng.integers(3))
        one = tuple(law if d == along else k for d in range(3))
        k = one if rng.random() < ALONG_ONE else law
    if m.resistivity is None or rng.random() >= RESISTIVITY:
        return replace(m, thermal_conductivity=k)
    # A resistivity that falls fast runs away, as in `random_boxes`.
    law = _law(rng, float(m.resistivity), -0.5)
    return replace(m, thermal_conductivity=k, resistivity=law, temperature_coefficient=0.0)


def _law(rng: np.random.Generator, value: float, lowest: float = -1.6) -> Law:
    """A power from the ``lowest`` to 1.5, or a table of two to five points between 250 and 900 K whose values go up
    and down as such powers do."""
    if rng.random() < 0.5:
        return PowerLaw(value, ROOM, float(rng.uniform(lowest, 1.5)))
    temperatures = np.sort(rng.uniform(250.0, 900.0, int(rng.integers(2, 6))))
    steps = np.diff(np.log(np.concatenate([[ROOM], temperatures]))) * rng.uniform(lowest, 1.5, len(temperatures))
    values = value * np.exp(np.cumsum(steps))
    return Table(tuple(temperatures.tolist()), tuple(values.tolist()))


def _contacts(rng: np.random.Generator, scene: Scene) -> list[Contact]:
    """Contacts of some pairs of boxes that touch, with a resistance like the boxes."""
    contacts = []
    for i, one in enumerate(scene.boxes):
        for other in scene.boxes[i + 1 :]:
            axis = _touching(one, other)
            if axis is None or rng.random() >= CONTACTS:
                continue
            thick, times = one.upper[axis] - one.lower[axis], 10 ** rng.uniform(*BETWEEN, 2)
            k, rho = (
                np.max(laws.at(getattr(one.material, key), ROOM) or 0.0)
                for key in ("thermal_conductivity", "resistivity")
            )
            conduct = one.material.resistivity is not None and other.material.resistivity is not None
            electrical = float(times[1] * thick * rho) if conduct and rng.random() < 0.5 else 0.0
            name = f"{one.name} to {other.name}"
            contacts.append(Contact(name, (one.name, other.name), float(times[0] * thick / k), electrical))
    return contacts


def _touching(one: Box, other: Box) -> int | None:
    """The axis across which two boxes share a face of some area."""
    low, high = np.maximum(one.lower, other.lower), np.minimum(one.upper, other.upper)
    flat = np.flatnonzero(low == high)
    return int(flat[0]) if len(flat) == 1 and (low <= high).all() else None


def _larger(scene: Scene, s: float) -> Scene:
    """The scene with ``s`` times the lengths and the same temperatures: heat that enters and films are less by area."""

    def move(lower: Point, upper: Point) -> tuple[Point, Point]:
        x, y, z, far_x, far_y, far_z = (s * c for c in (*lower, *upper))
        return (x, y, z), (far_x, far_y, far_z)

    grown = changed(scene, {"heat_source": s**-2, "heat_flux": 1 / s, "convection": 1 / s}, move=move)
    contacts = tuple(
        replace(c, thermal_resistance=s * c.thermal_resistance, electrical_resistance=s * c.electrical_resistance)
        for c in scene.contacts
    )
    times = tuple(s**2 * t for t in scene.output_times)
    return replace(grown, contacts=contacts, end_time=s**2 * scene.end_time, output_times=times)


def _radiating(rng: np.random.Generator, scene: Scene) -> Scene:
    """The scene with a face, of a box that has one free, that radiates."""
    taken = {(b.lower, b.upper) for b in scene.boundaries}
    free = []
    for box, axis, side in product(scene.boxes, range(3), (0, 1)):
        lower, upper = face(box.lower, box.upper, axis, side)
        flat, others = replace(box, lower=lower, upper=upper), (b for b in scene.boxes if b is not box)
        held = (lower, upper) in taken or (axis == 2 and lower[2] == 0.0)
        if not held and all(_touching(flat, other) is None for other in others):
            free.append((lower, upper))
    if not free:
        return scene
    lower, upper = free[int(rng.integers(len(free)))]
    ambient = float(rng.uniform(ROOM, HOTTEST)) if rng.random() < 0.5 else ROOM
    new = Boundary("radiant", "radiation", lower, upper, float(rng.uniform(0.05, 1.0)), ambient)
    probes = (*scene.probes, Probe("into radiant", lower, upper, "heat_flow"))
    return replace(scene, boundaries=(*scene.boundaries, new), probes=probes)


def _driven(rng: np.random.Generator, scene: Scene) -> Scene:
    """The scene driven by the current that its voltage makes in the cold, or with a resistance like its own before."""
    kind, factor = rng.random(), 10 ** float(rng.uniform(*BEFORE))
    plus = next((b for b in scene.boundaries if b.name == "plus"), None)
    if plus is None or kind >= CURRENT + BEHIND:
        return scene
    cold = replace(scene, boxes=tuple(replace(b, material=b.material.at(ROOM)) for b in scene.boxes))
    minus = next(p for p in scene.probes if p.name == "into minus")
    only = tuple(b for b in scene.boundaries if b.kind == "voltage")
    bare = replace(cold, boundaries=only, probes=(minus,), accuracy=0.1, steady=True, output_times=())
    try:
        current = -solve(bare).steady["into minus"].value
    except NumericsError:  # such as an edge so sharp that the draw itself will be refused
        return scene
    new = replace(plus, value=current, series_resistance=math.inf)
    if kind >= CURRENT:
        new = replace(plus, series_resistance=factor * float(plus.value) / current)  # type: ignore[arg-type]
    boundaries = tuple(new if b is plus else b for b in scene.boundaries)
    # The potential that the electrode takes.
    probes = (*scene.probes, Probe(AT_PLUS, plus.lower, plus.upper, "potential"))
    return replace(scene, boundaries=boundaries, probes=probes)
