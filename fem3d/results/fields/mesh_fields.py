"""Fields on the cells and points of a mesh file, for files, and on linear hexahedra, for pictures."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np

from fem3d.problems.current import Conductor
from fem3d.problems.heat import HeatProblem
from fem3d.results.fields.fields import Drawn, RunFields
from fem3d.results.fields.hexahedra import CORNERS
from fem3d.results.fields.quadratic import Snapshot
from fem3d.solution.steady import SteadyState
from fem3d.solution.transient import State, Transient
from fem3d.spaces.mapped import MappedSpace
from meshes.grouped.place import Placed
from meshes.grouped.read import own_order

_IN_TETRA = (
    (0, 4, 10, 6, 7, 11, 14, 13),
    (1, 5, 10, 4, 8, 12, 14, 11),
    (2, 6, 10, 5, 9, 13, 14, 12),
    (3, 7, 11, 8, 9, 13, 14, 12),
)
"""A tetrahedron as four hexahedra of its corners, the middles of its edges and faces, and its own."""


class MeshFields(RunFields):
    """For pictures ``points`` (n, 3) in m and ``hexes`` (m, 8), where ``steady`` and ``at`` are temperatures (K); for
    files ``quadratic``."""

    def __init__(
        self, placed: Placed, heat: HeatProblem, state: SteadyState | None, transient: Transient | None
    ) -> None:
        super().__init__(heat, state, transient)
        self._placed = placed

    def quadratic(self, times: np.ndarray, accuracy: float) -> OwnCells:
        """The file's own cells, whatever the ``accuracy``, with the steady state, if there is one, and some times (s),
        in this order; ValueError for times where the run has no transient."""
        return OwnCells(self._placed, self._heat, self._conductor, self._states(times))

    @cached_property
    def _drawn(self) -> Drawn:
        space = self._heat.domain.space
        places, parts = _pieces(space.mesh.refdom)
        points = np.moveaxis(space.mesh.mapping().F(places), 0, -1)
        count = space.mesh.t.shape[1]
        # Some cells are mirror images of the reference one.
        inverted = space.mesh.mapping().detDF(places.mean(axis=1, keepdims=True))[:, :1, None] < 0
        hexes = places.shape[1] * np.arange(count)[:, None, None] + np.where(inverted, np.roll(parts, 4, axis=1), parts)
        material = np.repeat(self._heat.domain.body, len(parts))
        return Drawn(points.reshape(-1, 3), hexes.reshape(-1, 8), material, space.at(places))

    def _sampled(self, functions: np.ndarray) -> np.ndarray:
        own = functions[..., self._heat.domain.space.dofs]
        found: np.ndarray = np.swapaxes(self._drawn.functions @ own, -1, -2)
        return found.reshape(*functions.shape[:-1], -1)


class OwnCells:
    """``hexes`` (m, nodes) of meshio's type ``cell_type`` on ``points`` (n, 3) in m, as in the file, whatever their
    shape; ``material`` (m,) the number of each cell's material; ``snapshot(k)`` the fields of the k-th of some states.
    """

    error = None  # of cells that are given, nothing is known to bound it

    def __init__(self, placed: Placed, heat: HeatProblem, conductor: Conductor | None, states: Sequence[State]) -> None:
        self._placed, self._heat, self._conductor, self._states = placed, heat, conductor, states
        mesh = placed.mesh
        self.cell_type, self.points, self.hexes = mesh.file_type, mesh.points, mesh.cells
        self.material, self.material_names = placed.body, [m.name for m in placed.materials]

    def snapshot(self, k: int) -> Snapshot:
        """The fields of the k-th state; the potential is solved for at its temperature."""
        heat, domain, conductor, (rise, inputs) = self._heat, self._heat.domain, self._conductor, self._states[k]
        weights = domain.space.on(np.arange(len(domain.body))).weights
        temperature = domain.scene.initial_temperature + self._at_points(heat.field(rise))
        heating, density = np.zeros(weights.shape), np.zeros((3, *weights.shape))
        for value, cells in domain.sources:
            heating[cells] += float(heat.inputs.split(value) @ inputs)
        potential = np.full(len(self.points), np.nan)
        if conductor is not None:
            found = conductor.solve(rise, inputs @ conductor.voltages)
            density[:, conductor.cells] = found.density
            heating[conductor.cells] += conductor.heating(found.density, found.density, rise)
            live = np.unique(self.hexes[self._placed.conductors[0]])
            potential[live] = self._at_points(found.potential)[live]
        parents = domain.placed.mesh.parents  # type: ignore[attr-defined]
        parents = np.arange(len(weights)) if parents is None else parents
        volume = np.bincount(parents, weights.sum(axis=1))

        def means(values: np.ndarray) -> np.ndarray:
            return np.bincount(parents, (weights * values).sum(axis=1)) / volume

        return Snapshot(temperature, potential, np.stack([means(d) for d in density], axis=1), means(heating))

    def _at_points(self, function: np.ndarray) -> np.ndarray:
        """(n,): a function (functions,) at the file's points."""
        space: Any = self._heat.domain.space
        mesh = self._placed.mesh
        order, found = own_order(self.cell_type), np.empty(len(self.points))
        if space.mesh.t.shape[1] > mesh.count:
            # The nodes of a cell of second order are corners of those that it is refined to, in scikit-fem's order.
            nodes = MappedSpace(mesh.mesh).dofs[order]
            found[self.hexes.T] = function[nodes]
            return found
        at = space.at(np.asarray(space.element.doflocs).T)[order]
        found[self.hexes.T] = at @ function[space.dofs]
        return found


def _pieces(reference: Any) -> tuple[np.ndarray, np.ndarray]:
    """Places (3, places) in a cell and the hexahedra (pieces, 8) between them."""
    corners, cube = reference.p.T, np.array(CORNERS)
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
