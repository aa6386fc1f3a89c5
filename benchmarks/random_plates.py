"""Random plates with pads that align with nothing, as drawings have them: scenes of 10 to 60 boxes, most of which are
solved on tetrahedra. Everything follows from a seed."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks.random_boxes import MATERIALS, ROOM, Drawn
from scenes.model import Boundary, Box, Probe, Scene

FEWEST, MOST = 10, 60  # boxes
ALIGNED, OVER_TIME = 0.3, 0.1  # of scenes: those whose pads stand on a raster, and those over time
APART, RIM = 0.004, 0.02  # of the plate's size: between pads, and beside its sides
TRIALS = 5_000  # places for pads that are drawn at most
CAPPED, BELOW, HEATED = 0.3, 0.2, 0.4  # of pads


def draw(seed: int, accuracy: float = 1e-2) -> Drawn:
    """A plate of silicon or nitride, cold at one side, often warmer at the other and cooled from below, with pads of
    gold or oxide above and below it and caps on some of these."""
    rng = np.random.default_rng([seed, 7])
    size, thickness = float(rng.uniform(1e-4, 4e-4)), 1e-6 * float(rng.choice([1, 2, 5, 10, 20]))
    by_name = {m.name: m for m in MATERIALS}
    plate = Box("plate", by_name[str(rng.choice(["silicon", "nitride"]))], (0.0, 0.0, 0.0), (size, size, thickness))
    boxes, raster = [plate], size / 20 if rng.random() < ALIGNED else 0.0
    count = int(rng.integers(FEWEST, MOST + 1))
    for low, high in _places(rng, size, raster, count - 1):
        material, height = by_name[str(rng.choice(["gold", "oxide"]))], 1e-6 * float(rng.choice([0.2, 0.5, 1.0, 3.0]))
        below = rng.random() < BELOW
        ends = (-height, 0.0) if below else (thickness, thickness + height)
        source = float(rng.choice([1e12, 1e13])) if rng.random() < HEATED or len(boxes) == 1 else 0.0
        boxes.append(Box(f"pad {len(boxes)}", material, (*low, ends[0]), (*high, ends[1]), source))
        if not below and rng.random() < CAPPED:
            (x, y), (far_x, far_y) = low, high
            inner = x + 0.2 * (far_x - x), y + 0.3 * (far_y - y), ends[1]
            outer = x + 0.7 * (far_x - x), y + 0.8 * (far_y - y), ends[1] + height
            boxes.append(Box(f"cap {len(boxes)}", by_name["oxide"], inner, outer))
    boundaries = [Boundary("cold", "temperature", (0.0, 0.0, 0.0), (0.0, size, thickness), ROOM)]
    if rng.random() < 0.5:
        boundaries.append(Boundary("warm", "temperature", (size, 0.0, 0.0), (size, size, thickness), ROOM + 7.0))
    if rng.random() < 0.4:
        boundaries.append(Boundary("air", "convection", (0.0, 0.0, 0.0), (size, size, 0.0), 1e3, ROOM))
    x, y, z = rng.uniform(0.2, 0.8, 3) * (size, size, thickness)
    within = float(x), float(y), float(z)
    pad = boxes[int(rng.integers(1, len(boxes)))]
    probes: list[Any] = [
        Probe("mean of a place", within, within), Probe("mean of a pad", pad.lower, pad.upper),
        Probe("mean of the plate", plate.lower, plate.upper),
    ]  # fmt: skip
    probes += [Probe(f"into {b.name}", b.lower, b.upper, "heat_flow") for b in boundaries]
    scene = Scene(f"plate {seed}", tuple(boxes), tuple(boundaries), tuple(probes), ROOM, accuracy=accuracy, steady=True)
    if rng.random() < OVER_TIME:
        material = plate.material
        end = 0.1 * size**2 * material.heat_capacity / material.thermal_conductivity
        scene = replace(scene, steady=False, end_time=end, output_times=tuple((end * np.linspace(0.1, 1, 10)).tolist()))
    return Drawn(seed, scene, ("source",))


def _places(
    rng: np.random.Generator, size: float, raster: float, most: int
) -> list[tuple[tuple[float, float], tuple[float, float]]]:
    """The corners of at most so many rectangles that stay apart, on a ``raster`` (m) where that is not zero."""
    places: list[tuple[tuple[float, float], tuple[float, float]]] = []
    for low, extent in zip(rng.uniform(RIM, 0.9, (TRIALS, 2)), rng.uniform(0.02, 0.12, (TRIALS, 2)), strict=True):
        low, extent = low * size, extent * size
        if raster:
            low, extent = raster * np.round(low / raster), raster * np.maximum(np.round(extent / raster), 1.0)
        (x, y), (far_x, far_y) = low.tolist(), (low + extent).tolist()
        gap = APART * size
        clear = all(x > b[0] + gap or far_x < a[0] - gap or y > b[1] + gap or far_y < a[1] - gap for a, b in places)
        if clear and min(x, y) > 0 and max(far_x, far_y) < (1 - RIM) * size:
            places.append(((x, y), (far_x, far_y)))
        if len(places) == most:
            break
    return places
