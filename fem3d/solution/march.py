"""Responses over time of problems whose properties follow the temperature.

With u the rise and phi the potential, the discrete equations are

    C(u) du/dt + A(u) = f(t) + q(u, phi),    E(u) phi = 0,

where C is the mass with the heat capacity at u, A the heat flow by conduction and through faces, f the heat
sources, q = int sigma(u) |grad phi|^2 v and E the conductor between its electrodes. A step of length h has the rates
k_i and the rises u_i = u + h sum_j a_ij k_j of the stages of ESDIRK4(3)6L[2]SA, which is of order 4, L-stable and
stiffly accurate (Kennedy and Carpenter, Appl. Numer. Math. 44, 2003). Newton's method solves each stage,

    (C + h a_ii (A' - q')) dk = f + q - A - C k,

by GMRES preconditioned with Cholesky factors of an earlier state and step, until these no longer serve. The embedded
method of order 3 gives the error of the step. Between the ends of a step the rise is a cubic (Hermite).

A step of the implicit Euler method, too short to matter, follows each jump of the inputs: its rate is consistent with
the equations, which the first stage needs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.sparse import csc_array

from fem3d.problems.current import Conductor
from fem3d.problems.gmres import solve_by_gmres
from fem3d.problems.heat import HeatProblem
from fem3d.problems.linearized import linearized, refine_quadratures
from fem3d.problems.paths import CurrentField
from fem3d.solution.exponential import SHORTEST, count_step, last_time, runaway_error, step_at
from fem3d.solution.newton import CONTRACTS, HOTTEST, MOST_NEWTON, largest
from fem3d.solution.transient import resists
from fem3d.spaces.sparse import submatrix
from scenes.errors import NumericsError
from scenes.units import TIME

# Butcher's tableau of ESDIRK4(3)6L[2]SA: a_ij, of which the last row are the weights b_j; those of order 3; c_i.
RK_A = np.array([
    [0, 0, 0, 0, 0, 0],
    [1 / 4, 1 / 4, 0, 0, 0, 0],
    [8611 / 62500, -1743 / 31250, 1 / 4, 0, 0, 0],
    [5012029 / 34652500, -654441 / 2922500, 174375 / 388108, 1 / 4, 0, 0],
    [15267082809 / 155376265600, -71443401 / 120774400, 730878875 / 902184768, 2285395 / 8070912, 1 / 4, 0],
    [82889 / 524892, 0, 15625 / 83664, 69875 / 102672, -2260 / 8211, 1 / 4],
])  # fmt: skip
RK_B3 = np.array([
    4586570599 / 29645900160, 0, 178811875 / 945068544, 814220225 / 1159782912, -3700637 / 11593932, 61727 / 225920,
])  # fmt: skip
RK_C = np.array([0, 1 / 2, 83 / 250, 31 / 50, 17 / 20, 1])
# Entry i extrapolates the rates of the stages up to i to the time of the next one, as a polynomial.
AHEAD = [np.linalg.solve(np.vander(RK_C[:i], increasing=True).T, RK_C[i] ** np.arange(i)) for i in range(1, 6)]
NEWTON = 0.1  # error of Newton's method over that of a step (Hairer and Wanner, Solving ODEs II, section IV.8)
STEP_RESIDUAL = 1e-2  # relative residual of a linear system: a tenth of what Newton's method may leave
MOST_STEP_GMRES = 40  # in one system, and in one step in time before new factors, which take about as long


class CubicStep(NamedTuple):
    """One step: its start and length (s), and the rises (K) and rates (K/s) of all dofs at both ends."""

    start: float
    length: float
    rise: np.ndarray
    rate: np.ndarray
    last_rise: np.ndarray
    last_rate: np.ndarray

    def at(self, time: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the rise (K) and the rate (K/s) of all dofs at a time (s)."""
        from scipy.interpolate import CubicHermiteSpline  # takes as long to import as all else; laws alone need it

        cubic = CubicHermiteSpline([0.0, self.length], [self.rise, self.last_rise], [self.rate, self.last_rate])
        since = min(max(time - self.start, 0.0), self.length)
        return cubic(since), cubic(since, 1)


