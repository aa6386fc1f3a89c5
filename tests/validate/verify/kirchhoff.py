"""Closed solutions where the conductivity follows the temperature, by Kirchhoff's transform (Carslaw and Jaeger,
Conduction of Heat in Solids, 2nd ed., 1.6): with theta(T) = integral of k dT from T_0 to T, div(k grad T) is the
Laplacian of theta, and solutions for constant properties hold for theta.
"""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.polynomial import legendre
from scipy.constants import Stefan_Boltzmann
from scipy.optimize import brentq

Curve = Callable[[np.ndarray], np.ndarray]
"""A property as a function of the temperature (K)."""
POINTS = 40  # of Gauss on each smooth piece, far more than a power law needs over a few hundred kelvin


def integral(curve: Curve, start: float, end: float, bends: Sequence[float] = ()) -> float:
    """The integral of a curve between two temperatures (K), smooth but at its ``bends``."""
    sign = 1.0 if end >= start else -1.0
    low, high = sorted((start, end))
    edges = np.array([low, *(b for b in bends if low < b < high), high])
    x, w = legendre.leggauss(POINTS)
    half = np.diff(edges)[:, None] / 2
    return sign * float((w * half * curve(edges[:-1, None] + half * (1 + x))).sum())


def temperature(curve: Curve, start: float, theta: float, most: float, bends: Sequence[float] = ()) -> float:
    """The temperature (K), between ``start`` and ``most``, up to which the integral of a curve is theta."""
    return float(brentq(lambda T: integral(curve, start, T, bends) - theta, start, most, xtol=1e-11, rtol=1e-14))


def along_bar(curve: Curve, cold: float, hot: float, part: float, bends: Sequence[float] = ()) -> float:
    """The temperature (K) at a part of the way from the cold to the hot end of a bar: there theta is linear."""
    return temperature(curve, cold, part * integral(curve, cold, hot, bends), hot, bends)


def hottest(product: Curve, cold: float, volts: float, most: float, bends: Sequence[float] = ()) -> float:
    """The largest temperature (K) of a conductor of any shape between electrodes of one temperature, cooled nowhere
    else: the integral of k rho dT is V^2/8 (Kohlrausch, Annalen der Physik 306, 132, 1900)."""
    return temperature(product, cold, volts**2 / 8, most, bends)


def radiating_slab(conductivity: float, thickness: float, hot: float, emissivity: float, ambient: float) -> float:
    """The temperature (K) of the far face of a slab whose near face is held hot and whose far face radiates into a
    large room: k (T_hot - T)/d = e s (T^4 - T_ambient^4)."""

    def excess(T: float) -> float:
        return conductivity / thickness * (hot - T) - emissivity * Stefan_Boltzmann * (T**4 - ambient**4)

    return float(brentq(excess, min(hot, ambient), max(hot, ambient), xtol=1e-11, rtol=1e-14))
