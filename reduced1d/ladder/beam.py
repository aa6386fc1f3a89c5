"""The beam as a fin between two anchors, each of one node; and fin or plate projected on few states.

The fin is the heat equation along the beam,

    rho c A dT/dt = k A T'' - (h_air w + h_gas w) T + I^2 rho_e(T) / A,

between anchors of a resistance R and a capacity C, k A T' = T / R + C dT/dt. Polynomials by Galerkin's method make the
fin the plate projected on rises that are uniform across the beam.

An anchor, pad and oxide: let theta be the steady rise when heat flows into it through the beam's end, per watt through
each end. Its mean over the end is R. For slow changes the anchor's rise is the end's times theta / R, and with that
shape (Galerkin) it is one node with the capacity

    C = integral of rho c (theta / R)^2,

which is also the capacity in Z(p) = R - p R^2 C + ... , the anchor's impedance at small rates p. A heat density q in
the pad counts by its effect on the end, as the integral of q theta / R (reciprocity).

Few states: the rise that a source s, switched on, causes has the Laplace transform (G + p C)^-1 s / p. Fields
(G + p C)^-1 s, ((G + p C)^-1 C)^j (G + p C)^-1 s span a space in which it is matched at the rate p with its first
derivatives in p; with G^-1 s its steady state is matched as well (Antoulas, Approximation of Large-Scale Dynamical
Systems, chapter 11). Galerkin's projection keeps the matrices symmetric, so that the reduced model is stable and loses
no heat. The steady field is the hot sink's, and p is the geometric mean of the slowest rate and one over the first time
of interest.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp

from reduced1d.equations import resistance, room_resistivity
from reduced1d.ladder.few_states import FewStates, steady_state
from reduced1d.ladder.plate import COPIES, Plate, along, current_through_pads, factorize, film, gap_film, stored
from reduced1d.numerics import Elements
from scenes.checks import FIRST_TIME
from scenes.sink import Sink


@dataclass(frozen=True)
class Anchor:
    """One of the two anchors: ``resistance`` in K/W, capacities of its ``pad`` and its ``oxide`` in J/K, conductance
    from the pad to the ``air`` in W/K.

    Of 1 A in the cold circuit beyond the plain beam, both anchors together: ``circuit`` (ohm), the part of its heat
    that the end feels, ``source`` (W), and its ``feedback`` (W)."""

    resistance: float
    pad: float
    oxide: float
    air: float
    circuit: float
    source: float
    feedback: float


def anchor_of(plate: Plate) -> Anchor:
    """The anchor of a plate, for the current that the plate carries."""
    theta = _per_watt(plate)
    R = float(plate.model.outputs["end"] @ theta)
    shape = theta / R
    sink, pads, air = plate.sink, plate.pads, plate.model.outputs["air"] - plate.model.outputs["air_beam"]
    resistivity, a = room_resistivity(sink.silicon, sink.room_temperature)
    # Where the current widens into the pad the beam has more resistance than a prism; it is counted at its end.
    widening = plate.model.resistance_beam - resistance(0.0, resistivity, a, sink.length, sink.cross_section)
    in_pads = (pads.resistance, pads.source @ shape, shape @ (pads.feedback @ shape)) if pads else (0.0, 0.0, 0.0)
    return Anchor(
        R, float(shape @ (plate.in_pads @ shape)) / 2, float(shape @ (plate.in_oxide @ shape)) / 2,
        float(air @ shape) / 2, *(float(part + widening) for part in in_pads),
    )  # fmt: skip


def thin_plate_remainder(plate: Plate) -> float:
    """The part of the anchor resistance (-) that the plate's neglected terms may be: where it is not small, the layer
    is not thin.

    Over the oxide the foot of the layer is colder than its mean by h t/(3 k), and at the oxide's edge by half as much:
    the step in the flux spreads over the thickness. Summed over the cosines across it, the flux there is larger than
    the plate's by zeta(3)/pi^3 h^2 t^2/k per length of edge and kelvin. On the other side of the interface the rise in
    the oxide is taken to fall linearly however fast it changes along the layer; the heat conducted sideways, k_ox |grad
    T|^2, is as large as the terms left out there. First-order perturbation of R by both, in terms of theta.
    """
    from scipy.special import zeta
    from skfem import BilinearForm
    from skfem.helpers import dot, grad

    sink, basis, mesh = plate.sink, plate.basis, plate.basis.mesh
    theta = _per_watt(plate)
    first, second = mesh.f2t
    above = plate.quarter.oxide
    edge = np.flatnonzero((second >= 0) & (above[first] != above[second]))
    h, t, k = film(sink), sink.thickness, sink.silicon.thermal_conductivity
    nodes, lengths = along(basis, edge)
    # The mass matrix of a quadratic on a unit interval, by its values at the ends and the middle.
    mass = np.array([[4, 2, -1], [2, 16, 2], [-1, 2, 4]]) / 30
    squares = np.einsum("if,ij,jf,f->", theta[nodes], mass, theta[nodes], lengths)
    at_edge = float(zeta(3)) / math.pi**3 * (h * t) ** 2 / k * float(squares)
    sideways = BilinearForm(lambda u, v, w: dot(grad(u), grad(v))).assemble(basis.with_elements(np.flatnonzero(above)))
    in_oxide = sink.oxide_thickness * stored(sink) * sink.oxide.thermal_conductivity * float(theta @ (sideways @ theta))
    # Both ends carry a watt, so that the quarters hold two anchors.
    return COPIES / 2 * float(at_edge + in_oxide) / float(plate.model.outputs["end"] @ theta)


def _per_watt(plate: Plate) -> np.ndarray:
    """theta (n,) from a uniform heat in the beam: how the heat gets to the end does not matter there."""
    field: np.ndarray = plate.inverse.solve(plate.model.outputs["mean"])
    return field / ((1 - float((plate.model.outputs["air_beam"] + plate.model.outputs["gas_beam"]) @ field)) / 2)


def fin(
    sink: Sink, anchor: Anchor, *, pad_capacity: bool = True, oxide_capacity: bool = True, finer: int = 0
) -> FewStates:
    """Assemble the fin on an anchor, with the chosen capacities, by polynomials of degree 7 + ``finer``.

    Raises ValueError where the silicon does not conduct.
    """
    # Half the beam; elements are fine near its end, from which heat has spread a little at 10 us.
    e = Elements([np.array([0.0, 0.02, 0.08, 0.3, 1.0]) * sink.length / 2], 7 + finer)
    k, A_c = sink.silicon.thermal_conductivity, sink.cross_section
    resistivity, a = room_resistivity(sink.silicon, sink.room_temperature)
    per_length, air, gas = resistivity / A_c, sink.convection_coefficient * sink.width, gap_film(sink) * sink.width
    both = np.full(len(e.lengths), 2.0)
    end, middle = (np.eye(1, e.size, e.end(0, side))[0] for side in (0, 1))
    node = sp.diags_array(end)
    capacity = pad_capacity * anchor.pad + oxide_capacity * anchor.oxide
    integral = e.integral(both)
    outputs = {
        "peak": middle, "end": end, "mean": integral / sink.length, "air": air * integral + 2 * anchor.air * end,
        "air_beam": air * integral, "gas_beam": gas * integral,
    }  # fmt: skip
    return FewStates(
        (e.mass(both * sink.silicon.heat_capacity * A_c) + 2 * capacity * node).tocsc(),
        (e.mass(both * (air + gas)) + e.stiffness(both * k * A_c) + 2 / anchor.resistance * node).tocsc(),
        per_length * integral + anchor.source * end,
        (e.mass(both * per_length) + anchor.feedback * node).tocsc(),
        per_length * sink.length + anchor.circuit, per_length * integral, per_length * sink.length, outputs,
        a, sink.drive,
    )  # fmt: skip


def added(fields: np.ndarray, field: np.ndarray, model: FewStates) -> np.ndarray | None:
    """Fields (n, states), orthonormal in the model's conductance, extended by another; ``None`` if it depends on
    them."""
    whole = math.sqrt(field @ (model.conductance @ field))
    # Twice is enough (Kahan) for orthogonality to rounding.
    for _ in range(2):
        field = field - fields @ (fields.T @ (model.conductance @ field))
    size = math.sqrt(max(float(field @ (model.conductance @ field)), 0.0))
    return np.column_stack([fields, field / size]) if size > 1e-10 * whole else None


def hot(plate: Plate) -> tuple[Plate, np.ndarray]:
    """The plate with the current as it flows in the steady state, and that state's rise (n,).

    Raises RunawayError where there is no steady state.
    """
    if plate.sink.electrodes == "beam-end":
        # Straight along the beam whatever the temperature, but for 4e-7 at 1 V (the 3D model's number).
        return plate, steady_rise(plate.model, plate.inverse)
    plate = plate.carrying(*current_through_pads(plate))
    rise = steady_rise(plate.model, plate.inverse)
    for _ in range(30 if plate.model.coefficient else 0):
        plate = plate.carrying(*current_through_pads(plate, rise))
        before, rise = rise, steady_rise(plate.model, plate.inverse)
        # Each step gains far more than this change.
        if np.abs(rise - before).max() <= 1e-6 * np.abs(rise).max():
            break
    return plate, rise


def steady_rise(model: FewStates, inverse: Any) -> np.ndarray:
    """From the fields G^-1 s, (G^-1 S) G^-1 s ... in whose span it is, as many as change it; ``inverse`` are the
    factors of G."""
    rise = np.zeros(model.states)
    fields = added(np.empty((model.states, 0)), inverse.solve(model.source), model)
    while fields is not None:
        before, small = rise, model.on(fields)
        squared = steady_state(small.in_modes())[1] ** 2
        heating = np.eye(small.states) - model.coefficient * squared * small.feedback
        rise = fields @ np.linalg.solve(heating, squared * small.source)
        if np.abs(rise - before).max() <= 1e-9 * np.abs(rise).max() or not model.coefficient:
            break
        fields = added(fields, inverse.solve(model.feedback @ fields[:, -1]), model)
    return rise


def projected(model: FewStates, inverse: Any, steady: np.ndarray, count: int) -> FewStates:
    """The model on a ``steady`` field (n,) and moments, with some states; ``inverse`` are the factors of G."""
    return model.on(moment_fields(model, inverse.solve(model.source), steady, count)).in_modes()


def moment_fields(model: FewStates, cold: np.ndarray, steady: np.ndarray, count: int) -> np.ndarray:
    """(n, count): a steady field, then the moments at the rate p; ``cold`` is the steady response of the cold sink."""
    from scipy.sparse import csc_matrix

    fields = added(np.empty((model.states, 0)), steady, model)
    if fields is None or count == 1:
        return np.empty((model.states, 0)) if fields is None else fields
    slowest = float(cold @ (model.conductance @ cold)) / float(cold @ (model.capacity @ cold))
    rate = math.sqrt(slowest / FIRST_TIME)
    solve, heat = factorize(csc_matrix(model.conductance + rate * model.capacity)).solve, model.source
    while fields.shape[1] < count and (more := added(fields, solve(heat), model)) is not None:
        fields, heat = more, model.capacity @ more[:, -1]
    return fields
