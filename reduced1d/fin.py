"""The heated beam as an exact steady fin, between given anchor resistances: the reduction without eq 9's parabola.

    k A T'' - h w T + I^2 rho0 (1 + a T) / A = 0 for 0 < y < L, T the rise above room temperature,
    k A T'(0) = T(0) / R_anchor, symmetric about L/2,   V = I times the integral of rho0 (1 + a T) / A.

With l = L/2, z = (I^2 rho0 a / A - h w) l^2 / (k A) and the numbers H = h w l^2 / (k A), B = R_anchor k A / l, the
solution is a cosine (z > 0, feedback prevails), a parabola (z = 0) or a hyperbolic cosine (z < 0) in y - l. In the
functions c, s, p of ``stumpff`` (c = cos r, s = sin r / r, p = (s - c)/z, r^2 = z) and Q = I^2 rho0 l^2 / (k A^2),
which is the rise that I would cause between ideal anchors, times 2, without feedback or air:

    D = c - B z s,   mean = Q (p + B s) / D,   end = Q B s / D,   R / R0 = 1 + a mean = (s + H (p + B s)) / D,

where no two large terms cancel. What is left is one equation for the current at a given voltage, y R/R0 = 1 with
y = I R0 / V.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from reduced1d.equations import resistance, room_resistivity
from reduced1d.errors import no_steady_state
from reduced1d.roots import increasing_root
from reduced1d.stumpff import c, p, p_slope, s
from scenes.sink import Sink


@dataclass(frozen=True)
class Fin:
    """The fin's steady state: rises in K at the middle, at the ends and in the mean, current in A, power in W.

    ``length`` (m), ``z`` (-) and ``amplitude`` Q/D (K) are the constants of the profile, ``rise``.
    """

    peak_rise: float
    end_rise: float
    mean_rise: float
    current: float
    power: float
    length: float
    z: float
    amplitude: float

    def rise(self, y: np.ndarray) -> np.ndarray:
        """The rise (K) at places ``y`` along the beam (m, 0 to its length), of the shape of ``y``."""
        eta = np.abs(2 * np.asarray(y, float) / self.length - 1)
        # (cos(eta r) - cos(r)) / z as a product, which neither cancels near the end nor at z = 0.
        product = s(self.z * ((1 + eta) / 2) ** 2) * s(self.z * ((1 - eta) / 2) ** 2)
        return self.end_rise + self.amplitude * (1 - eta**2) / 2 * product


def solve_fin(sink: Sink, anchor_resistance: float) -> Fin:
    """The exact steady fin of a sink's beam at its voltage, each end anchored by ``anchor_resistance`` (K/W, from the
    beam's end cross section to room temperature; 0 holds the ends at room temperature).

    The air takes heat from the beam's top face. A negative voltage gives a negative current.

    Raises RunawayError where no current matches the voltage, with the largest voltage that one does, and ValueError
    for a negative anchor resistance or silicon that does not conduct.
    """
    fin = _constants(sink, anchor_resistance)
    y, Q = 1.0, fin.heating
    if fin.a * Q != 0:
        y = _relative_current(fin, sink.voltage)
        Q *= y**2
    z = np.array(fin.a * Q - fin.H)
    D = c(z) - fin.B * z * s(z)
    end, mean = Q * fin.B * s(z) / D, Q * (p(z) + fin.B * s(z)) / D
    current = sink.voltage / fin.R0 * y
    amplitude = float(Q / D)
    # The profile's value at eta = 0, where both factors are s(z / 4).
    peak = end + amplitude / 2 * s(z / 4) ** 2
    return Fin(
        float(peak), float(end), float(mean), current, sink.voltage * current, sink.length, float(z), amplitude
    )  # fmt: skip


def fin_runaway_voltage(sink: Sink, anchor_resistance: float) -> float:
    """The voltage (V) above which ``solve_fin`` has no solution; infinite unless the resistance falls with rise.

    Along the solutions V^2 = 4 k rho0 / |a| psi(x)^2 with x = -a Q >= 0 and psi = sqrt(x) R/R0 at z = -x - H; the
    limit is the first maximum of psi. Without air it has the closed form psi = 1 / (sqrt(1 + B) + B asinh(1/sqrt B)),
    and between ideal anchors the classical 2 sqrt(k rho0 / |a|), which holds for any shape of the conductor.
    """
    fin = _constants(sink, anchor_resistance)
    if fin.a >= 0:
        return math.inf
    return _first_maximum(fin)[0] * fin.voltage_scale / math.sqrt(-fin.a)


@dataclass(frozen=True)
class _Constants:
    """The module's symbols; ``voltage_scale`` is sqrt(4 k rho0) in V/sqrt(K), and ``heating`` (K) is Q at the current
    that the voltage would drive through the cold beam, its square over voltage_scale's."""

    a: float
    R0: float
    B: float
    H: float
    voltage_scale: float
    heating: float


