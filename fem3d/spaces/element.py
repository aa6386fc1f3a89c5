"""The trunk (serendipity) hexahedron of any degree for scikit-fem, its reference matrices, and quadrature.

A basis function is a product of three 1D functions: 0 and 1 are linear, k >= 2 is the integral of the Legendre
polynomial k - 1. Edges carry k = 2 ... p, facets pairs with j + k <= p, the interior triples with i + j + k <= p (Szabo
and Babuska, Finite Element Analysis, 1991, section 6). All bricks of a grid are oriented alike, so that odd functions
match. Functions of lower degrees span the lower spaces: leaving some out makes spaces of mixed and of nested degrees.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import legendre
from scipy.sparse import csr_array
from skfem.element import ElementH1
from skfem.refdom import RefHex

Degrees = tuple[int, int, int]


class ElementHexTrunk(ElementH1):
    """The trunk hexahedron of degree ``p`` (p = 2 spans the space of scikit-fem's ElementHexS2)."""

    refdom = RefHex
    nodal_dofs = 1

    def __init__(self, p: int) -> None:
        self.p = self.maxdeg = p
        self.edge_dofs = p - 1
        self.facet_dofs = (p - 2) * (p - 3) // 2 if p > 3 else 0
        self.interior_dofs = (p - 3) * (p - 4) * (p - 5) // 6 if p > 5 else 0
        self.dofnames = ["u"] * (1 + self.edge_dofs + self.facet_dofs + self.interior_dofs)
        self.doflocs = np.where(modes(p) < 2, modes(p), 0.5)

    def lbasis(self, X: np.ndarray, i: int) -> tuple[np.ndarray, np.ndarray]:
        """Value and gradient of basis function ``i`` at reference points."""
        (f, g, h), (a, b, c) = (line(self.p, x) for x in X), modes(self.p)[i]
        slopes = [f[1][a] * g[0][b] * h[0][c], f[0][a] * g[1][b] * h[0][c], f[0][a] * g[0][b] * h[1][c]]
        return f[0][a] * g[0][b] * h[0][c], np.array(slopes)


def line(p: int, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(p + 1, *x) twice: the 1D functions on (0, 1) and their slopes."""
    t = 2 * np.asarray(x, float) - 1
    v = np.moveaxis(legendre.legvander(t, p), -1, 0)
    f, d = np.empty((p + 1, *t.shape)), np.empty((p + 1, *t.shape))
    f[0], f[1], d[0], d[1] = (1 - t) / 2, (1 + t) / 2, -1.0, 1.0
    for k in range(2, p + 1):
        f[k] = (v[k] - v[k - 2]) / np.sqrt(2 * (2 * k - 1))
        d[k] = np.sqrt(2 * (2 * k - 1)) * v[k - 1]
    return f, d


@lru_cache
def modes(p: int, full: bool = False) -> np.ndarray:
    """(functions, 3): the 1D functions of each, in scikit-fem's order of vertices, edges, facets, interior; of the
    trunk space, or the ``full`` tensor product."""
    corners = RefHex.p.T.astype(int)
    functions = [list(c) for c in corners]
    for entity in (RefHex.edges, RefHex.facets):
        for at in entity:
            c = corners[list(at)]
            free = np.flatnonzero((c != c[0]).any(axis=0))
            for k in np.ndindex(*[p - 1] * len(free)):
                if full or sum(k) + 2 * len(free) <= p:
                    one = c[0].copy()
                    one[free] = np.array(k) + 2
                    functions.append(list(one))
    inside = (k for k in np.ndindex(p + 1, p + 1, p + 1) if min(k) > 1 and (full or sum(k) <= p))
    return np.array([*functions, *inside])


def products(kinds: np.ndarray, X: np.ndarray, along: int | None = None) -> np.ndarray:
    """(points, functions): products of the 1D functions ``kinds`` (functions, 3) at reference points (3, points), or
    their slopes along an axis."""
    p = int(kinds.max())
    x, y, z = (line(p, at)[int(d == along)][k] for d, (at, k) in enumerate(zip(X, kinds.T, strict=True)))
    return (x * y * z).T


@lru_cache(maxsize=4096)
def active(p: int, degrees: Degrees) -> np.ndarray:
    """(functions,): which are there for degrees along x, y, z: a rule of each entity's own intervals alone."""
    k, bubble, d = modes(p), modes(p) > 1, np.array(degrees)
    mask: np.ndarray = np.all((k <= d) | ~bubble, axis=1)
    return mask & ((k * bubble).sum(axis=1) <= (bubble * d).max(axis=1, initial=0))


def gauss(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Points and weights of Gauss's rule on (0, 1)."""
    x, w = legendre.leggauss(n)
    return (x + 1) / 2, w / 2


@lru_cache
def factors(p: int) -> tuple[np.ndarray, np.ndarray]:
    """(functions, functions) twice: the 1D mass and stiffness that every matrix of a brick is a product of."""
    x, w = gauss(p + 1)
    f, d = line(p, x)
    mass, stiffness = (np.where(abs(m) < 1e-14, 0.0, m) for m in ((f * w) @ f.T, (d * w) @ d.T))
    return mass, stiffness


@lru_cache(maxsize=512)
def local(p: int, degrees: Degrees) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The reference matrices of the functions that are active for degrees along x, y, z, made of their 1D factors. The
    rows and columns (pairs,) among the functions whose entries are not zero, and (4, pairs) the x, y, z stiffness and
    the mass of the unit cube."""
    if min(degrees) < p:  # a part of the matrices of the whole degree
        (rows, columns, entries), there = local(p, (p, p, p)), active(p, degrees)
        kept = np.flatnonzero(there[rows] & there[columns])
        return rows[kept], columns[kept], entries[:, kept]
    both = np.any(factors(p), axis=0)
    x, y, z = kinds = modes(p).T
    r, c = np.nonzero(both[x[:, None], x] & both[y[:, None], y] & both[z[:, None], z])
    m, s = ([t[k[r], k[c]] for k in kinds] for t in factors(p))
    entries = np.array([s[0] * m[1] * m[2], m[0] * s[1] * m[2], m[0] * m[1] * s[2], m[0] * m[1] * m[2]])
    filled = np.flatnonzero(entries.any(axis=0))
    return r[filled], c[filled], entries[:, filled]


@lru_cache(maxsize=512)
def separate(p: int, degrees: Degrees) -> csr_array:
    """(4 functions, functions): the entries of `local` as matrices, one below the other."""
    (rows, columns, entries), n = local(p, degrees), len(modes(p))
    starts = np.append(0, np.tile(np.bincount(rows, minlength=n), 4).cumsum())
    return csr_array((entries.ravel(), np.tile(columns, 4), starts), shape=(4 * n, n))


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


Side = tuple[Rule, np.ndarray]
"""The rule of a side of the reference cell, with exact zeros of what vanishes there, and its outward normal, as long as
the parallelogram that two of its edges span."""

Values = Callable[..., np.ndarray]
"""(points, functions): those of a cell at reference points (3, points), or their slopes along an axis."""


def product_rule(*counts: int) -> tuple[np.ndarray, np.ndarray]:
    """Points (points, axes) and weights (points,) of Gauss's rule on the unit cube with ``counts`` points along the
    axes; one point without axes."""
    rules = [gauss(count) for count in counts]
    points = np.array([*product(*(x for x, _ in rules))]).reshape(-1, len(counts))
    return points, np.array([np.prod(each) for each in product(*(w for _, w in rules))])


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
    # Functions are of size one: smaller ones vanish on the side.
    values = np.where(np.abs(on_side.values).max(axis=0) > 1e-12, on_side.values, 0.0)
    return on_side._replace(values=values), normal
