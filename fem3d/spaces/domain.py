"""A scene laid on the cells of a mesh: which cells and facets its materials, sources, conditions and probes are on.

Boxes (`Boxes`) and mesh files (`fem3d.spaces.mapped`) say it in their own ways; the problems are assembled from here.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, ClassVar, TypeVar

import numpy as np

from fem3d.spaces.bricks import BrickSpace
from fem3d.spaces.channels import Inputs
from fem3d.spaces.integrals import Faces, Space
from fem3d.spaces.quadrature import product_rule
from fem3d.spaces.split import split, twin
from meshes import connected
from meshes.grid import Grid
from scenes import laws
from scenes.model import Boundary, Contact, Material, Probe, Scene, Schedule, Value

D = TypeVar("D", bound="Domain")
Patch = tuple[np.ndarray, np.ndarray, np.ndarray]
"""Cells (n,), and in the coordinates of their reference cell the corner (3,) and the sides (k, 3) of a part of each."""


@dataclass(frozen=True)
class Joint:
    """A contact that isn't perfect, and its facets."""

    contact: Contact
    facets: np.ndarray


@dataclass(frozen=True, eq=False)
class Domain(ABC):
    """Cells and conditions of a scene, of whatever kind. ``body`` (cells,) is the number of each cell's body in
    ``names`` and ``materials``; ``sources`` are heat sources (W/m3) with their cells; ``live`` (cells,) are the cells
    that current passes, ``still`` those of conductors at one voltage, with that voltage or the name of the electrode
    whose potential they have; ``anchored``: whether every part has an exit for heat. At ``contacts`` the temperature, a
    function of the ``space``, may jump, or the potential,
    one of ``potentials`` where these are others.
    """

    scene: Any
    space: Space
    body: np.ndarray
    names: tuple[str, ...]
    materials: tuple[Material, ...]
    sources: tuple[tuple[Value, np.ndarray], ...]
    live: np.ndarray
    still: tuple[tuple[np.ndarray, Value | str], ...]
    anchored: bool
    potentials: Space | None = field(default=None, kw_only=True)
    contacts: tuple[Joint, ...] = field(default=(), kw_only=True)

    conditions_first: ClassVar[bool] = False
    """Whether a flow is read off the conditions on a probe wherever there are any, inside the solid too."""

    @property
    def electric(self: D) -> D:
        """The same with the space of the potentials, in which voltages and currents are told."""
        return self if self.potentials is None else self._electric

    @cached_property
    def _electric(self: D) -> D:
        assert self.potentials is not None
        return replace(self, space=self.potentials, potentials=None)

    @cached_property
    def cold(self) -> tuple[Material, ...]:
        """The materials with numbers in the place of their laws, those of the initial temperature."""
        return tuple(m.at(self.scene.initial_temperature) for m in self.materials)

    def per_cell(self, key: str) -> np.ndarray:
        """(cells,): a property of the materials at the initial temperature; (3, cells) where it differs along x, y and
        z in one of them."""
        given = [getattr(m, key) for m in self.cold]
        if any(isinstance(each, tuple) for each in given):
            return np.array([laws.along(each) for each in given], float).T[:, self.body]
        return np.array(given, float)[self.body]

    @property
    def stands_for(self) -> np.ndarray:
        """(bodies,): how many such in series each body is to a current."""
        return np.ones(len(self.names))

    @cached_property
    def probes(self) -> dict[str, Any]:
        """The scene's, by name."""
        return {p.name: p for p in self.scene.probes}

    @cached_property
    def inputs(self) -> Inputs:
        """The channels of what varies in time."""
        values = [v for b in self.scene.boundaries for v in (b.value, b.ambient)] + [v for v, _ in self.sources]
        return Inputs(tuple(dict.fromkeys(v for v in values if isinstance(v, Schedule))))

    def exposed(self, facets: np.ndarray) -> np.ndarray:
        """(facets,): which are on the surface."""
        return self.space.mesh.f2t[1, facets] < 0

    def seen(self, facets: np.ndarray, inside: np.ndarray | None = None) -> Faces:
        """Those of some facets that are of a cell (among those chosen, (cells,)), each seen from one."""
        cells = self.space.mesh.f2t[:, facets]
        fine = cells >= 0 if inside is None else (cells >= 0) & inside[cells]
        side = fine.argmax(axis=0)
        kept = fine.any(axis=0)
        return self.space.faces(facets[kept], cells[side, np.arange(len(facets))][kept])

    def sides(
        self, item: Any, inside: np.ndarray, without: Sequence[np.ndarray] = ()
    ) -> Iterator[tuple[Faces, float, np.ndarray]]:
        """The facets of a flat probe, but for some, with a chosen cell on either side, as seen from both: (faces, half
        the sign of their normal, cells)."""
        facets = self.facets(item)
        pairs = self.space.mesh.f2t[:, facets]
        both = (pairs >= 0).all(axis=0)
        for others in without:
            both &= ~np.isin(facets, others)
        both[both] = inside[pairs[:, both]].all(axis=0)
        signs = self.directions(item)[both]
        for side in (0, 1):
            for sign in np.unique(signs):
                at = np.flatnonzero(signs == sign)
                cells = pairs[side, both][at]
                yield self.space.faces(facets[both][at], cells), float(sign) * (0.5 - side), cells

    def on(self, boundary: Any) -> np.ndarray:
        """The facets on which a condition acts: those of conductors that carry current for a voltage, exposed ones for
        a flux."""
        if boundary.name not in self._facets:
            facets = self.facets(boundary)
            if boundary.kind == "voltage":
                cells = self.space.mesh.f2t[:, facets]
                facets = facets[((cells >= 0) & self.live[cells]).any(axis=0)]
            elif boundary.kind != "temperature":
                facets = facets[self.exposed(facets)]
            self._facets[boundary.name] = facets
        return self._facets[boundary.name]

    def faces(self, boundary: Any) -> Faces:
        """Integrals over the facets on which a condition acts: of a voltage behind a contact, by the functions beyond
        it."""
        if boundary.kind != "voltage":
            if boundary.name not in self._faces:
                self._faces[boundary.name] = self.seen(self.on(boundary))
            return self._faces[boundary.name]
        face = self.seen(self.on(boundary), self.live)
        if boundary.name not in self.space.beyond:
            return face
        functions, partners = self.space.beyond[boundary.name]
        beyond = np.arange(self.space.size)
        beyond[functions] = partners
        return twin(face, beyond)

    @cached_property
    def _faces(self) -> dict[str, Faces]:
        return {}

    @cached_property
    def _facets(self) -> dict[str, np.ndarray]:
        return {}

    @cached_property
    def fixed(self) -> dict[str, np.ndarray]:
        """For each condition that gives a temperature or a voltage the functions (functions,) that it fixes."""
        kinds = ("temperature", "voltage")
        return {b.name: self.faces(b).functions for b in self.scene.boundaries if b.kind in kinds}

    @abstractmethod
    def facets(self, item: Any) -> np.ndarray:
        """The facets of a condition or of a flat probe."""

    def part(self, name: str) -> np.ndarray:
        """(cells,): which are of a part that a contact or a probe names; in the symmetric part of a scene it may be
        missing."""
        return np.array([each == name for each in self.names])[self.body]

    def parts(self, names: Iterable[str]) -> np.ndarray:
        """(cells,): those in any part with one of some names."""
        return np.any([np.zeros(len(self.body), bool), *map(self.part, names)], axis=0)

    @abstractmethod
    def directions(self, item: Any) -> np.ndarray:
        """(facets,): 1 where the direction in which flows through a flat probe count points out of a facet's first
        cell, else -1."""

    @abstractmethod
    def mean(self, probe: Any, inside: np.ndarray | None = None) -> np.ndarray:
        """(functions,): what each adds to the mean over a probe; ``inside`` are the cells of those that matter."""

    @abstractmethod
    def patches(self, probe: Any, inside: np.ndarray | None = None) -> list[Patch]:
        """The parts of cells that a probe lies in."""

    @abstractmethod
    def is_flat(self, probe: Any) -> bool:
        """Whether a probe is a surface."""