def _constants(sink: Sink, anchor_resistance: float) -> _Constants:
    if not anchor_resistance >= 0:
        raise ValueError(f"the anchor resistance must not be negative, {anchor_resistance:g} K/W")
    k, A_c, half = sink.silicon.thermal_conductivity, sink.cross_section, sink.length / 2
    resistivity, a = room_resistivity(sink.silicon, sink.room_temperature)
    return _Constants(
        a,
        R0=resistance(0.0, resistivity, a, sink.length, A_c),
        B=anchor_resistance * k * A_c / half,
        H=sink.convection_coefficient * sink.width * half**2 / (k * A_c),
        voltage_scale=math.sqrt(4 * k * resistivity),
        heating=sink.voltage**2 / (4 * k * resistivity),
    )


def _relative_current(fin: _Constants, voltage: float) -> float:
    """y = I R0 / V: the root of y - R0/R(y), which has no pole where y R/R0 - 1 has one."""
    feedback = fin.a * fin.heating

    def excess(y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        z = feedback * y**2 - fin.H
        N, D = s(z) + fin.H * (p(z) + fin.B * s(z)), c(z) - fin.B * z * s(z)
        N_slope = -p(z) / 2 + fin.H * (p_slope(z) - fin.B * p(z) / 2)
        D_slope = -(0.5 + fin.B) * s(z) + fin.B * z * p(z) / 2
        return y - D / N, 1 - 2 * feedback * y * (D_slope * N - D * N_slope) / N**2

    if feedback > 0:
        # Hot resistance is above the cold one, so y <= 1; and R is infinite at or before z = pi^2/4, where c = 0.
        lower, upper = 0.0, min(1.0, math.sqrt((math.pi**2 / 4 + fin.H) / feedback))
    else:
        largest, x = _first_maximum(fin)
        if math.sqrt(-feedback) > largest:
            raise no_steady_state(voltage, largest * fin.voltage_scale / math.sqrt(-fin.a))
        # Of the two currents the smaller one grows out of V = 0; it lies before psi's maximum.
        lower, upper = 1.0, max(1.0, math.sqrt(x / -feedback))
    return float(increasing_root(excess, np.array(lower), np.array(upper)))


def _first_maximum(fin: _Constants) -> tuple[float, float]:
    """The first maximum of psi(x) = sqrt(x) R/R0 and its place x, by repeatedly sampling the interval around it."""
    low, high = 1e-3 / (1 + fin.B), 1e3 * (1 + fin.H)
    for _ in range(6):
        x = np.geomspace(low, high, 200)
        z = -x - fin.H
        psi = np.sqrt(x) * (s(z) + fin.H * (p(z) + fin.B * s(z))) / (c(z) - fin.B * z * s(z))
        falls = np.flatnonzero(np.diff(psi) < 0)
        best = int(falls[0]) if falls.size else x.size - 1
        low, high = x[max(best - 1, 0)], x[min(best + 1, x.size - 1)]
    return float(psi[best]), float(x[best])
