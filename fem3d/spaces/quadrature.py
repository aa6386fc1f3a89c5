"""Quadrature on the reference cell and its sides: points, weights, and the functions and slopes there."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from typing import Any, NamedTuple

import numpy as np

NONE = 1e-12  # a function that is smaller all over a facet vanishes there; functions are of size one


class Lines(NamedTuple):
    """Functions of a cell that are products of those of one coordinate each, at the points of a grid: sums over them
    are three, axis by axis. ``tables``: of x, y, z the values and the slopes (2, functions of the coordinate, points
    along it); ``modes`` (3, functions): which ones each is a product of."""

    tables: tuple[np.ndarray, np.ndarray, np.ndarray]
    modes: np.ndarray

    def at(self, coefficients: np.ndarray, along: int | None) -> np.ndarray:
        """(..., points), for coefficients (..., functions)."""
        x, y, z = self._along(along)
        first = coefficients.shape[:-1]
        whole = np.zeros((*first, len(x), len(y), len(z)))
        whole[(..., *self.modes)] = coefficients
        in_yz = (y.T @ (whole @ z)).reshape(*first, len(x), -1)
        return (x.T @ in_yz).reshape(*first, -1)

    def tested(self, field: np.ndarray, along: int | None) -> np.ndarray:
        """(..., functions), for a field (..., points)."""
        x, y, z = self._along(along)
        first = field.shape[:-1]
        of_x = (x @ field.reshape(*first, x.shape[1], -1)).reshape(*first, len(x), y.shape[1], -1)
        tested: np.ndarray = (y @ of_x @ z.T)[(..., *self.modes)]
        return tested

    def functions(self, along: int | None) -> np.ndarray:
        """(points, functions)."""
        x, y, z = (table[k] for table, k in zip(self._along(along), self.modes, strict=True))
        values: np.ndarray = (x[:, :, None, None] * y[:, None, :, None] * z[:, None, None]).reshape(len(x), -1).T
        return values

    def functions_at(self, point: int) -> np.ndarray:
        """(functions,): those at one point."""
        tables = self._along(None)
        places = np.unravel_index(point, [table.shape[1] for table in tables])
        return np.prod([t[k, at] for t, k, at in zip(tables, self.modes, places, strict=True)], axis=0)

    def _along(self, along: int | None) -> list[np.ndarray]:
        return [table[int(d == along)] for d, table in enumerate(self.tables)]


class Rule(NamedTuple):
    """``points`` (3, points) of the reference cell with ``weights`` (points,), and the numbers of the cell's
    ``functions`` that it is for. Of these there is either ``dense``: their values (points, functions) and slopes (3,
    points, functions); or, at many points that are a grid, where these would take hundreds of megabytes, the ``lines``
    that the functions are products of."""

    points: np.ndarray
    weights: np.ndarray
    functions: np.ndarray
    dense: tuple[np.ndarray, np.ndarray] | None
    lines: Lines | None = None

    @property
    def values(self) -> np.ndarray:
        """(points, functions): of lines worked out anew each time."""
        return self.lines.functions(None) if self.lines is not None else self._dense[0]

    @property
    def slopes(self) -> np.ndarray:
        """(3, points, functions): of lines worked out anew each time."""
        if self.lines is not None:
            return np.array([self.lines.functions(axis) for axis in range(3)])
        return self._dense[1]

    @property
    def present(self) -> np.ndarray:
        """(functions,): which do not vanish at the points; inside a cell none does."""
        if self.lines is not None:
            return np.ones(len(self.functions), bool)
        return np.asarray(self._dense[0].any(axis=0))

    def values_at(self, point: int) -> np.ndarray:
        """(functions,): the values at one of the points."""
        return self.lines.functions_at(point) if self.lines is not None else self._dense[0][point]

    @property
    def _dense(self) -> tuple[np.ndarray, np.ndarray]:
        assert self.dense is not None
        return self.dense

    def at(self, coefficients: np.ndarray, along: int | None = None) -> np.ndarray:
        """(..., points): sums of the functions, or of their slopes along an axis, for coefficients (..., functions)."""
        if self.lines is not None:
            return self.lines.at(coefficients, along)
        summed: np.ndarray = coefficients @ (self.values if along is None else self.slopes[along]).T
        return summed

    def tested(self, field: np.ndarray, along: int | None = None) -> np.ndarray:
        """(..., functions): what a field (..., points) has with each of them, the transpose of `at`."""
        if self.lines is not None:
            return self.lines.tested(field, along)
        summed: np.ndarray = field @ (self.values if along is None else self.slopes[along])
        return summed


Pieces = tuple[int, int, int]
WHOLE: Pieces = (1, 1, 1)
Side = tuple[Rule, np.ndarray]
"""The rule of a side of the reference cell, with exact zeros of what vanishes there, and its outward normal, as long as
the parallelogram that two of its edges span."""

Values = Callable[..., np.ndarray]
"""(points, functions): those of a cell at reference points (3, points), or their slopes along an axis."""


def product_rule(count: int, dimension: int) -> tuple[np.ndarray, np.ndarray]:
    """Points (points, dimension) and weights (points,) of Gauss's rule on the unit cube of a dimension, 0 for a point,
    with ``count`` points along each axis."""
    x, w = np.polynomial.legendre.leggauss(count)
    points = np.array(list(product((x + 1) / 2, repeat=dimension))).reshape(count**dimension, dimension)
    return points, np.array([float(np.prod(each)) for each in product(w / 2, repeat=dimension)])


def rule(points: np.ndarray, weights: np.ndarray, functions: Values, kept: np.ndarray | slice = slice(None)) -> Rule:
    """A rule for those of a cell's functions that are ``kept``."""
    values, *slopes = (functions(points, along)[:, kept] for along in (None, 0, 1, 2))
    return Rule(points, weights, np.arange(functions(points[:, :1]).shape[1])[kept], (values, np.array(slopes)))


def side(reference: Any, number: int, plane: tuple[np.ndarray, np.ndarray], functions: Values) -> Side:
    """A side of scikit-fem's ``reference`` cell, with the points (2, points) and weights (points,) of a rule of the
    plane."""
    corners = reference.p[:, reference.facets[number]]
    along = np.stack([corners[:, 1] - corners[:, 0], corners[:, -1] - corners[:, 0]], axis=1)
    normal = np.cross(along[:, 0], along[:, 1])
    normal = normal * np.sign(normal @ (corners[:, 0] - reference.p.mean(axis=1)))
    on_side = rule(corners[:, :1] + along @ plane[0], plane[1], functions)
    values = np.where(np.abs(on_side.values).max(axis=0) > NONE, on_side.values, 0.0)
    return on_side._replace(dense=(values, on_side.slopes)), normal
