"""Bound the error of a goal by dual-weighted residuals in nested spaces of degrees p, p - 1 and p - 2.

The bound is an estimate: it extrapolates to degrees that are not solved, and no theorem guarantees it. Scenes against
finer solutions show how often it holds (docs/stress.md).

Let a(u, v) = l(v) be the problem, J the goal, z the dual solution, a(v, z) = J(v), and V(p-2) < V(p-1) < V(p) nested
spaces. With the residual r = l - a(u(p-1), .) and the dual weights z_i, the last degree changes the goal by

    J(u(p)) - J(u(p-1)) = r(z(p)) = sum of z_i r_i over the functions i of V(p) that V(p-1) lacks

(Becker and Rannacher, Acta Numerica 10, 2001). On bricks the term of a function is divided equally among the axes along
which it is of a degree above 1: one for an edge function, two for a face, three inside. On tetrahedra the terms are
energy integrals over each cell (`nested.heat`), but by function where the problem is linearized about a law. The
absolute values are added to the contribution d_p of each interval or cell; the next pair of spaces gives d_(p-1).

If the error after degree q is C q^-a, then d_q = C ((q-1)^-a - q^-a), and the error after degree p is
d_p / ((p/(p-1))^a - 1). The ratio d_p / d_(p-1) gives the rate a, which theory limits. Beside an edge of exponent s the
error is (p + lag)^-4s (Gui and Babuska, Numer. Math. 49, 1986). Away from edges, contributions fall at most by rho^-2
per degree; rho is the sum of the half axes, over the half length, of the ellipse around the interval that passes
through the edge (Bernstein). Odd and even degrees alternate, so d_(p-1) gives a second value; the larger counts.

An even solution on an interval has no contribution of odd degree. Away from edges d_(p-1) is therefore also continued
over every second degree, by q / (1 - q): q is the decay over two degrees of the coefficients of the solution and the
dual solution (the smoothness indicator of Mavriplis, ICOSAHOM 1989).

On the cells of a mesh the measured rate is used: at least SLOWEST, and at most 4s at an edge of exponent s, even if
that is slower. A smooth contribution may hide an edge in the same cell, where the
measured rate is then too fast. On tetrahedra the change that theory expects of later degrees is added to the values of
quantities (`fem3d.adaptivity.nested`).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from scipy.sparse import csc_array
from skfem.refdom import RefHex

from meshes import edgewise
from meshes.grading import Features
from meshes.grid import Grid

# Rates a that are assumed at least: beside an edge unless theory has a slower one, and away from edges, where 2 is the
# rate beside an edge of exponent 1/2. FASTEST is infinity, for a table of rates.
SLOWEST, REGULAR, FASTEST = 1.0, 2.0, 40.0
# Lag in degrees behind the asymptotic decay at an edge: a constant, and a part to be divided by the exponent. Measured
# for distances to powers from 0.13 to 0.67 about an edge, in cells up to four times longer than wide.
LAG, LAG_OVER_EXPONENT = 3.0, 0.6
# Factors, expected and largest, on the sum of all later degrees beside an edge in theory, p^-4s. Measured between
# meshes: 1.1 to 1.7 on random plates with pads (exponent 1/2), stacks with vias (2/3) and an L-shaped conductor, 2.1
# in the flattest films. Away from edges later degrees add at most AWAY times the last contribution: 0.1 to 0.3.
EXPECTED, LATER, AWAY = 1.2, 2.1, 0.5

Spread = list[np.ndarray]
"""Contributions per axis: on bricks (intervals,) or of their edges, on a mesh (cells,)."""


class Contributions(NamedTuple):
    """Contributions of the last two degrees to a goal.

    Attributes
    ----------
    before, last: absolute contributions of degrees p - 1 and p.
    every_second: decay of the contributions of degree p - 1 over two degrees.
    signed: (cells,) contributions of degree p with their sign; on bricks unused.
    """

    before: Spread
    last: Spread
    every_second: Spread
    signed: np.ndarray = np.zeros(1)


def left(p: np.ndarray, a: np.ndarray) -> np.ndarray:
    """Return the error after degree p over the contribution of degree p, for an error p^-a."""
    remaining: np.ndarray = 1 / ((p / (p - 1.0)) ** a - 1)
    return remaining


def rate_at_edge(p: np.ndarray, s: np.ndarray) -> np.ndarray:
    """Return the rate a at degree p of an error (p + lag)^-4s, beside an edge of exponent s."""
    shifted = p + LAG + LAG_OVER_EXPONENT / s
    rates: np.ndarray = 4 * s * np.log(shifted / (shifted - 1)) / np.log(p / (p - 1))
    return rates


def rate(p: np.ndarray, ratio: np.ndarray) -> np.ndarray:
    """Return the rate a of contributions of degrees p and p - 1 with this ratio; the slowest for p = 2."""
    rates = np.full(p.shape, SLOWEST)
    for q in np.unique(p[p > 2]):
        falling, a = _ratios(int(q))
        rates[p == q] = np.interp(-ratio[p == q], -falling, a)
    return rates


@lru_cache
def _ratios(p: int) -> tuple[np.ndarray, np.ndarray]:
    """Tabulate the ratio of the contributions of degrees p and p - 1 over the rate."""
    a = np.geomspace(SLOWEST, FASTEST, 400)
    return ((p - 1.0) ** -a - float(p) ** -a) / ((p - 2.0) ** -a - (p - 1.0) ** -a), a


@dataclass(frozen=True, eq=False)
class Estimator:
    """Extrapolate dual-weighted residuals in the polynomial degree, to bound the error of a goal.

    The dual weights z and the residual r of degree p - 1 give the contribution d_p = sum |z_i r_i| of degree p to the
    goal, on each interval of each axis of a grid; on a mesh of cells it is the absolute energy integral over each cell
    (where a law is linearized the sum by function), split among three axes; d_(p-1) likewise. An error q^-a after
    degree q has the ratio d_p / d_(p-1) = ((p-1)^-a - p^-a) / ((p-2)^-a - (p-1)^-a), which gives the rate a.

    Attributes
    ----------
    degrees: per axis the degree p of each interval, or of the cells; with ``grid`` (degrees, intervals), a row for the
        edges of each degree.
    slowest, fastest: per axis the least and the largest rate a.
    ellipse: per axis the least factor rho^-2 between contributions of successive degrees; zero on a mesh.
    near: per axis the exponent of the singular plane at each breakpoint; empty on a mesh.
    grid: the grid whose degrees differ from edge to edge; else None.
    later_factors: (2, cells) twice, for heat and current: expected and largest change by later degrees over the
        contribution of the last degree; None if the exponents are unknown.
    """

    degrees: Spread
    slowest: Spread
    fastest: Spread
    ellipse: Spread
    near: Spread = field(default_factory=list)
    grid: Grid | None = None
    later_factors: tuple[np.ndarray, np.ndarray] | None = None

    @classmethod
    def of_cells(cls, exponents: np.ndarray | None, cells: int, degree: int) -> Estimator:
        """Return the estimator for cells of one degree.

        ``exponents`` (2, cells) are the smallest exponents, for heat and for current, of the edges that each cell
        touches: infinite without an edge, None if unknown.
        """
        p, smallest = np.full(cells, degree), np.full(cells, np.inf) if exponents is None else exponents.min(axis=0)
        slowest, fastest = np.minimum(rate_at_edge(p, smallest), SLOWEST), np.minimum(4 * smallest, FASTEST)
        later = None
        if exponents is not None:
            theory, at_edge = left(p, np.minimum(4 * exponents, FASTEST)), np.isfinite(exponents)
            later = np.where(at_edge, EXPECTED * theory, 0.0), np.where(at_edge, LATER * theory, AWAY)
        return cls([p] * 3, [slowest] * 3, [fastest] * 3, [np.zeros(cells)] * 3, later_factors=later)

    @classmethod
    def of_grid(cls, grid: Grid, marks: Features) -> Estimator:
        """Return the estimator for a grid of bricks with the features of its scene."""
        degrees = [np.maximum(p, 2) for p in grid.degrees]
        if grid.edges:
            # All edges of one degree on an interval together: a single one is small by chance.
            degrees = [np.maximum(np.indices((p.max() + 1, len(p)))[0], 2) for p in degrees]
        near = marks.near(grid)
        slowest, fastest, ellipse = (list[np.ndarray]() for _ in range(3))
        for p, b, at_plane, planes in zip(degrees, grid.breaks, near, marks.exponents, strict=True):
            s, half, middle = np.minimum(at_plane[:-1], at_plane[1:]), np.diff(b) / 2, (b[1:] + b[:-1]) / 2
            distance = np.abs(np.array([*planes, np.inf]) - middle[:, None]) / half[:, None]
            distance = np.where(distance > 1 + 1e-9, distance, np.inf).min(axis=1)
            fall = np.zeros(len(half))
            finite = np.isfinite(distance)
            fall[finite] = (distance[finite] + np.sqrt(distance[finite] ** 2 - 1)) ** -2.0
            fall, edge = np.broadcast_to(fall, p.shape), rate_at_edge(p, s)
            ellipse.append(fall)
            slowest.append(np.where(np.isfinite(s), np.minimum(edge, SLOWEST), REGULAR))
            fastest.append(np.where(np.isfinite(s), edge, rate(p, fall)).clip(max=FASTEST))
        return cls(degrees, slowest, fastest, ellipse, near, grid if grid.edges else None)

    def indicators(self, goal: Contributions) -> Spread:
        """Return the error of a goal after the last degree on each interval or cell,

            eta = max(d_p / ((p/(p-1))^a - 1), d_(p-1) / (((p-1)/(p-2))^a - 1) ((p-1)/p)^a, d_(p-1) q / (1 - q)),

        with d_p = ``goal.last``, d_(p-1) = ``goal.before`` and the rate a from their ratio. On bricks away from
        edges q is ``goal.every_second``, within theoretical limits; else q = 0. For p = 2 only the first term counts.
        """
        pairs = [goal.before, goal.last]
        if self.grid is not None:
            pairs = [edgewise.pooled(self.grid, each) for each in pairs]
        errors = []
        for p, slowest, fastest, ellipse, before, last, decay in zip(
            self.degrees, self.slowest, self.fastest, self.ellipse, *pairs, goal.every_second, strict=True
        ):
            a = np.minimum(rate(p, last / np.maximum(before, 1e-300)), fastest).clip(slowest)
            continued = before * left(np.maximum(p - 1, 2), a) * ((p - 1.0) / p) ** a
            # Beside an edge both odd and even degrees contribute.
            q = np.where(slowest == REGULAR, np.maximum(decay, ellipse**2), 0.0)
            q = np.minimum(q, _contribution(p + 1) / _contribution(np.maximum(p - 1, 2)))
            even = before * q / (1 - q)
            errors.append(np.maximum(last * left(p, a), np.where(p > 2, np.maximum(continued, even), 0.0)))
        if self.grid is None:
            return errors
        return edgewise.shared(self.grid, errors, [x + y for x, y in zip(*goal[:2], strict=True)])

    @staticmethod
    def bound(indicators: Spread) -> float:
        """Return the estimated bound on the error |J(u) - J(u(p))| of a goal J after degree p: the sum of its
        ``indicators`` over all axes and their intervals or cells. Both are relative to the goal's scale. The error that
        a run states begins with it: `goal_errors.examined` adds parts, and on cells `cell_mesh.corrected` may lower or
        raise it.
        """
        return total(indicators)

    @property
    def largest_factor(self) -> float:
        """The largest error after the last degree over its contribution, at the slowest rates."""
        return max(float(left(p, a).max()) for p, a in zip(self.degrees, self.slowest, strict=True))

    @property
    def extrapolates(self) -> bool:
        """Whether the exponents of edges are given, so that later degrees can be extrapolated."""
        return self.later_factors is not None

    def later(self, changed: np.ndarray, electric: bool) -> tuple[float, float]:
        """Return the change of a goal expected from later degrees, and its largest deviation.

        ``changed`` (cells,) is the signed contribution of the last degree, by the heat or by the current.
        """
        assert self.later_factors is not None
        expected, most = (each[int(electric)] for each in self.later_factors)
        return float((expected * changed).sum()), float(((most - expected) * np.abs(changed)).sum())

    def at_vertices(self, space: Any, vertices: np.ndarray, parts: np.ndarray) -> Spread:
        """Return contributions (n,) of vertex functions on edges, in equal parts for the intervals that end there."""
        if not self.near:
            return space.spread(vertices, parts)
        corner, cell = np.nonzero(np.isin(space.dofs[:8], vertices))
        place = space.ijk[:, cell].T + RefHex.p.T.astype(int)[corner]
        ends_there = [np.isfinite(self.near[d][place[:, d]]) for d in range(3)]
        at = space.dofs[corner, cell]
        shares = np.maximum(np.bincount(at, np.sum(ends_there, axis=0), space.size), 1.0)
        each = (np.bincount(vertices, np.abs(parts), space.size) / shares)[at]
        spreads = []
        for d, (ends, degrees) in enumerate(zip(ends_there, space.grid.finest, strict=True)):
            edge = 2 * place[ends]
            edge[:, d] = 2 * space.ijk[d, cell[ends]] + 1
            spreads.append(np.bincount(space.slots(d, edge), each[ends], degrees.size).reshape(degrees.shape))
        return spreads


def _contribution(p: np.ndarray) -> np.ndarray:
    """Return the contribution of degree p at the least rate away from edges."""
    return (p - 1.0) ** -REGULAR - p**-REGULAR


def degree_products(matrix: csc_array, u: np.ndarray, depth: np.ndarray) -> np.ndarray:
    """Return (functions,) the products of a matrix with the functions of a solution of each depth, 1 to 3."""
    products = np.zeros(len(u))
    for d in (1, 2, 3):
        same_depth = depth == d
        products[same_depth] = (matrix @ np.where(same_depth, u, 0.0))[same_depth]
    return products


def every_second(space: Any, functions: np.ndarray, sizes: np.ndarray) -> Spread:
    """Return the decay over two degrees of the ``sizes`` of functions (n,): dual solution times `degree_products`."""
    depth = space.depth[functions]
    highest, near, far = (space.pooled(space.spread(functions[depth == d], sizes[depth == d])) for d in (1, 2, 3))
    with np.errstate(divide="ignore", invalid="ignore"):
        # Below degree 5 none is two degrees lower: the square of one degree's decay.
        ratios = [np.where(z > 0, x / z, (x / y) ** 2) for x, y, z in zip(highest, near, far, strict=True)]
    return [np.nan_to_num(ratio, nan=np.inf, posinf=np.inf) for ratio in ratios]


def total(parts: Spread) -> float:
    """Return the sum over all intervals or cells."""
    return float(sum(p.sum() for p in parts))


def worst_of(goals: Iterable[Spread]) -> Spread:
    """Return the largest indicator of any goal on each interval or cell."""
    return [np.max(each, axis=0) for each in zip(*goals, strict=True)]
