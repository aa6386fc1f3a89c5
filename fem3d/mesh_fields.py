"""Fields on the cells and points of a mesh file, for files, and on linear hexahedra, for pictures."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np

from fem3d.assembly import HeatProblem
from fem3d.steady import SteadyState
from meshes.grouped.place import Placed
from meshes.grouped.read import own_order

_CORNERS = (
    (0, 0, 0),
    (1, 0, 0),
    (1, 1, 0),
    (0, 1, 0),
    (0, 0, 1),
    (1, 0, 1),
    (1, 1, 1),
    (0, 1, 1),
)  # of VTK's hexahedron
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
        self, placed: Placed, heat: HeatProblem, state: SteadyState | None,
        rises: Callable[[np.ndarray], np.ndarray] | None,
    ) -> None:  # fmt: skip
        self._placed, self._heat, self._state, self._rises = placed, heat, state, rises
        mesh = placed.mesh
        self.cell_type, self.own_points, self.cells = mesh.file_type, mesh.points, mesh.cells

    @property
    def material_names(self) -> list[str]:
        """Names of the materials, in the order of ``material``."""
        return [m.name for m in self._placed.materials]

    @property
    def material(self) -> np.ndarray:
        """(m,): the material of each cell."""
        return self._placed.body

    def own_values(self, functions: np.ndarray) -> np.ndarray:
        """(..., n): fields (..., functions) at the file's points."""
        space, mesh = self._heat.domain.space, self._placed.mesh
        order = own_order(self.cell_type)
        found = np.empty((*functions.shape[:-1], len(self.own_points)))
        if space.mesh.t.shape[1] > mesh.count:
            # The nodes of a cell of second order are corners of those that it is refined to, in scikit-fem's order.
            from fem3d.mapped import MappedSpace

            nodes = MappedSpace(mesh.mesh).dofs[order]
            found[..., self.cells.T.ravel()] = functions[..., nodes.ravel()]
            return found
        at = space.at(np.asarray(space.element.doflocs).T)[order]  # type: ignore[attr-defined]
        found[..., self.cells.T.ravel()] = (at @ functions[..., space.dofs]).reshape(*functions.shape[:-1], -1)
        return found

    def own_steady(self) -> dict[str, np.ndarray]:
        """At the file's points: temperature (K) and, where there is one, potential (V)."""
        found = {"temperature": self._initial + self.own_values(self._steady_rise)}
        if self._state is not None and self._state.conductor is not None:
            found["potential"] = self.own_values(self._state.hot_potential)
        return found

    def own_at(self, times: np.ndarray) -> np.ndarray:
        """(times, n): temperatures (K) at the file's points; ValueError where the run has no transient."""
        return self._initial + self.own_values(self._rises_at(times))

    @property
    def _initial(self) -> float:
        return self._placed.scene.initial_temperature

    @property
    def _steady_rise(self) -> np.ndarray:
        if self._state is None:
            raise ValueError("the run has no steady state")
        return self._heat.field(self._state.rise)

    def _rises_at(self, times: np.ndarray) -> np.ndarray:
        if self._rises is None:
            raise ValueError("the run has no transient")
        return self._heat.field(self._rises(np.asarray(times, float)))

    @cached_property
    def _drawn(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Functions at the places (places, functions of a cell) of a cell that are drawn, points and hexahedra."""
        space = self._heat.domain.space
        places, parts = _pieces(space.mesh.refdom)
        points = np.moveaxis(space.mesh.mapping().F(places), 0, -1)
        count = space.mesh.t.shape[1]
        # Some cells are mirror images of the reference one.
        inverted = space.mesh.mapping().detDF(places.mean(axis=1, keepdims=True))[:, :1, None] < 0
        hexes = places.shape[1] * np.arange(count)[:, None, None] + np.where(inverted, np.roll(parts, 4, axis=1), parts)
        return space.at(places), points.reshape(-1, 3), hexes.reshape(-1, 8)

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
        return self._initial + self._sampled(self._steady_rise)

    def at(self, times: np.ndarray) -> np.ndarray:
        """(times, n) in K; ValueError where the run has no transient."""
        return self._initial + self._sampled(self._rises_at(times))

    def _sampled(self, functions: np.ndarray) -> np.ndarray:
        own = functions[..., self._heat.domain.space.dofs]
        found: np.ndarray = np.swapaxes(self._drawn[0] @ own, -1, -2)
        return found.reshape(*functions.shape[:-1], -1)


def _pieces(reference: Any) -> tuple[np.ndarray, np.ndarray]:
    """Places (3, places) in a cell and the hexahedra (pieces, 8) between them."""
    corners, cube = reference.p.T, np.array(_CORNERS)
    if len(corners) == 8:
        own = np.stack(np.meshgrid(*3 * [np.arange(3) / 2], indexing="ij"), axis=-1).reshape(-1, 3)
        return own.T, (cube[:, None] + cube) @ (9, 3, 1)
    middles = [corners[list(e)].mean(axis=0) for e in reference.edges]
    faces = [corners[list(f)].mean(axis=0) for f in ((0, 1, 2), (0, 1, 3), (1, 2, 3), (0, 2, 3))]
    own = np.array([*corners, *middles, *faces, corners.mean(axis=0)])
    parts = np.array(_IN_TETRA)
    sides = own[parts[:, [1, 3, 4]]] - own[parts[:, :1]]
    inside_out = np.linalg.det(sides) < 0
    parts[inside_out] = np.roll(parts[inside_out], 4, axis=1)
    return own.T, parts
