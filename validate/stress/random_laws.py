"""Random scenes whose properties follow the temperature: those of `random_scenes` that are steady, heated until laws
matter, with conductivities that fall or rise by a power or a table with kinks, some along one axis alone, and such
resistivities; one of four is heated from rest, over a time in which heat crosses some of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fem3d.runs.scene import solve
from scenes import laws
from scenes.laws import Law, PowerLaw, Property, Table
from scenes.model import Material, Scene
from validate.stress import random_scenes
from validate.stress.random_scenes import ROOM, Drawn

RISES = (20.0, 500.0)
"""K: the range of the largest mean rise of a box, if numbers stood in place of the laws."""
OVER_TIME = 2  # the remainder, of seeds by four, of those over time
ROUGH = 0.1  # accuracy of the solution that tells how strong the heat must be for that
LAW, RESISTIVITY, ALONG_ONE = 0.7, 0.4, 0.15
"""Of materials, those with a law of the conductivity; of conductors, of the resistivity; of laws, along one axis."""


def draw(seed: int, accuracy: float = 1e-2) -> Drawn:
    """The scene of a seed, over time where that is `OVER_TIME`. Raises as `draw_steady` does."""
    drawn = draw_steady(seed, accuracy)
    if seed % 4 != OVER_TIME:
        return drawn
    rng, scene = np.random.default_rng([seed, 4]), drawn.scene
    material, size = scene.boxes[0].material, max(max(np.subtract(b.upper, b.lower)) for b in scene.boxes)
    conductivity, heat = (laws.at(law, ROOM) for law in (material.thermal_conductivity, material.specific_heat))
    crossing = size**2 * material.density * float(np.max(heat)) / float(np.max(conductivity))
    end = 10 ** float(rng.uniform(-2, 0)) * crossing
    instants = tuple((end * np.linspace(0.05, 1.0, 20)).tolist())
    return replace(drawn, scene=replace(scene, steady=False, end_time=end, output_times=instants))


def draw_steady(seed: int, accuracy: float = 1e-2) -> Drawn:
    """The scene of a seed. Raises NumericsError where it can't be solved with numbers in place of the laws."""
    # Three of twenty of `random_scenes` run over time.
    drawn = random_scenes.draw(seed // 17 * 20 + seed % 17, accuracy)
    rng, scene = np.random.default_rng([seed, 3]), drawn.scene
    rough = replace(scene, accuracy=ROUGH, probes=scene.means())
    linear = _changed(rough, 1.0, {b.material: replace(b.material, temperature_coefficient=0.0) for b in scene.boxes})
    rise = max(mean.value - ROOM for mean in solve(linear).steady.values())
    factor = float(np.exp(rng.uniform(*np.log(RISES)))) / rise
    made: dict[Material, Material] = {}
    for box in scene.boxes:
        if box.material not in made:
            made[box.material] = _with_laws(rng, box.material)
    return replace(drawn, scene=replace(_changed(scene, factor, made), name=f"laws {seed}"))


def _changed(scene: Scene, factor: float, made: dict[Material, Material]) -> Scene:
    """The scene of other materials, with so much more heat."""
    factors = {"voltage": factor**0.5, "heat_flux": factor}
    boxes = tuple(replace(b, material=made[b.material], heat_source=_times(b.heat_source, factor)) for b in scene.boxes)
    boundaries = tuple(replace(b, value=_times(b.value, factors.get(b.kind, 1.0))) for b in scene.boundaries)
    return replace(scene, boxes=boxes, boundaries=boundaries)


def _times(value: object, factor: float) -> float:
    """A constant value, times a factor."""
    return float(value) * factor  # type: ignore[arg-type]


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
    # A resistivity that falls fast runs away, which `random_scenes` has.
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
