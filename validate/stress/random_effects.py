"""Random scenes with what a simple model leaves out: those of `random_laws`, with contacts between some of their boxes,
faces that radiate to surroundings of up to 1,500 K, and a given current, or a voltage behind a resistance, as drive."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import product

import numpy as np

from fem3d.runs.scene import solve
from scenes import laws
from scenes.errors import NumericsError
from scenes.model import Boundary, Box, Contact, Point, Probe, Scene
from validate.stress import invariants, random_laws
from validate.stress.random_scenes import AT_PLUS, ROOM, Drawn
from validate.verify.manufactured import face

HOTTEST = 1500.0  # K, of the surroundings of a face that radiates
CONTACTS, RADIATION, CURRENT, BEHIND = 0.4, 0.4, 0.3, 0.3
"""Of pairs of boxes that touch; of scenes; of scenes with a voltage, those with a current, and with a resistance."""
LARGER = 1e3  # times the lengths of a scene that radiates, at most: radiation matters where solids are large or hot
BETWEEN, BEFORE = (-2.0, 0.5), (-1.0, 0.5)
"""Powers of ten: of a contact's resistance over that of a box beside it, of a resistance in front over the scene's."""


def draw(seed: int, accuracy: float = 1e-2) -> Drawn:
    """The scene of a seed. Raises as `random_laws.draw` does."""
    drawn = random_laws.draw(seed, accuracy)
    rng, scene = np.random.default_rng([seed, 5]), drawn.scene
    scene = replace(scene, contacts=tuple(_contacts(rng, scene)))
    if rng.random() < RADIATION:
        scene = _radiating(rng, larger(scene, 10 ** float(rng.uniform(0, np.log10(LARGER)))))
    return replace(drawn, scene=_driven(rng, scene))


def _contacts(rng: np.random.Generator, scene: Scene) -> list[Contact]:
    """Contacts of some pairs of boxes that touch, of a resistance like that of the boxes themselves."""
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


def larger(scene: Scene, s: float) -> Scene:
    """The scene with ``s`` times the lengths and the same temperatures: heat that enters and films are less by area."""

    def move(lower: Point, upper: Point) -> tuple[Point, Point]:
        x, y, z, far_x, far_y, far_z = (s * c for c in (*lower, *upper))
        return (x, y, z), (far_x, far_y, far_z)

    grown = invariants.changed(scene, {"heat_source": s**-2, "heat_flux": 1 / s, "convection": 1 / s}, move=move)
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
