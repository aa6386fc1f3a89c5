"""Piecewise-polynomial spaces on a line: the factors of which every brick element is a product.

An axis is cut into intervals, each with a degree of its own; functions are continuous. The basis is Lagrange's on the
Gauss-Lobatto-Legendre points of each interval, so that a coefficient is the value at a node. Source: Karniadakis and
Sherwin, Spectral/hp Element Methods for Computational Fluid Dynamics, 2nd ed., section 2.3.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre


class Reference(NamedTuple):
    """The reference interval (-1, 1) at one degree: ``p + 1`` nodes and ``p + 1`` Gauss points."""

    nodes: np.ndarray
    points: np.ndarray
    weights: np.ndarray
    values: np.ndarray  # (points, nodes): the basis at the Gauss points
    slopes: np.ndarray  # (points, nodes): its derivative there
    modes: np.ndarray  # (p, points): Gauss-point values to coefficients of the Legendre polynomials below degree p


@lru_cache(maxsize=32)
def reference(degree: int) -> Reference:
    """The reference interval of a degree of at least 1."""
    extrema = legendre.legroots(legendre.legder([0.0] * degree + [1.0])).real if degree > 1 else np.empty(0)
    nodes = np.concatenate([[-1.0], np.sort(extrema), [1.0]])
    points, weights = legendre.leggauss(degree + 1)
    to_legendre = np.linalg.inv(legendre.legvander(nodes, degree))
    derivative = legendre.legder(np.eye(degree + 1))
    values = legendre.legvander(points, degree) @ to_legendre
    slopes = legendre.legvander(points, degree - 1) @ derivative @ to_legendre
    scale = np.arange(degree) + 0.5
    modes = scale[:, None] * (legendre.legvander(points, degree - 1) * weights[:, None]).T
    return Reference(nodes, points, weights, values, slopes, modes)


@dataclass(frozen=True, eq=False)
class Axis:
    """Breakpoints (m, increasing, one more than intervals) and the degree of each interval."""

    breaks: np.ndarray
    degrees: np.ndarray

    @cached_property
    def offsets(self) -> np.ndarray:
        """The node number of each breakpoint."""
        return np.concatenate([[0], np.cumsum(self.degrees)])

    @cached_property
    def size(self) -> int:
        """How many nodes there are."""
        return int(self.offsets[-1]) + 1

    @cached_property
    def nodes(self) -> np.ndarray:
        """Coordinates of the nodes (m)."""
        parts = [
            a + (b - a) * (reference(int(p)).nodes[:-1] + 1) / 2
            for a, b, p in zip(self.breaks[:-1], self.breaks[1:], self.degrees, strict=True)
        ]
        return np.concatenate([*parts, self.breaks[-1:]])

    @cached_property
    def tolerance(self) -> float:
        """Coordinates closer than this are the same (m)."""
        return 1e-3 * float(np.diff(self.breaks).min())

    def at(self, coordinate: float) -> int:
        """The number of the breakpoint at a coordinate; ValueError where there is none."""
        i = int(np.abs(self.breaks - coordinate).argmin())
        if abs(self.breaks[i] - coordinate) > self.tolerance:
            raise ValueError(f"no breakpoint at {coordinate:g}")
        return i

    def span(self, lower: float, upper: float) -> tuple[int, int]:
        """The half-open range of intervals between two breakpoints."""
        return self.at(lower), self.at(upper)

    def interpolation(self, coordinates: np.ndarray) -> np.ndarray:
        """(coordinates, nodes): the matrix that takes nodal values to values at coordinates inside the axis."""
        found = np.zeros((len(coordinates), self.size))
        which = np.clip(np.searchsorted(self.breaks, coordinates) - 1, 0, len(self.degrees) - 1)
        for i in np.unique(which):
            here = np.flatnonzero(which == i)
            a, b, p = self.breaks[i], self.breaks[i + 1], int(self.degrees[i])
            xi = np.clip(2 * (coordinates[here] - a) / (b - a) - 1, -1.0, 1.0)
            to_legendre = np.linalg.inv(legendre.legvander(reference(p).nodes, p))
            nodes = slice(self.offsets[i], self.offsets[i] + p + 1)
            found[here, nodes] = legendre.legvander(xi, p) @ to_legendre
        return found

    def part(self, first: int, last: int) -> Part:
        """The restriction to the intervals first..last-1; an empty range is the breakpoint itself, with weight one."""
        found = self._parts.get((first, last))
        if found is None:
            found = self._parts[first, last] = _part(self, first, last)
        return found

    @cached_property
    def _parts(self) -> dict[tuple[int, int], Part]:
        return {}

    def with_degrees(self, degrees: np.ndarray) -> Axis:
        """The same intervals with other degrees."""
        return Axis(self.breaks, degrees)


class Part(NamedTuple):
    """A run of intervals of an axis: its nodes, its Gauss points and the 1D matrices on them.

    ``values`` and ``slopes`` (points, nodes) give a function and its derivative at the Gauss points; ``weights``
    integrate. ``rows``, ``columns`` list the node pairs that share an interval; ``mass`` and ``stiffness`` (integrals
    of u v and u' v') are their values on it.
    """

    first: int
    last: int
    node_slice: slice
    points: np.ndarray
    weights: np.ndarray
    values: np.ndarray
    slopes: np.ndarray
    point_offsets: np.ndarray
    rows: np.ndarray
    columns: np.ndarray
    mass: np.ndarray
    stiffness: np.ndarray

    @property
    def shape(self) -> tuple[int, int]:
        """(points, nodes)."""
        return self.values.shape  # type: ignore[return-value]

    @property
    def integral(self) -> np.ndarray:
        """(nodes,): the integral of each basis function."""
        return self.weights @ self.values


def _part(axis: Axis, first: int, last: int) -> Part:
    start = int(axis.offsets[first])
    one, none = np.ones(1), np.zeros(1, dtype=int)
    if first == last:
        here = axis.breaks[first : first + 1]
        flat = (none, none, one, np.zeros(1))
        return Part(first, last, slice(start, start + 1), here, one, np.ones((1, 1)), np.zeros((1, 1)), none, *flat)
    degrees = axis.degrees[first:last]
    offsets = axis.offsets[first : last + 1] - axis.offsets[first]
    point_offsets = np.concatenate([[0], np.cumsum(degrees + 1)])
    nodes, count = int(offsets[-1]) + 1, int(point_offsets[-1])
    points, weights = np.empty(count), np.empty(count)
    values, slopes = np.zeros((count, nodes)), np.zeros((count, nodes))
    shared = np.zeros((nodes, nodes), dtype=bool)
    for i, degree in enumerate(degrees):
        ref = reference(int(degree))
        a, b = axis.breaks[first + i], axis.breaks[first + i + 1]
        at, on = slice(point_offsets[i], point_offsets[i + 1]), slice(offsets[i], offsets[i + 1] + 1)
        points[at] = a + (b - a) * (ref.points + 1) / 2
        weights[at] = ref.weights * (b - a) / 2
        values[at, on] = ref.values
        slopes[at, on] = ref.slopes * (2 / (b - a))
        shared[on, on] = True
    rows, columns = np.nonzero(shared)
    mass = (values.T * weights) @ values
    stiffness = (slopes.T * weights) @ slopes
    return Part(
        first, last, slice(start, start + nodes), points, weights, values, slopes, point_offsets,
        rows, columns, mass[rows, columns], stiffness[rows, columns],
    )  # fmt: skip
