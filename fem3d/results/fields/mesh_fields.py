"""Fields on the cells and points of a mesh, for files, and on linear hexahedra, for pictures."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
from skfem import ElementHex2, ElementTetP2

from fem3d.problems.current import Conductor
from fem3d.problems.heat import HeatProblem
from fem3d.results.fields.fields import Drawn, RunFields
from fem3d.results.fields.hexahedra import CORNERS
from fem3d.results.fields.quadratic import Snapshot
from fem3d.solution.transient import State
from fem3d.spaces.integrals import Space
from meshes.grouped.read import own_order

_IN_TETRA = (
    (0, 4, 10, 6, 7, 11, 14, 13),
    (1, 5, 10, 4, 8, 12, 14, 11),
    (2, 6, 10, 5, 9, 13, 14, 12),
    (3, 7, 11, 8, 9, 13, 14, 12),
)
"""A tetrahedron as four hexahedra of its corners, the middles of its edges and faces, and its own."""
_MIRRORED = np.array([1, 0, 2, 3, 4, 6, 5, 8, 7, 9])
"""The nodes of a tetrahedron of second order with its first two corners in each other's place."""

_FUNCTIONS = np.array([0, 1, 2, 3, 4, 6, 8, 10, 12, 14])
"""Of the functions of degree 3 on a tetrahedron those of these nodes: of corners, and of degree 2 on edges."""


class MeshFields(RunFields):
    """For pictures ``points`` (n, 3) in m and ``hexes`` (m, 8), where ``steady`` and ``at`` are temperatures (K); for
    files ``quadratic``."""

    def quadratic(self, times: np.ndarray, accuracy: float) -> OwnCells:
        """The cells that were solved on, whatever the ``accuracy``, with the steady state, if there is one, and some
        times (s), in this order; ValueError for times where the run has no transient."""
        return OwnCells(self._heat, self._conductor, self._states(times))

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
        coefficients = functions[..., self._heat.domain.space.dofs]
        sampled: np.ndarray = np.swapaxes(self._drawn.functions @ coefficients, -1, -2)
        return sampled.reshape(*functions.shape[:-1], -1)


class OwnCells:
    """``hexes`` (m, nodes) of meshio's type ``cell_type``, of second order, on ``points`` (n, 3) in m, those that were
    solved on; ``material`` (m,) the number of each cell's material; ``snapshot(k)`` the fields of the k-th of some
    states."""

    error = None  # nothing is known to bound that of a field

    def __init__(self, heat: HeatProblem, conductor: Conductor | None, states: Sequence[State]) -> None:
        self._heat, self._conductor, self._states = heat, conductor, states
        mesh, domain = heat.domain.space.mesh, heat.domain
        simplex = len(mesh.t) == 4
        self.cell_type, second = ("tetra10", ElementTetP2()) if simplex else ("hexahedron27", ElementHex2())
        self._places = np.asarray(second.doflocs).T
        # Where a function jumps there is a point on either side: what is at a place is told by the function there.
        there = _FUNCTIONS if simplex else np.arange(len(self._places.T))
        pairs = np.stack([x.space.dofs[there] for x in (domain, domain.electric)])
        numbers, nodes = np.unique(pairs.reshape(2, -1), axis=1, return_inverse=True)
        self._nodes = nodes.reshape(pairs.shape[1:])
        self.points = np.empty((numbers.shape[1], 3))
        at = np.moveaxis(mesh.mapping().F(self._places), 0, -1)
        self.points[self._nodes.T] = at
        self.hexes = self._nodes[own_order(self.cell_type)].T.copy()
        if simplex:
            # Some cells are mirror images of the reference one.
            a, b, c, d = np.swapaxes(at[:, :4], 0, 1)
            inverted = ((b - a) * np.cross(c - a, d - a)).sum(axis=1) < 0
            self.hexes[inverted] = self.hexes[inverted][:, _MIRRORED]
        self.material, self.material_names = domain.body, [m.name for m in domain.materials]

    def snapshot(self, k: int) -> Snapshot:
        """The fields of the k-th state; the potential is solved for at its temperature."""
        heat, domain, conductor, (rise, inputs) = self._heat, self._heat.domain, self._conductor, self._states[k]
        temperature = domain.scene.initial_temperature + self._at_points(heat.field(rise), domain.space)
        heating, density = np.zeros(len(domain.body)), np.zeros((3, len(domain.body)))
        for value, cells in domain.sources:
            heating[cells] += float(heat.inputs.split(value) @ inputs)
        potential = np.full(len(self.points), np.nan)
        if conductor is not None:
            electric, cells = conductor.solve(rise, inputs @ conductor.voltages), conductor.cells
            weights = conductor.on.weights[: len(cells)]

            def means(values: np.ndarray) -> np.ndarray:
                return (weights * values[..., : len(cells), :]).sum(axis=-1) / weights.sum(axis=-1)

            density[:, cells] = means(conductor.current_density(electric))
            heating[cells] += means(conductor.heating(electric.density, electric.density, rise))
            live = np.unique(self.hexes[domain.live])
            potential[live] = self._at_points(electric.potential, domain.electric.space)[live]
        return Snapshot(temperature, potential, density.T, heating)

    def _at_points(self, function: np.ndarray, space: Space) -> np.ndarray:
        """(n,): a function (functions,) of a space at the points."""
        values = np.empty(len(self.points))
        values[self._nodes] = space.at(self._places) @ function[space.dofs]
        return values


def _pieces(reference: Any) -> tuple[np.ndarray, np.ndarray]:
    """Places (3, places) in a cell and the hexahedra (pieces, 8) between them."""
    corners, cube = reference.p.T, np.array(CORNERS)
    if len(corners) == 8:
        points = np.stack(np.meshgrid(*3 * [np.arange(3) / 2], indexing="ij"), axis=-1).reshape(-1, 3)
        return points.T, (cube[:, None] + cube) @ (9, 3, 1)
    middles = [corners[list(e)].mean(axis=0) for e in reference.edges]
    faces = [corners[list(f)].mean(axis=0) for f in ((0, 1, 2), (0, 1, 3), (1, 2, 3), (0, 2, 3))]
    points = np.array([*corners, *middles, *faces, corners.mean(axis=0)])
    parts = np.array(_IN_TETRA)
    sides = points[parts[:, [1, 3, 4]]] - points[parts[:, :1]]
    inside_out = np.linalg.det(sides) < 0
    parts[inside_out] = np.roll(parts[inside_out], 4, axis=1)
    return points.T, parts
