"""Fields of the whole structure on quadratic hexahedra, for files: temperature, potential, current density, heat.

Each brick of the solved part is cut into pieces on which triquadratic functions follow the solution to a part of the
run's accuracy (`fem3d.results.fields.parabolas`), and mirrored to the whole, with the points of the mirror planes
shared.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fem3d.problems.conductors import law
from fem3d.problems.current import Conductor
from fem3d.problems.following import COLDEST
from fem3d.problems.heat import HeatProblem
from fem3d.results.fields.hexahedra import CORNERS, Whole, with_none
from fem3d.results.fields.parabolas import GAUSS, cut, samples
from fem3d.solution.transient import State
from fem3d.spaces.bricks import BrickSpace
from meshes.grid import VOID
from meshes.symmetry import Symmetry
from scenes import laws

# VTK's order of the 27 points of a triquadratic hexahedron: corners, edges, faces, middle; as steps of half a cell.
_CORNERS = [(2 * x, 2 * y, 2 * z) for x, y, z in CORNERS]
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


class Quadratic(Whole):
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
        assert isinstance(heat.domain.electric.space, BrickSpace)
        self._electric = heat.domain.electric.space
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
            fields += [np.where(live, self._electric.sample(phi, *self._samples), np.nan) for phi in self._potentials]
            widest = max((float(np.ptp(v)) for v in voltages), default=0.0)
            tolerances += [SHARE * accuracy * widest] * len(states)
        # A third along each axis, so that the three together stay within it.
        cuts = []
        both = zip(self._space.torn_planes, self._electric.torn_planes, strict=True)
        torn = [tuple(sorted({*one, *other})) for one, other in both]
        for d, (breaks, degrees) in enumerate(zip(self._grid.breaks, self._grid.degrees, strict=True)):
            lines = [np.moveaxis(u, d, 0).reshape(u.shape[d], -1) for u in fields]
            cuts.append(cut(breaks, degrees, lines, [t / 3 for t in tolerances], torn[d]))
        self._pieces = [axis for axis, _ in cuts]
        intervals = [p.interval for p in self._pieces]
        super().__init__(self._grid, symmetry, [p.points for p in self._pieces], intervals, ORDER)
        self._at = np.ix_(*intervals)
        self.error = tolerance / 3 * sum(worst for _, worst in cuts)

    @cached_property
    def _samples(self) -> list[np.ndarray]:
        """Coordinates (m) along each axis inside of all cells."""
        return [samples(b, d) for b, d in zip(self._grid.breaks, self._grid.degrees, strict=True)]

    def _sampled(self, rise: np.ndarray) -> np.ndarray:
        return self._space.sample(self._heat.field(rise), *self._samples)

    def _inside(self, cells: np.ndarray) -> np.ndarray:
        """Which samples lie in some cells (nx, ny, nz) of the grid."""
        at = [np.repeat(np.arange(len(d)), d + 1) for d in self._grid.degrees]
        return cells[np.ix_(*at)]

    @cached_property
    def _live(self) -> np.ndarray:
        """(nx, ny, nz): the cells of the grid that carry current."""
        live = np.zeros(self._grid.owner.shape, bool)
        live[tuple(self._space.ijk[:, self._heat.domain.live])] = True
        return live

    def snapshot(self, k: int) -> Snapshot:
        """The fields of the k-th state."""
        heat, (rise, inputs) = self._heat, self._states[k]
        at, rise = [p.points for p in self._pieces], heat.field(rise)
        given = np.array([float(heat.inputs.split(b.heat_source) @ inputs) for b in self._grid.boxes])[self.box]
        temperature = heat.domain.scene.initial_temperature + self.at_points(self._space.sample(rise, *at))
        if self._conductor is None:
            return Snapshot(temperature, np.full(len(temperature), np.nan), np.zeros((len(given), 3)), given)

        def turned(values: np.ndarray, axis: int, parity: str) -> np.ndarray:
            return values if parity == "even" else 2 * self._level(axis, inputs) - values

        potential, volts = self._potentials[k], np.full(len(temperature), np.nan)
        live = np.unique(self.hexes[self.in_hexes(with_none(self._live, False)[self._at])])
        volts[live] = self.at_points(self._electric.sample(potential, *at), turned)[live]
        density, joule = self._means(rise, potential)
        return Snapshot(temperature, volts, density, joule + given)

    def _level(self, axis: int, inputs: np.ndarray) -> float:
        """The potential of an odd mirror plane (V)."""
        name = f"symmetry-{'xyz'[axis]}"
        value = next(b.value for b in self._symmetry.scene.boundaries if b.name == name)
        return float(self._heat.inputs.split(value) @ inputs)

    def _means(self, rise: np.ndarray, potential: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Current density (m, 3) in A/m2 and Joule heat (m,) in W/m3, means over the cells."""
        at = [p.gauss for p in self._pieces]
        resistivity = self._resistivity(self._space.sample(rise, *at))
        gradient = [self._electric.sample(potential, *at, slope=d) for d in range(3)]
        alive = _at_gauss(with_none(self._live, False)[self._at])
        conductivity = np.zeros(alive.shape)
        conductivity[alive] = 1 / resistivity[alive]

        def mean(values: np.ndarray) -> np.ndarray:
            return np.einsum("xi,yj,zk,ijk->xyz", *(p.weights for p in self._pieces), values, optimize=True)

        ratios = self._resistivity_ratios

        def along(component: int) -> np.ndarray:
            def turned(values: np.ndarray, axis: int, parity: str) -> np.ndarray:
                # Even: the mirror turns the normal component; odd: it turns the others.
                return -values if (axis == component) == (parity == "even") else values

            return self.in_hexes(mean(-conductivity * gradient[component] / ratios[component]), turned)

        joule = self.in_hexes(mean(conductivity * np.sum(np.square(gradient) / ratios, axis=0)) / self._each)
        return np.stack([along(d) for d in range(3)], axis=1), joule

    @cached_property
    def _resistivity_ratios(self) -> np.ndarray:
        """(3, ...): the resistivity along x, y and z over that along x, at the Gauss points."""
        ratios = np.array([*(b.material.resistivity_ratios for b in self._grid.boxes), (1.0, 1.0, 1.0)])
        return np.moveaxis(_at_gauss(ratios[with_none(self._grid.owner, VOID)[self._at]]), -1, 0)

    @cached_property
    def _each(self) -> np.ndarray:
        """How many such pieces in series each one stands for: the potential falls by that of all."""
        pieces: np.ndarray = np.array([*(b.stands_for for b in self._grid.boxes), 1.0])[
            with_none(self._grid.owner, VOID)[self._at]
        ]
        return pieces

    def _resistivity(self, rise: np.ndarray) -> np.ndarray:
        """The resistivity along x at the Gauss points, at a rise there; 0 in insulators."""
        initial = self._heat.domain.scene.initial_temperature
        materials = [b.material for b in self._grid.boxes]
        lines = [law(m, initial) if m.resistivity else (0.0, 0.0) for m in materials]
        owner = _at_gauss(with_none(self._grid.owner, VOID)[self._at])
        at_room, per_kelvin = np.moveaxis(np.array([*lines, (0.0, 0.0)])[owner], -1, 0)
        resistivity = at_room + per_kelvin * rise
        for n, material in enumerate(materials):
            if isinstance(along_x := laws.along(material.resistivity)[0], laws.Law):
                resistivity[owner == n] = along_x(np.maximum(initial + rise[owner == n], COLDEST))
        each: np.ndarray = _at_gauss(self._each)
        return resistivity * each


def _at_gauss(of_pieces: np.ndarray) -> np.ndarray:
    """What is known of pieces (x, y, z, ...) at their Gauss points."""
    return of_pieces.repeat(GAUSS, 0).repeat(GAUSS, 1).repeat(GAUSS, 2)
