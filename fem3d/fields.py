"""Temperature fields of the whole structure: as linear hexahedra for pictures, as quadratic ones for files."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from skfem.refdom import RefHex

from fem3d.conductor import Conductor
from fem3d.heat import HeatProblem
from fem3d.steady import SteadyState
from fem3d.transient import State, Transient
from meshes.grid import VOID, Grid
from meshes.symmetry import Symmetry

if TYPE_CHECKING:
    from fem3d.quadratic import Quadratic

VTK = [7, 4, 1, 5, 6, 2, 0, 3]  # VTK's order of a brick's corners in scikit-fem's


def grid_of(heat: HeatProblem) -> Grid:
    """The grid of a problem on bricks."""
    space: Any = heat.domain.space
    found: Grid = space.grid
    return found


class RunFields:
    """What a run knows of its fields, on any mesh; ``_sampled`` takes functions (..., functions) to drawn points."""

    def __init__(self, heat: HeatProblem, state: SteadyState | None, transient: Transient | None) -> None:
        self._heat, self._state, self._transient = heat, state, transient

    @property
    def distinct(self) -> RunFields:
        """The same without what is there more than once."""
        return self

    @property
    def has_steady(self) -> bool:
        """Whether the run has a steady state."""
        return self._state is not None

    @property
    def steady(self) -> np.ndarray:
        """(n,) in K; ValueError where the run has no steady state."""
        if self._state is None:
            raise ValueError("the run has no steady state")
        return self._kelvins(self._state.rise[None])[0]

    def at(self, times: np.ndarray) -> np.ndarray:
        """(times, n) in K; ValueError where the run has no transient."""
        return self._kelvins(self._rises(times))

    def _rises(self, times: np.ndarray) -> np.ndarray:
        if self._transient is None:
            raise ValueError("the run has no transient")
        return self._transient.rises(np.asarray(times, dtype=float))

    def _kelvins(self, rises: np.ndarray) -> np.ndarray:
        return self._heat.domain.scene.initial_temperature + self._sampled(self._heat.field(rises))

    def _sampled(self, functions: np.ndarray) -> np.ndarray:
        raise NotImplementedError

    def _states(self, times: np.ndarray) -> list[State]:
        """The steady state, if there is one, and those at some times (s)."""
        state, inputs = self._state, self._heat.inputs
        # A run at another voltage keeps the first one's scene, and says how much more it drives it by.
        drive = 1.0 if state is None else state.drive
        found = [] if state is None else [(state.rise, drive * inputs.at(np.zeros(1))[0])]
        if len(times):
            given = drive * inputs.at(np.asarray(times, dtype=float))
            found += list(zip(self._rises(times), given, strict=True))
        return found

    @property
    def _conductor(self) -> Conductor | None:
        if self._state is not None and self._state.conductor is not None:
            return self._state.conductor
        return None if self._transient is None else self._transient.base.conductor


class Fields(RunFields):
    """Points (n, 3) in m, hexahedra (m, 8) that cut each brick by its degrees, materials (m,), temperatures (n,) in K.

    The solved part stands once for each of its mirror images; images share no points.
    """

    def __init__(
        self, heat: HeatProblem, state: SteadyState | None, symmetry: Symmetry, transient: Transient | None
    ) -> None:
        super().__init__(heat, state, transient)
        self._symmetry = symmetry
        self._space: Any = heat.domain.space

    @cached_property
    def _axes(self) -> list[np.ndarray]:
        """Coordinates (m) along each axis: every interval in as many equal parts as its degree."""
        grid, found = self._space.grid, []
        for breaks, degrees in zip(grid.breaks, grid.degrees, strict=True):
            parts = [np.linspace(a, b, p + 1)[:-1] for a, b, p in zip(breaks[:-1], breaks[1:], degrees, strict=True)]
            found.append(np.append(np.concatenate(parts), breaks[-1]))
        return found

    @cached_property
    def _part(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Of the solved part the used points' numbers in the grid of coordinates, hexahedra and the box of each."""
        grid = self._space.grid
        owner = grid.owner[np.ix_(*(np.repeat(np.arange(len(d)), d) for d in grid.degrees))]
        cells = np.argwhere(owner != VOID)
        corners = cells[:, None] + RefHex.p.T.astype(int)[VTK]
        numbers = np.ravel_multi_index(tuple(np.moveaxis(corners, -1, 0)), tuple(len(a) for a in self._axes))
        used, local = np.unique(numbers, return_inverse=True)
        return used, local.reshape(numbers.shape), owner[tuple(cells.T)]

    @cached_property
    def points(self) -> np.ndarray:
        """(n, 3) in m."""
        x, y, z = self._axes
        where = np.unravel_index(self._part[0], (len(x), len(y), len(z)))
        found = [np.stack([a[i] for a, i in zip((x, y, z), where, strict=True)], axis=1)]
        for axis, middle, _ in self._symmetry.planes:
            images = []
            for points in found:
                image = points.copy()
                image[:, axis] = 2 * middle - image[:, axis]
                images.append(image)
            found += images
        return np.concatenate(found)

    @cached_property
    def hexes(self) -> np.ndarray:
        """(m, 8) point numbers, in VTK's order."""
        found = [self._part[1]]
        for _ in self._symmetry.planes:
            count = len(found) * len(self._part[0])
            # A mirror image turns a brick inside out; exchanging its two faces turns it back.
            found += [np.roll(h, 4, axis=1) + count for h in found]
        return np.concatenate(found)

    @cached_property
    def material_names(self) -> list[str]:
        """Names of the materials, in the order of ``material``."""
        return list(dict.fromkeys(m.name for m in self._heat.domain.materials))

    @cached_property
    def material(self) -> np.ndarray:
        """(m,): the material of each hexahedron."""
        of_box = np.array([self.material_names.index(m.name) for m in self._heat.domain.materials])
        return np.tile(of_box[self._part[2]], self._symmetry.copies)

    def quadratic(self, times: np.ndarray, accuracy: float) -> Quadratic:
        """Quadratic cells fine enough for the steady state, if there is one, and for some times (s), in this order;
        ValueError for times where the run has no transient."""
        from fem3d.quadratic import Quadratic

        return Quadratic(self._heat, self._conductor, self._symmetry, self._states(times), accuracy)

    def _sampled(self, functions: np.ndarray) -> np.ndarray:
        sampled = self._space.sample(functions, *self._axes).reshape(len(functions), -1)[:, self._part[0]]
        return np.tile(sampled, (1, self._symmetry.copies))
