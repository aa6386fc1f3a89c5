"""The lines of a union of boxes, the joints where two touch, and the conditions on each.

Every box is a line along its longest side; of equal sides along the one at whose ends most is joined, then along the
axis of the neighbour with most contact, then along the first axis. The rest of a box under later boxes is cut into
boxes, across its longest side first, and each of these is a line like any other. A temperature or an electrode that
lies inside a box cuts it there. All corners are planes of the scene's grid, counted in whole numbers, so that contact
is exact.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from scenes import physics, readouts
from scenes.errors import SceneError, quoted
from scenes.free.grid import Grid, grid_of
from scenes.free.validity import tidy
from scenes.model import AnyScene, Boundary, Box, MeshScene, Point, Probe, Scene

Cells = tuple[tuple[int, int], tuple[int, int], tuple[int, int]]
"""A box, a flat box or a point as the first and the last plane along each axis."""

ALIKE = 1e-6
"""Sides of a box that differ by a smaller part are equally long (files give corners to six digits or more)."""


@dataclass(frozen=True)
class Line:
    """A box of one material, or a part of one, seen as a line along ``axis`` from ``start`` to ``stop`` (m)."""

    name: str
    box: Box
    axis: int
    lower: Point
    upper: Point

    @property
    def start(self) -> float:
        return self.lower[self.axis]

    @property
    def stop(self) -> float:
        return self.upper[self.axis]

    @property
    def length(self) -> float:
        return self.stop - self.start

    @property
    def sides(self) -> tuple[float, float]:
        """The two extents of the cross-section (m)."""
        first, second = (self.upper[d] - self.lower[d] for d in range(3) if d != self.axis)
        return first, second

    @property
    def area(self) -> float:
        """The cross-section (m2)."""
        return self.sides[0] * self.sides[1]


@dataclass(frozen=True)
class Touch:
    """A part of a line's surface, between two corners (m), with ``normal`` as the axis across it.

    At a line's ``end`` (0 or 1; None for a side) nothing lies between it and the line. At a side it covers the line
    from ``start`` to ``stop``, and ``half`` the thickness lies between (m).
    """

    line: int
    lower: Point
    upper: Point
    normal: int
    end: int | None
    start: float
    stop: float
    area: float
    half: float


@dataclass(frozen=True)
class Joint:
    """Two lines that touch. ``kind``: "ends" where both do with an end, which makes them one there; "along" where lines
    that run alike touch at their sides and exchange heat point by point; "means" for all others. ``contact`` is the
    thermal resistance of one between them (m2 K/W), which keeps two ends apart."""

    one: Touch
    other: Touch
    kind: str
    contact: float = 0.0


@dataclass(frozen=True)
class Condition:
    """A boundary's part that acts on a line."""

    boundary: int
    touch: Touch


@dataclass(frozen=True)
class Layout:
    """The lines of a scene; joints and conditions of the heat, and joints and electrodes of the current.

    ``measured`` are resistances (K/W or ohm) in the place of the calculated ones, by ("joint" | "condition" |
    "wire" | "electrode", number). ``pairs``: of each probe of a resistance, by its name, the numbers of the electrode's
    boundary and of the other one's."""

    scene: Scene
    lines: tuple[Line, ...]
    joints: tuple[Joint, ...]
    conditions: tuple[Condition, ...]
    wires: tuple[Joint, ...]
    electrodes: tuple[Condition, ...]
    measured: tuple[tuple[tuple[str, int], float], ...] = ()
    pairs: tuple[tuple[str, int, int], ...] = ()

    def resistivity(self, line: int, rise: Any = 0.0) -> Any:
        """Of a line's material at a rise above the initial temperature, in ohm m."""
        m = self.lines[line].box.material
        assert m.resistivity is not None
        warm = self.scene.initial_temperature + rise - m.reference_temperature
        return m.resistivity * (1 + m.temperature_coefficient * warm)

    def places(self, line: int) -> list[float]:
        """Where something begins or ends along a line (m), its own ends first and last, in order."""
        joints = (t for j in (*self.joints, *self.wires) for t in (j.one, j.other))
        touches = [*joints, *(c.touch for c in (*self.conditions, *self.electrodes))]
        segment = self.lines[line]
        axis = segment.axis
        probes = [
            x for p in self.scene.probes for x in (p.lower[axis], p.upper[axis]) if segment.start < x < segment.stop
        ]
        covered = [x for t in touches if t.line == line and t.end is None for x in (t.start, t.stop)]
        return sorted({segment.start, segment.stop, *covered, *probes})


