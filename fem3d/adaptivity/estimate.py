"""Errors of readings from three nested degrees, p, p - 1 and p - 2: where they come from, and what is left.

With the dual solution z of a reading and the residual r of the solution of degree p - 1, the difference of the two
readings is the sum of z_i r_i over the functions that p - 1 lacks (Becker and Rannacher, Acta Numerica 10, 2001). Each
function stands on known intervals of the axes, so that the same sum says where the difference comes from; what p - 1
takes away from p - 2 is known alike. An error that falls like q^-a with the degree q loses (p - 1)^-a - p^-a of itself
at degree p: the ratio of an interval's last two parts gives a, and what all further degrees would add is the last part
times 1 / ((p / (p - 1))^a - 1). Theory caps a: next to an edge of exponent s it is 4 s (Gui and Babuska, Numer. Math.
49, 1986), and at a distance from one the parts fall no faster than rho^-2 a degree, rho being the sum of the half axes,
over the half length, of the ellipse around the interval that the edge lies on (Bernstein). As odd and even degrees take
turns, the part of degree p - 1 gives a second value, and the larger counts.

A solution that is even over an interval has no part of an odd degree: with p odd the ratio of the last two parts is
nothing, however slowly the even ones fall. So every second degree is looked at too: what is left of those that p - 1 is
one of, the part of p - 1 gives, with a rate from the sizes of the functions of p - 1 and of two degrees lower in the
solution and the dual one (`sizes`), and this counts where it is the largest of the three.

All of that is of absolute values: in a reading parts of both signs cancel, and so will those that are left. They are
taken to cancel as far as those of the last two degrees did, of which the one counts that cancels less: in a solution
that is even one of them is rounding. No less is left than `LEAST_SEEN` of the sum.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from scipy.sparse import csc_array
from skfem.refdom import RefHex

from meshes import edgewise
from meshes.grading import LEAST_AT_EDGE, Features
from meshes.grid import Grid

SLOWEST = 1.0  # slowest rate a that is assumed next to an edge, unless theory has a slower one there
# Degrees, and those over the exponent, by which what the element leaves of an edge lags behind its asymptotic decay: of
# distances to powers s from 0.13 to 0.67 about an edge, in one layer of cells up to four times longer than wide, it
# leaves no more than (p + lag)^-4s has it (`validate stress`: "constants").
LAG, LAG_OVER_EXPONENT = 3.0, 0.6
# Times what degrees after p add in theory to an error like p^-4s, next to edges on tetrahedra: what they are expected
# to add, and the most. Between meshes of 12 random plates with pads (exponents of 0.5) it is 1.2, of a stack with vias
# (2/3) 1.1, and 1.2 to 1.7 of an L-shaped conductor (2/3), whose current is known.
EXPECTED, LATER = 1.2, 1.7
# The most in a cell at an edge that is flatter than this: it holds what happens over the thickness of a film alone, of
# which degree 3 sees little. Four plates of 1 um, 400 um wide, with pads were up to 1.3 times as far off as stated
# without, and are no more than 0.75 with (random plates 630, 634, 635, 643, which `validate stress --seed 630 --scenes
# 336` draws).
FLAT, LATER_IN_FLAT = 12.0, 2.5
# Smallest exponent of edges at which that was seen; at others nothing is expected, and the most may be.
KNOWN_FROM = 0.4
# Of what degree 3 added away from edges all later ones add at most this: 0.1 to 0.3 on the same plates.
AWAY = 0.5
# An interval next to an edge that is longer than this times the narrowest distance of two planes along another axis may
# hold what happens over that distance alone, as beside a film. Where its last degree took away more than the one
# before, no faster a rate a than the second number is assumed (`validate stress`: "constants").
LENGTHY, GROWING = 6.0, 0.5
REGULAR = 2.0  # slowest rate a away from edges: that next to an edge of exponent 1/2
FASTEST = 40.0
# At least this fraction of the sum of absolute values is taken to be left, however far the parts of the last degrees
# cancel: few of them are large, and their signs may be such by chance (`validate stress`: "constants").
LEAST_SEEN = 0.5
# Fastest rate a for a solution whose second derivative jumps inside an interval. In the energy norm its error falls
# like p^-3/2 (Gui and Babuska), in a reading like p^-3; one less, as parts of both signs cancel in what is seen of it.
BENT = 2.0

Spread = list[np.ndarray]
"""What is missing where, per axis: on bricks (intervals,), on a mesh (cells,)."""


class Parts(NamedTuple):
    """What degree p - 1 took away of an error ``before``, p as the ``last``, and how the size of the part of p - 1
    compares to that of two degrees lower (``every_second``); which fraction of what is left is ``seen``; and on cells
    of any shape what p added there, with its sign (cells,)."""

    before: Spread
    last: Spread
    every_second: Spread
    seen: float = 1.0
    signed: np.ndarray = np.zeros(1)


def left(p: np.ndarray, a: np.ndarray) -> np.ndarray:
    """What is left after degree p over what it took away, of an error that falls like p^-a."""
    remaining: np.ndarray = 1 / ((p / (p - 1.0)) ** a - 1)
    return remaining


def lag(s: np.ndarray) -> np.ndarray:
    """How many degrees the element lags behind at an edge of exponent s."""
    degrees: np.ndarray = LAG + LAG_OVER_EXPONENT / s
    return degrees


def at_edge(p: np.ndarray, s: np.ndarray) -> np.ndarray:
    """The rate a next to an edge of exponent s that leaves what (p + lag)^-4s does."""
    shifted = p + lag(s)
    rates: np.ndarray = 4 * s * np.log(shifted / (shifted - 1)) / np.log(p / (p - 1))
    return rates


def rate(p: np.ndarray, ratio: np.ndarray) -> np.ndarray:
    """a of parts of degrees p and p - 1 that have this ratio; the slowest where p - 1 can have none."""
    rates = np.full(p.shape, SLOWEST)
    for q in np.unique(p[p > 2]):
        falling, a = _ratios(int(q))
        rates[p == q] = np.interp(-ratio[p == q], -falling, a)
    return rates


@lru_cache
def _ratios(p: int) -> tuple[np.ndarray, np.ndarray]:
    a = np.geomspace(SLOWEST, FASTEST, 400)
    return ((p - 1.0) ** -a - float(p) ** -a) / ((p - 2.0) ** -a - (p - 1.0) ** -a), a


class Estimator:
    """What is known of how errors fall with the degree: on each interval of a grid what its features say, on each cell
    of a mesh what edges it touches. Where degrees are told edge by edge (``of_edges``, a grid), rates are those of all
    edges of one degree on an interval together, as what a single one misses is small by chance; (degrees, intervals) of
    them."""

    def __init__(
        self, degrees: Spread, cap: Spread, least: Spread, fall: Spread, near: Spread, last: Spread, lengthy: Spread,
        later: tuple[np.ndarray, np.ndarray] | None = None, of_edges: Grid | None = None,
    ) -> None:  # fmt: skip
        self._degrees, self._cap, self._least, self._fall, self._near = degrees, cap, least, fall, near
        self._last, self._lengthy, self._later, self._of_edges = last, lengthy, later, of_edges

    @classmethod
    def of_mesh(cls, exponents: np.ndarray, flatness: np.ndarray, degree: int) -> Estimator:
        """That of cells of one degree that touch edges of some ``exponents`` (2, cells), of heat and of current,
        infinite where they touch none, and are so many times longer than thick (cells,). What is smooth, and falls
        fast, hides what an edge in the same cell causes: of the last part nothing faster than the slowest rate is
        believed."""
        p, cap, fall, lengthy = (np.full(exponents.shape[1], x) for x in (degree, FASTEST, 0.0, False))
        least = np.minimum(at_edge(p, exponents.min(axis=0)), SLOWEST)
        theory = left(p, np.minimum(4 * exponents, FASTEST))
        expected = np.where((exponents >= KNOWN_FROM) & np.isfinite(exponents), EXPECTED * theory, 0.0)
        most = np.where(flatness > FLAT, LATER_IN_FLAT, LATER)
        later = expected, np.where(np.isfinite(exponents), most * theory, AWAY)
        return cls([p] * 3, [cap] * 3, [least] * 3, [fall] * 3, [], [least] * 3, [lengthy] * 3, later)

    @classmethod
    def of_grid(cls, grid: Grid, marks: Features) -> Estimator:
        """That of a grid with its features."""
        degrees = [np.maximum(p, 2) for p in grid.degrees]
        if grid.edges:
            degrees = [np.maximum(np.indices((p.max() + 1, len(p)))[0], 2) for p in degrees]
        at_planes = marks.near(grid)
        caps, slowest, falls, lengthy = (list[np.ndarray]() for _ in range(4))
        narrow = [
            float(np.diff(sorted({*inner, float(b[0]), float(b[-1])})).min())
            for inner, b in zip(marks.planes, grid.breaks, strict=True)
        ]
        for d, (p, b, near, planes) in enumerate(zip(degrees, grid.breaks, at_planes, marks.exponents, strict=True)):
            s, half, middle = np.minimum(near[:-1], near[1:]), np.diff(b) / 2, (b[1:] + b[:-1]) / 2
            edge = at_edge(p, s)
            away = np.abs(np.array([*planes, np.inf]) - middle[:, None]) / half[:, None]
            away = np.where(away > 1 + 1e-9, away, np.inf).min(axis=1)
            fall = np.zeros(len(half))
            seen = np.isfinite(away)
            fall[seen] = (away[seen] + np.sqrt(away[seen] ** 2 - 1)) ** -2.0
            fall = np.broadcast_to(fall, p.shape)
            falls.append(fall)
            slowest.append(np.where(np.isfinite(s), np.minimum(edge, SLOWEST), REGULAR))
            caps.append(np.where(np.isfinite(s), edge, rate(p, fall)).clip(max=FASTEST))
            across = min(narrow[:d] + narrow[d + 1 :])
            lengthy.append(np.isfinite(s) & (p >= LEAST_AT_EDGE) & (2 * half > LENGTHY * across))
        return cls(degrees, caps, slowest, falls, at_planes, caps, lengthy, of_edges=grid if grid.edges else None)

    def bending(self, bent: Spread | None) -> Estimator:
        """With the marked ones among ``bent`` (booleans) as places across which a property's law bends: a small part is
        so by chance there, and errors fall no faster than `BENT`."""
        if bent is None:
            return self
        cap = [np.where(at, np.minimum(limit, BENT), limit) for at, limit in zip(bent, self._cap, strict=True)]
        of_last = [np.minimum(last, most) for last, most in zip(self._last, cap, strict=True)]
        return Estimator(
            self._degrees, cap, self._least, self._fall, self._near, of_last, self._lengthy, self._later, self._of_edges
        )  # fmt: skip

    def at_vertices(self, space: Any, vertices: np.ndarray, parts: np.ndarray) -> Spread:
        """What the functions (n,) of some vertices on edges miss, on what ends there, in equal parts."""
        if not self._near:
            return space.spread(vertices, parts)
        corner, cell = np.nonzero(np.isin(space.dofs[:8], vertices))
        place = space.ijk[:, cell].T + RefHex.p.T.astype(int)[corner]
        ends_there = [np.isfinite(self._near[d][place[:, d]]) for d in range(3)]
        at = space.dofs[corner, cell]
        shares = np.maximum(np.bincount(at, np.sum(ends_there, axis=0), space.size), 1.0)
        each = (np.bincount(vertices, np.abs(parts), space.size) / shares)[at]
        spreads = []
        for d, (ends, degrees) in enumerate(zip(ends_there, space.grid.finest, strict=True)):
            edge = 2 * place[ends]
            edge[:, d] = 2 * space.ijk[d, cell[ends]] + 1
            spreads.append(np.bincount(space.slots(d, edge), each[ends], degrees.size).reshape(degrees.shape))
        return spreads

    @property
    def most(self) -> float:
        """What is left after the last degree over what it took away, at most."""
        return max(float(left(p, a).max()) for p, a in zip(self._degrees, self._least, strict=True))

    def remains(self, parts: Parts) -> Spread:
        """What is left of an error of which degree p - 1 took away ``parts.before`` and p ``parts.last``.

        With e_q ~ q^-a what is left after degree q, and d_q = e_(q-1) - e_q what q took away, three values of e_p, of
        which the largest counts: from d_p; from d_(p-1), scaled by (p / (p - 1))^-a, as odd and even degrees take
        turns; and from every second degree, as of those two parities one may be absent. The rest of it than
        ``parts.seen`` cancels.
        """
        remaining, every_second = [], self._every_second(parts.every_second)
        pairs = [parts.before, parts.last]
        if self._of_edges is not None:
            pairs = [edgewise.pooled(self._of_edges, each) for each in pairs]
        for p, cap, least, of_last, lengthy, before, last, ratio in zip(
            self._degrees, self._cap, self._least, self._last, self._lengthy, *pairs, every_second, strict=True
        ):
            a = np.minimum(rate(p, last / np.maximum(before, 1e-300)), cap).clip(least)
            of_growing = np.where(lengthy & (last > before), np.minimum(least, GROWING), np.inf)
            from_last = last * left(p, np.minimum(np.minimum(a, of_last).clip(least), of_growing))
            from_before = np.where(p > 2, before * left(np.maximum(p - 1, 2), a) * ((p - 1.0) / p) ** a, 0.0)
            remaining.append(parts.seen * np.maximum(np.maximum(from_last, from_before), before * ratio))
        if self._of_edges is None:
            return remaining
        return edgewise.shared(self._of_edges, remaining, [x + y for x, y in zip(*parts[:2], strict=True)])

    def later(self, changed: np.ndarray, electric: bool) -> tuple[float, float]:
        """What degrees after the last are expected to change of a reading of which that one ``changed`` so much on each
        cell, by the heat or by the current, and by how much more or less they may."""
        assert self._later is not None
        expected, most = (each[int(electric)] for each in self._later)
        return float((expected * changed).sum()), float(((most - expected) * np.abs(changed)).sum())

    def left_at_times(self, parts: Mapping[str, Parts]) -> dict[str, Spread]:
        """What is left of each goal over time, as if nothing cancelled: at another instant signs may be the same."""
        return {name: self.remains(each._replace(seen=1.0)) for name, each in parts.items()}

    def _every_second(self, every_second: Spread) -> Spread:
        """What the degrees p + 1, p + 3 ... will take away over the part of p - 1: q / (1 - q), where parts of what is
        analytic fall geometrically, by q every second degree; q is at least the ellipse's, and at most that of the
        least rate. Beside an edge both parities are there, and the other values are enough: zero."""
        ratios = []
        for p, fall, least, ratio in zip(self._degrees, self._fall, self._least, every_second, strict=True):
            q = np.minimum(np.maximum(ratio, fall**2), _part(p + 1) / _part(np.maximum(p - 1, 2)))
            ratios.append(np.where((p > 2) & (least == REGULAR), q / (1 - q), 0.0))
        return ratios


def _part(p: np.ndarray) -> np.ndarray:
    """What degree p takes away at the least rate away from edges."""
    return (p - 1.0) ** -REGULAR - p**-REGULAR


def seen(parts: np.ndarray) -> float:
    """Which fraction of the sum of their absolute values the sum of parts (functions,) is, at least `LEAST_SEEN`."""
    size = float(np.abs(parts).sum())
    return max(abs(float(parts.sum())) / size, LEAST_SEEN) if size > 0 else 1.0


def weights(matrix: csc_array, u: np.ndarray, depth: np.ndarray) -> np.ndarray:
    """(functions,): the product of a matrix with those functions of a solution that have the depth of each, for the
    depths that `every_second` looks at."""
    products = np.zeros(len(u))
    for d in (1, 2, 3):
        same_depth = depth == d
        products[same_depth] = (matrix @ np.where(same_depth, u, 0.0))[same_depth]
    return products


def every_second(space: Any, functions: np.ndarray, sizes: np.ndarray) -> Spread:
    """`Parts.every_second` of functions (n,): of the dual solution times the `weights` of the solution."""
    depth = space.depth[functions]
    highest, near, far = (space.pooled(space.spread(functions[depth == d], sizes[depth == d])) for d in (1, 2, 3))
    with np.errstate(divide="ignore", invalid="ignore"):
        # Below degree 5 there is none two degrees lower: what one degree takes is taken twice.
        ratios = [np.where(z > 0, x / z, (x / y) ** 2) for x, y, z in zip(highest, near, far, strict=True)]
    return [np.nan_to_num(ratio, nan=np.inf, posinf=np.inf) for ratio in ratios]


def falling(goals: Iterable[tuple[Spread, Spread, Spread]]) -> Spread:
    """On each interval or cell: by which factor, at most 1, the last degree took away less than the one before, for the
    goal of which most is left there; ``goals`` are what is left of each, and what the last two degrees took away."""
    remaining, before, last = zip(*goals, strict=True)
    factors = []
    for d in range(len(remaining[0])):
        most = np.array([goal[d] for goal in remaining]).argmax(axis=0)[None]
        x, y = (np.take_along_axis(np.array([part[d] for part in parts]), most, 0)[0] for parts in (before, last))
        factors.append(np.minimum(y / np.maximum(x, 1e-300), 1.0))
    return factors


def total(parts: Spread) -> float:
    """The sum over all intervals."""
    return float(sum(p.sum() for p in parts))


def worst(goals: Iterable[Spread]) -> Spread:
    """What is missing on each interval for the goal that misses most there."""
    return [np.max(each, axis=0) for each in zip(*goals, strict=True)]
