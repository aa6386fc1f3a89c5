"""The plate: the heat equation of the silicon layer, averaged over its thickness.

Integrating rho c dT/dt = div(k grad T) + q over z, with no heat through the top (or h_air T there) and h T through
the foot where there is oxide (h_gas T where there is gas), gives for the mean rise T(x, y, t) over the thickness t

    t rho c dT/dt + c_ox dT/dt = div([k t + k_ox] grad T) - h T - h_air T - h_gas T + q t,

    1/h = t_o/k_o + t/(3 k)       oxide in series with the silicon's own thickness (``film``),
    c_ox = t_o rho_o c_o / 3      a third of the oxide's capacity, and
    k_ox = t_o k_o / 3            a third of its conductance along the layer,

the last two by Galerkin's method with a rise that falls linearly to zero through the oxide (the integral of its square
is a third; ``stored`` has it with contacts at the oxide's faces). The neglected terms are of second order in the Biot
number h t / k; ``anchor.thin_plate_remainder`` computes it. A quarter is solved, between the two mirror planes; all
integrals here are of the whole sink.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from reduced1d.equations import plate_resistance, room_resistivity
from reduced1d.ladder.few_states import FewStates
from scenes.sink import Sink

if TYPE_CHECKING:
    import skfem
    from scipy.sparse import csc_matrix

COPIES = 4.0  # The plate is a quarter of the sink.


class Grading(NamedTuple):
    """How fine a mesh is: the first cell at the corner of beam and pad, and that at the oxide's outline, as parts of
    the narrowest size there; the largest ratio of neighbouring cells, in general and, where they are longer than the
    outline's, above the oxide; the longest cell, as a part of half the beam."""

    corner: float
    outline: float
    ratio: float
    above: float
    longest: float


FINE = Grading(0.0005, 0.25, 2.0, 1.4, 0.1)
COARSE = Grading(0.003, 0.5, 2.8, 2.0, 0.15)
"""Two meshes whose answers differ by more than the error of the finer one."""


class Quarter(NamedTuple):
    """A mesh (m) of x >= 0, y <= length / 2, and which of its elements are ``beam``, ``pad`` and, of these, above
    ``oxide`` (booleans, one per element)."""

    mesh: skfem.MeshQuad
    beam: np.ndarray
    pad: np.ndarray
    oxide: np.ndarray


class Heat(NamedTuple):
    """The heat of 1 A in a part of the cold sink: in all the ``resistance`` (ohm), the ``source`` (n,) for each basis
    function, and the ``feedback`` (n, n) for each two."""

    resistance: float
    source: np.ndarray
    feedback: csc_matrix


@dataclass(frozen=True, eq=False)
class Plate:
    """The ``model`` on all basis functions, with the parts of its capacity ``in_pads`` and ``in_oxide`` (J/K) and the
    heat of the current in the ``pads``, where they are part of the circuit; the factorized conductance: a steady rise
    is ``inverse.solve(heat)``."""

    sink: Sink
    quarter: Quarter
    basis: skfem.Basis
    model: FewStates
    in_pads: csc_matrix
    in_oxide: csc_matrix
    inverse: Any
    pads: Heat | None = None

    @property
    def unknowns(self) -> int:
        return self.model.states

    def carrying(self, beam: Heat, pads: Heat) -> Plate:
        whole = Heat(*(of_beam + of_pads for of_beam, of_pads in zip(beam, pads, strict=True)))
        model = replace(
            self.model, resistance=whole.resistance, source=whole.source, feedback=whole.feedback.tocsc(),
            resistance_beam=beam.resistance, source_beam=beam.source,
        )  # fmt: skip
        return replace(self, model=model, pads=pads)


def factorize(matrix: csc_matrix) -> Any:
    from scipy.sparse.linalg import splu

    return splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})


def film(sink: Sink) -> float:
    """The oxide as a film coefficient (W/(m2 K)) under the silicon's mean temperature: 1/h = t_o/k_o + t/(3 k), with
    the contacts at its faces and the substrate below.

    The oxide's own resistance, and the silicon's over its thickness: with heat taken off below and none above, the
    temperature is a parabola across the layer, whose mean is q t / (3 k) above its foot.
    """
    silicon = sink.thickness / (3 * sink.silicon.thermal_conductivity)
    return 1 / (sink.oxide_thickness / sink.oxide.thermal_conductivity + sink.contacts + silicon + below(sink))


