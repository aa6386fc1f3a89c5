"""What a change of one key does to a discrete problem that keeps its cells: to coordinates and coefficients.

Every number of a scene (a coordinate, a property, a given value) is affine in each of its keys, so that the difference
of two scenes over that of their keys is its derivative. Planes of the mesh go with the faces that lie in them, all
between two planes in proportion: bricks stay bricks, and an integral over one changes as its sides do.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fem3d.problems.conductors import law
from fem3d.problems.following import OfCells
from fem3d.spaces.box_cells import BoxCells, box_cells
from fem3d.spaces.domain import Domain, boxes
from fem3d.spaces.file_domain import groups
from meshes.grouped.place import Placed
from meshes.symmetry import Symmetry
from scenes import faces, laws, physics
from scenes.errors import SceneError
from scenes.laws import Property
from scenes.model import AnyScene, Material, MeshScene, Scene, Schedule, Value, bends

STEP = 2.0**-14  # relative change of a key from scene to scene, a power of two; rounding is divided by it
APART = 1e-9  # faces nearer to each other than this fraction of a scene's extent are in one plane


@dataclass(frozen=True, eq=False)
class Motion:
    """Derivatives by the logarithm of a key. ``breaks``: of the grid's breakpoints (m), per axis; ``stretch`` (3,
    cells): of the logarithms of the cells' sides; ``conductivity`` (3, cells), ``cold`` and ``warm`` (cells,): of
    the properties where these are numbers, the latter the two parts of the resistivity along x; ``ratios`` (3, cells):
    of the logarithms of the resistivities along x, y and z over that along x; ``rises`` and ``voltages``
    (functions,): of what is given; ``sources``: of the heat sources, as the domain has them; ``films``: of flux,
    coefficient and the air's rise, by boundary; ``probes``: of corners; ``electrodes``: their voltages, with how
    they change; ``terminals``: by name of the given current (A), or of the voltage and of the conductance (S) of
    the series resistance behind which it stands; ``contacts``: by name of the logarithms of the thermal and the
    electrical resistance of contacts, the latter of electrodes too. What a law of the temperature does is told at
    the points of integrals, from the scene that is ``changed`` by a ``step``."""

    breaks: tuple[np.ndarray, ...]
    stretch: np.ndarray
    conductivity: np.ndarray
    cold: np.ndarray
    warm: np.ndarray
    ratios: np.ndarray
    rises: np.ndarray
    voltages: np.ndarray
    sources: tuple[float, ...]
    films: dict[str, tuple[float, float, float]]
    probes: dict[str, tuple[np.ndarray, np.ndarray]]
    electrodes: tuple[tuple[float, float], ...]
    terminals: dict[str, tuple[float, float]]
    contacts: dict[str, tuple[float, float]]
    changed: AnyScene
    step: float

    def bends(self, domain: Domain, key: str) -> bool:
        """Whether a property by its key changes where the temperature is what it was above the initial one."""
        pairs = zip(domain.materials, physics.materials(self.changed), strict=True)
        moved = self.changed.initial_temperature != domain.scene.initial_temperature
        return moved or any(p.law(key) != q.law(key) for p, q in pairs)

    def of_law(self, domain: Domain, key: str, cells: np.ndarray, rise: np.ndarray) -> np.ndarray:
        """Of a property by its key on some cells, as `OfCells.value` of a rise (K) has it."""
        other = replace(domain, scene=self.changed, materials=physics.materials(self.changed))
        return OfCells(domain, key, cells).towards(OfCells(other, key, cells), rise) / self.step

    def of_face(self, scene: AnyScene, boundary: Any, temperature: np.ndarray) -> np.ndarray:
        """Of the flux (W/m2) that leaves by a boundary whose heat is no straight line of its face's temperature, at
        such ones (K)."""
        other = next(b for b in self.changed.boundaries if b.name == boundary.name)
        warmer = self.changed.initial_temperature - scene.initial_temperature
        change = faces.towards(boundary, other, temperature) + faces.slope(boundary, temperature) * warmer
        return change / self.step

    @property
    def moves(self) -> bool:
        """Whether any plane does."""
        return any(v.any() for v in self.breaks)

    def of_voltage(self, voltage: Value) -> float:
        """Of the voltage of electrodes that have this one."""
        changes = [change for value, change in self.electrodes if value == voltage]
        return sum(changes) / max(len(changes), 1)

    @property
    def volume(self) -> np.ndarray:
        """(cells,): of the logarithms of the cells' volumes."""
        volume: np.ndarray = self.stretch.sum(axis=0)
        return volume


