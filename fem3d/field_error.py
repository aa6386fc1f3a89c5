"""How well a whole temperature field is known, where nothing is read off it, and where it takes finer cells.

Probes' errors converge twice as fast as the field's, and a mesh that suits them may leave a field that swings beside a
steep decay. The field's error is what the coarser solutions of a level differ by from the finer ones, at the nodes,
relative to the largest rise; which cells cause it is told by the coefficient of the highest Legendre polynomial along
each axis.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fem3d import tensor
from fem3d.operators import HeatProblem
from fem3d.steady import SteadyState
from meshes.axis import reference

CAUSES = 0.3  # of the largest coefficient: what is refined
IN_DEPTH = 1.5  # the error in z over the difference of the solutions that differ in z, as for the probes


@dataclass(frozen=True, eq=False)
class FieldError:
    """How far a field is off at any node, over its largest rise; per axis, which intervals cause it."""

    relative: float
    marked: list[np.ndarray]


def of(fine: SteadyState, coarse: SteadyState, low: SteadyState, tall: SteadyState) -> FieldError:
    """The error of the fine steady field, from those of the lesser meshes (`fem3d.adapt.lesser_meshes`)."""
    largest = float(max(fine.rise.max(), 0.0) - min(fine.rise.min(), 0.0)) or 1.0
    off = distance(fine, coarse) + IN_DEPTH * distance(tall, low)
    return FieldError(off / largest, causes(fine.heat, fine.rise))


def distance(fine: SteadyState, coarse: SteadyState) -> float:
    """The largest distance (K) of two fields on the same cells, at the nodes of the first."""
    mesh, other = fine.heat.mesh, coarse.heat.mesh
    x, y, z = (b.interpolation(a.nodes) for a, b in zip(mesh.axes, other.axes, strict=True))
    gap = np.abs(_grid(fine) - tensor.along(x, y, z, _grid(coarse)))
    return float(gap.ravel()[mesh.solid].max())


def causes(heat: HeatProblem, rise: np.ndarray) -> list[np.ndarray]:
    """Per axis, which intervals have nearly the largest coefficient (K) of the highest polynomial along the axis in one
    of their cells."""
    mesh = heat.mesh
    found = [np.zeros(len(a.degrees)) for a in mesh.axes]
    for block in mesh.blocks:
        nodal = heat.on_block(block, rise)
        for d, (first, last) in enumerate(block.spans):
            along, axis = np.moveaxis(nodal, d, 0), mesh.axes[d]
            start = axis.offsets[first]
            for i in range(first, last):
                degree = int(axis.degrees[i])
                at = slice(axis.offsets[i] - start, axis.offsets[i + 1] - start + 1)
                top = np.tensordot(_highest(degree), along[at], 1)
                found[d][i] = max(found[d][i], float(np.abs(top).max()))
    most = max(float(f.max()) for f in found)
    return [f >= CAUSES * most for f in found]


def _grid(state: SteadyState) -> np.ndarray:
    heat = state.heat
    grid: np.ndarray = np.append(state.rise, 0.0)[heat.number].reshape(heat.mesh.shape)
    return grid


def _highest(degree: int) -> np.ndarray:
    """(nodes,): nodal values on an interval to the coefficient of the Legendre polynomial of its degree."""
    found: np.ndarray = np.linalg.inv(np.polynomial.legendre.legvander(reference(degree).nodes, degree))[-1]
    return found