def stored(sink: Sink) -> float:
    """The mean square of the rise in the oxide, over the square of the rise above: a third where it falls linearly
    to zero, (a^2 + a b + b^2)/3 where contacts leave a and b of it at its upper and its lower face."""
    oxide = sink.oxide_thickness / sink.oxide.thermal_conductivity
    b = sink.contacts / 2 / (oxide + sink.contacts)
    a = 1 - b
    return (a**2 + a * b + b**2) / 3


def below(sink: Sink) -> float:
    """The resistance (m2 K/W) of the substrate under an oxide block through which heat flows evenly, as through the
    other: its spreading resistance and the other's share, times the block's area. Its heat capacity is left out."""
    if sink.substrate_thickness is None:
        return 0.0
    middle = sink.length / 2 + sink.anchor_distance + sink.oxide_length / 2
    places = [(sink.substrate_length / 2 + side * middle, sink.substrate_width / 2) for side in (-1, 1)]
    plate = sink.substrate_length, sink.substrate_width, sink.substrate_thickness
    block, k = (sink.oxide_length, sink.oxide_width), sink.substrate.thermal_conductivity
    return math.prod(block) * sum(plate_resistance(plate, block, places[0], k, other) for other in places)


def gap_film(sink: Sink) -> float:
    """The gas in the gap as a film coefficient (W/(m2 K)), in series with the substrate's spreading resistance below
    the whole beam, where there is a substrate."""
    if not sink.gap_gas_conductivity or sink.substrate_thickness is None:
        return sink.gap_coefficient
    plate, beam = (sink.substrate_length, sink.substrate_width), (sink.length, sink.width)
    middle = plate[0] / 2, plate[1] / 2
    spreading = plate_resistance((*plate, sink.substrate_thickness), beam, middle, sink.substrate.thermal_conductivity)
    return 1 / (1 / sink.gap_coefficient + math.prod(beam) * spreading)


def assemble(sink: Sink, grading: Grading) -> Plate:
    """The plate of a sink on a mesh of biquadratic quadrilaterals, with the current of the cold sink between electrodes
    at the beam's ends: straight, and so heating each place by its resistivity.

    Raises ValueError where the silicon does not conduct.
    """
    from skfem import Basis, BilinearForm, ElementQuad2, LinearForm
    from skfem.helpers import dot, grad

    part = quarter(sink, grading)
    basis = Basis(part.mesh, ElementQuad2(), intorder=4)
    beam, pads, above = (basis.with_elements(np.flatnonzero(mask)) for mask in part[1:])
    silicon, oxide, t = sink.silicon, sink.oxide, sink.thickness
    h_air, h_gas, third = sink.convection_coefficient, gap_film(sink), sink.oxide_thickness * stored(sink)
    stiffness = BilinearForm(lambda u, v, w: dot(grad(u), grad(v)))
    mass = BilinearForm(lambda u, v, w: u * v)
    integral = LinearForm(lambda v, w: v)

    mass_beam, mass_pads, mass_above = (COPIES * mass.assemble(b) for b in (beam, pads, above))
    conductance = (
        COPIES * (silicon.thermal_conductivity * t * stiffness.assemble(basis))
        + COPIES * (oxide.thermal_conductivity * third * stiffness.assemble(above))
        + film(sink) * mass_above + h_air * (mass_beam + mass_pads) + h_gas * (mass_beam + mass_pads - mass_above)
    ).tocsc()  # fmt: skip
    in_pads, in_oxide = silicon.heat_capacity * t * mass_pads, oxide.heat_capacity * third * mass_above
    over_beam = integral.assemble(beam)
    nodes, lengths = along(basis, _beam_end(sink, part))
    end = np.zeros(basis.N)
    np.add.at(end, nodes, np.array([1, 4, 1])[:, None] / 6 * lengths)  # Simpson's rule, exact for the quadratic
    x, y = basis.doflocs
    outputs = {
        "peak": np.eye(1, basis.N, int(np.argmin(x + sink.length / 2 - y)))[0],
        "end": end / end.sum(),
        "mean": over_beam / over_beam.sum(),
        "air": COPIES * h_air * (over_beam + integral.assemble(pads)),
        "air_beam": COPIES * h_air * over_beam,
        "gas_beam": COPIES * h_gas * over_beam,
    }
    resistivity, a = room_resistivity(silicon, sink.room_temperature)
    heat = resistivity / (sink.width**2 * t)
    source = COPIES * heat * over_beam
    model = FewStates(
        (silicon.heat_capacity * t * mass_beam + in_pads + in_oxide).tocsc(), conductance, source,
        (heat * mass_beam).tocsc(), float(source.sum()), source, float(source.sum()), outputs, a, sink.drive,
    )  # fmt: skip
    return Plate(sink, part, basis, model, in_pads, in_oxide, factorize(conductance))


