"""An anchor, pad and oxide, as a boundary condition of the beam: a resistance, a capacity, and the heat of the circuit
in it; and warnings where this or the plate is not accurate.

Let theta be the steady rise when heat flows into the anchor through the beam's end, per watt through each end. Its mean
over the end is the anchor resistance R. For slow changes the anchor's rise is the end's times theta / R, and with that
shape (Galerkin) it is one node with the capacity

    C = integral of rho c (theta / R)^2,

which is also the capacity in Z(p) = R - p R^2 C + ... , the anchor's impedance at small rates p. A heat density q in
the pad counts by its effect on the end, as the integral of q theta / R (reciprocity).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from reduced1d.equations import resistance, room_resistivity
from reduced1d.ladder.plate import COPIES, Plate, along, film, stored
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
    return COPIES / 2 * (at_edge + in_oxide) / float(plate.model.outputs["end"] @ theta)


def one_node_remainder(plate: Plate) -> float:
    """How far the end of a fin on one-node anchors may be off on the way to the steady state, relative (-).

    Of the impedance Z(p) = m0 - m1 p + m2 p^2 ... one node has m2 = m1^2/m0. The error delta = m2 m0/m1^2 - 1
    matters as much as the anchor's time constant m1/m0 is not short against the sink's slowest: their product is
    returned, which is seldom exceeded, and often far above the error.
    """
    inside, model = plate.in_pads + plate.in_oxide, plate.model
    fields = [plate.inverse.solve(model.outputs["mean"])]
    for _ in range(2):
        fields.append(plate.inverse.solve(inside @ fields[-1]))
    m0, m1, m2 = (float(model.outputs["end"] @ field) for field in fields)
    first = fields[0]
    slowest = float(first @ (model.conductance @ first)) / float(first @ (model.capacity @ first))
    return (m2 * m0 / m1**2 - 1) * m1 / m0 * slowest


def _per_watt(plate: Plate) -> np.ndarray:
    """theta (n,) from a uniform heat in the beam: how the heat gets to the end does not matter there."""
    field: np.ndarray = plate.inverse.solve(plate.model.outputs["mean"])
    return field / ((1 - float((plate.model.outputs["air_beam"] + plate.model.outputs["gas_beam"]) @ field)) / 2)


def oxide_time(sink: Sink) -> float:
    """The oxide's slowest time constant (s), its top held: (2 t_o / pi)^2 over its diffusivity."""
    return (2 * sink.oxide_thickness / math.pi) ** 2 * sink.oxide.heat_capacity / sink.oxide.thermal_conductivity


def warnings(sink: Sink, remainder: float) -> list[str]:
    """Write a sentence for each assumption of the plate that a sink breaks; ``remainder`` is the neglected part."""
    sentences = []
    if remainder > 1e-3:
        sentences.append(
            f"the thin-plate assumption ends here: with silicon of {sink.thickness * 1e6:.3g} um on oxide of "
            f"{sink.oxide_thickness * 1e6:.3g} um, what the plate neglects may be {100 * remainder:.2g} % of the "
            "anchor resistance"
        )
    if oxide_time(sink) > FIRST_TIME:
        sentences.append(
            f"the oxide takes {oxide_time(sink) * 1e6:.3g} us to warm through, more than the "
            f"{FIRST_TIME * 1e6:.0f} us from which on traces are compared: the plate's third of its capacity is right "
            "only for slower changes"
        )
    return sentences


def fin_warnings(sink: Sink, one_node: float) -> list[str]:
    """A sentence for each assumption of the fin that a sink breaks; ``one_node`` estimates the error of its anchors."""
    sentences = []
    if one_node > 0.05:
        sentences.append(
            f"the anchors are too slow for one node each: on the way to the steady state the fin's ends may be off by "
            f"{100 * one_node:.2g} % (plate and moments are not)"
        )
    if sink.length < 2 * sink.width:
        sentences.append(
            f"a beam {sink.width * 1e6:.3g} um wide and {sink.length * 1e6:.3g} um long is not slender: its rise is "
            "not uniform across (plate and moments know that)"
        )
    return sentences
