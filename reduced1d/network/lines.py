"""The lines of a union of boxes, the links where a line touches another or a boundary, and the nodes along the lines.

Every box is a line along its longest side; of equal sides along the one at whose ends most is joined, then along the
axis of the decided neighbours with most contact, then along the first axis. The rest of a box under later boxes is cut
into boxes, across its longest side first, and each of these is a line like any other. A temperature or an electrode
that lies inside a box cuts it there. All corners are planes of the scene's grid, counted in whole numbers, so that
contact is exact. Elements are short where something begins or ends along a line and grow from there twofold. Lines that
run alike and touch have the same elements where they do, so that heat exchanged point by point is a product of values
at the same points.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
import scipy.sparse as sp

from scenes import physics
from scenes.errors import SceneError, quoted
from scenes.free import graph
from scenes.free.grid import Grid, grid_of
from scenes.free.rules import tidy
from scenes.model import AnyScene, Boundary, Box, MeshScene, Point, Probe, Scene

Cells = tuple[tuple[int, int], tuple[int, int], tuple[int, int]]
"""A box, a flat box or a point as the first and the last plane along each axis."""


@dataclass(frozen=True)
class Line:
    """A box of one material, or a part of one, seen as a line along ``axis``."""

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

    @property
    def conducts(self) -> bool:
        """Whether the line conducts a current."""
        return self.box.material.resistivity is not None


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
class Link:
    """A part of a line's surface that touches an ``other`` line, or a boundary.

    ``kind``: "ends" where all touch with an end, which makes them one there; "along" where lines that run alike touch
    at their sides and exchange heat point by point, and for a boundary at a side; "means" for all others. ``contact``
    is a thermal resistance between two lines (m2 K/W), which keeps two ends apart.
    """

    one: Touch
    other: Touch | None
    kind: str
    boundary: int = -1
    contact: float = 0.0

    @property
    def touches(self) -> tuple[Touch, ...]:
        return (self.one,) if self.other is None else (self.one, self.other)


@dataclass(frozen=True)
class Layout:
    """The lines of a scene and their links, for ``heat`` and for ``current``.

    ``measured`` are resistances (K/W or ohm) in the place of the calculated ones, by ("heat" | "current", number of the
    link). ``pairs``: of each probe of a resistance, by its name, the numbers of the electrode's boundary and of the
    other one's. ``anchored`` says whether heat can leave every connected part.
    """

    scene: Scene
    lines: tuple[Line, ...]
    heat: tuple[Link, ...]
    current: tuple[Link, ...]
    anchored: bool
    measured: tuple[tuple[tuple[str, int], float], ...] = ()
    pairs: tuple[tuple[str, int, int], ...] = ()

    def links(self, electric: bool) -> tuple[Link, ...]:
        return self.current if electric else self.heat

    def resistivity(self, line: int, electric: bool, rise: Any = 0.0) -> Any:
        """Of a line's material at a rise above the initial temperature, in ohm m; of heat in m K/W."""
        m = self.lines[line].box.material
        if not electric:
            return 1 / m.thermal_conductivity
        assert m.resistivity is not None
        warm = self.scene.initial_temperature + rise - m.reference_temperature
        return m.resistivity * (1 + m.temperature_coefficient * warm)

    def film(self, link: Link) -> float | None:
        """The film coefficient (W/(m2 K)) of a link with a boundary; None for another link."""
        b = self.scene.boundaries[link.boundary] if link.other is None else None
        return float(b.value) if b is not None and b.kind == "convection" else None  # type: ignore[arg-type]

    def places(self, line: int) -> list[float]:
        """Where something begins or ends along a line (m), its own ends first and last, in order."""
        segment = self.lines[line]
        touches = [t for link in (*self.heat, *self.current) for t in link.touches if t.line == line and t.end is None]
        probes = [x for p in self.scene.probes for x in (p.lower[segment.axis], p.upper[segment.axis])]
        inside = [x for x in probes if segment.start < x < segment.stop]
        return sorted({segment.start, segment.stop, *inside, *(x for t in touches for x in (t.start, t.stop))})


