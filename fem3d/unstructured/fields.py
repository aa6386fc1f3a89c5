"""Fields on the file's own cells, for files, and on linear hexahedra, for pictures."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

import numpy as np

from fem3d.steady import SteadyState
from fem3d.unstructured.level import Level
from meshes.grouped import shapes

_OWN = {"tetra": 4, "tetra10": 10, "hexahedron": 8, "hexahedron20": 20, "hexahedron27": 27}
_IN_TETRA = (
    (0, 4, 10, 6, 7, 11, 14, 13),
    (1, 5, 10, 4, 8, 12, 14, 11),
    (2, 6, 10, 5, 9, 13, 14, 12),
    (3, 7, 11, 8, 9, 13, 14, 12),
)
"""A tetrahedron as four hexahedra of its corners, the middles of its edges and faces, and its own."""


class MeshFields:
    """``cells`` (m, nodes) of meshio's type ``cell_type`` on ``own_points`` (n, 3) in m, as in the file; for pictures
    ``points`` and ``hexes`` (m, 8), where ``steady`` and ``at`` are temperatures (K)."""

    def __init__(
        self, level: Level, state: SteadyState | None, rises: Callable[[np.ndarray], np.ndarray] | None
    ) -> None:
        self._level, self._state, self._rises = level, state, rises
        mesh = level.given.mesh
        self.cell_type = mesh.file_type
        own = mesh.cells[:, : _OWN[self.cell_type]]
        used, local = np.unique(own, return_inverse=True)
        self.own_points, self.cells = mesh.points[used], np.asarray(local.reshape(own.shape), int)

    @property
    def material_names(self) -> list[str]:
        """Names of the materials, in the order of ``material``."""
        return [m.name for m in self._level.given.materials]

    @property
    def material(self) -> np.ndarray:
        """(m,): the material of each cell."""
        return self._level.given.body

    def own_values(self, field: np.ndarray) -> np.ndarray:
        """(..., n): a field at the nodes of the solution as one at the file's points."""
        mesh = self._level.given.mesh
        unknown = self._level.at_file_nodes(mesh.order)[:, : _OWN[self.cell_type]]
        found = np.empty((*field.shape[:-1], len(self.own_points)))
        found[..., self.cells.ravel()] = field[..., unknown.ravel()]
        return found

    def own_steady(self) -> dict[str, np.ndarray]:
        """At the file's points: temperature (K) and, where there is one, potential (V)."""
        found = {"temperature": self._initial + self.own_values(self._steady_rise)}
        if self._state is not None and self._state.conductor is not None:
            found["potential"] = self.own_values(self._state.hot_potential)
        return found

    def own_at(self, times: np.ndarray) -> np.ndarray:
        """(times, n): temperatures (K) at the file's points; ValueError where the run has no transient."""
        if self._rises is None:
            raise ValueError("the run has no transient")
        return self._initial + self.own_values(self._rises(times))

    @property
    def _initial(self) -> float:
        return self._level.given.scene.initial_temperature

    @property
    def _steady_rise(self) -> np.ndarray:
        if self._state is None:
            raise ValueError("the run has no steady state")
        return self._state.rise

    @cached_property
    def _drawn(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Shape functions at the places (places, nodes) of a cell that are drawn, points and hexahedra."""
        space = self._level.heat.space
        places, parts = _pieces(space.kind)
        mesh = space.mesh
        points = shapes.values(space.kind, mesh.order, places) @ mesh.points[mesh.cells]
        hexes = len(places) * np.arange(len(mesh.cells))[:, None, None] + parts
        return shapes.values(space.kind, space.degree, places), points.reshape(-1, 3), hexes.reshape(-1, 8)

    @property
    def points(self) -> np.ndarray:
        """(n, 3) in m, apart for each cell."""
        return self._drawn[1]

    @property
    def hexes(self) -> np.ndarray:
        """(m, 8) point numbers, in VTK's order."""
        return self._drawn[2]

    @property
    def steady(self) -> np.ndarray:
        """(n,) in K."""
        return self._initial + self._sampled(self._steady_rise[None])[0]

    def at(self, times: np.ndarray) -> np.ndarray:
        """(times, n) in K; ValueError where the run has no transient."""
        if self._rises is None:
            raise ValueError("the run has no transient")
        return self._initial + self._sampled(self._rises(np.asarray(times, float)))

    def _sampled(self, rises: np.ndarray) -> np.ndarray:
        at, space = self._drawn[0], self._level.heat.space
        found: np.ndarray = (rises[:, space.dofs] @ at.T).reshape(len(rises), -1)
        return found


def _pieces(kind: str) -> tuple[np.ndarray, np.ndarray]:
    """Places (places, 3) in a cell and the hexahedra (pieces, 8) between them."""
    if kind == shapes.HEXAHEDRON:
        own = shapes.nodes(kind, 2)
        cubes = np.array([(shapes.nodes(kind, 1) + corner) / 2 for corner in shapes.nodes(kind, 1)])
        return own, np.abs(cubes[:, :, None] - own).max(axis=-1).argmin(axis=-1)
    corners = shapes.nodes(kind, 1)
    faces = np.array([corners[list(f)].mean(axis=0) for f in ((0, 1, 2), (0, 1, 3), (1, 2, 3), (0, 2, 3))])
    own = np.concatenate([shapes.nodes(kind, 2), faces, corners.mean(axis=0)[None]])
    parts = np.array(_IN_TETRA)
    sides = own[parts[:, [1, 3, 4]]] - own[parts[:, :1]]
    inside_out = np.linalg.det(sides) < 0
    parts[inside_out] = np.roll(parts[inside_out], 4, axis=1)
    return own, parts