def layout(scene: AnyScene) -> Layout:
    """The lines of a scene of boxes; SceneError for one on a mesh, and for materials that lines don't take."""
    physics.refuse_laws(physics.materials(scene), "a network", ", or ask for the 3D solution alone")
    physics.refuse_faces(scene, "a network")
    if isinstance(scene, MeshScene):
        raise SceneError(
            f"scene {quoted(scene.name)} is on a mesh file, and a network is made of boxes: give [[box]]es"
        )
    _refuse_jumps(scene)
    grid = grid_of(scene)
    pairs = readouts.pairs(scene, grid.joined().values())
    number = {b.name: i for i, b in enumerate(scene.boundaries)}
    numbers = tuple((name, number[one.name], number[other.name]) for name, (one, other) in pairs.items())
    return replace(_Cutting(replace(grid, scene=tidy(grid))).layout(), pairs=numbers)


def _refuse_jumps(scene: Scene) -> None:
    """Raise SceneError where a potential jumps: the heat of a contact would have to enter two lines."""
    behind = [f"boundary {quoted(b.name)}.contact_resistance" for b in scene.boundaries if b.kind == "voltage"
              and b.contact_resistance]  # fmt: skip
    behind += [f"contact {quoted(c.name)}.electrical_resistance" for c in scene.contacts if c.electrical_resistance]
    if behind:
        raise SceneError(f"a network has no electrical resistance at a contact yet: leave {behind[0]} out")


def common(lower: Point, upper: Point, item: Line | Touch | Probe) -> tuple[Point, Point]:
    """The corners (m) of the intersection of two boxes."""
    low = [max(a, b) for a, b in zip(lower, item.lower, strict=True)]
    high = [min(a, b) for a, b in zip(upper, item.upper, strict=True)]
    return (low[0], low[1], low[2]), (high[0], high[1], high[2])


def overlap(first: Cells, second: Cells) -> Cells | None:
    """The intersection of two boxes, of the dimension of the smaller box; None where it is empty or of less."""
    shared = []
    for (a, b), (c, d) in zip(first, second, strict=True):
        low, high = max(a, c), min(b, d)
        if low > high or (low == high and a < b and c < d):
            return None
        shared.append((low, high))
    return shared[0], shared[1], shared[2]


def without(box: Cells, cut: Cells, order: tuple[int, ...] = (0, 1, 2)) -> list[Cells]:
    """A box, or a flat box, without another, cut into boxes across the axes in an ``order``."""
    shared = overlap(box, cut)
    if shared is None or any(low == high and a < b for (low, high), (a, b) in zip(shared, box, strict=True)):
        return [box]
    pieces, rest = [], list(box)
    for axis in order:
        for part in pairwise((rest[axis][0], *shared[axis], rest[axis][1])):
            if part[0] < part[1] and part != shared[axis]:
                pieces.append((*rest[:axis], part, *rest[axis + 1 :]))
        rest[axis] = shared[axis]
    return [(x, y, z) for x, y, z in pieces]


