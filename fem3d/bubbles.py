"""What the next degrees would add where a probe reads, along one axis at a time.

A solution that is symmetric in an interval, as between the ends of a heated arm, is the same for a degree and the next
lower one, so that neither their difference nor the highest mode of the solution says anything of the next even degree.
The heat does: tested with the functions b_m(s) of degree m above the interval's own p that vanish at both its ends,
constant across the slab of the solid that the interval cuts out, it gives what they would add,

    b_m(s) R_m / A_m,    R_m = integral of q b_m,    A_m = integral of k b_m'^2,    m = p + 1, p + 2.

With b_m' = P_(m-1), Legendre's polynomials, the solution itself has no part in R_m, and of the heat along s only the
coefficient of P_(m-2) has (hierarchic bases: Szabo and Babuska, Finite Element Analysis, 1991, section 6.1).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre

from fem3d import tensor
from fem3d.conduction import Field, combined
from fem3d.conductor import Conductor
from fem3d.heat import coefficient
from fem3d.operators import HeatProblem
from fem3d.outputs import reads_mean
from fem3d.steady import SteadyState
from fem3d.study import Study
from fem3d.transient import Transient
from meshes import connected
from meshes.bricks import VOID, Block
from scenes.model import Probe

NEXT = (1, 2)  # degrees above the interval's own: one of either parity


@dataclass(frozen=True, eq=False)
class Instant:
    """What heats and cools: the Joule heat at the points of each block of the conductor (W/m3), the rise (all nodes),
    its rate (K/s; none when steady), and the inputs (channels,)."""

    heating: Field
    rise: np.ndarray
    rate: np.ndarray | None
    inputs: np.ndarray

    @staticmethod
    def steady(state: SteadyState) -> Instant:
        """That of a steady state."""
        c = state.conductor
        heating = [] if c is None else c.heating(state.density, state.density, state.rise)
        return Instant(heating, state.rise, None, np.ones(1))

    @staticmethod
    def of(transient: Transient, times: np.ndarray) -> list[Instant]:
        """Those of a transient at some times (s)."""
        base, reduced = transient.base, transient.reduced
        heat, conductor, drive = base.heat, base.conductor, base.heat.inputs
        g, changing = drive.at(times), drive.rates(times)
        a, sources = transient.trajectory(times)
        rises = transient.rises(times)
        rates = heat.whole((sources - a * transient.trajectory.rates) @ reduced.basis.T) + changing @ heat.lifts
        found = []
        for i, c in enumerate(reduced.currents(a, g) if base.patterns else [None] * len(times)):
            density = None if c is None else combined(base.patterns, c)
            heating = [] if conductor is None or density is None else conductor.heating(density, density, rises[i])
            found.append(Instant(heating, rises[i], rates[i], g[i]))
        return found


def at_goals(
    study: Study, heat: HeatProblem, conductor: Conductor | None, instants: Sequence[Instant]
) -> dict[str, list[tuple[int, int, float]]]:
    """For each goal that is a mean temperature what `missing` finds, at the instant where that is most."""
    probes, found = {p.name: p for p in study.part.scene.probes}, {}
    for name, probe in study.goals.items():
        if reads_mean(probes[probe]):
            each = [list(missing(heat, conductor, instant, probes[probe])) for instant in instants]
            found[name] = max(each, key=lambda where: sum(kelvin for _, _, kelvin in where))
    return found


def missing(
    heat: HeatProblem, conductor: Conductor | None, instant: Instant, probe: Probe
) -> Iterator[tuple[int, int, float]]:
    """(axis, interval, K) where the mean temperature over a probe would change by the next degrees."""
    for d, axis in enumerate(heat.mesh.axes):
        low, high = probe.lower[d], probe.upper[d]
        for i, (a, b) in enumerate(zip(axis.breaks[:-1], axis.breaks[1:], strict=True)):
            if high <= a or low >= b or (low <= a and high >= b):
                continue  # at a breakpoint they vanish, and over a whole interval their mean does
            start, stop = max(low, a), min(high, b)
            share = (stop - start) / (high - low) if high > low else 1.0
            for cells in _slabs(heat, d, i, probe):
                line = _line(heat, conductor, instant, d, i, cells)
                places = (start + stop) / 2 + (stop - start) / 2 * legendre.leggauss(12)[0]
                mean = legendre.leggauss(12)[1] / 2
                found = 0.0
                for m in (int(axis.degrees[i]) + n for n in NEXT):
                    xi = 2 * (places - a) / (b - a) - 1
                    values = (legendre.Legendre.basis(m)(xi) - legendre.Legendre.basis(m - 2)(xi)) / (2 * m - 1)
                    found += abs(float(mean @ values) * line[m - 2]) * (b - a) ** 2 / (4 * (2 * m - 3))
                yield d, i, share * found


def _slabs(heat: HeatProblem, d: int, i: int, probe: Probe) -> Iterator[np.ndarray]:
    """The connected pieces (cells across) of the slab of an interval that a probe reaches, but those that are held at a
    temperature inside of it."""
    mesh = heat.mesh
    others = [e for e in range(3) if e != d]
    window = tuple(
        slice(
            max(int(np.searchsorted(mesh.axes[e].breaks, probe.lower[e], "left")) - 1, 0),
            max(int(np.searchsorted(mesh.axes[e].breaks, probe.upper[e], "right")), 1),
        )
        for e in others
    )
    inside = mesh.axes[d].offsets[i] + np.arange(1, mesh.axes[d].degrees[i])
    held = (heat.number >= heat.free).reshape(mesh.shape).take(inside, d).any(axis=d)
    for cells in connected.pieces(mesh.owner.take(i, d) != VOID):
        if cells[window].any() and not held[_nodes(heat, others, cells)].any():
            yield cells


def _nodes(heat: HeatProblem, others: list[int], cells: np.ndarray) -> np.ndarray:
    """(nodes across,): which nodes some cells have, along the two other axes."""
    found = np.zeros([heat.mesh.axes[e].size for e in others], dtype=bool)
    offsets = [heat.mesh.axes[e].offsets for e in others]
    for j, k in np.argwhere(cells):
        found[offsets[0][j] : offsets[0][j + 1] + 1, offsets[1][k] : offsets[1][k + 1] + 1] = True
    return found


def _line(
    heat: HeatProblem, conductor: Conductor | None, instant: Instant, d: int, i: int, cells: np.ndarray
) -> np.ndarray:
    """(degree + 1,): Legendre coefficients along an interval of the heat in a piece of a slab, over the conductance of
    its section (K/m2)."""
    mesh, others = heat.mesh, [e for e in range(3) if e != d]
    points = int(mesh.axes[d].degrees[i]) + 1
    xi, weights = legendre.leggauss(points)
    per_length, conductance = np.zeros(points), 0.0  # W/m, W m/K

    def across(parts: tensor.Parts, values: np.ndarray) -> np.ndarray:
        """(points,): the integral over the section of values at the points of a block."""
        first = parts[d].point_offsets[i - parts[d].first]
        along = np.moveaxis(values, d, -1)[..., first : first + points]
        found: np.ndarray = np.einsum("i,j,ijk->k", *(parts[e].weights for e in others), along)
        return found

    for block in mesh.blocks:
        if _within(block, d, i, others, cells):
            parts, box = mesh.parts(block), mesh.boxes[block.box]
            area = float(np.prod([parts[e].weights.sum() for e in others]))
            conductance += box.material.thermal_conductivity * area
            per_length += area * float(instant.inputs @ heat.inputs.split(box.heat_source))
            if instant.rate is not None:
                stored = box.material.heat_capacity * tensor.values(parts, heat.on_block(block, instant.rate))
                per_length -= across(parts, stored)
    if conductor is not None:
        for block, parts, q in zip(conductor.blocks, conductor.parts, instant.heating, strict=True):
            if _within(block, d, i, others, cells):
                per_length += across(parts, q)
    for b in heat.scene.boundaries:
        if b.kind != "convection":
            continue
        ambient = float(instant.inputs @ heat.inputs.split(b.ambient)) - heat.scene.initial_temperature
        for face in mesh.faces(b.lower, b.upper, exposed=True):
            if _within(face, d, i, others, cells):
                parts = mesh.parts(face)
                u = tensor.values(parts, heat.on_block(face, instant.rise))
                per_length += across(parts, coefficient(b.value) * (ambient - u))
    to_legendre = legendre.legvander(xi, points - 1).T * weights * (np.arange(points)[:, None] + 0.5)
    found: np.ndarray = to_legendre @ per_length / conductance
    return found


def _within(block: Block, d: int, i: int, others: list[int], cells: np.ndarray) -> bool:
    """Whether a block, or a face beside one, has a part in an interval of an axis and in a piece of its slab."""
    if not block.spans[d][0] <= i < block.spans[d][1]:
        return False
    window = tuple(slice(max(a - (a == b), 0), b + (a == b)) for a, b in (block.spans[e] for e in others))
    return bool(cells[window].any())
