"""Bound the error of a goal by dual-weighted residuals in nested spaces of degrees p, p - 1 and p - 2.

The bound is an estimate: it extrapolates to degrees that are not solved, and no theorem guarantees it. Scenes against
finer solutions show how often it holds (docs/stress.md).

Let a(u, v) = l(v) be the problem, J the goal, z the dual solution, a(v, z) = J(v), and V(p-2) < V(p-1) < V(p) nested
spaces. With the residual r = l - a(u_(p-1), .) the last degree changes the goal by

    J(u_p) - J(u_(p-1)) = r(w_p) = a(u_p - u_(p-1), w_p),

where w_p is the part of z_p in the functions that V(p-1) lacks (Becker and Rannacher, Acta Numerica 10, 2001). This
product is integrated over each cell and divided among the axes: d_p. The next pair of spaces gives d_(p-1)
(`nested.contributions`). On bricks their absolute values are summed over cells of one degree in one interval, because
the value of a single cell may be small by chance.

If the error after degree q is C q^-a, then d_q = C ((q-1)^-a - q^-a), and the error after degree p is
d_p / ((p/(p-1))^a - 1). The ratio d_p / d_(p-1) gives the rate a, which theory limits. Beside an edge of exponent s the
error on bricks is (p + lag)^-4s (Gui and Babuska, Numer. Math. 49, 1986). Odd and even degrees alternate, so d_(p-1)
gives a second value; the larger counts.

On the cells of a mesh the measured rate is used: at least SLOWEST, and at most 4s at an edge of exponent s, even if
that is slower. A smooth contribution may hide an edge in the same cell, where the measured rate is then too fast. On
tetrahedra the change that theory expects of later degrees is added to the values of quantities, unless the study wants
the values of the field itself, or a law or radiation makes the equations nonlinear (`fem3d.adaptivity.nested`).

Contributions grow with the degree where cells are much longer than a film is thick. At the end of a film of thickness
t the solution decays like exp(-pi x/t), but degree p resolves lengths above h/p^2 in a cell of length h (Schwab and
Suri, Math. Comp. 65, 1996). The least energy of a function that is linear across the film, and of degree p - 1 along a
cell that tapers like (1 - x/h)^2, is in proportion to 1/(p (p + 2)). So the error is C/(p (p + 2) + L) with L up to
pi h/t, and the error after degree p is up to (p^2 - 1 + L)/(2p + 1) times d_p. On tetrahedra two contributions, summed
over the cells around, give C and L, and the stretch of a cell limits h/t; this error belongs to all axes alike. On
bricks L is the largest: contributions grow by less than (2p + 1)/(2p - 1), and by more only where degrees alternate.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.sparse import csr_array

from meshes.grading import Features
from meshes.grid import Grid
from scenes.model import ROUNDING, Scene

# Rates a that are assumed at least: beside an edge unless theory has a slower one, and on bricks away from edges, where
# 2 is the rate beside an edge of exponent 1/2. No faster rate than FASTEST is assumed: the contribution of an odd
# degree to an even solution vanishes by chance.
SLOWEST, REGULAR, FASTEST = 1.0, 2.0, 8.0
# Lag in degrees behind the asymptotic decay at an edge: a constant, and a part to be divided by the exponent. Measured
# for distances to powers from 0.13 to 0.67 about an edge, in cells up to four times longer than wide.
LAG, LAG_OVER_EXPONENT = 3.0, 0.6
# Factors, expected and largest, on the sum of all later degrees beside an edge in theory, p^-4s. Measured between
# meshes: 1.1 to 1.7 on random plates with pads (exponent 1/2), stacks with vias (2/3) and an L-shaped conductor, 2.1
# in the flattest films. Away from edges later degrees add at most AWAY times the last contribution: 0.1 to 0.3.
EXPECTED, LATER, AWAY = 1.2, 2.1, 0.5


class Contributions(NamedTuple):
    """Contributions of the last two degrees to a goal, relative to its scale.

    Attributes
    ----------
    before, last: (3, cells) signed contributions of degrees p - 1 and p, divided among the axes.
    """

    before: np.ndarray
    last: np.ndarray


def tail(p: np.ndarray, a: np.ndarray) -> np.ndarray:
    """Return the sum of the contributions of all degrees above p over the contribution of p, for an error p^-a."""
    return np.asarray(1 / ((p / (p - 1.0)) ** a - 1))


def rate_at_edge(p: np.ndarray, s: np.ndarray) -> np.ndarray:
    """Return the rate a at degree p of an error (p + lag)^-4s, beside an edge of exponent s."""
    shifted = p + LAG + LAG_OVER_EXPONENT / s
    return np.asarray(4 * s * np.log(shifted / (shifted - 1)) / np.log(p / (p - 1)))


def rate(p: np.ndarray, ratio: np.ndarray) -> np.ndarray:
    """Return the rate a of contributions of degrees p and p - 1 with this ratio; the slowest for p = 2."""
    rates, a = np.full(p.shape, SLOWEST), np.geomspace(SLOWEST, FASTEST, 400)
    for q in np.unique(p[p > 2]).astype(float):
        falling = ((q - 1) ** -a - q**-a) / ((q - 2) ** -a - (q - 1) ** -a)
        rates[p == q] = np.interp(-ratio[p == q], -falling, a)
    return rates


def largest_growing(p: np.ndarray, stretch: np.ndarray) -> np.ndarray:
    """Return the largest error over the contribution of degree p where contributions grow, with L = pi ``stretch``."""
    return (p > 2) * (p**2 - 1 + np.pi * stretch) / (2 * p + 1)


@dataclass(frozen=True, eq=False)
class Estimator:
    """Extrapolate the contributions of the last two degrees, to bound the error of a goal.

    Attributes
    ----------
    degrees: (3, cells) the degree p of each cell along each axis, at least 2.
    slowest, fastest: (3, cells) the least and the largest rate a.
    pools: (3, cells) the number of the group whose contributions give one rate.
    later_factors: (2, cells) twice, for heat and current: expected and largest change by later degrees over the
        contribution of the last degree; None on bricks and hexahedra.
    growing: (cells,), on bricks (3, cells): the largest error over the contribution of the last degree where
        contributions grow: zero if p = 2, and on hexahedra.
    around: of tetrahedra, (cells, cells) the sparse number of vertices that two cells share, else None.
    """

    degrees: np.ndarray
    slowest: np.ndarray
    fastest: np.ndarray
    pools: np.ndarray
    growing: np.ndarray
    later_factors: tuple[np.ndarray, np.ndarray] | None = None
    around: Any = None

    @classmethod
    def of_cells(cls, exponents: np.ndarray, mesh: Any, degree: int) -> Estimator:
        """Return the estimator for the cells of scikit-fem's ``mesh``, of one degree.

        ``exponents`` (2, cells) are the smallest exponents, for heat and for current, of the edges that each cell
        touches: infinite without an edge.
        """
        cells, growing, later, around = mesh.t.shape[1], np.zeros(1), None, None
        p, smallest = np.full(cells, degree), exponents.min(axis=0)
        slowest, fastest = np.minimum(rate_at_edge(p, smallest), SLOWEST), np.minimum(4 * smallest, FASTEST)
        fastest = fastest if degree > 2 else slowest  # a single contribution shows no rate
        if len(mesh.t) == 4:
            theory, at_edge = tail(p, np.minimum(4 * exponents, FASTEST)), np.isfinite(exponents)
            later = np.where(at_edge, EXPECTED * theory, 0.0), np.where(at_edge, LATER * theory, AWAY)
            corners = mesh.p[:, mesh.t]
            stretch = np.linalg.cond((corners[:, 1:] - corners[:, :1]).T)
            at = csr_array((np.ones(mesh.t.size), (np.tile(np.arange(cells), 4), mesh.t.ravel())))
            around, growing = at @ at.T, largest_growing(p, stretch)
        degrees, slowest, fastest, pools = (np.tile(each, (3, 1)) for each in (p, slowest, fastest, np.arange(cells)))
        return cls(degrees, slowest, fastest, pools, growing, later, around)

    @classmethod
    def of_grid(cls, grid: Grid, features: Features, scene: Scene) -> Estimator:
        """Return the estimator for a grid of bricks with the features of its scene.

        Where a flux or a film ends on a face the solution behaves as r log r, and the error falls like p^-4.
        """
        degrees, intervals = np.maximum(grid.of_cells, 2), np.argwhere(grid.solid).T
        s = np.array([np.minimum(near[i], near[i + 1]) for near, i in zip(features.near(grid), intervals, strict=True)])
        singular, edge = np.isfinite(s), rate_at_edge(degrees, s)
        slowest = np.where(singular, np.minimum(edge, SLOWEST), REGULAR)
        passed = [b for b in scene.boundaries if b.kind in ("heat_flux", "convection", "radiation")]
        rims, lengths, spans = np.zeros(s.shape, bool), np.zeros(s.shape), np.zeros(s.shape)
        for d, (breaks, i) in enumerate(zip(grid.breaks, intervals, strict=True)):
            ends = [c for b in passed for c in (b.lower[d], b.upper[d])]
            at = np.isclose(breaks[:, None], ends, 0.0, ROUNDING * np.ptp(breaks)).any(axis=1)
            at[[0, -1]] = False  # ends of the scene or its part
            rims[d], lengths[d] = at[i] | at[i + 1], np.diff(breaks)[i]
            planes = np.array(sorted({*features.planes[d], breaks[0], breaks[-1]}))
            spans[d] = np.diff(planes)[np.searchsorted(planes, breaks[i] + lengths[d] / 2) - 1]
        fastest = np.where(singular, edge, np.where(rims, 4.0, FASTEST)).clip(max=FASTEST)
        growing = largest_growing(degrees, lengths / spans.min(axis=0))
        return cls(degrees, slowest, fastest, intervals * (degrees.max() + 1) + degrees, growing)

    def indicators(self, goal: Contributions) -> np.ndarray:
        """Return (3, cells) the error of a goal after the last degree in each cell, by axis; their sum is the error
        bound, without other errors than of the space. For the sums over a group of cells it is

            eta = max(d_p / ((p/(p-1))^a - 1), d_(p-1) / (((p-1)/(p-2))^a - 1) ((p-1)/p)^a),

        shared in proportion to d_p + d_(p-1), with the rate a from the ratio of d_p to d_(p-1). For p = 2 only the
        first term counts. Where contributions grow with the degree the error is at least C/(p (p + 2) + L).
        """
        p, sizes = self.degrees, np.abs(goal)
        before, last = np.array([[np.bincount(g, x)[g] for g, x in zip(self.pools, d, strict=True)] for d in sizes])
        a = np.minimum(rate(p, last / np.maximum(before, 1e-300)), self.fastest).clip(self.slowest)
        continued = before * tail(np.maximum(p - 1, 2), a) * ((p - 1.0) / p) ** a
        error = np.maximum(last * tail(p, a), np.where(p > 2, continued, 0.0))
        error *= sizes.sum(axis=0) / np.maximum(before + last, 1e-300)
        if self.around is None:
            grows = (before < last) & ((2 * p - 1) * last < (2 * p + 1) * before)
            return np.maximum(error, grows * self.growing * sizes[1])
        growing = self._unresolved(goal) * sizes[1].sum(axis=0)
        return np.where(growing > error.sum(axis=0), growing / 3, error)

    def _unresolved(self, goal: Contributions) -> np.ndarray:
        """Return (cells,) the error over the last contribution where contributions grow with the degree, else 0."""
        p, (before, last) = self.degrees[0], (self.around @ (self.around @ np.abs(goal).sum(axis=1).T)).T
        slow = np.maximum((2 * p + 1) * before - (2 * p - 1) * last, 1e-300)
        return np.where(last > before, np.minimum((2 * p - 1) * (before + last) / slow, self.growing), 0.0)

    def later(self, goal: Contributions, electric: bool) -> np.ndarray:
        """Return (3, cells) the contributions of the last degree to a goal, by the heat or by the current, the change
        expected from later degrees, and its largest deviation."""
        assert self.later_factors is not None
        (expected, most), last = (each[int(electric)] for each in self.later_factors), goal.last.sum(axis=0)
        return np.array([last, expected * last, (np.maximum(most, self._unresolved(goal)) - expected) * np.abs(last)])

    def at_vertices(self, space: Any, vertices: np.ndarray, parts: np.ndarray) -> np.ndarray:
        """Distribute parts (n,) of vertex functions over the cells around, and over their axes across an edge."""
        shares: Any = np.bincount(vertices, np.abs(parts), space.size)
        shares = shares / np.maximum(np.bincount(space.dofs.ravel(), minlength=space.size), 1)
        singular = self.fastest < FASTEST
        axes = np.where(singular.any(axis=0), singular, True)
        return np.asarray(shares[space.dofs].sum(axis=0) * axes / axes.sum(axis=0))