class _Cutting:
    def __init__(self, grid: Grid) -> None:
        self.grid, self.scene = grid, grid.scene
        self.parts: list[tuple[int, Cells]] = []
        boundaries = self.scene.boundaries
        self.sheets = [self._cells(b) for b in boundaries]
        whole = [self._cells(b) for b in self.scene.boxes]
        for number, box in enumerate(whole):
            self.parts += [(number, part) for part in self._uncovered(box, whole[number + 1 :])]
        for sheet, b in zip(self.sheets, boundaries, strict=True):
            if b.kind in ("temperature", "voltage"):
                self.parts = [(n, half) for n, part in self.parts for half in self._halved(n, part, sheet, b)]
        self.conducts = [self.scene.boxes[n].material.resistivity is not None for n, _ in self.parts]
        self.contacts = self._contacts()
        self.axes = self._axes()

    def layout(self) -> Layout:
        """The layout of the parts."""
        electric = physics.electric(self.scene)
        held = [s for s, b in zip(self.sheets, self.scene.boundaries, strict=True) if b.kind == "temperature"]
        fixed = [s for s, b in zip(self.sheets, self.scene.boundaries, strict=True) if b.kind == "voltage"]
        conducting = [c for c in self.contacts if self.conducts[c[0]] and self.conducts[c[1]]] if electric else []
        return Layout(
            self.scene, self._lines(), self._joints(self.contacts, held, True), self._conditions(held),
            self._joints(conducting, fixed, False), self._electrodes(),
        )  # fmt: skip

    def _cells(self, item: Box | Boundary) -> Cells:
        x, y, z = (self.grid.span(d, item.lower[d], item.upper[d]) for d in range(3))
        return x, y, z

    def _length(self, part: Cells, axis: int) -> float:
        planes = self.grid.planes[axis]
        return float(planes[part[axis][1]] - planes[part[axis][0]])

    def _uncovered(self, box: Cells, later: list[Cells]) -> list[Cells]:
        order = tuple(sorted(range(3), key=lambda d: -self._length(box, d)))
        parts = [box]
        for cut in later:
            parts = [rest for part in parts for rest in without(part, cut, order)]
        return parts

    def _halved(self, number: int, part: Cells, sheet: Cells, b: Boundary) -> list[Cells]:
        """A part, cut in two at a sheet inside it that acts on it."""
        axis = next(d for d in range(3) if sheet[d][0] == sheet[d][1])
        (a, b_), at = part[axis], sheet[axis][0]
        acts = b.kind == "temperature" or self.scene.boxes[number].material.resistivity is not None
        if not (acts and a < at < b_ and overlap(part, sheet)):
            return [part]
        return [(*part[:axis], half, *part[axis + 1 :]) for half in ((a, at), (at, b_))]  # type: ignore[misc]

    def _contacts(self) -> list[tuple[int, int, int, Cells]]:
        """The numbers of two parts that touch with a face, the axis across it, and the face."""
        contacts = []
        low, high = (np.array([[p[d][side] for d in range(3)] for _, p in self.parts]) for side in (0, 1))
        for axis in range(3):
            others = [d for d in range(3) if d != axis]
            meets = high[:, None, axis] == low[None, :, axis]
            for d in others:
                meets &= np.maximum(low[:, None, d], low[None, :, d]) < np.minimum(high[:, None, d], high[None, :, d])
            for i, j in np.argwhere(meets).tolist():
                pairs = zip(self.parts[i][1], self.parts[j][1], strict=True)
                x, y, z = ((max(a, c), min(b, d)) for (a, b), (c, d) in pairs)
                contacts.append((i, j, axis, (x, y, z)))
        return contacts

    def _area(self, face: Cells, normal: int) -> float:
        first, second = (self._length(face, d) for d in range(3) if d != normal)
        return first * second

    def _axes(self) -> list[int]:
        """The axis of each part's line."""
        areas = np.zeros((len(self.parts), 3))
        for i, j, axis, face in self.contacts:
            areas[[i, j], axis] += self._area(face, axis)
        for sheet in self.sheets:
            normal = next(d for d in range(3) if sheet[d][0] == sheet[d][1])
            for i, (_, part) in enumerate(self.parts):
                shared = overlap(part, sheet)
                areas[i, normal] += self._area(shared, normal) if shared else 0.0
        choices: list[list[int]] = []
        for i, (_, part) in enumerate(self.parts):
            lengths = [self._length(part, d) for d in range(3)]
            longest = [d for d in range(3) if lengths[d] >= (1 - ALIKE) * max(lengths)]
            most = max(areas[i, d] for d in longest)
            joined = [d for d in longest if areas[i, d] >= (1 - ALIKE) * most]
            choices.append(joined)
        return self._as_neighbours(choices)

    def _as_neighbours(self, choices: list[list[int]]) -> list[int]:
        """Choose for each part, among its axes, that of the neighbours with most contact."""
        while open_ := [i for i, axes in enumerate(choices) if len(axes) > 1]:
            shares = {}
            for i in open_:
                by_axis = dict.fromkeys(choices[i], 0.0)
                for a, b, axis, face in self.contacts:
                    neighbour = b if a == i else a
                    if i in (a, b) and len(choices[neighbour]) == 1 and choices[neighbour][0] in by_axis:
                        by_axis[choices[neighbour][0]] += self._area(face, axis)
                shares[i] = by_axis
            i = max(open_, key=lambda i: max(shares[i].values()))
            choices[i] = [max(choices[i], key=lambda axis: shares[i][axis])]
        return [axes[0] for axes in choices]

    def _corner(self, part: Cells, side: int) -> Point:
        x, y, z = (float(self.grid.planes[d][part[d][side]]) for d in range(3))
        return x, y, z

    def _lines(self) -> tuple[Line, ...]:
        numbers = [n for n, _ in self.parts]
        lines = []
        for i, (number, part) in enumerate(self.parts):
            box = self.scene.boxes[number]
            rank = f" {1 + numbers[:i].count(number)}" if numbers.count(number) > 1 else ""
            corners = self._corner(part, 0), self._corner(part, 1)
            lines.append(Line(f"{box.name}{rank}", box, self.axes[i], *corners))
        return tuple(lines)

    def _touch(self, i: int, face: Cells, normal: int) -> Touch:
        axis, part = self.axes[i], self.parts[i][1]
        lower, upper = self._corner(face, 0), self._corner(face, 1)
        end = None if normal != axis else int(face[axis][0] == part[axis][1])
        half = 0.0 if normal == axis else self._length(part, normal) / 2
        return Touch(i, lower, upper, normal, end, lower[axis], upper[axis], self._area(face, normal), half)

    def _joints(
        self, contacts: list[tuple[int, int, int, Cells]], cuts: list[Cells], thermal: bool
    ) -> tuple[Joint, ...]:
        joints = []
        for i, j, axis, face in contacts:
            rest = [face]
            for cut in cuts:
                rest = [r for part in rest for r in without(part, cut)]
            contact = self.scene.contact(self.parts[i][0], self.parts[j][0]) if thermal else None
            resistance = contact.thermal_resistance if contact else 0.0
            for part in rest:
                one, other = self._touch(i, part, axis), self._touch(j, part, axis)
                ends = (one.end is None) + (other.end is None)
                kind = "ends" if not ends else "along" if ends == 2 and self.axes[i] == self.axes[j] else "means"
                joints.append(Joint(one, other, kind, resistance))
        return tuple(joints)

    def _conditions(self, held: list[Cells]) -> tuple[Condition, ...]:
        """Temperatures on either side of where they are given, the first of several that overlap; fluxes and films
        where a face is bare and no temperature is given."""
        conditions, taken = [], list[Cells]()
        for number, (sheet, b) in enumerate(zip(self.sheets, self.scene.boundaries, strict=True)):
            if b.kind == "temperature":
                conditions += self._acting(number, sheet, taken)
                taken.append(sheet)
            elif b.kind != "voltage":
                conditions += self._acting(number, sheet, [*held, *(c[3] for c in self.contacts)])
        return tuple(conditions)

    def _electrodes(self) -> tuple[Condition, ...]:
        electrodes, taken = [], list[Cells]()
        for number, (sheet, b) in enumerate(zip(self.sheets, self.scene.boundaries, strict=True)):
            if b.kind == "voltage":
                electrodes += [c for c in self._acting(number, sheet, taken) if self.conducts[c.touch.line]]
                taken.append(sheet)
        return tuple(electrodes)

    def _acting(self, number: int, sheet: Cells, but: list[Cells]) -> list[Condition]:
        normal = next(d for d in range(3) if sheet[d][0] == sheet[d][1])
        conditions = []
        for i, (_, part) in enumerate(self.parts):
            shared = overlap(part, sheet)
            rest = [shared] if shared and sheet[normal][0] in part[normal] else []
            for other in but:
                rest = [r for face in rest for r in without(face, other)]
            conditions += [Condition(number, self._touch(i, face, normal)) for face in rest]
        return conditions
