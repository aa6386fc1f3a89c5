"""The trunk (serendipity) hexahedron of any degree for scikit-fem, its reference matrices, and quadrature.

A basis function N_i(x, y, z) = f_a(x) f_b(y) f_c(z) has the multi-index (a, b, c). The 1D functions f_0 and f_1 are
linear, and f_k for k >= 2 is the integral of the Legendre polynomial k - 1. Edges carry k = 2 ... p, facets pairs with
j + k <= p, the interior triples with i + j + k <= p (Szabo and Babuska, Finite Element Analysis, 1991, section 6). All
bricks of a grid are oriented alike, so that odd functions match. Functions of lower degrees span the lower spaces:
leaving some out makes spaces of mixed and of nested degrees.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre
from scipy.sparse import csr_array
from skfem.element import ElementH1
from skfem.refdom import Refdom, RefHex

Degrees = tuple[int, int, int]
Values = Callable[..., np.ndarray]
"""(points, functions): the functions of a cell at reference points (3, points), or their slopes along an axis."""


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
        self.doflocs = np.where(multi_indices(p) < 2, multi_indices(p), 0.5)

    def lbasis(self, X: np.ndarray, i: int) -> tuple[np.ndarray, np.ndarray]:
        """Value and gradient of basis function ``i`` at reference points."""
        (f, g, h), (a, b, c) = (line_functions(self.p, x) for x in X), multi_indices(self.p)[i]
        slopes = [f[1][a] * g[0][b] * h[0][c], f[0][a] * g[1][b] * h[0][c], f[0][a] * g[0][b] * h[1][c]]
        return f[0][a] * g[0][b] * h[0][c], np.array(slopes)


def line_functions(p: int, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
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
def multi_indices(p: int, full: bool = False) -> np.ndarray:
    """(functions, 3): the multi-index of each function, in scikit-fem's order of vertices, edges, facets, interior; of
    the trunk space, or the ``full`` tensor product."""
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


def shape_functions(indices: np.ndarray, X: np.ndarray, along: int | None = None) -> np.ndarray:
    """(points, functions): the functions of multi-indices (functions, 3) at points (3, points), or their slopes."""
    p = int(indices.max())
    x, y, z = (line_functions(p, at)[int(d == along)][k] for d, (at, k) in enumerate(zip(X, indices.T, strict=True)))
    return (x * y * z).T


@lru_cache(maxsize=4096)
def active_functions(p: int, degrees: Degrees) -> np.ndarray:
    """(functions,): which of the functions of degree p a cell has whose degrees along x, y, z are lower."""
    k, bubble, d = multi_indices(p), multi_indices(p) > 1, np.array(degrees)
    mask: np.ndarray = np.all((k <= d) | ~bubble, axis=1)
    return mask & ((k * bubble).sum(axis=1) <= (bubble * d).max(axis=1, initial=0))


def gauss(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Points and weights of Gauss's rule on (0, 1)."""
    x, w = legendre.leggauss(n)
    return (x + 1) / 2, w / 2


@lru_cache
def line_matrices(p: int) -> tuple[np.ndarray, np.ndarray]:
    """(p + 1, p + 1) twice: the 1D mass int f_j f_k and stiffness int f_j' f_k' on (0, 1)."""
    x, w = gauss(p + 1)
    f, d = line_functions(p, x)
    mass, stiffness = (np.where(abs(m) < 1e-14, 0.0, m) for m in ((f * w) @ f.T, (d * w) @ d.T))
    return mass, stiffness


@lru_cache(maxsize=512)
def reference_matrices(p: int, degrees: Degrees) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The matrices of the unit cube, products of 1D matrices, for the functions that `active_functions` keeps: rows and
    columns (pairs,) of the entries that are not zero; and (4, pairs), for d = x, y, z the stiffness
    int dN_i/dd dN_j/dd, and the mass int N_i N_j."""
    if min(degrees) < p:  # a part of the matrices of the whole degree
        (rows, columns, entries), there = reference_matrices(p, (p, p, p)), active_functions(p, degrees)
        kept = np.flatnonzero(there[rows] & there[columns])
        return rows[kept], columns[kept], entries[:, kept]
    both = np.any(line_matrices(p), axis=0)
    x, y, z = kinds = multi_indices(p).T
    r, c = np.nonzero(both[x[:, None], x] & both[y[:, None], y] & both[z[:, None], z])
    m, s = ([t[k[r], k[c]] for k in kinds] for t in line_matrices(p))
    entries = np.array([s[0] * m[1] * m[2], m[0] * s[1] * m[2], m[0] * m[1] * s[2], m[0] * m[1] * m[2]])
    filled = np.flatnonzero(entries.any(axis=0))
    return r[filled], c[filled], entries[:, filled]


@lru_cache(maxsize=512)
def stacked_matrices(p: int, degrees: Degrees) -> csr_array:
    """(4 functions, functions): the `reference_matrices`, one below the other."""
    (rows, columns, entries), n = reference_matrices(p, degrees), len(multi_indices(p))
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


def cube_rule(*counts: int) -> tuple[np.ndarray, np.ndarray]:
    """(points, axes) and (points,): Gauss's rule with ``counts`` points along the axes; one point without axes."""
    rules = [gauss(count) for count in counts]
    weights = np.array([np.prod(each) for each in product(*(w for _, w in rules))])
    return np.array([*product(*(x for x, _ in rules))]).reshape(len(weights), len(counts)), weights


def make_rule(
    points: np.ndarray, weights: np.ndarray, functions: Values, kept: np.ndarray | slice = slice(None)
) -> Rule:
    """Return a rule for the ``kept`` functions of a cell."""
    every = [functions(points, along) for along in (None, 0, 1, 2)]
    values, *slopes = (each[:, kept] for each in every)
    return Rule(points, weights, np.arange(every[0].shape[1])[kept], values, np.array(slopes))


def make_side(reference: type[Refdom], number: int, plane: tuple[np.ndarray, np.ndarray], functions: Values) -> Side:
    """A side of scikit-fem's ``reference`` cell, by a rule of the ``plane``: points (2, points), weights (points,)."""
    corners = reference.p[:, reference.facets[number]]
    along = np.stack([corners[:, 1] - corners[:, 0], corners[:, -1] - corners[:, 0]], axis=1)
    normal = np.cross(along[:, 0], along[:, 1])
    normal = normal * np.sign(normal @ (corners[:, 0] - reference.p.mean(axis=1)))
    on_side = make_rule(corners[:, :1] + along @ plane[0], plane[1], functions)
    # Functions are of size one: smaller ones vanish on the side.
    values = np.where(np.abs(on_side.values).max(axis=0) > 1e-12, on_side.values, 0.0)
    return on_side._replace(values=values), normal