@dataclass(frozen=True, eq=False)
class Boxes(Domain):
    """A scene of boxes on a grid of bricks."""

    scene: Scene
    space: BrickSpace

    @property
    def stands_for(self) -> np.ndarray:
        """(bodies,): what the boxes say."""
        return np.array([b.stands_for for b in self.scene.boxes])

    def facets(self, item: Boundary | Probe) -> np.ndarray:
        """The facets on a flat box."""
        grid, d = self.space.grid, self.space.grid.flat(item.lower, item.upper)
        on = np.abs(self._middles[d] - grid.breaks[d][grid.at(d, item.lower[d])]) <= grid.small(d)
        for e in range(3):
            if e != d:
                low, high = (grid.breaks[e][i] for i in grid.span(e, item.lower[e], item.upper[e]))
                on &= (self._middles[e] > low) & (self._middles[e] < high)
        return np.flatnonzero(on)

    @cached_property
    def _middles(self) -> np.ndarray:
        mesh = self.space.mesh
        return mesh.p[:, mesh.facets].mean(axis=1)

    def directions(self, item: Boundary | Probe) -> np.ndarray:
        """(facets,): 1 where the first cell is the lower one along the axis."""
        facets = self.facets(item)
        middles = self.space.mesh.p[:, self.space.mesh.t[:, self.space.mesh.f2t[0, facets]]].mean(axis=1)
        return np.where((self._middles[:, facets] - middles).sum(axis=0) > 0, 1, -1)

    def mean(self, probe: Probe, inside: np.ndarray | None = None) -> np.ndarray:
        """(functions,): what a function adds to the mean over a probe."""
        if self.space.plain and not probe.boxes:
            row = self.space.mean(probe.lower, probe.upper)
            return row if inside is None else np.where(self.space.of(inside), row, 0.0)
        return self._mean_of_one_side(probe, inside)

    def _mean_of_one_side(self, probe: Probe, inside: np.ndarray | None) -> np.ndarray:
        """The same where functions jump: each place is read in one of the cells that it is in, if need be of those that
        matter."""
        space, mean, whole, taken = self.space, np.zeros(self.space.size), 0.0, np.empty((0, 3))
        for part in (inside, None) if inside is not None else (None,):
            for cells, corner, sides in self.patches(probe, part):
                extended = sides.sum(axis=0)
                # The interval and a half, the breakpoint, or where between two: what cells beside one another share.
                places = np.round(space.ijk[:, cells].T + corner + extended / 2, 6)
                _, first = np.unique(np.concatenate([taken, places]), axis=0, return_index=True)
                new_cells, taken = cells[first[first >= len(taken)] - len(taken)], np.concatenate([taken, places])
                points, weights = product_rule(space.p + 1, len(sides))
                size = np.where(extended[:, None] > 0, space.h[:, new_cells], 1.0).prod(axis=0)
                whole += float(size.sum())
                if part is inside:
                    row = weights @ space.at((corner + points @ sides).T)
                    np.add.at(mean, space.dofs[:, new_cells], row[:, None] * size)
        return mean / whole

    def patches(self, probe: Probe, inside: np.ndarray | None = None) -> list[Patch]:
        """The parts of the cells that a box of any dimension lies in."""
        space, grid = self.space, self.space.grid
        chosen = np.ones(space.ijk.shape[1], bool) if inside is None else inside.copy()
        if probe.boxes:
            chosen &= self.parts(probe.boxes)
        corner, sides = np.zeros((3, space.ijk.shape[1])), np.ones(3)
        for d in range(3):
            i, j = grid.span(d, probe.lower[d], probe.upper[d])
            interval = space.ijk[d]
            if i < j:
                chosen &= (interval >= i) & (interval < j)
                continue
            at = (probe.lower[d] - grid.breaks[d][interval]) / space.h[d]
            chosen &= (at > -1e-9) & (at < 1 + 1e-9)
            corner[d], sides[d] = np.clip(at, 0.0, 1.0), 0.0
        cells = np.flatnonzero(chosen)
        kinds, kind = np.unique(corner[:, cells], axis=1, return_inverse=True)
        extended = np.eye(3)[sides > 0]
        return [(cells[kind.ravel() == k], kinds[:, k], extended) for k in range(kinds.shape[1])]

    def across(self, probe: Probe) -> int:
        """The axis across a flat box."""
        return self.space.grid.flat(probe.lower, probe.upper)

    def is_flat(self, probe: Probe) -> bool:
        """Whether a probe is a flat box."""
        return sum(a == b for a, b in zip(probe.lower, probe.upper, strict=True)) == 1


