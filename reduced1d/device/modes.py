"""The coupled device as modes that decay on their own: the monolithic semi-discretisation of eqs 3, 8 and 20.

The temperature rise is u = w T_ext + v, with w the steady distribution of a unit outer temperature (exact: straight
lines), and v zero on the outer face. With v = sum_i b_i phi_i, where K phi = lambda M phi,

    db/dt = -lambda b + phi_sink P_sink + phi_sensor P_sensor,      b jumps by -jump dT_ext with the outer temperature.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg

from reduced1d.device.elements import assemble
from reduced1d.device.lumped import Lumped


@dataclass(frozen=True)
class Modes:
    """``rates`` (n,) in 1/s, ascending; ``shape`` (2, n), the modes at sink and sensor; ``jump`` (n,), see above.

    ``external`` (2,) is w at sink and sensor; ``flux`` (n,) and ``flux_external`` give the heat flow in W from the
    sensor into the polymer, ``content`` (n,) and ``content_external`` the heat in J/K stored in sink, insulator and
    sensor.
    """

    rates: np.ndarray
    shape: np.ndarray
    jump: np.ndarray
    external: np.ndarray
    flux: np.ndarray
    flux_external: float
    content: np.ndarray
    content_external: float

    @property
    def count(self) -> int:
        """Number of modes."""
        return len(self.rates)


def modes(lumped: Lumped, degree: int, grids: tuple[np.ndarray, np.ndarray]) -> Modes:
    """Modes of the device with insulator and polymer cut at ``grids`` into elements of ``degree``.

    The pencil is solved for 1/lambda, so that the slow modes, which set the steady state, keep full precision.
    """
    stack = assemble((lumped.insulator, lumped.polymer), grids, degree)
    sink, sensor, outer = stack.interfaces
    mass, stiffness = stack.mass, stack.stiffness
    mass[sink, sink] += lumped.sink.capacity
    mass[sensor, sensor] += lumped.sensor.capacity
    stiffness[sink, sink] += lumped.sink.conductance
    free = np.delete(np.arange(len(mass)), outer)
    K = stiffness[np.ix_(free, free)]
    w = np.zeros(len(mass))
    w[outer] = 1.0
    w[free] = -scipy.linalg.solve(K, stiffness[free, outer], assume_a="pos")
    times, vectors = scipy.linalg.eigh(mass[np.ix_(free, free)], K)
    rates = 1 / times[::-1]
    phi = vectors[:, ::-1] * np.sqrt(rates)
    into_polymer, content = stack.slopes[1][0], stack.contents[0]
    content[[sink, sensor]] += lumped.sink.capacity, lumped.sensor.capacity
    return Modes(
        rates, phi[[sink, sensor]], phi.T @ (mass[np.ix_(free, free)] @ (w - stack.step)[free]), w[[sink, sensor]],
        into_polymer[free] @ phi, float(into_polymer @ w), content[free] @ phi, float(content @ w),
    )  # fmt: skip