def layout(scene: AnyScene) -> Layout:
    """Cut a scene of boxes into lines; SceneError for one on a mesh, and for materials that lines don't take."""
    physics.refuse_laws(physics.materials(scene), "a network", instead=", or ask for the 3D solution alone")
    physics.refuse_faces(scene, "a network")
    if isinstance(scene, MeshScene):
        raise SceneError(
            f"scene {quoted(scene.name)} is on a mesh file, and a network is made of boxes: give [[box]]es"
        )
    # The heat of an electrical contact would have to enter two lines.
    behind = [f"boundary {quoted(b.name)}.contact_resistance" for b in scene.boundaries if b.kind == "voltage"
              and b.contact_resistance]  # fmt: skip
    behind += [f"contact {quoted(c.name)}.electrical_resistance" for c in scene.contacts if c.electrical_resistance]
    if behind:
        raise SceneError(f"a network has no electrical resistance at a contact yet: leave {behind[0]} out")
    grid = grid_of(scene)
    pairs = graph.pairs(grid)
    number = {b.name: i for i, b in enumerate(scene.boundaries)}
    cut = _Cutting(replace(grid, scene=tidy(grid)))
    return Layout(
        cut.scene, cut.lines(), cut.links(False), cut.links(True) if physics.electric(cut.scene) else (), grid.anchored,
        pairs=tuple((name, number[one.name], number[other.name]) for name, (one, other) in pairs.items()),
    )  # fmt: skip


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


def without(box: Cells, cuts: list[Cells], order: tuple[int, ...] = (0, 1, 2)) -> list[Cells]:
    """A box, or a flat box, without others, cut into boxes across the axes in an ``order``."""
    parts = [box]
    for cut in cuts:
        parts = [rest for part in parts for rest in _without_one(part, cut, order)]
    return parts


def _without_one(box: Cells, cut: Cells, order: tuple[int, ...]) -> list[Cells]:
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


def _normal(sheet: Cells) -> int:
    return next(d for d in range(3) if sheet[d][0] == sheet[d][1])


class _Cutting:
    """The parts of a scene's boxes in planes of its grid, each with the number of its box."""

    def __init__(self, grid: Grid) -> None:
        self.grid, self.scene = grid, grid.scene
        self.sheets = [self._cells(b) for b in self.scene.boundaries]
        self.parts: list[tuple[int, Cells]] = []
        whole = [self._cells(b) for b in self.scene.boxes]
        for number, box in enumerate(whole):
            order = tuple(sorted(range(3), key=lambda d, box=box: -self._length(box, d)))  # type: ignore[misc]
            self.parts += [(number, part) for part in without(box, whole[number + 1 :], order)]
        for sheet, b in zip(self.sheets, self.scene.boundaries, strict=True):
            if b.kind in ("temperature", "voltage"):
                self.parts = [(n, half) for n, part in self.parts for half in self._halved(n, part, sheet, b)]
        self.conducts = [self.scene.boxes[n].material.resistivity is not None for n, _ in self.parts]
        self.contacts = self._contacts()
        self.axes = self._axes()

    def _cells(self, item: Box | Boundary) -> Cells:
        x, y, z = (self.grid.span(d, item.lower[d], item.upper[d]) for d in range(3))
        return x, y, z

    def _length(self, part: Cells, axis: int) -> float:
        planes = self.grid.planes[axis]
        return float(planes[part[axis][1]] - planes[part[axis][0]])

    def _area(self, face: Cells, normal: int) -> float:
        first, second = (self._length(face, d) for d in range(3) if d != normal)
        return first * second

    def _halved(self, number: int, part: Cells, sheet: Cells, b: Boundary) -> list[Cells]:
        """A part, cut in two at a sheet inside it that acts on it."""
        axis = _normal(sheet)
        (first, last), at = part[axis], sheet[axis][0]
        acts = b.kind == "temperature" or self.scene.boxes[number].material.resistivity is not None
        if not (acts and first < at < last and overlap(part, sheet)):
            return [part]
        return [(*part[:axis], half, *part[axis + 1 :]) for half in ((first, at), (at, last))]  # type: ignore[misc]

    def _contacts(self) -> list[tuple[int, int, int, Cells]]:
        """The numbers of two parts that touch with a face, the axis across it, and the face."""
        contacts = []
        low, high = (np.array([[p[d][side] for d in range(3)] for _, p in self.parts]) for side in (0, 1))
        for axis in range(3):
            meets = high[:, None, axis] == low[None, :, axis]
            for d in range(3):
                if d != axis:
                    first, last = np.maximum(low[:, None, d], low[:, d]), np.minimum(high[:, None, d], high[:, d])
                    meets &= first < last
            for i, j in np.argwhere(meets).tolist():
                pairs = zip(self.parts[i][1], self.parts[j][1], strict=True)
                x, y, z = ((max(a, c), min(b, d)) for (a, b), (c, d) in pairs)
                contacts.append((i, j, axis, (x, y, z)))
        return contacts

    def _axes(self) -> list[int]:
        """The axis of each part's line."""
        areas = np.zeros((len(self.parts), 3))
        for i, j, axis, face in self.contacts:
            areas[[i, j], axis] += self._area(face, axis)
        for sheet in self.sheets:
            for i, (_, part) in enumerate(self.parts):
                if shared := overlap(part, sheet):
                    areas[i, _normal(sheet)] += self._area(shared, _normal(sheet))
        choices: list[list[int]] = []
        for i, (_, part) in enumerate(self.parts):
            lengths = [self._length(part, d) for d in range(3)]
            # Files give corners to six digits or more.
            longest = [d for d in range(3) if lengths[d] >= (1 - 1e-6) * max(lengths)]
            most = max(areas[i, d] for d in longest)
            choices.append([d for d in longest if areas[i, d] >= (1 - 1e-6) * most])
        shares = np.zeros_like(areas)
        for a, b, axis, face in self.contacts:
            for i, neighbour in ((a, b), (b, a)):
                if len(choices[neighbour]) == 1:
                    shares[i, choices[neighbour][0]] += self._area(face, axis)
        return [axes[int(shares[i, axes].argmax())] for i, axes in enumerate(choices)]

    def _corner(self, part: Cells, side: int) -> Point:
        x, y, z = (float(self.grid.planes[d][part[d][side]]) for d in range(3))
        return x, y, z

    def lines(self) -> tuple[Line, ...]:
        """The line of each part."""
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

    def links(self, electric: bool) -> tuple[Link, ...]:
        """The links of heat, or of the current: first of two lines, then of boundaries.

        A temperature or voltage acts on either side of its place, the first of several that overlap; fluxes and films
        act where a face is bare and no temperature is given.
        """
        kind, links, taken = "voltage" if electric else "temperature", list[Link](), list[Cells]()
        given = list(zip(self.sheets, self.scene.boundaries, strict=True))
        held = [sheet for sheet, b in given if b.kind == kind]
        live = self.conducts if electric else [True] * len(self.parts)
        for i, j, axis, face in self.contacts:
            contact = self.scene.contact(self.parts[i][0], self.parts[j][0]) if not electric else None
            for part in without(face, held) if live[i] and live[j] else ():
                one, other = self._touch(i, part, axis), self._touch(j, part, axis)
                sides = (one.end is None) + (other.end is None)
                how = "ends" if not sides else "along" if sides == 2 and self.axes[i] == self.axes[j] else "means"
                links.append(Link(one, other, how, contact=contact.thermal_resistance if contact else 0.0))
        for number, (sheet, b) in enumerate(given):
            if b.kind == kind:
                others = taken.copy()
                taken.append(sheet)
            elif electric or b.kind == "voltage":
                continue
            else:
                others = [*held, *(face for *_, face in self.contacts)]
            normal = _normal(sheet)
            for i, (_, cells) in enumerate(self.parts):
                shared = overlap(cells, sheet)
                if live[i] and shared and sheet[normal][0] in cells[normal]:
                    touches = [self._touch(i, face, normal) for face in without(shared, others)]
                    links += [Link(t, None, "along" if t.end is None else "ends", number) for t in touches]
        return tuple(links)