def heated(scene: Scene, owner: np.ndarray) -> tuple[tuple[Value, np.ndarray], ...]:
    """The heat sources (W/m3) of boxes with their cells, for the numbers of the boxes that own each (cells,)."""
    return tuple((b.heat_source, np.flatnonzero(owner == n)) for n, b in enumerate(scene.boxes) if b.heat_source)


def boxes(scene: Scene, grid: Grid) -> Boxes:
    """The domain of a scene of boxes (or of its symmetric part) on a grid."""
    space = BrickSpace(grid)
    owner, at = grid.owner, tuple(space.ijk)
    coarse = connected.coarsest(scene)

    def cells(flags: np.ndarray) -> np.ndarray:
        return grid.refined(coarse, flags)[at]

    domain = Boxes(
        scene, space, owner[at], tuple(b.name for b in scene.boxes), tuple(b.material for b in scene.boxes),
        heated(scene, owner[at]),
        cells(connected.live(scene)), tuple((cells(part), value) for part, value in connected.still(scene)),
        connected.anchored(scene),
    )  # fmt: skip
    return with_contacts(domain)


def with_contacts(domain: D) -> D:
    """A domain whose temperature and potential jump at the contacts of its scene, and whose voltages behind a contact
    are those of functions beyond their faces."""
    scene, space = domain.scene, domain.space
    behind = [b for b in scene.boundaries if b.kind == "voltage" and b.contact_resistance]
    contacts = [c for c in scene.contacts if not c.perfect]
    if not contacts and not behind:
        return domain
    f2t, live = space.mesh.f2t, domain.live
    every = [Joint(c, connected.between(f2t, *map(domain.part, c.between))) for c in contacts]
    joints = [joint for joint in every if len(joint.facets)]
    alive = connected.between(f2t, live, live)
    thermal = _every(j.facets for j in joints if j.contact.thermal_resistance)
    electric = np.intersect1d(_every(j.facets for j in joints if j.contact.electrical_resistance), alive)
    beyond = {b.name: domain.seen(domain.on(b), domain.live) for b in behind if len(domain.on(b))}
    potentials = None
    if beyond or not np.array_equal(thermal, electric):
        potentials = split(space, electric, beyond)
    return replace(domain, space=split(space, thermal), potentials=potentials, contacts=tuple(joints))


def _every(facets: Iterable[np.ndarray]) -> np.ndarray:
    return np.unique(np.concatenate([np.empty(0, int), *facets]))
