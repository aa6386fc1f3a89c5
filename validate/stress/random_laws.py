"""Random scenes whose properties follow the temperature: those of `random_scenes` that are steady, heated more, with
conductivities that fall or rise by a power or a table with kinks, some along one axis alone, and such resistivities."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from scenes.laws import Law, PowerLaw, Property, Table
from scenes.model import Material, Scene
from validate.stress.random_scenes import ROOM, Drawn, draw

STRONGER = (1.0, 40.0)
"""Times the heat of `random_scenes`, which is for some ten kelvin."""
LAW, RESISTIVITY, ALONG_ONE = 0.7, 0.4, 0.15
"""Of materials, those with a law of the conductivity; of conductors, of the resistivity; of laws, along one axis."""


def draw_steady(seed: int, accuracy: float = 1e-2) -> Drawn:
    """The scene of a seed; what is drawn here leaves the scene that it is made of as it is."""
    # Three of twenty of those run over time.
    drawn = draw(seed // 17 * 20 + seed % 17, accuracy)
    rng = np.random.default_rng([seed, 3])
    factor = float(np.exp(rng.uniform(*np.log(STRONGER))))
    made: dict[Material, Material] = {}
    for box in drawn.scene.boxes:
        if box.material not in made:
            made[box.material] = _with_laws(rng, box.material)
    factors = {"voltage": factor**0.5, "heat_flux": factor}
    scene = drawn.scene
    boxes = tuple(replace(b, material=made[b.material], heat_source=_times(b.heat_source, factor)) for b in scene.boxes)
    boundaries = tuple(replace(b, value=_times(b.value, factors.get(b.kind, 1.0))) for b in scene.boundaries)
    return replace(drawn, scene=replace(scene, name=f"laws {seed}", boxes=boxes, boundaries=boundaries))


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
