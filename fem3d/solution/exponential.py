"""Stepping da/dt = -lambda a + s(a) with the linear part exact and the source collocated.

In each step the source is a polynomial through Gauss-Lobatto points; its convolution with the decaying exponentials is
exact, so no mode is too stiff and none rings. The source depends weakly on the state (through the resistance), so that
usually a few fixed-point sweeps over a step converge; else Newton's method with the source's Jacobian does. Source of
the idea: Hochbruck and Ostermann, Exponential integrators, Acta Numerica 19, 2010, section 2.2 (exponential
collocation).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.polynomial import legendre

from scenes.errors import NumericsError, RunawayInTimeError
from scenes.units import TIME

FAST = 200.0  # beyond this decay over a step the convolution is summed by parts, below it by Gauss's rule of 48 points
SWEEPS = 30
APART = 1e-6  # of the norm of the state: the finite differences for the slope of a stiff source
SETTLED = 1e-8  # relative change of a stiff source in a sweep at which its iteration ends
STILL = 1e-3  # change of the states in a sweep, over the error allowed, which ends it too
RENEWED = 8  # sweeps after which a stiff source's slope is taken anew
# Halvings of a step in which a response runs away: they give the time to a millionth of the step.
HALVINGS = 20
MOST_IN_TIME = 20_000  # in time, those that are taken and those that fail
SHORTEST = 1e-13  # step over the end time


@dataclass(frozen=True)
class Step:
    """One step: ``start`` and ``length`` (s), initial state (r,), Legendre coefficients (q, r) of the source."""

    start: float
    length: float
    state: np.ndarray
    source: np.ndarray


@dataclass(frozen=True)
class Trajectory:
    """The state at every time from 0 to the end of the last step; ``rates`` are the decay rates (r,)."""

    rates: np.ndarray
    steps: list[Step]

    def __call__(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """States and sources, both (times, r)."""
        starts = np.array([s.start for s in self.steps])
        which = np.clip(np.searchsorted(starts, times, side="right") - 1, 0, len(starts) - 1)
        states = np.empty((len(times), len(self.rates)))
        sources = np.empty_like(states)
        for i in np.unique(which):
            step, during = self.steps[i], which == i
            tau = np.clip((times[during] - step.start) / step.length, 0.0, 1.0)
            kernel = Convolution(tau, len(step.source))(self.rates * step.length)
            decay = np.exp(-np.outer(tau, self.rates * step.length))
            states[during] = decay * step.state + step.length * np.einsum("tkr,kr->tr", kernel, step.source)
            sources[during] = legendre.legvander(2 * tau - 1, len(step.source) - 1) @ step.source
        return states, sources


Source = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""The sources (n, r) at some times (s) and states (n, r), from one instant on."""


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

    ``source(t)`` is the source from t to the next instant of ``jumps``; a step ends and the state jumps at each
    instant. If sweeps do not converge although nothing grows, the source is stiff: its slope enters the sweeps.

    Raises RunawayInTimeError where the state grows and the source outruns every step, or where ``holds(time, state)``
    becomes false; NumericsError where nothing grows and no step is short enough.
    """
    nodes = _lobatto(degree)
    to_legendre = np.linalg.inv(legendre.legvander(2 * nodes - 1, degree))
    time, length = 0.0, end * 1e-4
    state = np.zeros(len(rates)) if start is None else start
    jumps = jumps or {}
    stops = [*sorted(t for t in jumps if 0 < t < end), end]
    steps: list[Step] = []
    trials = 0
    convolve, stiff = Convolution(nodes, degree + 1), False

    def holds_at(instant: float) -> bool:
        return holds(instant, Trajectory(rates, steps[-1:])(np.array([instant]))[0][0])

    for stop in stops:
        piece = source(time)
        while time < stop:
            trials = count_step(trials, time)
            remaining = stop - time
            last = length >= remaining * (1 - 1e-12)
            taken = remaining if last else length
            if taken < SHORTEST * end and not last:
                if _growth(piece, rates, time, state, size) <= 0:
                    raise too_short(time)
                raise runaway(time)
            times = time + taken * nodes
            kernel = convolve(rates * taken)
            decay = np.exp(-np.outer(nodes, rates * taken)) * state
            values = piece(times, np.repeat(state[None], len(nodes), axis=0))
            scale = float(np.abs(values).max(initial=0.0))
            settled, newton, states = False, None, np.full(values.shape, np.inf)
            for sweep in range(SWEEPS):
                coefficients = to_legendre @ values
                before, states = states, decay + taken * np.einsum("tkr,kr->tr", kernel, coefficients)
                old, values = values, piece(times, states)
                change = float(np.abs(values - old).max(initial=0.0))
                if stiff and np.isfinite(values).all():
                    if newton is None or sweep % RENEWED == 0:
                        weights = taken * (kernel.transpose(0, 2, 1) @ to_legendre)
                        newton = _newton(piece, times, states, weights, size)
                    values = old + newton(values - old)
                    change = float(np.abs(values - old).max(initial=0.0))
                if not np.isfinite(change) or change > 1e3 * scale:
                    break
                # A small difference of large sources is as uncertain as they are; its states are not.
                still = stiff and float(np.abs(states - before).max(initial=0.0)) <= STILL * accuracy * size
                if still or change <= (SETTLED if stiff else 1e-13) * scale:
                    settled = True
                    break
            if not settled:
                # Where the source only damps the state, no step needs to be as short as its slope makes sweeps.
                again = not stiff and _growth(piece, rates, time, state, size) * taken < 1
                stiff, length = stiff or again, taken if again else taken / 4
                continue
            tail = taken * np.sqrt((kernel[:, -1] * coefficients[-1]) ** 2 + (kernel[:, -2] * coefficients[-2]) ** 2)
            error = float(np.linalg.norm(tail, axis=1).max()) / (accuracy * size)
            if error <= 1.0:
                steps.append(Step(time, taken, state, coefficients))
                if not holds(time + taken, states[-1]):
                    raise runaway(last_time(holds_at, time, time + taken))
                time, state = stop if last else time + taken, states[-1]
            grown = taken * float(np.clip(0.8 * (error + 1e-30) ** (-1 / degree), 0.2, 6.0))
            # A step that a stop cut short is no reason against a longer step after it.
            length = max(grown, length) if last and error <= 1.0 else grown
        state = state + jumps[stop] if stop in jumps else state
    return Trajectory(rates, steps)


def _newton(
    source: Source, times: np.ndarray, states: np.ndarray, weights: np.ndarray, size: float
) -> Callable[[np.ndarray], np.ndarray]:
    """Return the map from a defect of sources (times, r) to their change, along the source's slope in the step's
    middle: ``weights`` (times, r, times) map sources to states."""
    middle, (n, r) = len(times) // 2, states.shape
    slope = _slope(source, float(times[middle]), states[middle], APART * size)
    matrix = np.eye(n * r) - np.einsum("ab,tbs->tasb", slope, weights).reshape(n * r, n * r)
    inverse = np.linalg.inv(matrix)
    return lambda defect: (inverse @ defect.ravel()).reshape(n, r)


def _slope(source: Source, time: float, state: np.ndarray, step: float) -> np.ndarray:
    """(r, r): how a source follows the state, by differences over a ``step``."""
    r = len(state)
    states = np.vstack([state + step * np.eye(r), state - step * np.eye(r)])
    values = source(np.full(2 * r, time), states)
    slopes: np.ndarray = ((values[:r] - values[r:]) / (2 * step)).T
    return slopes


def _growth(source: Source, rates: np.ndarray, time: float, state: np.ndarray, size: float) -> float:
    """The largest rate (1/s) at which a small change of a state grows; negative where all decay."""
    slope = _slope(source, time, state, APART * size)
    return float(np.linalg.eigvals(slope - np.diag(rates)).real.max()) if np.isfinite(slope).all() else np.inf


def runaway(time: float) -> RunawayInTimeError:
    """Return the error of a response that runs away at a time (s)."""
    return RunawayInTimeError(runs_away(time), time)


def runs_away(time: float, accuracy: float = 1e-3) -> str:
    """A sentence with the time (s), in as many digits as a relative ``accuracy`` leaves, at most three."""
    digits = min(max(round(-np.log10(accuracy)), 1), 3)
    return f"the heating runs away at t = {TIME.show(float(f'{time:.{digits}g}'))}"


def last_time(holds: Callable[[float], bool], low: float, high: float) -> float:
    """The last time (s) between two at which something holds, by bisection."""
    for _ in range(HALVINGS):
        middle = (low + high) / 2
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


def too_short(time: float) -> NumericsError:
    """Return the error of a response of which no step is short enough at a time (s)."""
    return NumericsError(f"no step in time is short enough at t = {TIME.show(float(f'{time:.3g}'))}")


class Convolution:
    """Integrals of exp(-decay (tau - x)) P_k(2 x - 1) from 0 to each ``tau``, for k below ``count`` and any decay."""

    def __init__(self, tau: np.ndarray, count: int) -> None:
        points, weights = _gauss()
        x = np.outer(tau, (points + 1) / 2)
        self._tau = tau
        self._before = tau[:, None] - x
        self._polynomials = legendre.legvander(2 * x - 1, count - 1) * (weights * tau[:, None] / 2)[..., None]
        self._at_tau = legendre.legvander(2 * tau - 1, count - 1)

    def __call__(self, decay: np.ndarray) -> np.ndarray:
        """(tau, count, decay) for decays (decay,) over the unit interval."""
        slow = decay < FAST
        integrals = np.empty((len(self._tau), len(decay), self._polynomials.shape[-1]))
        integrals[:, slow] = np.exp(-decay[slow, None] * self._before[:, None]) @ self._polynomials
        integrals[:, ~slow] = self._by_parts(decay[~slow])
        return integrals.transpose(0, 2, 1)

    def _by_parts(self, decay: np.ndarray) -> np.ndarray:
        """By parts, from degree to degree: (tau, decay, count). With P(x) for P_k(2 x - 1), the derivative of
        P_(k+1) - P_(k-1) is 2 (2 k + 1) P_k, and both are equal at zero."""
        tau, at_tau = self._tau[:, None], self._at_tau[:, None]
        vanishing = np.exp(-np.minimum(tau * decay, 700.0))
        integrals = [(1 - vanishing) / decay]
        integrals.append((2 * tau - 1 + vanishing - 2 * integrals[0]) / decay)
        for k in range(1, at_tau.shape[-1] - 1):
            change = at_tau[..., k + 1] - at_tau[..., k - 1]
            integrals.append(integrals[k - 1] + (change - (4 * k + 2) * integrals[k]) / decay)
        return np.stack(integrals, axis=-1)


@lru_cache(maxsize=1)
def _gauss() -> tuple[np.ndarray, np.ndarray]:
    points, weights = legendre.leggauss(48)
    return points, weights


@lru_cache(maxsize=8)
def _lobatto(degree: int) -> np.ndarray:
    """(degree + 1,): Gauss and Lobatto's points on (0, 1)."""
    inner = np.sort(legendre.legroots(legendre.legder([0.0] * degree + [1.0])).real)
    return (np.concatenate([[-1.0], inner, [1.0]]) + 1) / 2
