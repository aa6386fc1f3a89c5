"""The heated beam as a fin between given anchor resistances, to rounding: the reference of the 3D model.

    k A T'' - h w T + I^2 rho0 (1 + a T) / A = 0 for 0 < y < L, T the rise above room temperature,
    k A T'(0) = T(0) / R_anchor, symmetric about L/2,   V = I times the integral of rho0 (1 + a T) / A.

Chebyshev's collocation on half the beam for a given current, and of the currents that a voltage drives the smaller one.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import chebyshev
from scipy.optimize import brentq, minimize_scalar

from reduced1d.equations import room_resistivity
from scenes.sink import Sink

POINTS = 40
_PLACES = -np.cos(np.pi * np.arange(POINTS) / (POINTS - 1))  # -1 at the beam's end, 1 at its middle
_VALUES, _SLOPES, _CURVES = (
    chebyshev.chebval(_PLACES, chebyshev.chebder(np.eye(POINTS), order)).T for order in (0, 1, 2)
)


@dataclass(frozen=True)
class Fin:
    """Rises (K), current (A) and power (W) of the whole beam; ``series`` are the rise's coefficients."""

    peak_rise: float
    end_rise: float
    mean_rise: float
    current: float
    power: float
    length: float
    series: np.ndarray

    def rise(self, y: np.ndarray) -> np.ndarray:
        """The rise (K) at places along the beam (m)."""
        return chebyshev.chebval(1 - 2 * np.abs(2 * np.asarray(y) / self.length - 1), self.series)


def fin_at(sink: Sink, anchor_resistance: float, current: float) -> Fin:
    """The fin that carries a current (A); its power gives the voltage."""
    k, area, half = sink.silicon.thermal_conductivity, sink.cross_section, sink.length / 2
    rho, a = room_resistivity(sink.silicon, sink.room_temperature)
    heat = current**2 * rho / area
    matrix = k * area * (2 / half) ** 2 * _CURVES + (heat * a - sink.convection_coefficient * sink.width) * _VALUES
    right = np.full(POINTS, -heat)
    matrix[0] = _VALUES[0] - anchor_resistance * k * area * 2 / half * _SLOPES[0]
    matrix[-1] = _SLOPES[-1]
    right[[0, -1]] = 0.0
    scale = np.abs(matrix).max(axis=1)
    series = np.linalg.solve(matrix / scale[:, None], right / scale)
    integral = chebyshev.chebint(series, lbnd=-1)
    mean = float(chebyshev.chebval(1.0, integral)) / 2
    power = current**2 * rho * sink.length / area * (1 + a * mean)
    return Fin(float(series.sum()), float(chebyshev.chebval(-1.0, series)), mean, current, power, sink.length, series)


def solve_fin(sink: Sink, anchor_resistance: float) -> Fin:
    """The fin at a sink's voltage, which has a steady state; 0 K/W holds its ends at room temperature."""
    rho, a = room_resistivity(sink.silicon, sink.room_temperature)
    cold = sink.voltage * sink.cross_section / (rho * sink.length)
    if a * cold == 0:
        return fin_at(sink, anchor_resistance, cold)

    def excess(current: float) -> float:
        # Without the pole that the resistance may have.
        return current - sink.voltage * current**2 / fin_at(sink, anchor_resistance, current).power

    if a > 0:
        # There the resistance is infinite between ideal anchors, and negative between others.
        k, area, half = sink.silicon.thermal_conductivity, sink.cross_section, sink.length / 2
        pole = (k * area * (math.pi / 2 / half) ** 2 + sink.convection_coefficient * sink.width) * area / (a * rho)
        ends = 1e-6 * cold, math.copysign(min(abs(cold), math.sqrt(pole)), cold)
    else:
        ends = cold, math.copysign(_fold(sink, anchor_resistance)[1], cold)
    return fin_at(sink, anchor_resistance, brentq(excess, *ends, xtol=1e-15 * abs(cold), rtol=1e-14))


def fin_runaway_voltage(sink: Sink, anchor_resistance: float) -> float:
    """The largest voltage (V) with a steady state, infinite unless the resistance falls with the rise."""
    if sink.silicon.temperature_coefficient >= 0:
        return math.inf
    return _fold(sink, anchor_resistance)[0]


def _fold(sink: Sink, anchor_resistance: float) -> tuple[float, float]:
    """The first maximum of the voltage (V) over the current (A), and that current."""

    def voltage(log_current: float) -> float:
        current = math.exp(log_current)
        return fin_at(sink, anchor_resistance, current).power / current

    tried = np.log(np.geomspace(1e-4, 1.0, 200))
    best = int(np.flatnonzero(np.diff([voltage(each) for each in tried]) < 0)[0])
    bounds = tried[[max(best - 1, 0), best + 1]]
    found = minimize_scalar(lambda x: -voltage(x), bounds=bounds, options={"xatol": 1e-9})
    return float(-found.fun), math.exp(found.x)
