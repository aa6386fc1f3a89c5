"""The steady state of a few states, from one equation for the current.

With modes in which conductance and feedback are both diagonal, G = 1 and S = diag(nu), the state at the squared current
x is a_k = x s_k / (1 - alpha x nu_k), and the voltage

    V(x) = sqrt(x) (r + alpha sum_k x s_k^2 / (1 - alpha x nu_k)).

For alpha > 0 it grows from 0 to infinity, at the pole or beyond all bounds. For alpha < 0 it has a maximum: thermal
runaway above it, and of two currents below it the smaller one grows out of rest.
"""

from __future__ import annotations

import math

import numpy as np
import scipy.linalg

from reduced1d.errors import no_steady_state
from reduced1d.ladder.few_states import FewStates
from reduced1d.roots import increasing_root


def steady_state(model: FewStates) -> tuple[np.ndarray, float]:
    """The state (n,) and the current (A) at the model's voltage.

    Raises RunawayError where no current matches it.
    """
    gains, sources, shapes = _diagonal(model)
    sign, voltage = math.copysign(1.0, model.voltage), abs(model.voltage)
    upper = voltage / model.resistance
    if model.coefficient > 0:
        pole = model.coefficient * gains.max()
        upper = min(upper, 1 / math.sqrt(pole)) if pole > 0 else upper
    elif model.coefficient < 0:
        limit, at = _first_maximum(model, gains, sources)
        if voltage > limit:
            raise no_steady_state(model.voltage, limit)
        upper = at

    def excess(current: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        x = model.coefficient * current**2
        # I - V/R has no pole where the resistance does; its derivative there is not needed, a bisection follows.
        with np.errstate(divide="ignore", invalid="ignore"):
            parts = sources**2 / (1 - np.outer(x, gains))
            resistance = model.resistance + x * parts.sum(axis=1)
            slope = 2 * x * (parts / (1 - np.outer(x, gains))).sum(axis=1)
            return current - voltage / resistance, 1 + voltage * slope / (current * resistance**2)

    lower = 1e-3 * upper if model.coefficient >= 0 else voltage / model.resistance * (1 - 1e-12)
    current = float(increasing_root(excess, np.array([lower]), np.array([upper]))[0])
    amplitudes = current**2 * sources / (1 - model.coefficient * current**2 * gains)
    return shapes @ amplitudes, sign * current


def runaway_voltage(model: FewStates) -> float:
    """The voltage (V) above which there is no steady state; infinite unless the resistance falls with the rise."""
    if model.coefficient >= 0:
        return math.inf
    gains, sources, _ = _diagonal(model)
    return _first_maximum(model, gains, sources)[0]


def _diagonal(model: FewStates) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """nu (n,), the sources (n,) and the shapes (states, n) of the diagonal form."""
    root = np.sqrt(model.rates)
    gains, turned = scipy.linalg.eigh(model.feedback / np.outer(root, root))
    shapes = turned / root[:, None]
    return gains, model.source @ shapes, shapes


def _first_maximum(model: FewStates, gains: np.ndarray, sources: np.ndarray) -> tuple[float, float]:
    """The first maximum of V and the current there, by repeatedly sampling the interval around it."""
    scale = 1 / math.sqrt(-model.coefficient * gains.max())
    low, high = 1e-4 * scale, 1e4 * scale
    for _ in range(8):
        current = np.geomspace(low, high, 200)
        x = model.coefficient * current**2
        voltage = current * (model.resistance + x * (sources**2 / (1 - np.outer(x, gains))).sum(axis=1))
        falls = np.flatnonzero(np.diff(voltage) < 0)
        best = int(falls[0]) if falls.size else current.size - 1
        low, high = current[max(best - 1, 0)], current[min(best + 1, current.size - 1)]
    return float(voltage[best]), float(current[best])
