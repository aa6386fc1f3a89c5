"""The coupled device as modes that decay on their own: the monolithic semi-discretisation of eqs 3, 8 and 20.

The temperature rise is u = w T_ext + v, with w the steady distribution of a unit outer temperature (exact: straight
lines), and v zero on the outer face. With v = sum_i b_i phi_i, where K phi = lambda M phi,

    db/dt = -lambda b + phi_sink P_sink + phi_sensor P_sensor,      b jumps by -jump dT_ext with the outer temperature.
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
import scipy.linalg

from reduced1d.device.lumped import Lumped
from reduced1d.line import Line, reference
from reduced1d.line import modes as modes_of
from scenes.loop.modal import Modal

GRIDS = (np.array([0.0, 1.0]), np.array([0.0, 0.1, 0.5, 1.0]))
"""Where insulator and polymer are cut into elements, as fractions of their thickness."""


class Modes(NamedTuple):
    """The modes, without local departures and with one flow, that from the sensor into the polymer; ``content`` (n,)
    and ``content_external`` give the heat in J/K stored in sink, insulator and sensor."""

    modal: Modal
    content: np.ndarray
    content_external: float


def modes(lumped: Lumped, degree: int, grids: tuple[np.ndarray, np.ndarray] = GRIDS) -> Modes:
    """Modes of the device with insulator and polymer cut at ``grids`` into elements of a degree of at least 2."""
    slabs, cuts = (lumped.insulator, lumped.polymer), [len(grid) - 1 for grid in grids]
    sizes = [slab.thickness * np.diff(grid) for slab, grid in zip(slabs, grids, strict=True)]
    outer = sum(cuts)
    line = Line(np.concatenate(sizes).tolist(), [degree] * outer, list(pairwise(range(outer + 1))))
    capacity = np.repeat([slab.heat_capacity * slab.area for slab in slabs], cuts)
    conductivity = np.repeat([slab.conductivity * slab.area for slab in slabs], cuts)
    films = np.array([0, cuts[0]])
    mass, stiffness = line.products(capacity), line.products(0 * capacity, conductivity)
    mass[films, films] += lumped.capacity
    stiffness[0, 0] += lumped.conductance
    free = np.delete(np.arange(line.size), outer)
    K = stiffness[np.ix_(free, free)]
    w = np.zeros(line.size)
    w[outer] = 1.0
    w[free] = -scipy.linalg.solve(K, stiffness[free, outer], assume_a="pos")
    rates, phi = modes_of(mass[np.ix_(free, free)], K)
    into_polymer = -conductivity[-1] * line.at(cuts[0], -1.0)[1]
    content = line.integral(capacity * (np.arange(outer) < cuts[0]))
    content[films] += lumped.capacity
    modal = Modal(
        rates, phi[films], np.array([0, 1]), lumped.resistance, lumped.coefficient, w[films],
        phi.T @ (mass[np.ix_(free, free)] @ (w - _step(line, degree))[free]),
        (into_polymer[free] @ phi)[None], np.array([into_polymer @ w]), np.zeros((1, 2)),
    )  # fmt: skip
    return Modes(modal, content[free] @ phi, float(content @ w))


def _step(line: Line, degree: int) -> np.ndarray:
    """(n,): a unit step of the outer face's temperature an instant later: zero outside the last element and, in it,
    orthogonal to all polynomials of a degree less that vanish at that face, so that the rest of the stack sees nothing
    yet. An L2 projection of the step would ring through it at once."""
    mass, tests, found = reference(degree)[0], np.r_[0, 2:degree], np.zeros(line.size)
    last = line.functions[-1]
    found[last[1]] = 1.0
    found[last[2:]] = -np.linalg.solve(mass[tests, 2:], mass[tests, 1])
    return found
