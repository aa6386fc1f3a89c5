"""What a change of one key does to a discrete problem that keeps its cells: to coordinates and coefficients.

Every number of a scene (a coordinate, a property, a given value) is affine in each of its keys, so that the difference
of two scenes over that of their keys is its derivative. Planes of the mesh go with the faces that lie in them, all
between two planes in proportion: bricks stay bricks, and an integral over one changes as its sides do.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from fem3d.conductor import law
from fem3d.domain import Boxes
from meshes.symmetry import Symmetry
from scenes.errors import SceneError
from scenes.model import Boundary, Material, Scene, Schedule

APART = 1e-9  # of a scene's extent: faces nearer to each other are in one plane


@dataclass(frozen=True, eq=False)
class Given:
    """Where the conditions of a domain act: for each one of its scene, by number, the functions that it fixes
    (functions,), none of a film."""

    domain: Boxes
    fixed: dict[int, np.ndarray]

    @staticmethod
    def of(domain: Boxes) -> Given:
        """The conditions of a domain."""
        kinds = ("temperature", "voltage")
        conditions = enumerate(domain.scene.boundaries)
        return Given(domain, {i: domain.faces(b).functions for i, b in conditions if b.kind in kinds})


@dataclass(frozen=True, eq=False)
class Motion:
    """Derivatives by the logarithm of a key. ``breaks``: of the grid's breakpoints (m), per axis; ``stretch`` (3,
    cells): of the logarithms of the cells' sides; ``conductivity``, ``capacity`` (cells,), ``cold`` and ``warm``
    (cells,): of the properties, the latter the two parts of the resistivity; ``rises`` and ``voltages`` (functions,):
    of what is given; ``sources``: of the heat sources, as the domain has them; ``films``: of flux, coefficient and the
    air's rise, by boundary; ``probes``: of corners; ``added``: of what symmetry adds to a probe."""

    breaks: tuple[np.ndarray, ...]
    stretch: np.ndarray
    conductivity: np.ndarray
    capacity: np.ndarray
    cold: np.ndarray
    warm: np.ndarray
    rises: np.ndarray
    voltages: np.ndarray
    sources: tuple[float, ...]
    films: dict[str, tuple[float, float, float]]
    probes: dict[str, tuple[np.ndarray, np.ndarray]]
    added: dict[str, float]

    @property
    def volume(self) -> np.ndarray:
        """(cells,): of the logarithms of the cells' volumes."""
        found: np.ndarray = self.stretch.sum(axis=0)
        return found


def motion(given: Given, part: Symmetry, other: Symmetry, step: float) -> Motion:
    """The motion between the part of a scene that is solved and that of another, whose key is larger by a relative
    ``step``. Raises SceneError where the one can't move into the other."""
    domain, here, there = given.domain, part.scene, other.scene
    if [p[::2] for p in part.planes] != [p[::2] for p in other.planes] or _names(here) != _names(there):
        raise SceneError("the scene loses a mirror plane or a part when it changes")
    space = domain.space
    breaks = tuple(
        np.interp(at, *_planes(here, there, d, step)) for d, at in enumerate(space.grid.breaks)
    )  # fmt: skip
    sides = [np.diff(v)[i] / h for v, i, h in zip(breaks, space.ijk, space.h, strict=True)]
    start = here.initial_temperature, there.initial_temperature
    rises, voltages = np.zeros(space.size), np.zeros(space.size)
    films = {}
    for number, (a, b) in enumerate(zip(here.boundaries, there.boundaries, strict=True)):
        if a.kind == "temperature":
            own = given.fixed[number]
            rises[own] = space.unit[own] * (_number(b.value) - start[1] - _number(a.value) + start[0]) / step
        elif a.kind == "voltage":
            own = given.fixed[number]
            voltages[own] = space.unit[own] * (_number(b.value) - _number(a.value)) / step
        else:
            films[a.name] = _difference(_film(a, start[0]), _film(b, start[1]), step)
    owner = [(p.material, q.material) for p, q in zip(here.boxes, there.boxes, strict=True)]
    own = domain.body

    def change(of: str) -> np.ndarray:
        return np.array([(getattr(q, of) - getattr(p, of)) / step for p, q in owner])[own]

    laws = np.array([_difference(_law(p, start[0]), _law(q, start[1]), step) for p, q in owner])
    laws = (laws * domain.stands_for[:, None])[own]
    return Motion(
        breaks, np.array(sides), change("thermal_conductivity"), change("heat_capacity"), laws[:, 0], laws[:, 1],
        rises, voltages,
        tuple(
            (_number(q.heat_source) - _number(p.heat_source)) / step
            for p, q in zip(here.boxes, there.boxes, strict=True) if p.heat_source
        ),
        films,
        {
            p.name: (np.subtract(q.lower, p.lower) / step, np.subtract(q.upper, p.upper) / step)
            for p, q in zip(here.probes, there.probes, strict=True)
        },
        {
            name: sum(map(_number, other.probes[name][1])) / step - sum(map(_number, added)) / step
            for name, (_, added) in part.probes.items()
        },
    )  # fmt: skip


