"""Where a solution is under-resolved, weighted by what it means for each quantity.

Along each axis, in each cell, the derivative of the solution is a polynomial; the energy in its highest Legendre
coefficient is what the next lower degree would miss, and a geometric tail estimates what this degree misses (Mavriplis
1994; Houston and Suli 2005). The error of a quantity is the energy product of the error of the solution and that of
the quantity's dual solution (Becker and Rannacher, Acta Numerica 10, 2001); cell by cell it is at most the root of the
product of the two energies.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fem3d import tensor
from fem3d.steady import SteadyState
from meshes.axis import reference
from meshes.bricks import Block, BrickMesh
from meshes.grading import Features, at_planes

SMALLEST_RATIO, UNKNOWN_RATIO, LARGEST_RATIO = 0.05, 0.3, 0.8

Cells = list[tuple[int, int, np.ndarray, np.ndarray]]  # axis, interval, (top, missing) energies of the cells across


@dataclass(frozen=True)
class Indicators:
    """Per axis, per interval, the estimated relative error that it causes in a quantity: ``missing``, and ``highest``
    what a degree lower by one would cause."""

    highest: tuple[np.ndarray, np.ndarray, np.ndarray]
    missing: tuple[np.ndarray, np.ndarray, np.ndarray]

    @property
    def remaining(self) -> float:
        """The estimated relative error in all."""
        return float(sum(m.sum() for m in self.missing))

    @property
    def in_plane(self) -> float:
        """The estimated relative error from x and y alone."""
        return float(self.missing[0].sum() + self.missing[1].sum())


def of_goals(
    state: SteadyState, rises: Sequence[np.ndarray], functionals: Sequence[np.ndarray], features: Features
) -> list[Indicators]:
    """For each functional (free nodes,) of the rise, where its relative error comes from.

    ``rises`` are temperature fields (free nodes) that must be resolved, the steady one first; values of the functional
    on the first are the unit. Each solves one dual problem with the factorization at hand.
    """
    heat = state.heat
    blocks = heat.mesh.blocks
    k = [heat.mesh.boxes[b.box].material.thermal_conductivity for b in blocks]

    near = [at_planes(axis, list(found)) for axis, found in zip(heat.mesh.axes, features.exponents, strict=True)]

    def cells(field: np.ndarray) -> Cells:
        return _cells(heat.mesh, blocks, [heat.on_block(b, field) for b in blocks], k, near)

    solutions = [cells(rise) for rise in rises]
    electric = _electric(state, near)
    found = []
    for functional in functionals:
        dual = cells(heat.solve_steady(functional))
        value = abs(float(functional @ rises[0])) or 1.0
        sums = [_product(heat.mesh, solution, dual, value) for solution in solutions]
        highest = [np.max([s[0][d] for s in sums], axis=0) + electric[0][d] for d in range(3)]
        missing = [np.max([s[1][d] for s in sums], axis=0) + electric[1][d] for d in range(3)]
        found.append(Indicators(tuple(highest), tuple(missing)))  # type: ignore[arg-type]
    return found


def _electric(state: SteadyState, near: list[list[bool]]) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """The potential is its own dual: its relative energy error is that of the power, and so of every rise."""
    mesh, c = state.heat.mesh, state.conductor
    if c is None or state.potential is None:
        return [np.zeros(len(a.degrees)) for a in mesh.axes], [np.zeros(len(a.degrees)) for a in mesh.axes]
    sigma = [1 / (c.material(b).resistivity or 1.0) for b in c.blocks]
    cells = _cells(mesh, c.blocks, [state.potential[n] for n in c.local], sigma, near)
    total = sum(
        s * float((tensor.weights(p) * (g * g).sum(axis=0)).sum())
        for s, p, g in zip(sigma, c.parts, c.gradient(state.potential), strict=True)
    )
    return _product(mesh, cells, cells, total)


def _product(mesh: BrickMesh, u: Cells, z: Cells, unit: float) -> tuple[list[np.ndarray], list[np.ndarray]]:
    highest, missing = ([np.zeros(len(a.degrees)) for a in mesh.axes] for _ in range(2))
    for (d, i, u_top, u_missing), (_, _, z_top, z_missing) in zip(u, z, strict=True):
        highest[d][i] += np.sqrt(u_top * z_top).sum() / unit
        missing[d][i] += np.sqrt(u_missing * z_missing).sum() / unit
    return highest, missing


def _cells(
    mesh: BrickMesh,
    blocks: tuple[Block, ...],
    nodal: list[np.ndarray],
    coefficients: list[float],
    near: list[list[bool]],
) -> Cells:
    """For each block, axis and interval: the energies of its cells in the highest mode, and beyond it.

    At a singular plane the modes decay algebraically, like degree^-3 or so, and so does the tail.
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
                singular = near[d][part.first + i] or near[d][part.first + i + 1]
                found.append((d, part.first + i, top, top * (degree / 3 if singular else ratio / (1 - ratio))))
    return found
