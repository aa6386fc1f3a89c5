"""A scene laid on the cells of a mesh: the cells and facets of its materials, sources, conditions and probes.

The problems are assembled from a `Domain`. `Domain.locate` returns the cells, facets, edges or the point of a
condition or a probe: for boxes by coordinates (`BoxDomain`), for mesh files by groups (`GroupDomain`).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, ClassVar, NamedTuple, TypeVar

import numpy as np
from skfem import Mesh

from fem3d.spaces.bricks import BrickSpace
from fem3d.spaces.element import cube_rule
from fem3d.spaces.integrals import FaceIntegrals, Space
from fem3d.spaces.mapped import MappedSpace, split
from meshes import grid as grids
from meshes.grid import Grid
from meshes.grouped.check import Placed
from meshes.grouped.model import locate
from scenes import laws, model
from scenes.free.graph import between
from statespace.channels import Inputs

D = TypeVar("D", bound="Domain")


class Patch(NamedTuple):
    """Parts of cells that are alike: the whole of each of n cells, or a side, an edge or a point of it.

    Attributes
    ----------
    cells : (n,) array
    corner, sides : (3,) and (k, 3) arrays, in the coordinates of the reference cell; k is the dimension
    """

    cells: np.ndarray
    corner: np.ndarray
    sides: np.ndarray


class Region(NamedTuple):
    """The place of a condition or a probe.

    Attributes
    ----------
    dimension : 3 for a volume, 2 for a surface, 1 for a line, 0 for a point
    numbers : (n,) array, its cells, facets or edges
    signs : (n,) array, for a surface: 1 where positive flows leave a facet's first cell, else -1
    point : coordinates of a point (m)
    parts : names of the parts that restrict a probe, if any
    """

    dimension: int
    numbers: np.ndarray
    signs: np.ndarray = np.empty(0, int)
    point: model.Point | None = None
    parts: tuple[str, ...] = ()


@dataclass(frozen=True)
class Joint:
    """A contact that isn't perfect, and its facets."""

    contact: model.Contact
    facets: np.ndarray


