"""The transient, in a space of shift-invert Krylov fields.

The fields (M + g K)^-1 F, ((M + g K)^-1 M)^j (M + g K)^-1 F ... for every load F hold the whole response from some g/10
on to a few digits per handful of fields; the reduced problem is diagonal and is stepped with its linear part exact.
Where times of interest are far apart, several shifts g take turns.
Source: Saad, SIAM J. Numer. Anal. 29, 1992; Druskin and Knizhnerman, J. Comput. Phys. 1989; for several shifts Ruhe,
Linear Algebra Appl. 58, 1984.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from fem3d.problems.current import Conductor
from fem3d.problems.heat import HeatProblem
from fem3d.problems.linearized import nonlinear
from fem3d.problems.paths import CurrentField
from fem3d.solution.exponential import CollocationStep, Source, Trajectory, integrate
from fem3d.solution.reduced import Reduced, independent_currents, independent_fields, project
from fem3d.solution.steady import NEGLIGIBLE, SteadyState
from scenes.errors import BeyondLawError

# Fraction of the cold resistivity below which the heating counts as run away: where current has a way round, it grows
# beyond all bounds within the next ten thousandth of the time, elsewhere the heat falls with the resistivity. A given
# current heats a hotter conductor more, and the heat grows by the same factor in equal times until numbers overflow:
# above the inverse fraction it counts as run away.
RUNAWAY_RATIO = 1e-2


@dataclass(frozen=True, eq=False)
class Base:
    """The start of the reduced space of a transient on one mesh.

    Attributes
    ----------
    heat, conductor : the problems; ``heat`` is the exact one where a law makes it nonlinear
    patterns : the current fields
    fields, loads : (free dofs, any number), temperature fields, and loads (all dofs,) in W to respond to
    size, steady : norm of the state that errors are relative to, and a steady state of a nonlinear problem, if known
    unseen : part of the largest current that the current fields miss
    """

    heat: HeatProblem
    conductor: Conductor | None
    patterns: list[CurrentField]
    fields: np.ndarray
    loads: list[np.ndarray]
    size: float | None = None
    steady: SteadyState | None = None
    unseen: float = 0.0

    @staticmethod
    def of_steady(state: SteadyState, accuracy: float = 0.0) -> Base:
        """The base of a response to a constant drive with a steady state, which is relatively accurate."""
        heat, conductor, lift = state.heat, state.conductor, state.heat.lifts[0]
        if (exact := state.exact) is not heat or heat.storage is not None:
            return replace(Base.bare(exact, conductor), steady=state)
        rise, load = (state.rise - lift)[: heat.free], heat.loads[0]
        fields, patterns = [rise], list[CurrentField]()
        if conductor is not None and state.potential is not None:
            hot = conductor.current(state.potential, conductor.resistivity(state.rise), state.rise)
            cold = conductor.solve(lift, conductor.voltages[0]) if conductor.warms else hot
            patterns = independent_currents(conductor, [cold, hot], NEGLIGIBLE * accuracy)
            load = load + conductor.joule_load(patterns[0].density, lift)
            fields.insert(0, heat.solve_steady(load[: heat.free]))
        return Base(heat, conductor, patterns, np.column_stack(fields), _with_inertia(heat, [load]), heat.norm(rise))

    @staticmethod
    def bare(heat: HeatProblem, conductor: Conductor | None) -> Base:
        """The base without prior information."""
        return Base(heat, conductor, [], np.empty((heat.free, 0)), [])

    @property
    def nonlinear(self) -> bool:
        """Whether a law of the temperature makes the equations over time nonlinear."""
        return self.heat.storage is not None or nonlinear(self.heat, self.conductor)

    def project(self, fields: np.ndarray) -> Reduced:
        """The reduced problem on the current patterns and some temperature fields."""
        basis, _ = independent_fields(fields, self.heat.inner_mass, fields[:, :0], fields[:, :0])
        return project(self.heat, self.conductor, basis, self.patterns)

    def near(self, known: Reduced, values: np.ndarray | None) -> Reduced:
        """The reduced problem on the fields of a ``known`` one that this is near, made orthonormal here; ``values``
        (r, rows, points) are those of the fields in the conductor."""
        near = project(self.heat, self.conductor, known.basis, self.patterns, values)
        mass = known.basis.T @ (self.heat.inner_mass @ known.basis)
        return near.changed(np.linalg.inv(np.linalg.cholesky(mass)).T)


def _with_inertia(heat: HeatProblem, loads: list[np.ndarray]) -> list[np.ndarray]:
    """The loads, and the loads of changing given temperatures."""
    return loads + [heat.mass @ lift for lift in heat.lifts if lift.any()]


def jumping_lifts(heat: HeatProblem) -> np.ndarray:
    """(free dofs, any number): the lifts of given temperatures that jump. At that instant the free dofs stay as they
    were, which needs a field in the space that cancels the lift; without it heat would appear from nowhere."""
    inputs = heat.inputs
    jumps = np.vstack([inputs.at(0.0), inputs.jumps(inputs.knots(heat.domain.scene.end_time))])
    jumping = np.any(jumps, axis=0) & heat.lifts.any(axis=1)
    return heat.lifts[jumping, : heat.free].T


def heat_loads(heat: HeatProblem) -> list[np.ndarray]:
    """The loads of a scene without any current: per channel its sources, and its given temperatures."""
    lifted = [] if heat.domain.anchored else [heat.stiffness @ lift for lift in heat.lifts if lift.any()]
    return _with_inertia(heat, [*(load for load in heat.loads if load.any()), *lifted])


@dataclass(frozen=True, eq=False)
class ReducedResponse:
    """A trajectory of the diagonalised reduced problem of one mesh."""

    base: Base
    reduced: Reduced
    trajectory: Trajectory

    @property
    def heat(self) -> HeatProblem:
        return self.base.heat

    @property
    def conductor(self) -> Conductor | None:
        return self.base.conductor

    @property
    def steps(self) -> list[CollocationStep]:
        return self.trajectory.steps

    @property
    def end(self) -> float:
        """The end of the last step (s)."""
        last = self.trajectory.steps[-1]
        return last.start + last.length

    def states(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(times, r) twice: the reduced states, and their rates (1/s)."""
        a, sources = self.trajectory(times)
        return a, sources - a * self.trajectory.rates

    def rises(self, times: np.ndarray) -> np.ndarray:
        """(times, all dofs): the temperature rise (K)."""
        heat = self.base.heat
        rises: np.ndarray = heat.whole(self.trajectory(times)[0] @ self.reduced.basis.T)
        return rises + heat.inputs.at(times) @ heat.lifts if heat.lifts.any() else rises


