"""Fields on the file's own cells, for files, and on linear hexahedra, for pictures."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from fem3d.hex27 import State
from fem3d.steady import SteadyState
from fem3d.transient import Transient
from fem3d.unstructured.level import Level
from fem3d.unstructured.own_cells import OwnCells
from meshes.grouped import shapes

_IN_TETRA = (
    (0, 4, 10, 6, 7, 11, 14, 13),
    (1, 5, 10, 4, 8, 12, 14, 11),
    (2, 6, 10, 5, 9, 13, 14, 12),
    (3, 7, 11, 8, 9, 13, 14, 12),
)
"""A tetrahedron as four hexahedra of its corners, the middles of its edges and faces, and its own."""


class MeshFields:
    """For pictures ``points`` (n, 3) in m and ``hexes`` (m, 8), where ``steady`` and ``at`` are temperatures (K); for
    files ``quadratic``."""

    def __init__(self, level: Level, state: SteadyState | None, transient: Transient | None) -> None:
        self._level, self._state, self._transient = level, state, transient

    @property
    def material_names(self) -> list[str]:
        """Names of the materials, in the order of ``material``."""
        return [m.name for m in self._level.given.materials]

    @property
    def has_steady(self) -> bool:
        """Whether the run has a steady state."""
        return self._state is not None

    def quadratic(self, times: np.ndarray, accuracy: float) -> OwnCells:
        """The file's own cells, whatever the ``accuracy``, with the steady state, if there is one, and some times (s),
        in this order; ValueError for times where the run has no transient."""
        inputs = self._level.heat.inputs
        states = [] if self._state is None else [State(self._state.rise, inputs.at(np.zeros(1))[0])]
        if len(times):
            states += [State(*pair) for pair in zip(self._rises(times), inputs.at(times), strict=True)]
        return OwnCells(self._level, states)

    @property
    def _initial(self) -> float:
        return self._level.given.scene.initial_temperature

    @property
    def _steady_rise(self) -> np.ndarray:
        if self._state is None:
            raise ValueError("the run has no steady state")
        return self._state.rise

    def _rises(self, times: np.ndarray) -> np.ndarray:
        if self._transient is None:
            raise ValueError("the run has no transient")
        return self._transient.rises(np.asarray(times, float))

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
        return self._initial + self._sampled(self._rises(times))

    @property
    def material(self) -> np.ndarray:
        """(m,): the material of each hexahedron."""
        own = self._level.heat.placed.body
        return np.repeat(own, len(self.hexes) // len(own))

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
