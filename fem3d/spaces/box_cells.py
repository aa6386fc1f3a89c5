"""A scene of boxes on tetrahedra as a domain: which cells, facets and edges its boxes, conditions and probes are."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from fem3d.spaces.domain import heated, with_contacts
from fem3d.spaces.mapped import MappedSpace
from fem3d.spaces.mapped_domain import MappedDomain
from meshes import connected
from scenes.model import Boundary, Point, Probe, Scene


@dataclass(frozen=True, eq=False)
class BoxCells(MappedDomain):
    """A scene of boxes on tetrahedra that no plane of any of its parts cuts there."""

    scene: Scene

    @property
    def stands_for(self) -> np.ndarray:
        """(bodies,): what the boxes say."""
        return np.array([b.stands_for for b in self.scene.boxes])

    @cached_property
    def _small(self) -> np.ndarray:
        grid = connected.coarsest(self.scene)
        return np.array([grid.small(d) for d in range(3)])

    def _within(self, item: Boundary | Probe, corners: np.ndarray) -> np.ndarray:
        """(n,): which of some parts of cells, by the vertices of each (vertices, n), lie in the box of an item."""
        low, high = (np.array(c)[:, None, None] for c in (item.lower, item.upper))
        small, at = self._small[:, None, None], self.space.mesh.p[:, corners]
        inside: np.ndarray = ((at >= low - small) & (at <= high + small)).all(axis=(0, 1))
        return inside

    def _extends(self, item: Boundary | Probe) -> int:
        """Along how many axes."""
        return int((np.subtract(item.upper, item.lower) > self._small).sum())

    def facets(self, item: Boundary | Probe) -> np.ndarray:
        """The facets on a flat box."""
        return np.flatnonzero(self._within(item, self.space.mesh.facets))

    def directions(self, item: Boundary | Probe) -> np.ndarray:
        """(facets,): 1 where the first cell is the lower one along the axis."""
        mesh, facets = self.space.mesh, self.facets(item)
        d = int(np.argmin(np.subtract(item.upper, item.lower)))
        away = mesh.p[d][mesh.facets[:, facets]].mean(axis=0) - mesh.p[d][mesh.t[:, mesh.f2t[0, facets]]].mean(axis=0)
        return np.where(away > 0, 1, -1)

    def read_in(self, probe: Probe) -> tuple[str, ...]:
        """The boxes that it names."""
        return probe.boxes

    def point(self, probe: Probe) -> Point | None:
        """Where both corners are the same."""
        return probe.lower if self._extends(probe) == 0 else None

    def edges(self, probe: Probe) -> np.ndarray | None:
        """Those on a line between two corners."""
        return np.flatnonzero(self._within(probe, self.space.mesh.edges)) if self._extends(probe) == 1 else None

    def cells(self, probe: Probe) -> np.ndarray | None:
        """Those in a box."""
        if self._extends(probe) < 3:
            return None
        inside = self._within(probe, self.space.mesh.t)
        return np.flatnonzero(inside & self.parts(probe.boxes) if probe.boxes else inside)


def box_cells(scene: Scene, mesh: Any, degree: int = 3) -> BoxCells:
    """Return the domain of a scene of boxes on scikit-fem's mesh of `meshes.columns`, or of halves of its cells."""
    grid = connected.coarsest(scene)
    middles = mesh.p[:, mesh.t].mean(axis=1)
    at = tuple(
        np.clip(np.searchsorted(b, x, side="right") - 1, 0, len(b) - 2)
        for b, x in zip(grid.breaks, middles, strict=True)
    )
    owner = grid.owner[at]
    space = MappedSpace(mesh, degree)
    return with_contacts(BoxCells(
        scene, space, owner, tuple(b.name for b in scene.boxes), tuple(b.material for b in scene.boxes),
        heated(scene, owner), connected.live(scene)[at],
        tuple((cells[at], value) for cells, value in connected.still(scene)), connected.anchored(scene),
    ))  # fmt: skip
