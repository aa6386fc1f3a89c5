"""The plate: the heat equation of the silicon layer, averaged over its thickness.

Integrating rho c dT/dt = div(k grad T) + q over z, with no heat through the top (or h_air T there) and h T through
the foot where there is oxide, gives for the mean rise T(x, y, t) over the thickness t

    t rho c dT/dt + c_ox dT/dt = div([k t + k_ox] grad T) - h T - h_air T + q t,

    1/h = t_o/k_o + t/(3 k)       oxide in series with the silicon's own thickness (``quads.film``),
    c_ox = t_o rho_o c_o / 3      a third of the oxide's capacity, and
    k_ox = t_o k_o / 3            a third of its conductance along the layer,

the last two by Galerkin's method with a rise that falls linearly to zero through the oxide (the integral of its square
is a third). What is neglected is of second order in the Biot number h t / k; ``anchor.thin_plate_remainder`` computes
it. A quarter is solved, between the two mirror planes; all integrals here are of the whole sink.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from reduced1d.equations import room_resistivity
from reduced1d.ladder.quads import Grading, Quarter, film, quarter
from scenes.sink import Sink

if TYPE_CHECKING:
    import skfem
    from scipy.sparse import csc_matrix

COPIES = 4.0  # the sink in quarters


@dataclass(frozen=True, eq=False)
class Heat:
    """The heat of 1 A in a part of the cold sink: in all the ``resistance`` (ohm), the ``source`` (n,) for each basis
    function, and the ``feedback`` (n, n) for each two."""

    resistance: float
    source: np.ndarray
    feedback: csc_matrix


@dataclass(frozen=True, eq=False)
class Current:
    """The heat of a current in the beam and, where they are part of the circuit, in the pads."""

    beam: Heat
    pads: Heat | None = None

    @cached_property
    def whole(self) -> Heat:
        """In both."""
        if self.pads is None:
            return self.beam
        return Heat(
            self.beam.resistance + self.pads.resistance,
            self.beam.source + self.pads.source,
            (self.beam.feedback + self.pads.feedback).tocsc(),
        )


@dataclass(frozen=True, eq=False)
class Plate:
    """The matrices (n, n): ``conductance`` (W/K), ``capacity`` (J/K) with its parts ``in_pads`` and ``in_oxide``; the
    rows (n,) that give the rises ``peak``, ``end``, ``mean`` (K) and the heat (W) to the ``air`` and that from the beam
    alone, ``air_beam``; and the ``current``."""

    sink: Sink
    quarter: Quarter
    basis: skfem.Basis
    conductance: csc_matrix
    capacity: csc_matrix
    in_pads: csc_matrix
    in_oxide: csc_matrix
    peak: np.ndarray
    end: np.ndarray
    mean: np.ndarray
    air: np.ndarray
    air_beam: np.ndarray
    current: Current

    @property
    def unknowns(self) -> int:
        """How many basis functions there are."""
        return len(self.peak)

    @cached_property
    def inverse(self) -> Any:
        """The factorized conductance; ``inverse.solve(heat)`` is a steady rise."""
        return factorize(self.conductance)

    def carrying(self, current: Current) -> Plate:
        """The same plate with another current."""
        found = replace(self, current=current)
        found.__dict__["inverse"] = self.inverse
        return found


def factorize(matrix: csc_matrix) -> Any:
    """The sparse factors of a symmetric positive definite matrix."""
    from scipy.sparse.linalg import splu

    return splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})


def assemble(sink: Sink, grading: Grading) -> Plate:
    """The plate of a sink on a mesh of biquadratic quadrilaterals, with the current of the cold sink.

    Raises ValueError where the silicon does not conduct.
    """
    from skfem import Basis, BilinearForm, ElementQuad2, LinearForm
    from skfem.helpers import dot, grad

    part = quarter(sink, grading)
    basis = Basis(part.mesh, ElementQuad2(), intorder=4)
    beam, pads, above = (basis.with_elements(np.flatnonzero(of)) for of in (part.beam, part.pad, part.oxide))
    silicon, oxide, t = sink.silicon, sink.oxide, sink.thickness
    h, h_air, third = film(sink), sink.convection_coefficient, sink.oxide_thickness / 3
    stiffness = BilinearForm(lambda u, v, w: dot(grad(u), grad(v)))
    mass = BilinearForm(lambda u, v, w: u * v)
    integral = LinearForm(lambda v, w: v)

    mass_beam, mass_pads, mass_above = (COPIES * mass.assemble(b) for b in (beam, pads, above))
    conductance = (
        COPIES * (silicon.thermal_conductivity * t * stiffness.assemble(basis))
        + COPIES * (oxide.thermal_conductivity * third * stiffness.assemble(above))
        + h * mass_above + h_air * (mass_beam + mass_pads)
    )  # fmt: skip
    in_pads, in_oxide = silicon.heat_capacity * t * mass_pads, oxide.heat_capacity * third * mass_above
    over_beam = integral.assemble(beam)
    nodes, lengths = along(basis, _beam_end(sink, part))
    end = np.zeros(basis.N)
    np.add.at(end, nodes, np.array([1, 4, 1])[:, None] / 6 * lengths)  # Simpson's rule, exact for the quadratic
    x, y = basis.doflocs
    peak = np.zeros(basis.N)
    peak[np.argmin(x + sink.length / 2 - y)] = 1.0
    return Plate(
        sink, part, basis, conductance.tocsc(), (silicon.heat_capacity * t * mass_beam + in_pads + in_oxide).tocsc(),
        in_pads, in_oxide, peak,
        end=end / end.sum(),
        mean=over_beam / over_beam.sum(),
        air=COPIES * h_air * (over_beam + integral.assemble(pads)),
        air_beam=COPIES * h_air * over_beam,
        current=uniform_current(sink, over_beam, mass_beam),
    )  # fmt: skip


def uniform_current(sink: Sink, over_beam: np.ndarray, mass_beam: csc_matrix) -> Current:
    """The current between electrodes at the beam's ends: straight, and so heating each place by its resistivity."""
    heat = room_resistivity(sink.silicon, sink.room_temperature)[0] / (sink.width**2 * sink.thickness)
    source = COPIES * heat * over_beam
    return Current(Heat(float(source.sum()), source, (heat * mass_beam).tocsc()))


def along(basis: skfem.Basis, facets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The unknowns (3, facets) at the start, middle and end of some facets, and the facets' lengths (m).

    Integrals along facets are sums over these: the library's own map there from outside fails for cells that are small
    against their distance from the origin.
    """
    first, second = basis.mesh.facets[:, facets]
    lengths = np.abs(basis.mesh.p[:, first] - basis.mesh.p[:, second]).sum(axis=0)
    return np.array([basis.nodal_dofs[0, first], basis.facet_dofs[0, facets], basis.nodal_dofs[0, second]]), lengths


def _beam_end(sink: Sink, part: Quarter) -> np.ndarray:
    """The facets of the beam's end cross section: those between beam and pad, and where the beam is wider, its own."""
    mesh = part.mesh
    first, second = mesh.f2t
    of_beam = part.beam[first] | ((second >= 0) & part.beam[second])
    low = mesh.p[1][mesh.facets].max(axis=0)
    cell = np.diff(np.unique(mesh.p[1])).min()
    found: np.ndarray = np.flatnonzero(of_beam & (low < cell / 2))
    return found
