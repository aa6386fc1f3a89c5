"""Fields on the cells of a mesh file, for files: temperature, potential, current density, heat."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fem3d.hex27 import Snapshot, State
from fem3d.unstructured.level import Level

_OWN = {"tetra": 4, "tetra10": 10, "hexahedron": 8, "hexahedron20": 20, "hexahedron27": 27}


class OwnCells:
    """``hexes`` (m, nodes) of meshio's type ``cell_type`` on ``points`` (n, 3) in m, as in the file, whatever their
    shape; ``material`` (m,) the number of each cell's material; ``snapshot(k)`` the fields of the k-th of some states.
    """

    error = None  # of cells that are given, nothing is known to bound it

    def __init__(self, level: Level, states: Sequence[State]) -> None:
        self._level, self._states = level, states
        mesh = level.given.mesh
        self.cell_type = mesh.file_type
        own = mesh.cells[:, : _OWN[self.cell_type]]
        used, local = np.unique(own, return_inverse=True)
        self.points, self.hexes = mesh.points[used], np.asarray(local.reshape(own.shape), int)
        self.material, self.material_names = level.given.body, [m.name for m in level.given.materials]

    def snapshot(self, k: int) -> Snapshot:
        """The fields of the k-th state; the potential is solved for at its temperature."""
        heat, conductor, state = self._level.heat, self._level.conductor, self._states[k]
        space, placed = heat.space, heat.placed
        temperature = placed.scene.initial_temperature + self._at_points(state.rise)
        heating = np.zeros(space.weights.shape)
        for source in placed.scene.sources:
            heating[placed.mesh.volumes[source.group]] += float(heat.inputs.split(source.heat_source) @ state.inputs)
        density, potential = np.zeros((*heating.shape, 3)), np.full(space.size, np.nan)
        if conductor is not None:
            found = conductor.solve(state.rise, state.inputs @ conductor.voltages)
            density[conductor.cells] = found.density[0]
            heating[conductor.cells] += conductor.resistivity(state.rise) * (found.density[0] ** 2).sum(axis=-1)
            live = space.nodes_of(conductor.cells)
            potential[live] = found.potential[live]
        return Snapshot(temperature, self._at_points(potential), self._means(density), self._means(heating))

    def _at_points(self, field: np.ndarray) -> np.ndarray:
        """(n,): a field at the nodes of the solution as one at the file's points."""
        unknown = self._level.at_file_nodes(self._level.given.mesh.order)[:, : _OWN[self.cell_type]]
        found = np.empty(len(self.points))
        found[self.hexes.ravel()] = field[unknown.ravel()]
        return found

    def _means(self, values: np.ndarray) -> np.ndarray:
        """(m, ...): means over the file's cells of what is given at the quadrature's points (cells, points, ...)."""
        weights = self._level.heat.space.weights
        each = np.einsum("cp,cp...->c...", weights, values).reshape(len(self.hexes), -1, *values.shape[2:])
        found: np.ndarray = each.sum(axis=1)
        volume = weights.reshape(len(self.hexes), -1).sum(axis=1)
        return found / volume.reshape(-1, *[1] * (found.ndim - 1))
