"""Stepping da/dt = -lambda a + s(a) with the linear part exact and the source collocated.

In each step the source is a polynomial through Gauss-Lobatto points; its convolution with the decaying exponentials is
exact, so no mode is too stiff and none rings. Newton's method solves for the states at the points: the source may damp
a state however fast, and where no step converges the heating runs away. Source of the idea: Hochbruck and Ostermann,
Exponential integrators, Acta Numerica 19, 2010, section 2.2 (exponential collocation).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import factorial
from typing import Any

import numpy as np
from numpy.polynomial import Polynomial, legendre

from fem3d.problems.gmres import solve_by_gmres
from fem3d.solution.newton import MOST_NEWTON
from scenes.errors import NumericsError, RunawayInTimeError
from scenes.units import TIME
from statespace.runtime import phi

MOST_IN_TIME = 20_000  # steps in time, taken and failed ones: a choice, some minutes; the sink takes 8
SHORTEST = 1e-13  # step over the end time: shorter ones are rounding of the time, which has 2e-16
Source = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""The sources (n, r) at some times (s) and states (n, r), from one instant on."""


@dataclass(frozen=True)
class CollocationStep:
    """One step: ``start`` and ``length`` (s), initial state (r,), Legendre coefficients (q, r) of the source."""

    start: float
    length: float
    state: np.ndarray
    source: np.ndarray