def along(basis: skfem.Basis, facets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The unknowns (3, facets) at the start, middle and end of some facets, and the facets' lengths (m).

    Integrals along facets are sums over these: the library's own map there from outside fails for cells that are small
    against their distance from the origin.
    """
    first, second = basis.mesh.facets[:, facets]
    lengths = np.abs(basis.mesh.p[:, first] - basis.mesh.p[:, second]).sum(axis=0)
    return np.array([basis.nodal_dofs[0, first], basis.facet_dofs[0, facets], basis.nodal_dofs[0, second]]), lengths


def _beam_end(sink: Sink, part: Quarter) -> np.ndarray:
    """The facets of the beam's end cross section: between beam and pad, and where the beam is wider, its own."""
    mesh = part.mesh
    first, second = mesh.f2t
    of_beam = part.beam[first] | ((second >= 0) & part.beam[second])
    low = mesh.p[1][mesh.facets].max(axis=0)
    return np.flatnonzero(of_beam & (low < np.diff(np.unique(mesh.p[1])).min() / 2))


def current_through_pads(plate: Plate, rise: np.ndarray | None = None) -> tuple[Heat, Heat]:
    """Heat of the current between the pads' outer faces in beam and pads, at a rise (n,), ``None`` for none.

    With the sheet current density (A/m) written as j = (dpsi/dy, -dpsi/dx) it is free of sources whatever psi is. Of
    all such currents of a given total, the current of least heat flows (Thomson's principle):

        div(rho_e / t grad psi) = 0,   psi = 0 on the mirror x = 0,   psi = I/2 on the insulated sides,

    and the natural condition, no current along the boundary, holds on the electrodes and on the mirror y = L/2. The
    resistivity enters linearly, and a psi that is off by e gives a resistance that is too large by e^2. The heat is
    that of the cold resistivity, as in `Heat`, in the pattern of the hot current.
    """
    from skfem import BilinearForm, LinearForm
    from skfem.helpers import dot, grad

    sink, basis = plate.sink, plate.basis
    resistivity, a = room_resistivity(sink.silicon, sink.room_temperature)
    hot: Any = 1.0 if rise is None else 1.0 + a * np.asarray(basis.interpolate(rise))
    matrix = BilinearForm(lambda u, v, w: w["hot"] * dot(grad(u), grad(v))).assemble(basis, hot=hot).tocsc()
    psi, free = _sides(plate)
    psi[free] = factorize(matrix[free][:, free]).solve(-(matrix @ psi)[free])
    slope = grad(basis.interpolate(psi))
    # The density of a 1 A current's heat per area of the layer.
    density = resistivity / sink.thickness * dot(slope, slope)
    source = LinearForm(lambda v, w: w["heat"] * v)
    feedback = BilinearForm(lambda u, v, w: w["heat"] * u * v)

    def heat(where: np.ndarray) -> Heat:
        elements = np.flatnonzero(where)
        part = basis.with_elements(elements)
        vector = COPIES * source.assemble(part, heat=density[elements])
        matrix = COPIES * feedback.assemble(part, heat=density[elements]).tocsc()
        return Heat(float(vector.sum()), vector, matrix)

    return heat(plate.quarter.beam), heat(plate.quarter.pad)


def _sides(plate: Plate) -> tuple[np.ndarray, np.ndarray]:
    """psi (n,) with its values on the insulated sides and zero elsewhere, and the numbers of its free entries."""
    sink, basis, mesh = plate.sink, plate.basis, plate.basis.mesh
    small = [np.diff(np.unique(each)).min() / 2 for each in mesh.p]
    outer = mesh.boundary_facets()
    x, y = mesh.p[:, mesh.facets[:, outer]].mean(axis=1)
    mirror, open_ends = x < small[0], (y > sink.length / 2 - small[1]) | (y < small[1] - sink.pad_length)
    psi = np.zeros(basis.N)
    sides = basis.get_dofs(outer[~(mirror | open_ends)]).all()
    psi[sides] = 0.5
    held = np.union1d(sides, basis.get_dofs(outer[mirror]).all())
    return psi, np.setdiff1d(np.arange(basis.N), held)


def quarter(sink: Sink, grading: Grading) -> Quarter:
    """The mesh of a sink, graded towards where the plate's solution bends.

    Only the corner where the beam meets a pad of another width is singular (exponent 2/3), and there cells shrink
    geometrically. Across the oxide's outline the field has a kink in its second derivative, and decays within the
    healing length sqrt(k t / h): cells there are a part of it.
    """
    from skfem import MeshQuad

    w, pad, oxide = sink.width / 2, sink.pad_width / 2, sink.oxide_width / 2
    near, far, length = sink.anchor_distance, sink.anchor_distance + sink.oxide_length, sink.pad_length
    narrow = min(w, pad)
    healing = math.sqrt(sink.silicon.thermal_conductivity * sink.thickness / film(sink))
    outline = grading.outline * min(healing, oxide, sink.oxide_length / 2)
    corner = grading.corner * narrow
    # Planes closer than a thousandth of the narrowest size are merged.
    small = 1e-3 * min(narrow, sink.oxide_length / 2, oxide)

    x = _lines(
        [(0.0, None), (narrow, corner), (max(w, pad), None), (oxide, outline)], small,
        lambda at: (grading.above if at < oxide else grading.ratio, math.inf),
    )  # fmt: skip
    y = _lines(
        # The beam itself is no sliver, however short.
        [(-length, None), (-far, outline), (-near, outline), (0.0, corner), (sink.length / 2, None)],
        min(small, sink.length / 4),
        # Cells beside the beam of a pad that is longer need not be as short as the beam's own.
        lambda at: (
            grading.above if -far < at < -near else grading.ratio,
            grading.longest * max(sink.length / 2, length if at < 0 else 0.0),
        ),
    )  # fmt: skip
    mesh = MeshQuad.init_tensor(x, y)
    cx, cy = mesh.p[:, mesh.t].mean(axis=1)
    mesh = mesh.restrict(np.flatnonzero(((cy > 0) & (cx < w)) | ((cy < 0) & (cx < pad))))
    cx, cy = mesh.p[:, mesh.t].mean(axis=1)
    return Quarter(mesh, cy > 0, cy < 0, (cx < oxide) & (cy < -near) & (cy > -far))


def _lines(
    planes: list[tuple[float, float | None]], small: float, limits: Callable[[float], tuple[float, float]]
) -> np.ndarray:
    """Coordinates through the planes, the cells at each no longer than its value (``None``: as long as others let) and
    growing from there by the ratio, up to the longest, that ``limits`` has for the middle between two planes."""
    merged: list[tuple[float, float]] = []
    for at, first in sorted((at, math.inf if first is None else first) for at, first in planes):
        if merged and at - merged[-1][0] < small:
            merged[-1] = merged[-1][0], min(merged[-1][1], first)
        else:
            merged.append((at, first))
    near = np.geomspace(1e-6, 0.5, 150)
    places = np.concatenate([[0.0], near, 1 - near[-2::-1], [1.0]])
    coordinates = [np.array([merged[0][0]])]
    for (a, _), (b, _) in pairwise(merged):
        (ratio, longest), x = limits((a + b) / 2), a + (b - a) * places
        sizes = [np.maximum(first, math.log(ratio) * np.abs(x - at)) for at, first in merged]
        density = 1 / np.minimum(longest, np.min(sizes, axis=0))
        cells = np.concatenate([[0.0], np.cumsum(np.diff(x) * (density[1:] + density[:-1]) / 2)])
        count = max(math.ceil(cells[-1]), 1)
        coordinates.append(np.interp(cells[-1] * np.arange(1, count + 1) / count, cells, x))
    return np.concatenate(coordinates)
