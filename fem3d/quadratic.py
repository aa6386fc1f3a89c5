"""Fields of the whole structure on quadratic hexahedra, for files: temperature, potential, current density, heat.

Each brick of the solved part is cut into pieces on which triquadratic functions follow the solution to a part of the
run's accuracy (``fem3d.pieces``), and mirrored to the whole, with the points of the mirror planes shared.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from fem3d import tensor
from fem3d.conductor import Conductor
from fem3d.hex27 import ORDER, Snapshot, State
from fem3d.operators import HeatProblem
from fem3d.pieces import GAUSS, Pieces, cut
from fem3d.resistivity import law
from meshes.bricks import VOID
from meshes.symmetry import Symmetry

SHARE = 0.1
"""Part of the accuracy (of the largest rise; of the largest voltage) that the quadratic cells may add."""


class Quadratic:
    """The quadratic cells of a run's structure, fine enough for some states; ``snapshot(k)`` has the k-th's fields.

    ``error`` bounds what the cells add to the temperature (K), by the sum over the axes of the largest distance along
    each. The potentials are solved for at each state's temperature.
    """

    def __init__(
        self,
        heat: HeatProblem,
        conductor: Conductor | None,
        symmetry: Symmetry,
        states: Sequence[State],
        accuracy: float,
    ) -> None:
        self._heat, self._conductor, self._symmetry, self._mesh = heat, conductor, symmetry, heat.mesh
        self._states = states
        tolerance = SHARE * accuracy * max((float(np.abs(s.rise).max(initial=0.0)) for s in states), default=0.0)
        fields = [self._grid(s.rise, heat.number) for s in states]
        tolerances = [tolerance] * len(fields)
        self._potentials: list[np.ndarray] = []
        if conductor is not None:
            live = (conductor.number >= 0).reshape(self._mesh.shape)
            voltages = [s.inputs @ conductor.voltages for s in states]
            found = [conductor.solve(s.rise, v).potential for s, v in zip(states, voltages, strict=True)]
            self._potentials = [self._grid(phi, conductor.number) for phi in found]
            # Not a number outside: lines that leave the conductor are left out.
            fields += [np.where(live, phi, np.nan) for phi in self._potentials]
            widest = max((float(np.ptp(v)) for v in voltages), default=0.0)
            tolerances += [SHARE * accuracy * widest] * len(states)
        # A third along each axis, so that the three together stay within it.
        cuts = [
            cut(axis, self._slabs(d, fields), [t / 3 for t in tolerances]) for d, axis in enumerate(self._mesh.axes)
        ]
        self._pieces: tuple[Pieces, Pieces, Pieces] = (cuts[0][0], cuts[1][0], cuts[2][0])
        self.error = tolerance / 3 * sum(worst for _, worst in cuts)

    def _grid(self, values: np.ndarray, number: np.ndarray) -> np.ndarray:
        """Values of numbered unknowns on the whole grid of nodes, zero where there are none."""
        found: np.ndarray = np.where(number >= 0, values[np.maximum(number, 0)], 0.0).reshape(self._mesh.shape)
        return found

    def _slabs(self, d: int, fields: list[np.ndarray]) -> list[list[np.ndarray]]:
        """For each interval of an axis the fields' values on its lines of nodes inside the solid."""
        mesh, found = self._mesh, []
        for i, degree in enumerate(mesh.axes[d].degrees):
            cells = np.take(mesh.owner, i, axis=d) != VOID
            for position, other in enumerate(e for e in range(3) if e != d):
                inside = np.zeros((mesh.axes[other].size, len(mesh.axes[other].degrees)), dtype=int)
                for cell, (a, b) in enumerate(
                    zip(mesh.axes[other].offsets[:-1], mesh.axes[other].offsets[1:], strict=True)
                ):
                    inside[a : b + 1, cell] = 1
                cells = np.moveaxis(np.tensordot(inside, cells.astype(int), axes=(1, position)), 0, position) > 0
            start = int(mesh.axes[d].offsets[i])
            lines = [np.moveaxis(u, d, 0)[start : start + int(degree) + 1][:, cells] for u in fields]
            found.append([u[:, np.isfinite(u).all(axis=0)] for u in lines])
        return found

    @cached_property
    def _owner(self) -> np.ndarray:
        """The box of each piece of the whole structure's grid."""
        x, y, z = (p.interval for p in self._pieces)
        owner = self._mesh.owner[np.ix_(x, y, z)]
        for axis, _, _ in self._symmetry.planes:
            owner = np.concatenate([owner, np.flip(owner, axis)], axis=axis)
        return owner

    @cached_property
    def _solid(self) -> tuple[np.ndarray, np.ndarray]:
        """Hexahedra (m, 27) in numbers of the points that are used, and those points' numbers in the grid (n,)."""
        shape = tuple(2 * n + 1 for n in self._owner.shape)
        numbers = np.arange(np.prod(shape)).reshape(shape)
        first = np.argwhere(self._owner != VOID) * 2
        hexes = np.stack([numbers[tuple((first + step).T)] for step in ORDER], axis=1)
        used, local = np.unique(hexes, return_inverse=True)
        return local.reshape(hexes.shape), used

    @property
    def hexes(self) -> np.ndarray:
        """(m, 27) point numbers, in VTK's order of the triquadratic hexahedron."""
        return self._solid[0]

    @cached_property
    def points(self) -> np.ndarray:
        """(n, 3) in m."""
        axes = [p.points for p in self._pieces]
        for axis, middle, _ in self._symmetry.planes:
            axes[axis] = np.concatenate([axes[axis], 2 * middle - axes[axis][-2::-1]])
        grid = np.stack(np.meshgrid(*axes, indexing="ij")).reshape(3, -1)
        return grid[:, self._solid[1]].T

    @cached_property
    def material_names(self) -> list[str]:
        """Names of the materials, in the order of ``material``."""
        return list(dict.fromkeys(b.material.name for b in self._mesh.boxes))

    @cached_property
    def material(self) -> np.ndarray:
        """(m,): the number of each cell's material."""
        of_box = np.array([self.material_names.index(b.material.name) for b in self._mesh.boxes])
        return of_box[self._owner[self._owner != VOID]]

    def snapshot(self, k: int) -> Snapshot:
        """The fields of the k-th state."""
        heat, state = self._heat, self._states[k]
        nodal = self._grid(state.rise, heat.number)
        per_box = np.array([float(heat.inputs.split(b.heat_source) @ state.inputs) for b in self._mesh.boxes])
        given = per_box[self._owner[self._owner != VOID]]
        temperature = heat.scene.initial_temperature + self._at_points(nodal)
        if self._conductor is None:
            return Snapshot(temperature, np.full(len(temperature), np.nan), np.zeros((len(given), 3)), given)
        potential = self._potentials[k]
        volts = np.full(len(temperature), np.nan)
        live = np.unique(self.hexes[self._whole(self._alive)[self._owner != VOID]])
        volts[live] = self._at_points(potential, state.inputs)[live]
        density, joule = self._means(nodal, potential)
        return Snapshot(temperature, volts, density, joule + given)

    def _at_points(self, nodal: np.ndarray, inputs: np.ndarray | None = None) -> np.ndarray:
        """(n,): a field of the grid's nodes at the points of the whole; ``inputs`` are given for a potential, which
        mirrors may turn about a level."""
        x, y, z = self._pieces
        found = tensor.along(x.at_points, y.at_points, z.at_points, nodal)
        for axis, _, parity in self._symmetry.planes:
            image = np.take(found, np.arange(found.shape[axis] - 2, -1, -1), axis=axis)
            if inputs is not None and parity == "odd":
                image = 2 * self._level(axis, inputs) - image
            found = np.concatenate([found, image], axis=axis)
        return found.ravel()[self._solid[1]]

    def _level(self, axis: int, inputs: np.ndarray) -> float:
        """The potential of an odd mirror plane (V)."""
        name = f"symmetry-{'xyz'[axis]}"
        value = next(b.value for b in self._symmetry.scene.boundaries if b.name == name)
        return float(self._heat.inputs.split(value) @ inputs)

    @cached_property
    def _alive(self) -> np.ndarray:
        """Which pieces of the solved part carry current."""
        assert self._conductor is not None
        alive = np.zeros(self._mesh.owner.shape, dtype=bool)
        for block in self._conductor.blocks:
            alive[tuple(slice(*span) for span in block.spans)] = True
        return alive[np.ix_(*(p.interval for p in self._pieces))]

    def _whole(self, cells: np.ndarray) -> np.ndarray:
        """A scalar of the solved part's pieces on those of the whole."""
        for axis, _, _ in self._symmetry.planes:
            cells = np.concatenate([cells, np.flip(cells, axis)], axis=axis)
        return cells

    def _means(self, nodal: np.ndarray, potential: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Current density (m, 3) in A/m2 and Joule heat (m,) in W/m3, means over the cells."""
        (vx, dx), (vy, dy), (vz, dz) = (p.at_gauss for p in self._pieces)
        mx, my, mz = (p.weights for p in self._pieces)
        at_room, per_kelvin = self._laws
        resistivity = at_room + per_kelvin * tensor.along(vx, vy, vz, nodal)
        gradient = [tensor.along(a, b, c, potential) for a, b, c in ((dx, vy, vz), (vx, dy, vz), (vx, vy, dz))]
        alive = self._alive.repeat(GAUSS, 0).repeat(GAUSS, 1).repeat(GAUSS, 2)
        conductivity = np.zeros(alive.shape)
        conductivity[alive] = 1 / resistivity[alive]
        joule = tensor.along(mx, my, mz, conductivity * np.sum(np.square(gradient), axis=0))
        found = []
        for component, g in enumerate(gradient):
            j = tensor.along(mx, my, mz, -conductivity * g)
            for axis, _, parity in self._symmetry.planes:
                # Even: the mirror turns the normal component; odd: it turns the others.
                sign = -1.0 if (axis == component) == (parity == "even") else 1.0
                j = np.concatenate([j, sign * np.flip(j, axis)], axis=axis)
            found.append(j[self._owner != VOID])
        return np.stack(found, axis=1), self._whole(joule)[self._owner != VOID]

    @cached_property
    def _laws(self) -> tuple[np.ndarray, np.ndarray]:
        """The resistivity at the initial temperature and its change per kelvin at the Gauss points; 0 in insulators."""
        initial = self._heat.scene.initial_temperature
        boxes = [law(b.material, initial) if b.material.resistivity else (0.0, 0.0) for b in self._mesh.boxes]
        of_piece = np.array([*boxes, (0.0, 0.0)])[self._mesh.owner[np.ix_(*(p.interval for p in self._pieces))]]
        wide = of_piece.repeat(GAUSS, 0).repeat(GAUSS, 1).repeat(GAUSS, 2)
        return wide[..., 0], wide[..., 1]
