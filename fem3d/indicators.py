"""Where a solution is under-resolved, weighted by what it means for each quantity.

Along each axis, in each cell, the derivative of the solution is a polynomial; the energy in its highest Legendre
coefficient is what the next lower degree would miss, and a geometric tail estimates what this degree misses (Mavriplis
1994; Houston and Suli 2005). The error of a quantity is the energy product of the error of the solution and that of
the quantity's dual solution (Becker and Rannacher, Acta Numerica 10, 2001); cell by cell it is at most the root of the
product of the two energies.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fem3d import tensor
from fem3d.conductor import Conductor
from fem3d.operators import HeatProblem
from fem3d.outputs import Goal
from meshes.axis import Axis, reference
from meshes.bricks import Block, BrickMesh
from meshes.grading import Features, exponents_at, singular_intervals

SMALLEST_RATIO, UNKNOWN_RATIO, LARGEST_RATIO = 0.05, 0.3, 0.8
USUAL = 2 / 3  # exponent of a re-entrant corner, at which the tail of the modes was found to be a third of the degree
UNSEEN = 1.25  # power of the length of an interval over that over which its edge spreads by which it is more
WEAKER = 1.75  # power of the inverse exponent by which it is more: 1 for the modes of r^s, and what they keep of others

Cells = list[tuple[int, int, np.ndarray]]  # axis, interval, missing energies of the cells across


@dataclass(frozen=True)
class Indicators:
    """Per axis, per interval, the estimated error that it causes in a quantity, in its unit."""

    missing: tuple[np.ndarray, np.ndarray, np.ndarray]
    edges_in_z: np.ndarray  # which intervals along z are at a singular plane

    @property
    def remaining(self) -> float:
        """The estimated error in all."""
        return float(sum(m.sum() for m in self.missing))

    @property
    def but_depth(self) -> float:
        """The estimated error from x and y, and from singular edges in z, which no difference of degrees in z shows."""
        return float(self.missing[0].sum() + self.missing[1].sum() + self.missing[2][self.edges_in_z].sum())


def of_goals(
    heat: HeatProblem,
    conductor: Conductor | None,
    potentials: Sequence[np.ndarray],
    rises: Sequence[np.ndarray],
    goals: Mapping[str, Goal | None],
    scales: Mapping[str, float],
    features: Features,
) -> dict[str, Indicators]:
    """For each quantity where its error comes from, in its unit.

    A quantity is a functional of the rise, a goal, or an electric one (None). ``rises`` are temperature fields that
    must be resolved; each goal solves one dual problem with the factorization at hand. ``potentials`` (all
    nodes of the conductor) must be resolved too: a potential is its own dual, so that its relative energy error is that
    of the power, and so of what the power causes, for which ``scales`` stand.
    """
    blocks = heat.mesh.blocks
    k = [heat.mesh.boxes[b.box].material.thermal_conductivity for b in blocks]
    at_edges = [
        _at_edges(axis, *edges)
        for axis, *edges in zip(heat.mesh.axes, features.exponents, features.lengths, strict=True)
    ]

    def cells(field: np.ndarray) -> Cells:
        return _cells(heat.mesh, blocks, [heat.on_block(b, field) for b in blocks], k, at_edges)

    solutions = [cells(rise) for rise in rises] if any(goal is not None for goal in goals.values()) else []
    electric = _electric(heat, conductor, potentials, at_edges)
    in_z = singular_intervals(heat.mesh.axes[2], features.exponents[2])
    found = {}
    for name, goal in goals.items():
        sums = []
        if goal is not None:
            dual = cells(np.concatenate([heat.solve_steady(goal.row), goal.trace]))
            sums = [_product(heat.mesh, s, dual, 1.0) for s in solutions]
        x, y, z = (np.max([s[d] for s in sums] or [0.0 * e], axis=0) + scales[name] * e for d, e in enumerate(electric))
        found[name] = Indicators((x, y, z), in_z)
    return found


def _electric(
    heat: HeatProblem, conductor: Conductor | None, potentials: Sequence[np.ndarray], at_edges: list[np.ndarray]
) -> list[np.ndarray]:
    """The relative energy errors of potentials, per axis and interval."""
    mesh = heat.mesh
    none = [np.zeros(len(a.degrees)) for a in mesh.axes]
    if conductor is None or not potentials:
        return none
    sigma = [1 / conductor.law(b)[0] for b in conductor.blocks]
    sums = []
    for potential in potentials:
        cells = _cells(mesh, conductor.blocks, [potential[n] for n in conductor.local], sigma, at_edges)
        total = sum(
            s * float((tensor.weights(p) * (g * g).sum(axis=0)).sum())
            for s, p, g in zip(sigma, conductor.parts, conductor.gradient(potential), strict=True)
        )
        sums.append(_product(mesh, cells, cells, total or 1.0))
    return [np.max([s[d] for s in sums], axis=0) for d in range(3)]


def _product(mesh: BrickMesh, u: Cells, z: Cells, unit: float) -> list[np.ndarray]:
    found = [np.zeros(len(a.degrees)) for a in mesh.axes]
    for (d, i, of_u), (_, _, of_z) in zip(u, z, strict=True):
        found[d][i] += np.sqrt(of_u * of_z).sum() / unit
    return found


def _at_edges(axis: Axis, exponents: Mapping[float, float], lengths: Mapping[float, float]) -> np.ndarray:
    """(intervals,): what is beyond the highest mode over it and the degree, in intervals at singular planes; else NaN.

    At an edge of exponent s the energies of the modes decay no faster than degree^-(4 s + 1), and what is beyond one of
    them is it times the degree over 4 s or so. Of an edge that spreads over less than an interval, as that of a thin
    layer does, the modes see but a part.
    """
    near, spread = exponents_at(axis, exponents), exponents_at(axis, lengths)
    found = np.full(len(axis.degrees), np.nan)
    for i, length in enumerate(np.diff(axis.breaks)):
        s = min(near[i], near[i + 1])
        if np.isfinite(s):
            unseen = max(length / min(spread[i], spread[i + 1]), 1.0)
            found[i] = max(USUAL / s, 1.0) ** WEAKER * unseen**UNSEEN / 3
    return found


def _cells(
    mesh: BrickMesh,
    blocks: tuple[Block, ...],
    nodal: list[np.ndarray],
    coefficients: list[float],
    at_edges: list[np.ndarray],
) -> Cells:
    """For each block, axis and interval: the energies of its cells beyond the highest mode, ``at_edges`` (intervals,)
    that times the degree, elsewhere (NaN there) by what the modes decay.
    """
    found: Cells = []
    for block, u, coefficient in zip(blocks, nodal, coefficients, strict=True):
        parts = mesh.parts(block)
        slopes = tensor.gradient(parts, u)
        for d, part in enumerate(parts):
            first, second = (parts[e] for e in range(3) if e != d)
            across = first.weights[:, None] * second.weights
            along = np.moveaxis(slopes[d], d, 0)
            for i in range(part.last - part.first):
                degree = int(mesh.axes[d].degrees[part.first + i])
                at = slice(part.point_offsets[i], part.point_offsets[i + 1])
                length = part.weights[at].sum()
                modes = np.tensordot(reference(degree).modes[max(degree - 2, 0) :], along[at], 1)
                cells = np.add.reduceat(across * modes**2, first.point_offsets[:-1], axis=1)
                cells = np.add.reduceat(cells, second.point_offsets[:-1], axis=2) * (coefficient * length)
                top = cells[-1] / (2 * degree - 1)
                # The lowest mode is the mean flux, which says nothing of smoothness.
                below = cells[0] / (2 * degree - 3) if degree > 2 else top / UNKNOWN_RATIO
                ratio = np.clip((top + 1e-300) / (below + 1e-300), SMALLEST_RATIO, LARGEST_RATIO)
                edge = at_edges[d][part.first + i]
                tail = degree * edge if np.isfinite(edge) else ratio / (1 - ratio)
                found.append((d, part.first + i, top * tail))
    return found
