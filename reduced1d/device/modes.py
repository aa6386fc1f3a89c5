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
from scenes.loop.modal import Modal


@dataclass(frozen=True)
class Modes:
    """The modes, without local departures and with one flow, that from the sensor into the polymer; ``content`` (n,)
    and ``content_external`` give the heat in J/K stored in sink, insulator and sensor."""

    modal: Modal
    content: np.ndarray
    content_external: float


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
    modal = Modal(
        rates, phi[[sink, sensor]], np.array([0, 1]), lumped.resistance, lumped.coefficient, w[[sink, sensor]],
        phi.T @ (mass[np.ix_(free, free)] @ (w - stack.step)[free]),
        (into_polymer[free] @ phi)[None], np.array([into_polymer @ w]), np.zeros((1, 2)),
    )  # fmt: skip
    return Modes(modal, content[free] @ phi, float(content @ w))