@dataclass(frozen=True, eq=False)
class Domain(ABC):
    """Cells and conditions of a scene of any kind.

    Attributes
    ----------
    space, potentials : of the temperature, and of the potential: None where both have one space
    body : (cells,), the number of each cell's body in ``names`` and ``materials``
    sources : heat sources (W/m3), each with its cells
    live : (cells,), whether current flows there
    still : cells of conductors without current, each with its voltage or the name of the electrode at its potential
    anchored : whether every part has an exit for heat
    contacts : facets at which the temperature or the potential may jump
    """

    scene: model.AnyScene
    space: Space
    body: np.ndarray
    names: tuple[str, ...]
    materials: tuple[model.Material, ...]
    sources: tuple[tuple[model.Value, np.ndarray], ...]
    live: np.ndarray
    still: tuple[tuple[np.ndarray, model.Value | str], ...]
    anchored: bool
    potentials: Space | None = field(default=None, kw_only=True)
    contacts: tuple[Joint, ...] = field(default=(), kw_only=True)
    _faces: dict[str, FaceIntegrals] = field(init=False, default_factory=dict)
    """By name the facets of conditions, for `faces`."""

    conditions_first: ClassVar[bool] = False
    """Whether a flow is read off the conditions on a probe wherever there are any, inside the solid too."""

    @property
    def electric(self: D) -> D:
        """The same domain with the space of the potentials, for voltages and currents."""
        return self._electric or self

    @cached_property
    def _electric(self: D) -> D | None:
        return None if self.potentials is None else replace(self, space=self.potentials, potentials=None)

    def per_cell(self, key: str) -> np.ndarray:
        """(cells,), or (3, cells) with an anisotropic material: a property at the initial temperature."""
        given = [getattr(m.at(self.scene.initial_temperature), key) for m in self.materials]
        if any(isinstance(each, tuple) for each in given):
            return np.array([laws.along(each) for each in given], float).T[:, self.body]
        return np.array(given, float)[self.body]

    @cached_property
    def probes(self) -> dict[str, model.AnyProbe]:
        """The scene's, by name."""
        return {p.name: p for p in self.scene.probes}

    @cached_property
    def inputs(self) -> Inputs:
        """The channels of all values that vary in time."""
        values = [v for b in self.scene.boundaries for v in (b.value, b.ambient)] + [v for v, _ in self.sources]
        return Inputs(tuple(dict.fromkeys(v for v in values if isinstance(v, model.Schedule))))

    def exposed(self, facets: np.ndarray) -> np.ndarray:
        """(facets,): which are on the surface."""
        return self.space.mesh.f2t[1, facets] < 0

    def seen(self, facets: np.ndarray, inside: np.ndarray | None = None, more: int = 0) -> FaceIntegrals:
        """Integrals over the facets that touch a cell (of the mask ``inside`` (cells,)), each seen from one cell, by a
        quadrature with ``more`` points along each axis."""
        cells = self.space.mesh.f2t[:, facets]
        fine = cells >= 0 if inside is None else (cells >= 0) & inside[cells]
        side = fine.argmax(axis=0)
        kept = fine.any(axis=0)
        return FaceIntegrals(self.space, facets[kept], cells[side, np.arange(len(facets))][kept], more)

    def facets(self, boundary: model.AnyBoundary) -> np.ndarray:
        """(facets on which a condition acts,): their numbers."""
        return self.faces(boundary).facets

    def faces(self, boundary: model.AnyBoundary) -> FaceIntegrals:
        """Integrals over the facets on which a condition acts: a voltage where current flows, a flux on exposed facets;
        of a voltage behind a contact, by the functions beyond it."""
        if boundary.name not in self._faces:
            facets, inside = self.locate(boundary).numbers, self.live if boundary.kind == "voltage" else None
            facets = facets if boundary.kind in ("temperature", "voltage") else facets[self.exposed(facets)]
            self._faces[boundary.name] = self.seen(facets, inside)
        face, space = self._faces[boundary.name], self.space
        if boundary.name not in space.beyond:
            return face
        functions, partners = space.beyond[boundary.name]
        numbers = np.arange(space.size)
        numbers[functions] = partners
        return FaceIntegrals(space, face.facets, face.cells, dofs=numbers[space.dofs[:, face.cells]])

    @abstractmethod
    def locate(self, item: Any) -> Region:
        """Return the place of a condition or a probe."""

    def part(self, name: str) -> np.ndarray:
        """(cells,): which are of a part that a contact or a probe names; none if symmetry has cut it off."""
        return np.array([each == name for each in self.names])[self.body]

    def parts(self, names: Iterable[str]) -> np.ndarray:
        """(cells,): whether each cell is in a part with one of these names."""
        return np.any([np.zeros(len(self.body), bool), *map(self.part, names)], axis=0)

    def mean(self, probe: model.AnyProbe, inside: np.ndarray | None = None) -> np.ndarray:
        """(functions,): the contribution of each to the mean over a probe; of ``inside`` (cells,) alone where given."""
        region, space = self.locate(probe), self.space
        beside = self._beside(region, inside)
        if region.dimension == 3:
            cells = region.numbers[beside[region.numbers]]
            return space.on(cells).load(np.ones((len(cells), 1))) / space.on(region.numbers).weights.sum()
        if region.dimension == 2:
            return self.seen(region.numbers, beside).load() / self.seen(region.numbers).areas.sum()
        row, lengths = np.zeros(space.size), 0.0
        for cells, corner, sides in self.patches(probe, inside):
            ends = space.mesh.mapping().F(np.stack([corner, corner + sides.sum(axis=0)], axis=1), tind=cells)
            length = np.linalg.norm(ends[..., 1] - ends[..., 0], axis=0) if len(sides) else np.ones(1)
            for x, w in zip(*cube_rule(*len(sides) * [space.p // 2 + 1]), strict=True):
                values = space.at((corner + x @ sides)[:, None])[0]
                np.add.at(row, space.dofs[:, cells], values[:, None] * (w * length))
            lengths += float(length.sum())
        return row / max(lengths, 1e-300)

    def patches(self, probe: model.AnyProbe, inside: np.ndarray | None = None) -> list[Patch]:
        """Return the parts of cells that a probe lies in."""
        region, mesh = self.locate(probe), self.space.mesh
        beside = self._beside(region, inside)
        if region.dimension == 3:
            cells = region.numbers[beside[region.numbers]]
            return [Patch(cells, np.zeros(3), np.eye(3))]
        if region.dimension == 0:
            place = locate(mesh, np.array(region.point), beside)
            return [] if place is None else [Patch(np.array([place[0]]), place[1], np.zeros((0, 3)))]
        flat = region.dimension == 2
        parts, corners = (mesh.t2f, mesh.refdom.facets) if flat else (mesh.t2e, mesh.refdom.edges)
        wanted = np.zeros(parts.max() + 1, bool)
        wanted[region.numbers] = True
        numbers, cells = np.nonzero(wanted[parts] & beside)
        _, first = np.unique(parts[numbers, cells], return_index=True)
        numbers, cells = numbers[first], cells[first]
        patches = []
        for number in np.unique(numbers):
            a, *others = mesh.refdom.p[:, list(corners[number])].T
            sides = np.stack([others[0] - a, others[-1] - a] if flat else [others[0] - a])
            patches.append(Patch(cells[numbers == number], a, sides))
        return patches

    def _beside(self, region: Region, inside: np.ndarray | None) -> np.ndarray:
        """(cells,): the mask ``inside``, by default of all cells, restricted to the parts of a region if any."""
        every = np.ones(len(self.body), bool) if inside is None else inside
        return every & self.parts(region.parts) if region.parts else every


@dataclass(frozen=True, eq=False)
class BoxDomain(Domain):
    """A scene of boxes on bricks or tetrahedra; no plane of the scene cuts a cell."""

    scene: model.Scene

    def locate(self, item: model.Boundary | model.Probe) -> Region:
        mesh, names, graph = self.space.mesh, getattr(item, "boxes", ()), grids.graph(self.scene)
        flat, off = graph.flat(item.lower, item.upper), np.array(graph.small)
        dimension = 3 - len(flat)
        if dimension == 0:
            return Region(0, np.empty(0, int), point=item.lower, parts=names)
        corners = mesh.t if dimension == 3 else mesh.facets if dimension == 2 else mesh.edges
        low, high = (
            [p[np.abs(p - c).argmin()] for p, c in zip(graph.planes, end, strict=True)]
            for end in (item.lower, item.upper)
        )
        if isinstance(self.space, BrickSpace):
            # Graded intervals beside a plane may be shorter than a rounding error of the scene.
            off = np.minimum(off, [0.1 * np.diff(b).min() for b in self.space.grid.breaks])
        within = ((np.subtract(low, off) <= mesh.p.T) & (np.add(high, off) >= mesh.p.T)).all(axis=1)
        numbers, signs = np.flatnonzero(within[corners].all(axis=0)), np.empty(0, int)
        if dimension == 3 and names:
            numbers = numbers[self.parts(names)[numbers]]
        if dimension == 2:
            d = flat[0]
            first = mesh.p[d][mesh.t[:, mesh.f2t[0, numbers]]].mean(axis=0)
            signs = np.where(mesh.p[d][mesh.facets[:, numbers]].mean(axis=0) > first, 1, -1)
        return Region(dimension, numbers, signs, parts=names)


@dataclass(frozen=True, eq=False)
class GroupDomain(Domain):
    """A scene on the cells of a mesh file with groups."""

    space: MappedSpace
    placed: Placed

    conditions_first = True

    def part(self, name: str) -> np.ndarray:
        """(cells,): whether each cell is in a volume group."""
        return self.placed.part(name)

    def locate(self, item: model.GroupBoundary | model.GroupProbe) -> Region:
        name, mesh, parts = item.group or "", self.placed.mesh, tuple[str, ...]()
        if isinstance(item, model.GroupProbe):
            parts = (item.side,) if item.side else ()
            if item.at is not None:
                return Region(0, np.empty(0, int), point=item.at, parts=parts)
            if item.groups:
                return Region(3, np.flatnonzero(self.parts(item.groups)), parts=parts)
            # A flow passes the surface of this name; a potential is read there where not all cells conduct.
            cells = None if item.quantity in model.FLOWS else mesh.volumes.get(name)
            if cells is not None and (item.quantity != "potential" or self.placed.conducting[cells].all()):
                return Region(3, cells, parts=parts)
        return Region(2, mesh.surfaces[name][0], 1 - 2 * mesh.surfaces[name][1], parts=parts)


def box_domain(scene: model.Scene, cells: Grid | Mesh, degree: int = 3) -> BoxDomain:
    """Return the domain of a scene of boxes (or of its symmetric part) on a grid of bricks, or with elements of a
    degree on scikit-fem's mesh of `meshes.columns`."""
    space = BrickSpace(cells) if isinstance(cells, Grid) else MappedSpace(cells, degree)
    graph, middles = grids.graph(scene), space.mesh.p[:, space.mesh.t].mean(axis=1)
    places = tuple(
        np.clip(np.searchsorted(p, x, side="right") - 1, 0, len(p) - 2)
        for p, x in zip(graph.planes, middles, strict=True)
    )
    at = np.ravel_multi_index(places, graph.owner.shape)
    owner = graph.owner.ravel()[at]
    sources = tuple((b.heat_source, np.flatnonzero(owner == n)) for n, b in enumerate(scene.boxes) if b.heat_source)
    return with_contacts(BoxDomain(
        scene, space, owner, tuple(b.name for b in scene.boxes), tuple(b.material for b in scene.boxes), sources,
        graph.live[at], tuple((cells[at], value) for cells, value in graph.still), graph.anchored,
    ))  # fmt: skip


def group_domain(placed: Placed, degree: int = 3) -> GroupDomain:
    """Return the domain of a scene on its mesh, with tetrahedra of a degree."""
    scene, mesh = placed.scene, placed.mesh
    return with_contacts(GroupDomain(
        scene, MappedSpace(mesh.mesh, degree), placed.body, tuple(m.name for m in placed.materials),
        tuple(placed.materials), tuple((s.heat_source, mesh.volumes[s.group]) for s in scene.sources),
        placed.live, placed.still, placed.anchored, placed,
    ))  # fmt: skip


def with_contacts(domain: D) -> D:
    """Return a domain with jumps at the contacts of its scene, and functions beyond faces with a voltage behind one."""
    scene, space = domain.scene, domain.space
    behind = [b for b in scene.boundaries if b.kind == "voltage" and b.contact_resistance]
    contacts = [c for c in scene.contacts if not c.perfect]
    if not contacts and not behind:
        return domain
    f2t, live = space.mesh.f2t, domain.live
    every = [Joint(c, between(f2t, *map(domain.part, c.between))) for c in contacts]
    joints = [joint for joint in every if len(joint.facets)]
    alive = between(f2t, live, live)
    thermal = _every(j.facets for j in joints if j.contact.thermal_resistance)
    electric = np.intersect1d(_every(j.facets for j in joints if j.contact.electrical_resistance), alive)
    beyond = {b.name: domain.seen(domain.facets(b), domain.live) for b in behind if len(domain.facets(b))}
    apart = beyond or not np.array_equal(thermal, electric)
    potentials = split(space, electric, beyond) if apart else None
    return replace(domain, space=split(space, thermal), potentials=potentials, contacts=tuple(joints))


def _every(facets: Iterable[np.ndarray]) -> np.ndarray:
    return np.unique(np.concatenate([np.empty(0, int), *facets]))