def motion(domain: Any, part: Symmetry, other: Symmetry, step: float) -> Motion:
    """The motion of a domain between the part of a scene that is solved and that of another, whose key is larger by a
    relative ``step``. On a mesh file nothing moves. Raises SceneError where the one can't move into the other, as on
    tetrahedra of boxes."""
    scene = part.scene
    changed: Any = other.scene  # on a mesh where the scene is, which is checked
    _check_alike(part, other)
    space = domain.space
    start = scene.initial_temperature, changed.initial_temperature
    rises, voltages = np.zeros(space.size), np.zeros(domain.electric.space.size)
    films, electrodes, terminals = {}, [], {}
    for a, b in zip(scene.boundaries, changed.boundaries, strict=True):
        if a.kind == "temperature":
            indices = domain.fixed[a.name]
            rises[indices] = space.unit[indices] * (_number(b.value) - start[1] - _number(a.value) + start[0]) / step
        elif a.kind == "voltage":
            more = (_number(b.value) - _number(a.value)) / step
            if a.series_resistance:
                grown = 0.0 if np.isinf(a.series_resistance) else b.series_resistance - a.series_resistance
                terminals[a.name] = more, -grown / a.series_resistance**2 / step
                continue
            indices = domain.electric.fixed[a.name]
            voltages[indices] = domain.electric.space.unit[indices] * more
            electrodes.append((_number(a.value), more))
        elif not bends(a):
            films[a.name] = _difference(_film(a, start[0]), _film(b, start[1]), step)
    owner = list(zip(physics.materials(scene), physics.materials(changed), strict=True))
    indices = domain.body

    conductivity = [_change(p.thermal_conductivity, q.thermal_conductivity, step) for p, q in owner]
    lines = np.array([_difference(_law(p, start[0]), _law(q, start[1]), step) for p, q in owner])
    lines = (lines * domain.stands_for[:, None])[indices]
    ratios = np.array([np.log(np.divide(q.resistivity_ratios, p.resistivity_ratios)) / step for p, q in owner])
    breaks: tuple[np.ndarray, ...] = ()
    stretch, probes = np.zeros((3, len(indices))), dict[str, tuple[np.ndarray, np.ndarray]]()
    if isinstance(domain, BoxCells):
        _check_stays(part, other)
    elif isinstance(scene, Scene):
        breaks = speeds(domain, scene, changed, step)
        sides = (np.diff(v)[i] / h for v, i, h in zip(breaks, space.ijk, space.h, strict=True))
        stretch = np.array(list(sides))
        probes = {
            p.name: (np.subtract(q.lower, p.lower) / step, np.subtract(q.upper, p.upper) / step)
            for p, q in zip(scene.probes, changed.probes, strict=True)
        }
    return Motion(
        breaks, stretch, np.array(conductivity).T[:, indices], lines[:, 0], lines[:, 1], ratios.T[:, indices], rises,
        voltages, _sources(scene, changed, step), films, probes, tuple(electrodes), terminals,
        _resisting(scene, changed, step), changed, step,
    )  # fmt: skip


def moved(domain: Any, part: Symmetry, other: Symmetry, step: float) -> Domain:
    """The domain of the part of another scene, as of `motion`, on the cells of this one's, moved. Raises as that
    does."""
    _check_alike(part, other)
    if isinstance(other.scene, MeshScene):
        return groups(Placed(other.scene, domain.placed.mesh))
    if isinstance(domain, BoxCells):
        _check_stays(part, other)
        return box_cells(other.scene, domain.space.mesh)
    grid, by = domain.space.grid, speeds(domain, part.scene, other.scene, step)
    breaks = tuple(b + step * v for b, v in zip(grid.breaks, by, strict=True))
    moved_grid = replace(grid, breaks=breaks, boxes=other.scene.boxes)
    if _voltages(part.scene) != _voltages(other.scene):
        return boxes(other.scene, moved_grid)  # which cells carry current may change
    owned = (b.heat_source for b in other.scene.boxes if b.heat_source)
    contacts = {c.name: c for c in other.scene.contacts}
    return replace(
        domain, scene=other.scene, space=domain.space.moved(moved_grid),
        potentials=domain.potentials and domain.potentials.moved(moved_grid),
        contacts=tuple(replace(joint, contact=contacts[joint.contact.name]) for joint in domain.contacts),
        materials=tuple(b.material for b in other.scene.boxes),
        sources=tuple((value, cells) for value, (_, cells) in zip(owned, domain.sources, strict=True)),
    )  # fmt: skip


def _voltages(scene: AnyScene) -> list[Value]:
    return [b.value for b in scene.boundaries if b.kind == "voltage"]


def _check_alike(part: Symmetry, other: Symmetry) -> None:
    alike = [p[::2] for p in part.planes] == [p[::2] for p in other.planes]
    if not alike or _names(part.scene) != _names(other.scene):
        raise SceneError("the scene loses a mirror plane or a part when it changes")