def _planes(here: Scene, there: Scene, axis: int, step: float) -> tuple[list[float], list[float]]:
    """Coordinates (m) of the planes of a scene across an axis, ascending, and how they move."""
    found = sorted(_moving(here, there, axis, step))
    low, high = found[0][0], found[-1][0]
    at, by = [found[0][0]], [found[0][1]]
    for coordinate, speed in found[1:]:
        if coordinate - at[-1] > APART * (high - low):
            at.append(coordinate)
            by.append(speed)
        elif abs(speed - by[-1]) > 1e-6 * (high - low):
            raise SceneError(
                f"faces at {'xyz'[axis]} = {coordinate:.6g} m lie in one plane and move apart: neither the scene of a "
                "smaller value nor that of a larger one is like this one, and there is no derivative"
            )
    return at, by


def _moving(here: Scene, there: Scene, axis: int, step: float) -> Iterator[tuple[float, float]]:
    """Every coordinate along an axis that is a plane of the mesh, and how it moves."""
    extent = [c for box in here.boxes for c in (box.lower[axis], box.upper[axis])]
    low, high = min(extent), max(extent)
    extended = [(p, q) for p, q in zip(here.probes, there.probes, strict=True) if p.lower != p.upper]
    both: list[tuple[Any, Any]] = [
        *zip(here.boxes, there.boxes, strict=True), *zip(here.boundaries, there.boundaries, strict=True), *extended,
    ]  # fmt: skip
    small = APART * (high - low)
    for a, b in both:
        for p, q in ((a.lower[axis], b.lower[axis]), (a.upper[axis], b.upper[axis])):
            if low - small <= p <= high + small:
                yield p, (q - p) / step


def _names(scene: Scene) -> list[str]:
    return [x.name for items in (scene.boxes, scene.boundaries, scene.probes) for x in items]  # type: ignore[attr-defined]


def _number(value: float | Schedule) -> float:
    if isinstance(value, Schedule):
        raise SceneError("a value that varies in time has no single derivative")
    return value


def _film(boundary: Boundary, start: float) -> tuple[float, float, float]:
    """Flux (W/m2), coefficient (W/(m2 K)) and the air's rise (K)."""
    value = _number(boundary.value)
    if boundary.kind == "heat_flux":
        return value, 0.0, 0.0
    return 0.0, value, _number(boundary.ambient) - start


def _law(material: Material, start: float) -> tuple[float, float]:
    return law(material, start) if material.resistivity else (0.0, 0.0)


def _difference(a: tuple[float, ...], b: tuple[float, ...], step: float) -> tuple[float, float, float]:
    x, y, *z = ((q - p) / step for p, q in zip(a, b, strict=True))
    return x, y, z[0] if z else 0.0
