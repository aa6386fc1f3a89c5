"""How well a whole temperature field is known, where nothing is read off it, and a mesh that suits it better.

Probes' errors converge twice as fast as the field's, and a mesh that suits them may leave a field that swings beside a
steep decay. The field's error is what the coarser solutions of a level differ by from the finer ones, at the nodes,
relative to the largest rise; which cells cause it is told by the coefficients of the highest Legendre polynomials along
each axis, and so is whether they are better cut or given a degree more (Mavriplis 1994).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fem3d import tensor
from fem3d.steady import SteadyState
from meshes import grading
from meshes.axis import Axis, reference
from meshes.bricks import BrickMesh

CAUTION = 1.5  # the error over the differences of a level, at most, once they are small
CAUSES = 0.3  # of the largest coefficient of the highest polynomials: what is refined
SLOW = 0.4  # of the coefficients before it: a highest one above that says that more degrees are in vain


def of(fine: SteadyState, coarse: SteadyState, low: SteadyState, tall: SteadyState) -> float:
    """The error of the fine steady field at its worst node over its largest rise, from the solutions on the lesser
    meshes (`fem3d.level.lesser_meshes`)."""
    largest = float(max(fine.rise.max(), 0.0) - min(fine.rise.min(), 0.0)) or 1.0
    return CAUTION * (distance(fine, coarse) + distance(tall, low)) / largest


def distance(fine: SteadyState, coarse: SteadyState) -> float:
    """The largest distance (K) of two fields on the same cells, at the nodes of the first."""
    mesh, other = fine.heat.mesh, coarse.heat.mesh
    x, y, z = (b.interpolation(a.nodes) for a, b in zip(mesh.axes, other.axes, strict=True))
    gap = np.abs(_grid(fine) - tensor.along(x, y, z, _grid(coarse)))
    return float(gap.ravel()[mesh.solid].max())


@dataclass(frozen=True)
class _Cause:
    """Of the cells of an interval of an axis the largest highest coefficient (K), whether those before it are hardly
    larger, and whether the field is steeper at the upper end."""

    size: float = 0.0
    slow: bool = False
    above: bool = False


def refined(state: SteadyState) -> BrickMesh:
    """The mesh of a steady state with the intervals refined that cause most of its field's error: cut towards their
    steeper end where it decays within a small part of them, and with a degree more where not."""
    mesh, causes = state.heat.mesh, _causes(state)
    least = CAUSES * max(c.size for of_axis in causes for c in of_axis)
    shortest = grading.shortest_of(mesh)
    x, y, z = (_refined(axis, of_axis, least, shortest) for axis, of_axis in zip(mesh.axes, causes, strict=True))
    return BrickMesh((x, y, z), mesh.boxes)


def _refined(axis: Axis, causes: list[_Cause], least: float, shortest: float) -> Axis:
    breaks, degrees = [axis.breaks[0]], []
    for i, (degree, cause) in enumerate(zip(axis.degrees.tolist(), causes, strict=True)):
        a, b = axis.breaks[i], axis.breaks[i + 1]
        if cause.size >= least > 0 and b - a > shortest:
            if cause.slow:
                part = grading.RATIO * (b - a)
                breaks.append(b - part if cause.above else a + part)
                degrees.append(degree)
            elif degree < grading.HIGHEST_DEGREE:
                degree += 1
            else:
                breaks.append((a + b) / 2)
                degrees.append(degree)
        breaks.append(b)
        degrees.append(degree)
    return Axis(np.array(breaks), np.array(degrees))


def _causes(state: SteadyState) -> list[list[_Cause]]:
    """Per axis, for each interval."""
    heat, mesh = state.heat, state.heat.mesh
    found = [[_Cause()] * len(a.degrees) for a in mesh.axes]
    for block in mesh.blocks:
        nodal = heat.on_block(block, state.rise)
        for d, (first, last) in enumerate(block.spans):
            axis = mesh.axes[d]
            along = np.moveaxis(nodal, d, 0).reshape(nodal.shape[d], -1)
            for i in range(first, last):
                start, end = axis.offsets[[i, i + 1]] - axis.offsets[first]
                cause = _cause(int(axis.degrees[i]), along[start : end + 1])
                found[d][i] = max(found[d][i], cause, key=lambda c: c.size)
    return found


def _cause(degree: int, nodal: np.ndarray) -> _Cause:
    """Of one interval; ``nodal`` (degree + 1, lines along the axis)."""
    coefficients = np.linalg.solve(np.polynomial.legendre.legvander(reference(degree).nodes, degree), nodal)
    worst = int(np.abs(coefficients[-1]).argmax())
    line, size = np.abs(coefficients[:, worst]), float(abs(coefficients[-1, worst]))
    # The constant one says nothing of smoothness.
    slow = size > SLOW * float(line[max(degree - 2, 1) : degree].max(initial=0.0))
    numbers = np.arange(degree + 1)
    slopes = numbers * (numbers + 1) / 2 * coefficients[:, worst]
    return _Cause(size, slow, bool(abs(slopes.sum()) > abs((slopes * (-1.0) ** (numbers + 1)).sum())))


def _grid(state: SteadyState) -> np.ndarray:
    heat = state.heat
    grid: np.ndarray = np.append(state.rise, 0.0)[heat.number].reshape(heat.mesh.shape)
    return grid
