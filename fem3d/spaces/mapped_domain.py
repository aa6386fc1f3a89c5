"""What a probe reads on mapped cells: means over them, their sides, their edges, or a point in one."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import Any

import numpy as np

from fem3d.spaces.domain import Domain, Patch
from fem3d.spaces.mapped import MappedSpace
from meshes.grouped.model import GroupedMesh, locate
from scenes.model import Point


@dataclass(frozen=True, eq=False)
class MappedDomain(Domain):
    """A scene on the cells of one of scikit-fem's meshes."""

    space: MappedSpace

    @abstractmethod
    def point(self, probe: Any) -> Point | None:
        """Where a probe is that is a point (m); None for any other."""

    @abstractmethod
    def cells(self, probe: Any) -> np.ndarray | None:
        """The cells of a probe that is a volume; None for any other."""

    def edges(self, probe: Any) -> np.ndarray | None:
        """The edges of a probe that is a line; None for any other."""
        return None

    @abstractmethod
    def read_in(self, probe: Any) -> tuple[str, ...]:
        """The parts in which a probe reads, where it names some."""

    @property
    def grouped(self) -> GroupedMesh:
        """The mesh, as points are looked for in it."""
        return GroupedMesh(self.space.mesh, {}, {})

    def mean(self, probe: Any, inside: np.ndarray | None = None) -> np.ndarray:
        """(functions,): what a function adds to the mean over a probe, or to the value at a point."""
        space, row, inside = self.space, np.zeros(self.space.size), self._beside(probe, inside)
        if self.point(probe) is not None or self.edges(probe) is not None:
            points, weights = np.polynomial.legendre.leggauss(3) if self.point(probe) is None else ([0.0], [2.0])
            lengths = []
            for cells, corner, sides in self.patches(probe, inside):
                along = sides.sum(axis=0)
                ends = space.mesh.mapping().F(np.stack([corner, corner + along], axis=1), tind=cells)
                length = np.linalg.norm(ends[..., 1] - ends[..., 0], axis=0) if len(sides) else np.ones(len(cells))
                lengths.append(length.sum())
                for x, w in zip(points, weights, strict=True):
                    values = space.at((corner + (1 + x) / 2 * along)[:, None])[0]
                    np.add.at(row, space.dofs[:, cells], values[:, None] * (w / 2 * length))
            return row / sum(lengths) if lengths else row
        volume_cells = self.cells(probe)
        if volume_cells is None:
            facets = self.facets(probe)
            return self.seen(facets, inside).load() / self.seen(facets).areas.sum()
        chosen = volume_cells if inside is None else volume_cells[inside[volume_cells]]
        return space.on(chosen).load(np.ones((len(chosen), 1))) / space.on(volume_cells).weights.sum()

    def patches(self, probe: Any, inside: np.ndarray | None = None) -> list[Patch]:
        """The cells of a probe, or their sides, their edges, or the point in one."""
        mesh, at, inside = self.space.mesh, self.point(probe), self._beside(probe, inside)
        if at is not None:
            place = locate(self.grouped, np.array(at), inside)
            return [] if place is None else [(np.array([place[0]]), place[1], np.zeros((0, 3)))]
        volume_cells = self.cells(probe)
        if volume_cells is not None:
            return [(volume_cells if inside is None else volume_cells[inside[volume_cells]], np.zeros(3), np.eye(3))]
        along = self.edges(probe)
        parts, corners = (mesh.t2f, mesh.refdom.facets) if along is None else (mesh.t2e, mesh.refdom.edges)
        wanted = self.facets(probe) if along is None else along
        numbers, cells = np.nonzero(np.isin(parts, wanted) & (True if inside is None else inside))
        # Each seen from one of its cells.
        _, first = np.unique(parts[numbers, cells], return_index=True)
        numbers, cells = numbers[first], cells[first]
        patches = []
        for number in np.unique(numbers):
            a, *others = mesh.refdom.p[:, list(corners[number])].T
            sides = np.stack([others[0] - a] if along is not None else [others[0] - a, others[-1] - a])
            patches.append((cells[numbers == number], a, sides))
        return patches

    def _beside(self, probe: Any, inside: np.ndarray | None) -> np.ndarray | None:
        """(cells,): those ``inside`` that are on the side of a probe, where it says one."""
        if not (sides := self.read_in(probe)):
            return inside
        return self.parts(sides) if inside is None else inside & self.parts(sides)

    def is_flat(self, probe: Any) -> bool:
        """Whether a probe is a surface."""
        return self.point(probe) is None and self.cells(probe) is None and self.edges(probe) is None
