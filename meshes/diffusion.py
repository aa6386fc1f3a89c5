"""Layers towards faces whose temperature jumps: heat has gone no further than sqrt(D t) from them at a time t."""

from __future__ import annotations

import numpy as np

from meshes.grading import RATIO
from meshes.grid import Grid
from scenes import faces, laws
from scenes.model import Boundary, Box, Scene, Schedule, bends

REACH = 3.0  # the first interval at a face is at most this many diffusion lengths long
DEGREE = 4  # least degree of the layers
FIRM = 0.1  # a film counts as a jump of the temperature from this fraction of what the first diffusion length conducts


def graded(grid: Grid, scene: Scene, earliest: float) -> Grid:
    """The grid with more intervals towards each face whose temperature jumps, down to the diffusion length of the
    earliest time of interest (s)."""
    axes = [_graded(grid.breaks[d], grid.degrees[d], _lengths(scene, d, earliest)) for d in range(3)]
    return grid.with_axes([breaks for breaks, _ in axes], [degrees for _, degrees in axes])


def _lengths(scene: Scene, d: int, earliest: float) -> dict[float, float]:
    """The shortest diffusion length (m) at each plane across an axis where a temperature jumps."""
    lengths: dict[float, float] = {}
    for b in scene.boundaries:
        for box in scene.boxes:
            if b.kind == "voltage" or b.lower[d] != b.upper[d] or not _touch(b, box):
                continue
            material = box.material.at(scene.initial_temperature)
            k = laws.along(material.thermal_conductivity)[d]
            length = float(np.sqrt(k / material.heat_capacity * earliest))
            if _jumps(b, scene.initial_temperature, k / length):
                lengths[b.lower[d]] = min(length, lengths.get(b.lower[d], np.inf))
    return lengths


def _jumps(b: Boundary, initial: float, conductance: float) -> bool:
    """Whether a boundary makes the temperature of its face jump; ``conductance`` (W/(m2 K)) is the conductance of
    a diffusion length."""
    if b.kind == "temperature":
        steps = isinstance(b.value, Schedule) and any(np.diff(b.value.times) == 0)
        return steps or _at_start(b.value) != initial
    if bends(b):
        return bool(faces.coefficient(b, np.array(max(initial, _at_start(b.ambient)))) > FIRM * conductance)
    return b.kind == "convection" and _at_start(b.value) > FIRM * conductance


def _at_start(value: float | Schedule) -> float:
    return float(np.interp(0.0, value.times, value.values)) if isinstance(value, Schedule) else value


def _touch(b: Boundary, box: Box) -> bool:
    return all(b.lower[d] <= box.upper[d] and b.upper[d] >= box.lower[d] for d in range(3))


def _graded(at: np.ndarray, initial_degrees: np.ndarray, lengths: dict[float, float]) -> tuple[np.ndarray, np.ndarray]:
    breaks, degrees = at.tolist(), initial_degrees.tolist()
    for plane, length in lengths.items():
        i = int(np.abs(np.array(breaks) - plane).argmin())
        while i + 1 < len(breaks) and breaks[i + 1] - breaks[i] > REACH * length:
            gap = breaks[i + 1] - breaks[i]
            degrees[i] = max(degrees[i], DEGREE)
            breaks.insert(i + 1, breaks[i] + max(RATIO * gap, REACH * length / 2))
            degrees.insert(i, degrees[i])
        while i > 0 and breaks[i] - breaks[i - 1] > REACH * length:
            gap = breaks[i] - breaks[i - 1]
            degrees[i - 1] = max(degrees[i - 1], DEGREE)
            breaks.insert(i, breaks[i] - max(RATIO * gap, REACH * length / 2))
            degrees.insert(i, degrees[i - 1])
            i += 1
    return np.array(breaks), np.array(degrees)
