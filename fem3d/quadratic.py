"""Fields of the whole structure on quadratic hexahedra, for files: temperature, potential, current density, heat.

Each brick of the solved part is cut into pieces on which triquadratic functions follow the solution to a part of the
run's accuracy (`fem3d.parabolas`), and mirrored to the whole, with the points of the mirror planes shared.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fem3d.bricks import BrickSpace
from fem3d.conductor import Conductor, law
from fem3d.heat import HeatProblem
from fem3d.parabolas import GAUSS, CutAxis, cut, samples
from fem3d.transient import State
from meshes.grid import VOID
from meshes.symmetry import Symmetry

# VTK's order of the 27 points of a triquadratic hexahedron: corners, edges, faces, middle; as steps of half a cell.
_CORNERS = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2)]
_EDGES = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
_FACES = [(0, 1, 1), (2, 1, 1), (1, 0, 1), (1, 2, 1), (1, 1, 0), (1, 1, 2)]
_MIDDLES = [tuple((p + q) // 2 for p, q in zip(_CORNERS[a], _CORNERS[b], strict=True)) for a, b in _EDGES]
ORDER = [*_CORNERS, *_MIDDLES, *_FACES, (1, 1, 1)]

SHARE = 0.1
"""Part of the accuracy (of the largest rise; of the largest voltage) that the quadratic cells may add."""


@dataclass(frozen=True)
class Snapshot:
    """One state: temperature (points,) in K; potential (points,) in V, not a number where no current flows; current
    density (cells, 3) in A/m2 and heat source (cells,) in W/m3, means over the cells."""

    temperature: np.ndarray
    potential: np.ndarray
    current_density: np.ndarray
    heat_source: np.ndarray


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
        self._heat, self._conductor, self._symmetry, self._states = heat, conductor, symmetry, states
        assert isinstance(heat.domain.space, BrickSpace)
        self._space, self._grid = heat.domain.space, heat.domain.space.grid
        tolerance = SHARE * accuracy * max((float(np.ptp(self._sampled(rise))) for rise, _ in states), default=0.0)
        fields = [np.where(self._inside(self._grid.solid), self._sampled(rise), np.nan) for rise, _ in states]
        tolerances = [tolerance] * len(fields)
        self._potentials: list[np.ndarray] = []
        if conductor is not None:
            voltages = [inputs @ conductor.voltages for _, inputs in states]
            self._potentials = [
                conductor.solve(rise, v).potential for (rise, _), v in zip(states, voltages, strict=True)
            ]
            # Not a number outside: lines that leave the conductor are left out.
            live = self._inside(self._live)
            fields += [np.where(live, self._space.sample(phi, *self._samples), np.nan) for phi in self._potentials]
            widest = max((float(np.ptp(v)) for v in voltages), default=0.0)
            tolerances += [SHARE * accuracy * widest] * len(states)
        # A third along each axis, so that the three together stay within it.
        cuts = []
        for d, (breaks, degrees) in enumerate(zip(self._grid.breaks, self._grid.degrees, strict=True)):
            lines = [np.moveaxis(u, d, 0).reshape(u.shape[d], -1) for u in fields]
            cuts.append(cut(breaks, degrees, lines, [t / 3 for t in tolerances]))
        self._pieces: tuple[CutAxis, CutAxis, CutAxis] = (cuts[0][0], cuts[1][0], cuts[2][0])
        self.error = tolerance / 3 * sum(worst for _, worst in cuts)

    @cached_property
    def _samples(self) -> list[np.ndarray]:
        """Coordinates (m) along each axis inside of all cells."""
        return [samples(b, d) for b, d in zip(self._grid.breaks, self._grid.degrees, strict=True)]

    def _sampled(self, rise: np.ndarray) -> np.ndarray:
        found: np.ndarray = self._space.sample(self._heat.field(rise), *self._samples)
        return found

    def _inside(self, cells: np.ndarray) -> np.ndarray:
        """Which samples lie in some cells (nx, ny, nz) of the grid."""
        at = [np.repeat(np.arange(len(d)), d + 1) for d in self._grid.degrees]
        found: np.ndarray = cells[np.ix_(*at)]
        return found

    @cached_property
    def _live(self) -> np.ndarray:
        """(nx, ny, nz): the cells of the grid that carry current."""
        found = np.zeros(self._grid.owner.shape, bool)
        found[tuple(self._space.ijk[:, self._heat.domain.live])] = True
        return found

    @cached_property
    def _owner(self) -> np.ndarray:
        """The box of each piece of the whole structure's grid."""
        owner = self._owner_solved
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
        return list(dict.fromkeys(b.material.name for b in self._grid.boxes))

    @cached_property
    def material(self) -> np.ndarray:
        """(m,): the number of each cell's material."""
        of_box = np.array([self.material_names.index(b.material.name) for b in self._grid.boxes])
        return of_box[self._owner[self._owner != VOID]]

    def snapshot(self, k: int) -> Snapshot:
        """The fields of the k-th state."""
        heat, (rise, inputs) = self._heat, self._states[k]
        rise = heat.field(rise)
        per_box = np.array([float(heat.inputs.split(b.heat_source) @ inputs) for b in self._grid.boxes])
        given = per_box[self._owner[self._owner != VOID]]
        temperature = heat.domain.scene.initial_temperature + self._at_points(rise)
        if self._conductor is None:
            return Snapshot(temperature, np.full(len(temperature), np.nan), np.zeros((len(given), 3)), given)
        potential = self._potentials[k]
        volts = np.full(len(temperature), np.nan)
        live = np.unique(self.hexes[self._whole(self._alive)[self._owner != VOID]])
        volts[live] = self._at_points(potential, inputs)[live]
        density, joule = self._means(rise, potential)
        return Snapshot(temperature, volts, density, joule + given)

    def _at_points(self, u: np.ndarray, inputs: np.ndarray | None = None) -> np.ndarray:
        """(n,): a function at the points of the whole; ``inputs`` are given for a potential, which mirrors may turn
        about a level."""
        found = self._space.sample(u, *(p.points for p in self._pieces))
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
        found: np.ndarray = self._live[np.ix_(*(p.interval for p in self._pieces))]
        return found

    def _whole(self, cells: np.ndarray) -> np.ndarray:
        """A scalar of the solved part's pieces on those of the whole."""
        for axis, _, _ in self._symmetry.planes:
            cells = np.concatenate([cells, np.flip(cells, axis)], axis=axis)
        return cells

    def _means(self, rise: np.ndarray, potential: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Current density (m, 3) in A/m2 and Joule heat (m,) in W/m3, means over the cells."""
        at = [p.gauss for p in self._pieces]
        at_room, per_kelvin = self._laws
        resistivity = at_room + per_kelvin * self._space.sample(rise, *at)
        gradient = [self._space.sample(potential, *at, slope=d) for d in range(3)]
        alive = self._alive.repeat(GAUSS, 0).repeat(GAUSS, 1).repeat(GAUSS, 2)
        conductivity = np.zeros(alive.shape)
        conductivity[alive] = 1 / resistivity[alive]

        def mean(values: np.ndarray) -> np.ndarray:
            weights = [p.weights for p in self._pieces]
            found: np.ndarray = np.einsum("xi,yj,zk,ijk->xyz", *weights, values, optimize=True)
            return found

        joule = mean(conductivity * np.sum(np.square(gradient), axis=0)) / self._each
        found = []
        for component, g in enumerate(gradient):
            j = mean(-conductivity * g)
            for axis, _, parity in self._symmetry.planes:
                # Even: the mirror turns the normal component; odd: it turns the others.
                sign = -1.0 if (axis == component) == (parity == "even") else 1.0
                j = np.concatenate([j, sign * np.flip(j, axis)], axis=axis)
            found.append(j[self._owner != VOID])
        return np.stack(found, axis=1), self._whole(joule)[self._owner != VOID]

    @cached_property
    def _owner_solved(self) -> np.ndarray:
        """The box of each piece of the solved part."""
        found: np.ndarray = self._grid.owner[np.ix_(*(p.interval for p in self._pieces))]
        return found

    @cached_property
    def _each(self) -> np.ndarray:
        """How many such pieces in series each one stands for: the potential falls by that of all."""
        found: np.ndarray = np.array([*(b.stands_for for b in self._grid.boxes), 1.0])[self._owner_solved]
        return found

    @cached_property
    def _laws(self) -> tuple[np.ndarray, np.ndarray]:
        """The resistivity at the initial temperature and its change per kelvin at the Gauss points; 0 in insulators."""
        initial = self._heat.domain.scene.initial_temperature
        boxes = [law(b.material, initial) if b.material.resistivity else (0.0, 0.0) for b in self._grid.boxes]
        of_piece = np.array([*boxes, (0.0, 0.0)])[self._owner_solved] * self._each[..., None]
        wide = of_piece.repeat(GAUSS, 0).repeat(GAUSS, 1).repeat(GAUSS, 2)
        return wide[..., 0], wide[..., 1]