@dataclass(frozen=True, eq=False)
class FullResponse:
    """The response of a heat problem and its conductor, as steps from time 0 on."""

    heat: HeatProblem
    conductor: Conductor | None
    steps: list[CubicStep]
    outputs: dict[int, dict[str, np.ndarray]] = field(default_factory=dict)
    """Outputs at a few times of each step, by its number: `fem3d.results.outputs` interpolates between."""

    @property
    def end(self) -> float:
        """The end of the last step (s)."""
        return self.steps[-1].start + self.steps[-1].length

    def ends(self, parts: int = 1) -> list[float]:
        """Return the ends (s) of the steps, each cut into equal ``parts``."""
        return [step.start + step.length * n / parts for step in self.steps for n in range(1, parts + 1)]

    def at(self, time: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the rise (K) and the rate (K/s) of all dofs at a time (s)."""
        return self.steps[int(step_at(self.steps, np.array([time]))[0])].at(time)

    def rises(self, times: np.ndarray) -> np.ndarray:
        """Return (times, all dofs) the rise (K)."""
        return np.array([self.at(time)[0] for time in times.tolist()])


class _State(NamedTuple):
    """A rise (K) and its rate (K/s) at all dofs, and the potential then."""

    rise: np.ndarray
    rate: np.ndarray
    potential: CurrentField | None = None


def _balance(
    heat: HeatProblem, conductor: Conductor | None, g: np.ndarray, state: _State
) -> tuple[np.ndarray, CurrentField | None]:
    """The heat (all dofs,) that is missing (W) in a state at inputs g, and the current there."""
    lack = g @ heat.loads - heat.outflow(state.rise) - heat.stored(state.rise, state.rate)
    if conductor is None:
        return lack, None
    guess = None if state.potential is None else state.potential.potential
    current = conductor.solve(state.rise, g @ conductor.voltages, guess)
    return lack + conductor.joule_load(current.density, state.rise), current


class _StepTangent:
    """The derivative of the equations at a state, with factors of its symmetric part for one ``shift`` (s)."""

    def __init__(self, heat: HeatProblem, conductor: Conductor | None, state: _State, shift: float) -> None:
        density = np.empty(0)
        if conductor is not None and state.potential is not None:
            density = -conductor.on.gradient(state.potential.potential) / conductor.resistivity(state.rise)
        tangent = linearized(heat, conductor, state.rise, density)
        self._stiffness, self._rest, self._capacity = tangent.inner_stiffness, tangent.inner_rest(), heat.inner_mass
        if heat.storage is not None:
            capacity, steepness = heat.storage.tangent(heat.field(state.rise), heat.field(state.rate))
            inner = heat.order[: heat.free]
            self._capacity = csc_array(self._capacity + submatrix(capacity, inner))
            self._rest = replace(self._rest, matrix=csc_array(self._rest.matrix + submatrix(steepness, inner)))
        self._inverse = heat.factors(self._capacity + shift * self._stiffness, np.float32).solve

    def solve(self, load: np.ndarray, shift: float) -> tuple[np.ndarray, int]:
        """Return the solution (free dofs,) of (C + shift (K + R)) d = load, and the steps of GMRES."""

        def product(v: np.ndarray) -> np.ndarray:
            return self._inverse(self._capacity @ v + shift * (self._stiffness @ v + self._rest(v)))

        return solve_by_gmres(product, self._inverse(load), STEP_RESIDUAL, MOST_STEP_GMRES)


class March:
    """Integrate the equations in the docstring of this module from zero rise, in adaptive steps.

    Parameters
    ----------
    heat, conductor : the heat problem, not linearized, and the current problem of the same mesh, or None
    tolerance : error of each step at the vertices, relative to the largest rise so far
    """

    growth = 8.0  # largest ratio of successive steps

    def __init__(self, heat: HeatProblem, conductor: Conductor | None, tolerance: float) -> None:
        self._heat, self._conductor, self._exact, self._tolerance = heat, conductor, conductor, tolerance
        if conductor is not None:
            # Newton's steps get no smaller than the noise of potentials, but currents are read from exact ones.
            self._conductor = replace(conductor, solved=NEWTON * tolerance)
            self._conductor.cache.update(conductor.cache)
        vertices = heat.unit[: heat.free] == 1.0
        self._vertices = vertices if vertices.any() else np.ones(heat.free, bool)
        self._rounding = 1e-11 * max(float(heat.domain.scene.initial_temperature), 1.0)
        self._linearization: _StepTangent | None = None
        self._since, self._piece = 0.0, (np.zeros(heat.inputs.count),) * 2
        self._largest, self._contraction, self._inner = 0.0, CONTRACTS, 0

    def run(self, end: float, earliest: float, ends: Sequence[float] = ()) -> FullResponse:
        """Return the response. In two spaces with the same steps the difference is of space.

        Parameters
        ----------
        end : end of the response (s)
        earliest : earliest time of interest after a jump (s), by which the first step is chosen
        ends : ends of the steps (s); without them the error of each step decides its length

        Raises RunawayInTimeError where the heating runs away, at the latest above `newton.HOTTEST`; BeyondLawError
        where the heat vanishes with the resistivity; NumericsError where no step is short enough or they are too many.
        """
        heat, steps, trials, before = self._heat, list[CubicStep](), 0, end
        state = _State(np.zeros(heat.size), np.zeros(heat.size))
        for time, stop in pairwise([0.0, *heat.inputs.knots(end).tolist(), end]):
            state, euler, second = self._pass_knot(state, time, stop - time, before, earliest)
            length, last_error, hard = euler or second, 0.0, 0.0  # up to a time that is hard to reach steps grow slowly
            while time < stop:
                trials = count_step(trials, time)
                ends = [each for each in ends if each > time * (1 + 1e-12)]
                length = min([length, *(each - time for each in ends[:1])])
                if length < SHORTEST * end:
                    raise NumericsError(f"no step in time is short enough at t = {TIME.show(float(f'{time:.3g}'))}")
                at_stop = length >= (stop - time) * (1 - 1e-9)
                taken = stop - time if at_stop else length
                fresh = self._linearization is None
                try:
                    step, new, error = (self._euler if euler else self._step)(state, time, taken)
                except NumericsError:
                    # Newton's method, a potential or a factorization fails.
                    self._linearization, length, hard = None, taken / 4 if fresh else taken, max(hard, time + taken)
                    continue
                error = 0.0 if ends else max(error, self._interpolation_error([*steps[-1:], step]))
                if error <= 1.0:
                    steps.append(step)
                    self._limit(step)
                    time, state = stop if at_stop else time + taken, new
                    self._largest = max(self._largest, largest(new.rise))
                grown = self._next_length(steps, taken, error, last_error)
                if error <= 1.0 and not euler:
                    # A step that a stop cuts short is no reason against a longer step before it.
                    before, last_error = max(grown, length) if at_stop else grown, error
                length, euler = end if ends and time >= hard else second if euler else grown, 0.0
        return FullResponse(heat, self._exact, steps)

    def _pass_knot(
        self, state: _State, time: float, gap: float, before: float, earliest: float
    ) -> tuple[_State, float, float]:
        """The state after a knot of the inputs at a time (s), and the lengths (s) of the next two steps: of an Euler
        step, 0 where the rate stays consistent, and of a step after it. The next knot is in a ``gap`` (s)."""
        heat, inputs, n, brief = self._heat, self._heat.inputs, self._heat.free, 1e-3
        jumps = inputs.jumps(time) if time else inputs.at(0.0)
        change = np.concatenate([np.zeros(n), jumps @ heat.given])
        sudden = not time or change.any()
        if change.any():
            # The free dofs keep the heat.
            change[:n] -= heat.factors(heat.inner_mass).solve((heat.mass @ change)[:n])
            state = state._replace(rise=state.rise + change)
        bends = inputs.rates(time) - self._piece[1]
        self._since, self._piece = time, (inputs.at(time), inputs.rates(time))
        if not (jumps.any() or (bends @ heat.given).any()):
            return state, 0.0, before
        if not sudden:
            return state, brief * min(before, gap), before
        # After a jump the error at a time t is about the first step over t.
        length = min(self._tolerance * earliest, brief * gap)
        return state, length, self.growth * length

    def _next_length(self, steps: Sequence[CubicStep], taken: float, error: float, last_error: float) -> float:
        """The length (s) after a step of an error over the error allowed; of an accepted one, the last of ``steps``, as
        if the error goes on to change as it has (Gustafsson, ACM Trans. Math. Softw. 20, 1994)."""
        factor = 0.9 * max(error, 1e-12) ** (-1 / 4)
        if last_error and error <= 1.0:
            factor *= taken / steps[-2].length * (last_error / max(error, 1e-12)) ** (1 / 4)
        return taken * min(max(factor, 0.2), self.growth)

    def _limit(self, step: CubicStep) -> None:
        """Raise RunawayInTimeError, with the time, where the rise exceeds every solid in a step."""

        def holds(time: float) -> bool:
            rise = step.at(time)[0]
            return largest(rise) <= HOTTEST and resists(self._conductor, time, rise)

        end = step.start + step.length
        if not holds(end):
            raise runaway_error(last_time(holds, step.start, end))

    def _euler(self, state: _State, time: float, length: float) -> tuple[CubicStep, _State, float]:
        """A step of the implicit Euler method; the rise is linear in the step."""
        n = self._heat.free
        new = self._stage(state.rise[:n], np.zeros(n), time + length, length, state)
        line = (new.rise - state.rise) / length
        return CubicStep(time, length, state.rise, line, new.rise, line), new, 0.0

    def _step(self, state: _State, time: float, length: float) -> tuple[CubicStep, _State, float]:
        """A step of the ESDIRK method, with its error over the error allowed."""
        n, shift, new, self._inner = self._heat.free, RK_A[1, 1] * length, state, 0
        rates = [state.rate[:n]]
        for weights, ahead, c in zip(RK_A[1:], AHEAD, RK_C[1:].tolist(), strict=True):
            base = state.rise[:n] + length * sum(w * k for w, k in zip(weights, rates, strict=False))
            guess = sum(w * k for w, k in zip(ahead, rates, strict=False))
            new = self._stage(base, guess, time + c * length, shift, new)
            rates.append(new.rate[:n])
        error = length * sum(w * k for w, k in zip(RK_A[-1] - RK_B3, rates, strict=True))
        if self._inner > MOST_STEP_GMRES or self._contraction > CONTRACTS:
            self._linearization = None
        return (
            CubicStep(time, length, state.rise, state.rate, new.rise, new.rate), new,
            largest(error[self._vertices]) / self._allowed(new.rise),
        )  # fmt: skip

    def _interpolation_error(self, pair: Sequence[CubicStep]) -> float:
        """The error of the last step's cubic, h^4/384 |d4u/dt4|, over the error allowed, by both third derivatives."""
        third = [6 * (s.rate + s.last_rate - 2 * (s.last_rise - s.rise) / s.length) / s.length**2 for s in pair]
        error = pair[-1].length ** 3 / 384 * np.diff(third, axis=0).sum(axis=0)[: self._heat.free]
        return largest(error[self._vertices]) / self._allowed(pair[-1].last_rise)

    def _allowed(self, rise: np.ndarray) -> float:
        """The error (K) that a step may have."""
        return max(self._tolerance * max(self._largest, largest(rise)), self._rounding)

    def _stage(self, base: np.ndarray, rate: np.ndarray, time: float, shift: float, near: _State) -> _State:
        """The state at a time (s) with rise = base + shift * rate (free dofs,), by Newton's method from ``near``."""
        heat, conductor, (first, slope) = self._heat, self._conductor, self._piece
        g = first + (time - self._since) * slope
        given, changing = g @ heat.given, slope @ heat.given
        size, potential = np.inf, near.potential
        for number in range(MOST_NEWTON):
            state = _State(np.concatenate([base + shift * rate, given]), np.concatenate([rate, changing]), potential)
            lack, potential = _balance(heat, conductor, g, state)
            state = state._replace(potential=potential)
            if not np.isfinite(lack).all():
                break
            if self._linearization is None:
                self._linearization = _StepTangent(heat, conductor, state, shift)
            change, count = self._linearization.solve(lack[: heat.free], shift)
            self._inner += count
            rate, before, size = rate + change, size, shift * largest(change[self._vertices])
            if number:
                self._contraction = size / max(before, 1e-300)
            else:
                # The contraction of the last stage (Hairer and Wanner, equation IV.8.10), and the residual of GMRES.
                self._contraction = max(self._contraction, STEP_RESIDUAL) ** 0.8
            enough = NEWTON * self._allowed(state.rise)
            if size * min(self._contraction, 1.0) <= enough * (1 - min(self._contraction, 0.9)):
                rise = np.concatenate([base + shift * rate, given])
                return _State(rise, np.concatenate([rate, changing]), potential)
            if number and self._contraction >= 1.0:
                break
        raise NumericsError("Newton's method does not converge in a step")


def by_finer_quadratures(response: FullResponse, times: np.ndarray) -> list[FullResponse]:
    """Return a response at some times (s) by finer quadratures of laws: the loads that these add act
    for an implicit Euler step from time 0 on."""
    own, n = (response.heat, response.conductor), response.heat.free
    finer = [FullResponse(*problems, []) for problems in refine_quadratures(*own)]
    for time in times.tolist():
        g, state = response.heat.inputs.at(time), _State(*response.at(time))
        lack, current = _balance(*own, g, state)
        state = state._replace(potential=current)
        tangent = _StepTangent(*own, state, time)
        for each in finer:
            load = _balance(each.heat, each.conductor, g, state)[0] - lack
            rise = state.rise + np.append(time * tangent.solve(load[:n], time)[0], np.zeros(len(load) - n))
            each.steps.append(CubicStep(time, time, rise, state.rate, rise, state.rate))
    return finer
