"""Quadrature on the reference cell and its sides: points, weights, and the functions and slopes there."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from typing import Any, NamedTuple

import numpy as np

NONE = 1e-12  # a function that is smaller all over a facet vanishes there; functions are of size one


class Rule(NamedTuple):
    """``points`` (3, points) of the reference cell with ``weights`` (points,), and the numbers of the cell's
    ``functions`` that it is for, with their ``values`` (points, functions) and ``slopes`` (3, points, functions)."""

    points: np.ndarray
    weights: np.ndarray
    functions: np.ndarray
    values: np.ndarray
    slopes: np.ndarray

    @property
    def present(self) -> np.ndarray:
        """(functions,): which do not vanish at the points; inside a cell none does."""
        return np.asarray(self.values.any(axis=0))

    def at(self, coefficients: np.ndarray, along: int | None = None) -> np.ndarray:
        """(..., points): sums of the functions, or of their slopes along an axis, for coefficients (..., functions)."""
        summed: np.ndarray = coefficients @ (self.values if along is None else self.slopes[along]).T
        return summed

    def tested(self, field: np.ndarray, along: int | None = None) -> np.ndarray:
        """(..., functions): sums over points of a field (..., points) times each function, the transpose of `at`."""
        summed: np.ndarray = field @ (self.values if along is None else self.slopes[along])
        return summed


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
    """Return a rule for the ``kept`` functions of a cell."""
    values, *slopes = (functions(points, along)[:, kept] for along in (None, 0, 1, 2))
    return Rule(points, weights, np.arange(functions(points[:, :1]).shape[1])[kept], values, np.array(slopes))


def side(reference: Any, number: int, plane: tuple[np.ndarray, np.ndarray], functions: Values) -> Side:
    """A side of scikit-fem's ``reference`` cell, with the points (2, points) and weights (points,) of a rule of the
    plane."""
    corners = reference.p[:, reference.facets[number]]
    along = np.stack([corners[:, 1] - corners[:, 0], corners[:, -1] - corners[:, 0]], axis=1)
    normal = np.cross(along[:, 0], along[:, 1])
    normal = normal * np.sign(normal @ (corners[:, 0] - reference.p.mean(axis=1)))
    on_side = rule(corners[:, :1] + along @ plane[0], plane[1], functions)
    values = np.where(np.abs(on_side.values).max(axis=0) > NONE, on_side.values, 0.0)
    return on_side._replace(values=values), normal