def _check_stays(part: Symmetry, other: Symmetry) -> None:
    """Raises SceneError where any part of a scene is elsewhere in another."""
    both: Any = [(*s.scene.boxes, *s.scene.boundaries, *s.scene.probes) for s in (part, other)]
    if any((a.lower, a.upper) != (b.lower, b.upper) for a, b in zip(*both, strict=True)):
        raise SceneError('a part of the scene moves, which tetrahedra don\'t follow; run.mesh = "bricks" does')


def speeds(domain: Any, scene: Scene, changed: Scene, step: float) -> tuple[np.ndarray, ...]:
    """(breakpoints,) per axis: how the planes of the mesh move from a scene to another, over the ``step`` between.
    Raises SceneError where planes of one place move apart."""
    return tuple(np.interp(at, *_planes(scene, changed, d, step)) for d, at in enumerate(domain.space.grid.breaks))


def _sources(scene: AnyScene, changed: AnyScene, step: float) -> tuple[float, ...]:
    """How the sources change that a domain has."""
    pairs = zip(physics.heat_sources(scene), physics.heat_sources(changed), strict=True)
    # A source of a mesh's group is one even where it is nothing; a box that is not heated has none.
    every = scene.heated[0] == "source"
    return tuple((_number(q) - _number(p)) / step for (_, p), (_, q) in pairs if every or p)


def _resisting(scene: AnyScene, changed: AnyScene, step: float) -> dict[str, tuple[float, float]]:
    """`Motion.contacts`."""
    resistances = []
    for each in (scene, changed):
        contacts = {c.name: (c.thermal_resistance, c.electrical_resistance) for c in each.contacts}
        electrodes = {b.name: (0.0, b.contact_resistance) for b in each.boundaries if b.kind == "voltage"}
        resistances.append(contacts | electrodes)
    first, second = resistances

    def grown(a: float, b: float) -> float:
        return (b - a) / a / step if a else 0.0

    return {name: (grown(a, second[name][0]), grown(b, second[name][1])) for name, (a, b) in first.items()}


def _planes(scene: Scene, changed: Scene, axis: int, step: float) -> tuple[list[float], list[float]]:
    """Coordinates (m) of the planes of a scene across an axis, ascending, and how they move."""
    planes = sorted(_moving(scene, changed, axis, step))
    low, high = planes[0][0], planes[-1][0]
    at, by = [planes[0][0]], [planes[0][1]]
    for coordinate, speed in planes[1:]:
        if coordinate - at[-1] > APART * (high - low):
            at.append(coordinate)
            by.append(speed)
        elif abs(speed - by[-1]) > 1e-6 * (high - low):
            raise SceneError(
                f"faces at {'xyz'[axis]} = {coordinate:.6g} m lie in one plane and move apart, which no motion of "
                "this mesh does"
            )
    return at, by


def _moving(scene: Scene, changed: Scene, axis: int, step: float) -> Iterator[tuple[float, float]]:
    """Every coordinate along an axis that is a plane of the mesh, and how it moves."""
    extent = [c for box in scene.boxes for c in (box.lower[axis], box.upper[axis])]
    low, high = min(extent), max(extent)
    extended = [(p, q) for p, q in zip(scene.probes, changed.probes, strict=True) if p.lower != p.upper]
    both: list[tuple[Any, Any]] = [
        *zip(scene.boxes, changed.boxes, strict=True),
        *zip(scene.boundaries, changed.boundaries, strict=True),
        *extended,
    ]  # fmt: skip
    small = APART * (high - low)
    for a, b in both:
        for p, q in ((a.lower[axis], b.lower[axis]), (a.upper[axis], b.upper[axis])):
            if low - small <= p <= high + small:
                yield p, (q - p) / step


def _names(scene: AnyScene) -> list[str]:
    parts: tuple[Any, ...] = getattr(scene, "boxes", ())
    return [x.name for items in (parts, scene.boundaries, scene.probes) for x in items]


def _number(value: float | Schedule) -> float:
    if isinstance(value, Schedule):
        raise SceneError("a value that varies in time has no single derivative")
    return value


def _film(boundary: Any, start: float) -> tuple[float, float, float]:
    """Flux (W/m2), coefficient (W/(m2 K)) and the air's rise (K)."""
    value = _number(boundary.value)
    if boundary.kind == "heat_flux":
        return value, 0.0, 0.0
    return 0.0, value, _number(boundary.ambient) - start


def _change(given: Property, other: Property, step: float) -> list[float]:
    """Of a property along x, y and z; nothing where it follows the temperature."""
    pairs = zip(laws.along(given), laws.along(other), strict=True)
    return [0.0] * 3 if laws.varies(given) else [(q - p) / step for p, q in pairs]


def _law(material: Material, start: float) -> tuple[float, float]:
    return law(material, start) if material.resistivity else (0.0, 0.0)


def _difference(a: tuple[float, ...], b: tuple[float, ...], step: float) -> tuple[float, float, float]:
    x, y, *z = ((q - p) / step for p, q in zip(a, b, strict=True))
    return x, y, z[0] if z else 0.0
