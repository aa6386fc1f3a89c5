"""Stepping da/dt = -lambda a + s(a) with the linear part exact and the source collocated.

In each step the source is a polynomial through Gauss-Lobatto points; its convolution with the decaying exponentials is
exact, so no mode is too stiff and none rings. The source depends on the state so weakly (through the resistance) that
a few sweeps over a step settle it. Source of the idea: Hochbruck and Ostermann, Exponential integrators, Acta Numerica
19, 2010, section 2.2 (exponential collocation).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre

from fem3d.errors import NumericsError
from meshes.axis import reference

FAST = 200.0  # beyond this decay over a step the convolution is summed by parts, below it by Gauss's rule
SWEEPS = 30


@dataclass(frozen=True)
class Step:
    """One step: from ``start`` (s) over ``length``, initial state (r,) and Legendre coefficients (q, r) of the source."""

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
            step, here = self.steps[i], which == i
            tau = np.clip((times[here] - step.start) / step.length, 0.0, 1.0)
            kernel = convolution(self.rates * step.length, tau, len(step.source))
            decay = np.exp(-np.outer(tau, self.rates * step.length))
            states[here] = decay * step.state + step.length * np.einsum("tkr,kr->tr", kernel, step.source)
            sources[here] = legendre.legvander(2 * tau - 1, len(step.source) - 1) @ step.source
        return states, sources


def integrate(
    rates: np.ndarray,
    source: Callable[[np.ndarray], np.ndarray],
    end: float,
    accuracy: float,
    size: float,
    degree: int = 6,
) -> Trajectory:
    """From rest to ``end`` (s), each step's collocation error below ``accuracy * size`` in the Euclidean norm.

    ``source`` maps states (n, r) to sources (n, r); ``size`` is the norm of the final state. Raises NumericsError where
    the source outruns every step, as it does beyond thermal runaway.
    """
    nodes = (reference(degree).nodes + 1) / 2
    to_legendre = np.linalg.inv(legendre.legvander(2 * nodes - 1, degree))
    time, state, length = 0.0, np.zeros(len(rates)), end * 1e-4
    steps: list[Step] = []
    while time < end:
        length = min(length, end - time)
        if length < 1e-13 * end:
            raise NumericsError(f"the heating runs away at {time:.3g} s")
        kernel = convolution(rates * length, nodes, degree + 1)
        decay = np.exp(-np.outer(nodes, rates * length)) * state
        values = np.repeat(source(state[None]), len(nodes), axis=0)
        scale = float(np.abs(values[0]).max())
        settled = False
        for _ in range(SWEEPS):
            coefficients = to_legendre @ values
            states = decay + length * np.einsum("tkr,kr->tr", kernel, coefficients)
            old, values = values, source(states)
            change = float(np.abs(values - old).max())
            if not np.isfinite(change) or change > 1e3 * scale:
                break
            if change <= 1e-13 * scale:
                settled = True
                break
        if not settled:
            length /= 4
            continue
        tail = length * np.sqrt((kernel[:, -1] * coefficients[-1]) ** 2 + (kernel[:, -2] * coefficients[-2]) ** 2)
        error = float(np.linalg.norm(tail, axis=1).max()) / (accuracy * size)
        if error <= 1.0:
            steps.append(Step(time, length, state, coefficients))
            time, state = time + length, states[-1]
            if end - time < 1e-12 * end:
                break
        length *= float(np.clip(0.8 * (error + 1e-30) ** (-1 / degree), 0.2, 6.0))
    return Trajectory(rates, steps)


def convolution(decay: np.ndarray, tau: np.ndarray, count: int) -> np.ndarray:
    """(tau, count, decay): integral from 0 to tau of exp(-decay (tau - x)) P_k(2 x - 1) dx for k below count."""
    points, weights = legendre.leggauss(48)
    x = np.outer(tau, (points + 1) / 2)
    polynomials = legendre.legvander(2 * x - 1, count - 1) * (weights * tau[:, None] / 2)[..., None]
    slow = decay[None] * tau[:, None] < FAST
    exponent = np.where(slow[..., None], decay[None, :, None] * (tau[:, None] - x)[:, None], 0.0)
    found = np.matmul(np.exp(-exponent), polynomials)
    if not slow.all():
        found = np.where(slow[..., None], found, _by_parts(decay, tau, count))
    return np.moveaxis(found, -1, 1)


def _by_parts(decay: np.ndarray, tau: np.ndarray, count: int) -> np.ndarray:
    """The same by repeated integration by parts, a finite sum in 1 / decay; (tau, decay, count)."""
    found = np.zeros((len(tau), len(decay), count))
    rate = np.maximum(decay, 1e-300)
    vanishing = np.exp(-np.minimum(np.outer(tau, decay), 700.0))
    for k in range(count):
        polynomial, power = np.eye(count)[k], 1 / rate
        for _ in range(k + 1):
            at_tau = legendre.legval(2 * tau - 1, polynomial)
            at_zero = legendre.legval(-1.0, polynomial)
            found[:, :, k] += power * (at_tau[:, None] - vanishing * at_zero)
            polynomial, power = 2 * legendre.legder(polynomial), -power / rate
    return found
