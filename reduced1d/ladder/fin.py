"""The beam as a fin between its anchors, and as one lump after the paper: the reductions without a plate.

The fin is the heat equation along the beam, with the heat that the current makes at each place,

    rho c A dT/dt = k A T'' - h_air w T + I^2 rho_e(T) / A,

and at its ends anchors of a resistance R and a capacity C,  k A T' = T / R + C dT/dt at y = 0, where electrodes at the
pads' outer faces also make heat. Half the beam is cut into polynomials; theirs is Galerkin's method, as is the anchor's
one shape, so that the fin is the plate projected on rises that are uniform across the beam.
"""

from __future__ import annotations

import numpy as np
from numpy.polynomial import legendre

from reduced1d.equations import anchor_flow, end_rise_from_equivalent, peak_above_end, resistance, room_resistivity
from reduced1d.ladder.anchor import Anchor
from reduced1d.ladder.few_states import FewStates, Matrices, in_modes
from reduced1d.sink import air_conductance
from scenes.sink import Sink

_HALVES = 2.0
_BREAKS = (0.0, 0.02, 0.08, 0.3, 1.0)  # of half the beam: heat spreads from the end at 10 us, and long after
_DEGREES = (5, 6, 7, 8)


def fin(
    sink: Sink, anchor: Anchor, *, pad_capacity: bool = True, oxide_capacity: bool = True, finer: int = 0
) -> FewStates:
    """The fin on an anchor, with the capacities that are asked for; ``finer`` is added to the polynomials' degrees.

    Raises ValueError where the silicon does not conduct.
    """
    integral, mass, stiffness = line(np.array(_BREAKS) * sink.length / 2, np.array(_DEGREES) + finer)
    k, A_c = sink.silicon.thermal_conductivity, sink.cross_section
    resistivity, a = room_resistivity(sink.silicon, sink.room_temperature)
    per_length = resistivity / A_c
    film = sink.convection_coefficient * sink.width
    end, peak = np.eye(len(integral))[[0, len(_BREAKS) - 1]]
    node = np.outer(end, end)
    capacity = pad_capacity * anchor.pad + oxide_capacity * anchor.oxide
    beam = _HALVES * per_length * integral
    matrices = Matrices(
        _HALVES * (sink.silicon.heat_capacity * A_c * mass + capacity * node),
        _HALVES * (k * A_c * stiffness + film * mass + node / anchor.resistance),
        beam + anchor.source * end, _HALVES * per_length * mass + anchor.feedback * node,
        per_length * sink.length + anchor.circuit, beam, per_length * sink.length,
        {
            "peak": peak, "end": end, "mean": integral / (sink.length / 2),
            "air": _HALVES * (film * integral + anchor.air * end), "air_beam": _HALVES * film * integral,
        },
    )  # fmt: skip
    return in_modes(matrices, a, sink.voltage)


def line(
    breaks: np.ndarray, degrees: np.ndarray, of: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(n,), (n, n) twice: the integrals of functions on a line, of their products and of those of their slopes, over
    all intervals or those chosen (booleans). The functions of the breakpoints (m) come first, then the integrals of
    Legendre's polynomials on each interval."""
    n = len(breaks) + int(np.sum(degrees - 1))
    integral, mass, stiffness = np.zeros(n), np.zeros((n, n)), np.zeros((n, n))
    first = len(breaks)
    for i, (h, p) in enumerate(zip(np.diff(breaks), degrees.tolist(), strict=True)):
        x, w = legendre.leggauss(p + 1)
        v, one = legendre.legvander(x, p).T, np.ones(p + 1)
        f = np.array([(1 - x) / 2, (1 + x) / 2, *((v[k] - v[k - 2]) / (2 * k - 1) for k in range(2, p + 1))])
        slopes = np.array([-one / 2, one / 2, *(v[k - 1] for k in range(2, p + 1))])
        own = np.array([i, i + 1, *range(first, first + p - 1)])
        first += p - 1
        if of is not None and not of[i]:
            continue
        integral[own] += h / 2 * f @ w
        mass[np.ix_(own, own)] += h / 2 * (f * w) @ f.T
        stiffness[np.ix_(own, own)] += 2 / h * (slopes * w) @ slopes.T
    return integral, mass, stiffness


def lump(sink: Sink, anchor_resistance: float) -> FewStates:
    """The paper's model on any anchor resistance (K/W): one state, the equivalent rise, from eqs 13 and 17 to 20.

    As the paper's it has no pads: no capacity, no air on them, no part of the circuit.
    """
    k, A_c, L = sink.silicon.thermal_conductivity, sink.cross_section, sink.length
    resistivity, a = room_resistivity(sink.silicon, sink.room_temperature)
    cold = np.array([resistance(0.0, resistivity, a, L, A_c)])
    end = end_rise_from_equivalent(1.0, anchor_resistance, k, A_c, L)
    air = np.array([air_conductance(sink)])
    matrices = Matrices(
        np.array([[sink.silicon.heat_capacity * L * A_c]]),
        np.array([[anchor_flow(1.0, anchor_resistance, k, A_c, L)]]) + air,
        cold, cold[:, None], float(cold[0]), cold, float(cold[0]),
        {
            "peak": np.array([end + peak_above_end(end, anchor_resistance, k, A_c, L)]), "end": np.array([end]),
            "mean": np.ones(1), "air": air, "air_beam": air,
        },
    )  # fmt: skip
    return in_modes(matrices, a, sink.voltage)