class Krylov:
    """The growing space of one mesh; each field costs one solve with a factorization made once for each shift."""

    def __init__(self, base: Base, *shifts: float) -> None:
        self._base, self._mass, n = base, base.heat.inner_mass, base.heat.free
        self._solves: list[Callable[[np.ndarray], np.ndarray]] = [base.heat.solve_shifted(shift) for shift in shifts]
        self._made = self._loads = np.empty((n, 0))
        self._next = np.array([load[:n] for load in base.loads]).reshape(-1, n).T
        self._ends = [0]  # after each generation, how many fields there are

    def fields(self, generations: int) -> np.ndarray:
        """(free dofs, fields): the base's own first, then some generations of one field for every load."""
        for number in range(len(self._ends) - 1, generations):
            fields = self._solves[number % len(self._solves)](self._next.T).T
            if not number and not self._base.fields.shape[1] and not fields.any():
                fields = self._base.heat.unit[: len(fields), None]  # nothing warms anything: one field at rest
            self._made, self._loads = independent_fields(fields, self._mass, self._made, self._loads)
            self._next = self._loads[:, self._ends[-1] :]
            self._ends.append(self._made.shape[1])
        return np.column_stack([self._base.fields, self._made[:, : self._ends[generations]]])

    def dropped(self, generations: int, fewer: int) -> int:
        """How many fields the last ``fewer`` of some generations are."""
        return self._ends[generations] - self._ends[max(generations - fewer, 0)]