def graded_nodes(layout: Layout, shortest: Sequence[float]) -> list[np.ndarray]:
    """The nodes of each line (m): where something begins or ends on it or on a line that it exchanges heat with point
    by point, and between these, at distances that grow from the ``shortest`` of each line."""
    count = len(layout.lines)
    groups = joined(count, [(link.one.line, link.other.line) for link in (*layout.heat, *layout.current)
                            if link.kind == "along" and link.other])  # fmt: skip
    by_line: list[np.ndarray] = [np.empty(0)] * count
    for group in range(groups.max() + 1):
        lines = np.flatnonzero(groups == group).tolist()
        places = sorted({x for i in lines for x in layout.places(i)})
        nodes = graded(places, min(shortest[i] for i in lines))
        for i in lines:
            line = layout.lines[i]
            by_line[i] = nodes[(nodes >= line.start) & (nodes <= line.stop)]
    return by_line


def graded(places: Sequence[float], shortest: float) -> np.ndarray:
    """Nodes at some places (m, ascending) and between them, at distances that double from ``shortest`` on away from
    each, as fields get smoother."""
    pieces = [np.asarray(places)]
    for a, b in pairwise(places):
        # From both ends the distances shortest (1 + 2 + 4 ...), up to the middle.
        half = (b - a) / 2
        steps = int(np.ceil(np.log1p(half / shortest) / np.log(2)))
        if steps < 1 or shortest > half:
            continue
        outward = (2.0 ** np.arange(1, steps + 1) - 1) / (2.0**steps - 1) * half
        pieces += [a + outward, b - outward[:-1]]
    return np.unique(np.concatenate(pieces))


def joined(count: int, pairs: Sequence[tuple[int, int]]) -> np.ndarray:
    """(count,): a number for each connected set under some pairs."""
    rows, columns = np.array(pairs, int).reshape(-1, 2).T
    graph = sp.coo_array((np.ones(len(rows)), (rows, columns)), shape=(count, count))
    return np.asarray(sp.csgraph.connected_components(graph, directed=False)[1])
