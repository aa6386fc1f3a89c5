"""Temperature fields of the whole structure: as linear hexahedra for pictures, as quadratic ones for files."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from fem3d.problems.current import Conductor
from fem3d.problems.heat import HeatProblem
from fem3d.results.fields.hexahedra import CORNERS, Whole
from fem3d.results.fields.parabolas import CutAxis
from fem3d.solution.steady import SteadyState
from fem3d.solution.transient import State, Transient
from meshes.symmetry import Symmetry

if TYPE_CHECKING:
    from fem3d.results.fields.quadratic import Quadratic


class Drawn(NamedTuple):
    """Hexahedra as of `fem3d.results.fields.hexahedra.Whole`, and the functions (places, functions of a cell) at the
    points of a cell."""

    points: np.ndarray
    hexes: np.ndarray
    material: np.ndarray
    functions: np.ndarray


class RunFields(ABC):
    """What a run knows of its fields, on any mesh; for pictures on linear hexahedra."""

    _drawn: Any  # Drawn or Whole, made when asked for

    def __init__(self, heat: HeatProblem, state: SteadyState | None, transient: Transient | None) -> None:
        self._heat, self._state, self._transient = heat, state, transient

    @property
    def points(self) -> np.ndarray:
        """(n, 3) in m."""
        return self._drawn.points

    @property
    def hexes(self) -> np.ndarray:
        """(m, 8) point numbers, in VTK's order."""
        return self._drawn.hexes

    @property
    def material_names(self) -> list[str]:
        """Names of the materials, in the order of ``material``."""
        return list(dict.fromkeys(m.name for m in self._heat.domain.materials))

    @property
    def material(self) -> np.ndarray:
        """(m,): the material of each hexahedron."""
        return self._drawn.material

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

    def ceiling(self, times: np.ndarray) -> float:
        """A temperature (K) that is exceeded nowhere in the steady state, if there is one, and at some times (s); found
        without sampling, and infinite where the cells allow no such bound."""
        return math.inf

    def _rises(self, times: np.ndarray) -> np.ndarray:
        if self._transient is None:
            raise ValueError("the run has no transient")
        return self._transient.rises(np.asarray(times, dtype=float))

    def _kelvins(self, rises: np.ndarray) -> np.ndarray:
        return self._heat.domain.scene.initial_temperature + self._sampled(self._heat.field(rises))

    @abstractmethod
    def _sampled(self, functions: np.ndarray) -> np.ndarray:
        """Functions (..., functions) at the drawn points."""

    def _states(self, times: np.ndarray) -> list[State]:
        """The steady state, if there is one, and those at some times (s)."""
        state, inputs = self._state, self._heat.inputs
        # A run at another voltage keeps the first one's scene, and says how much more it drives it by.
        drive = 1.0 if state is None else state.drive
        states = [] if state is None else [(state.rise, drive * inputs.at(np.zeros(1))[0])]
        if len(times):
            given = drive * inputs.at(np.asarray(times, dtype=float))
            states += list(zip(self._rises(times), given, strict=True))
        return states

    @property
    def _conductor(self) -> Conductor | None:
        if self._state is not None and self._state.conductor is not None:
            return self._state.conductor
        return None if self._transient is None else self._transient.base.conductor


class Fields(RunFields):
    """Points (n, 3) in m, hexahedra (m, 8) that cut each brick by its degrees, materials (m,), temperatures (n,) in K,
    of the whole structure (`fem3d.results.fields.hexahedra`)."""

    def __init__(
        self, heat: HeatProblem, state: SteadyState | None, symmetry: Symmetry, transient: Transient | None
    ) -> None:
        super().__init__(heat, state, transient)
        self._symmetry = symmetry
        self._space: Any = heat.domain.space

    @cached_property
    def _cuts(self) -> list[CutAxis]:
        """Along each axis every interval in as many equal parts as its degree."""
        grid, torn = self._space.grid, self._space.torn_planes
        return [CutAxis(*axis) for axis in zip(grid.breaks, grid.degrees, torn, strict=True)]

    @cached_property
    def _drawn(self) -> Whole:
        edges, intervals = [c.edges for c in self._cuts], [c.interval for c in self._cuts]
        return Whole(self._space.grid, self._symmetry, edges, intervals, CORNERS)

    def quadratic(self, times: np.ndarray, accuracy: float) -> Quadratic:
        """Quadratic cells fine enough for the steady state, if there is one, and for some times (s), in this order;
        ValueError for times where the run has no transient."""
        from fem3d.results.fields.quadratic import Quadratic

        return Quadratic(self._heat, self._conductor, self._symmetry, self._states(times), accuracy)

    def ceiling(self, times: np.ndarray) -> float:
        rises = np.array([rise for rise, _ in self._states(times)])
        return float(self._heat.domain.scene.initial_temperature + self._space.ceiling(self._heat.field(rises)))

    def _sampled(self, functions: np.ndarray) -> np.ndarray:
        return self._drawn.at_points(self._space.sample(functions, *(c.edges for c in self._cuts)))