@dataclass(frozen=True)
class Trajectory:
    """The state at every time from 0 to the end of the last step; ``rates`` are the decay rates (r,)."""

    rates: np.ndarray
    steps: list[CollocationStep]

    def __call__(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """States and sources, both (times, r)."""
        which = step_at(self.steps, times)
        states = np.empty((len(times), len(self.rates)))
        sources = np.empty_like(states)
        for i in np.unique(which):
            step, during = self.steps[i], which == i
            tau = np.clip((times[during] - step.start) / step.length, 0.0, 1.0)
            decay, kernel = propagate(tau, self.rates, step.length, len(step.source))
            states[during] = decay * step.state + np.einsum("tkr,kr->tr", kernel, step.source)
            sources[during] = legendre.legvander(2 * tau - 1, len(step.source) - 1) @ step.source
        return states, sources


def integrate(
    rates: np.ndarray,
    source: Callable[[float], Source],
    end: float,
    accuracy: float,
    size: float,
    degree: int = 6,
    start: np.ndarray | None = None,
    jumps: Mapping[float, np.ndarray] | None = None,
    holds: Callable[[float, np.ndarray], bool] = lambda time, state: True,
) -> Trajectory:
    """Integrate da/dt = source - rates a from rest (or ``start``) to ``end`` (s). The collocation error of each step is
    below ``accuracy * size`` in the Euclidean norm.

    ``source(t)`` is the source from t to the next instant of ``jumps``, at which a step ends and the state jumps.

    Raises RunawayInTimeError where no step is short enough, or where ``holds(time, state)`` becomes false.
    """
    nodes = _lobatto(degree)
    to_legendre = np.linalg.inv(legendre.legvander(2 * nodes - 1, degree))
    time, length = 0.0, end * 1e-4
    state = np.zeros(len(rates)) if start is None else start
    jumps, steps, trials = jumps or {}, list[CollocationStep](), 0
    stops = [*sorted(t for t in jumps if 0 < t < end), end]

    def holds_at(instant: float) -> bool:
        return holds(instant, Trajectory(rates, steps[-1:])(np.array([instant]))[0][0])

    for stop in stops:
        piece = source(time)
        while time < stop:
            trials = count_step(trials, time)
            last = length >= (stop - time) * (1 - 1e-12)
            taken = stop - time if last else length
            if taken < SHORTEST * end and not last:
                raise runaway_error(time)
            decay, kernel = propagate(nodes, rates, taken, degree + 1)
            weights, times = np.einsum("tkr,kn->tnr", kernel, to_legendre), time + taken * nodes
            solution = _collocate(piece, times, state, decay * state, weights, size)
            if solution is None:
                length = taken / 4
                continue
            states, coefficients = solution[0], to_legendre @ solution[1]
            tail = np.linalg.norm(kernel[:, -2:] * coefficients[-2:], axis=1)
            error = float(np.linalg.norm(tail, axis=1).max()) / (accuracy * size)
            if error <= 1.0:
                steps.append(CollocationStep(time, taken, state, coefficients))
                if not holds(time + taken, states[-1]):
                    raise runaway_error(last_time(holds_at, time, time + taken))
                time, state = stop if last else time + taken, states[-1]
            grown = taken * float(np.clip(0.8 * (error + 1e-30) ** (-1 / degree), 0.2, 6.0))
            # A step that a stop cut short is no reason against a longer step after it.
            length = max(grown, length) if last and error <= 1.0 else grown
        state = state + jumps[stop] if stop in jumps else state
    return Trajectory(rates, steps)


def _collocate(
    source: Source, times: np.ndarray, state: np.ndarray, free: np.ndarray, weights: np.ndarray, size: float
) -> tuple[np.ndarray, np.ndarray] | None:
    """Solve for the states (n, r) = free + weights sources and the sources at the times of a step, by Newton's method
    with the sources' slope at the state in front; None where it does not converge."""
    states, slope = np.repeat(state[None], len(times), axis=0), _slope(source, float(times[0]), state, size)

    def driven(sources: np.ndarray) -> np.ndarray:
        return np.asarray(np.einsum("tnr,nr->tr", weights, sources))

    def product(v: np.ndarray) -> np.ndarray:
        change = v.reshape(states.shape)
        return (change - driven(change @ slope.T)).ravel()

    for _ in range(MOST_NEWTON):
        sources = source(times, states)
        lacking = free + driven(sources) - states
        if not (np.isfinite(lacking).all() and np.isfinite(slope).all()):
            return None
        try:
            change, _ = solve_by_gmres(product, lacking.ravel(), 1e-3, lacking.size)
        except NumericsError:
            return None
        # By the slope of the sources: this is exact to more digits where large sources differ little.
        sources = sources + change.reshape(states.shape) @ slope.T
        before, states = states, free + driven(sources)
        if np.abs(states - before).max(initial=0.0) <= 1e-12 * size:
            return states, sources
    return None


def _slope(source: Source, time: float, state: np.ndarray, size: float) -> np.ndarray:
    """(r, r): how a source follows the state, by differences."""
    r = len(state)
    step = np.finfo(float).eps ** (1 / 3) * size * np.eye(r)
    values = source(np.full(2 * r, time), np.vstack([state + step, state - step]))
    return np.asarray(((values[:r] - values[r:]) / (2 * step[0, 0])).T)


def propagate(tau: np.ndarray, rates: np.ndarray, length: float, count: int) -> tuple[np.ndarray, np.ndarray]:
    """(tau, r) and (tau, count, r): what is left of a state after each part ``tau`` of a step, and the integrals of
    exp(-rates (t - x)) P_k(2 x - 1) over x from 0 to t = tau * length."""
    decay = np.outer(tau, rates * length)
    # The integrals of powers x^k are k! tau^(k+1) phi_(k+1), and Legendre's polynomials are sums of powers.
    scale = np.array([factorial(k) * tau ** (k + 1) for k in range(count)])
    kernel = np.tensordot(_in_powers(count), length * scale[..., None] * phi(decay, count), 1)
    return np.exp(-decay), kernel.swapaxes(0, 1)


@lru_cache(maxsize=8)
def _in_powers(count: int) -> np.ndarray:
    """(count, count): the coefficients of P_k(2 x - 1) in powers of x."""
    x = Polynomial([0.0, 1.0])
    kept = [legendre.Legendre.basis(k, domain=[0.0, 1.0])(x).coef for k in range(count)]
    return np.array([np.pad(row, (0, count - len(row))) for row in kept])


@lru_cache(maxsize=8)
def _lobatto(degree: int) -> np.ndarray:
    """(degree + 1,): Gauss and Lobatto's points on (0, 1)."""
    inner = np.sort(legendre.legroots(legendre.legder([0.0] * degree + [1.0])).real)
    return (np.concatenate([[-1.0], inner, [1.0]]) + 1) / 2


def runaway_error(time: float) -> RunawayInTimeError:
    """Return the error of a response that runs away at a time (s)."""
    return RunawayInTimeError(runaway_sentence(time), time)


def runaway_sentence(time: float, accuracy: float = 1e-3) -> str:
    """A sentence with the time (s), in as many digits as a relative ``accuracy`` leaves, at most three."""
    digits = min(max(round(-np.log10(accuracy)), 1), 3)
    return f"the heating runs away at t = {TIME.show(float(f'{time:.{digits}g}'))}"


def step_at(steps: Sequence[Any], times: np.ndarray) -> np.ndarray:
    """Return (times,) the number of the step that each time (s) is in; at a jump the following step."""
    return np.clip(np.searchsorted([step.start for step in steps], times, side="right") - 1, 0, len(steps) - 1)


def last_time(holds: Callable[[float], bool], low: float, high: float) -> float:
    """The last time (s) between two at which something holds, by bisection."""
    while low < (middle := (low + high) / 2) < high:
        low, high = (middle, high) if holds(middle) else (low, middle)
    return low


def count_step(trials: int, time: float) -> int:
    """Return the number of trials with one more step at a time (s). Raises NumericsError where they are too many."""
    if trials >= MOST_IN_TIME:
        raise NumericsError(
            f"the transient needs more than {MOST_IN_TIME:,} steps in time: they get as far as t = "
            f"{TIME.show(float(f'{time:.3g}'))}; ask for an earlier end or a larger accuracy"
        )
    return trials + 1