def slowest(heat: HeatProblem) -> float:
    """The relaxation time (s) of a uniformly heated structure, the scale of the slowest response."""
    n = heat.free
    load = (heat.mass @ heat.unit)[:n]
    return float(heat.unit[:n] @ (heat.inner_mass @ heat.solve_steady(load)) / max(heat.unit[:n] @ load, 1e-300))


def shift(slowest: float, earliest: float) -> float:
    """The shift g (s): between the earliest time of interest and the slowest response."""
    return float(np.sqrt(earliest * max(slowest, earliest)))


def march(base: Base, reduced: Reduced, end: float, accuracy: float, drop: int = 0) -> ReducedResponse:
    """Integrate the reduced heat equation M da/dt + K a = f(t) + q(a, t) from rest to ``end`` (s). The modes of K
    diagonalize it. Exponential collocation integrates the linear part exactly.

    The error of each step is below ``accuracy``, relative to ``base.size`` or else to the state that inputs can reach.
    The last ``drop`` fields are left out: the change of the response estimates the truncation error.

    Raises RunawayInTimeError where the heating runs away, BeyondLawError where the heat vanishes with the resistivity,
    and NumericsError where no step is short enough.
    """
    kept = reduced.states - drop
    inner = reduced.stiffness[:kept, :kept]
    rates, modes = np.linalg.eigh((inner + inner.T) / 2)
    modal, rates = reduced.changed(np.eye(reduced.states, kept) @ modes), np.maximum(rates, 0.0)
    inputs = base.heat.inputs
    size = base.size or _size(modal, rates, inputs.largest(end), end)
    start = -inputs.at(0.0) @ modal.inertia
    knots = inputs.knots(end)
    jumps = dict(zip(knots.tolist(), -inputs.jumps(knots) @ modal.inertia, strict=True))

    def holds(time: float, state: np.ndarray) -> bool:
        rise = base.heat.whole(modal.basis @ state) + inputs.at(time) @ base.heat.lifts
        return resists(base.conductor, time, rise)

    sources = partial(_source, base, modal)
    trajectory = integrate(rates, sources, end, accuracy, size, start=start, jumps=jumps, holds=holds)
    return ReducedResponse(base, modal, trajectory)


def resists(conductor: Conductor | None, time: float, rise: np.ndarray) -> bool:
    """Return whether a linear resistivity exceeds `RUNAWAY_RATIO` of its cold value everywhere, and at a given current
    is below the inverse, at a rise (all dofs, K) and a time (s). A law has values at all temperatures.

    Raises BeyondLawError where the resistivity that is used up heats nothing on the way: one that rises with the
    temperature, and any at a given current, whose heat falls with it.
    """
    if conductor is None or conductor.law is not None or not conductor.warms:
        return True
    ratio = conductor.resistivity(rise) / conductor.cold
    if conductor.draws_current and ratio.max() > 1 / RUNAWAY_RATIO:
        return False
    used_up = (ratio <= RUNAWAY_RATIO).any(axis=1)
    if (used_up & (conductor.draws_current | (conductor.warm[:, 0] > 0))).any():
        raise BeyondLawError(time)
    return not used_up.any()


def _source(base: Base, modal: Reduced, since: float) -> Source:
    """The source of the modal problem from an instant on."""
    conducts = modal.supply.shape[1] > 0
    first, slope = base.heat.inputs.at(since), base.heat.inputs.rates(since)
    rate = slope @ modal.inertia

    def source(times: np.ndarray, states: np.ndarray) -> np.ndarray:
        g = first + np.outer(times - since, slope)
        sources: np.ndarray = g @ modal.source - rate
        return sources + modal.joule(states, modal.currents(states, g), g) if conducts else sources

    return source


def _size(modal: Reduced, rates: np.ndarray, largest: np.ndarray, end: float) -> float:
    """Return the norm of the state that the largest inputs would reach by the end time."""
    none = np.zeros(modal.states)
    load = largest @ np.abs(modal.source)
    if modal.supply.shape[1]:
        load = load + np.abs(modal.joule(none, modal.currents(none, largest), largest))
    reached = load * np.minimum(1 / np.maximum(rates, 1e-300), end)
    return float(np.linalg.norm(reached) + np.linalg.norm(largest @ np.abs(modal.inertia))) or 1.0
