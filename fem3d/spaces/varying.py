"""Matrices of bricks for coefficients that vary within a cell: from their Legendre coefficients, as sums of products of
1D integrals.

A coefficient is taken up to a total degree in a cell that follows from how much it varies there. That is enough for the
tangent of a law: Newton's residual has the law itself, by quadrature, and the tangent's error is but a factor on what a
step leaves.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre

from fem3d.spaces.element import Degrees, active, gauss, line, modes

# Degrees, with the ratio of the largest to the smallest coefficient in a cell up to which each serves: of a power law
# over such a ratio it leaves some 1e-2, and Newton's steps converge like the powers of that.
DEGREES = ((1.1, 1), (2.0, 3), (8.0, 6), (np.inf, 9))

# Bytes of the tables that are kept, an eighth of what a run may have: one of the highest degrees takes 0.3 GB.
KEPT = 5e8


def by_degree(ratio: np.ndarray) -> list[tuple[int, np.ndarray]]:
    """The degrees for coefficients whose largest is so many times (cells,) the smallest in a cell, each with its
    cells."""
    at = np.searchsorted([most for most, _ in DEGREES], ratio)
    return [(DEGREES[i][1], np.flatnonzero(at == i)) for i in np.unique(at).tolist()]


@lru_cache
def _powers(degree: int) -> np.ndarray:
    """(modes, 3): the degrees of the modes along the axes."""
    return np.array([k for k in np.ndindex(*3 * [degree + 1]) if sum(k) <= degree])


class Reference(NamedTuple):
    """``conduction`` and ``transport`` (3, modes, n n): for each axis the integrals over the unit cube of a Legendre
    mode times du/dx dv/dx, and times u dv/dx, v along the rows, for the n functions of a cell."""

    conduction: np.ndarray
    transport: np.ndarray


_tables: dict[tuple[int, Degrees, int], Reference] = {}


def reference(p: int, degrees: Degrees, degree: int) -> Reference:
    """The integrals of the functions that are active for degrees along x, y, z, with modes up to a total ``degree``.
    Those used last are kept."""
    key = p, degrees, degree
    table = _tables.pop(key, None) or _reference(*key)
    _tables[key] = table
    while len(_tables) > 1 and sum(t.conduction.nbytes + t.transport.nbytes for t in _tables.values()) > KEPT:
        del _tables[next(iter(_tables))]
    return table


def _reference(p: int, degrees: Degrees, degree: int) -> Reference:
    factors = modes(p)[np.flatnonzero(active(p, degrees))].T
    mass, stiffness, mixed = (_gathered(table, factors) for table in _moments(p, degree))
    powers, tables = _powers(degree), list[list[np.ndarray]]([[], []])
    for first in (stiffness, mixed):
        for d in range(3):
            parts = [(first if e == d else mass)[e][powers[:, e]] for e in range(3)]
            tables[first is mixed].append((parts[0] * parts[1] * parts[2]).reshape(len(powers), -1))
    return Reference(np.array(tables[0]), np.array(tables[1]))


def _gathered(table: np.ndarray, factors: np.ndarray) -> list[np.ndarray]:
    """For each axis (powers, n, n): a table (powers, functions, functions) of 1D integrals at the factors (3, n) of the
    functions of a cell."""
    return [table[:, k[:, None], k] for k in factors]


@lru_cache
def _moments(p: int, degree: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(powers, p + 1, p + 1) three times: the 1D integrals of P_l f_a f_b, P_l f_a' f_b' and P_l f_a' f_b, with P_l of
    size one in the mean square."""
    x, w = gauss(p + 1 + (degree + 1) // 2)
    f, slopes = line(p, x)
    weighted = _legendre(x, degree) * w
    return (
        np.einsum("lx,ax,bx->lab", weighted, f, f),
        np.einsum("lx,ax,bx->lab", weighted, slopes, slopes),
        np.einsum("lx,ax,bx->lab", weighted, slopes, f),
    )


def coefficients(values: np.ndarray, points: np.ndarray, degree: int) -> np.ndarray:
    """(..., modes): the Legendre coefficients, up to a total ``degree``, of fields (..., points), times the weights of
    a rule of the unit cube with such points (3, points), on a lattice; zero of modes that these cannot tell."""
    polynomials = np.ones((len(_powers(degree)), points.shape[1]))
    for c, k in zip(points, _powers(degree).T, strict=True):
        polynomials *= np.where(k < len(np.unique(c)), 1.0, 0.0)[:, None] * _legendre(c, degree)[k]
    return values @ polynomials.T


def _legendre(x: np.ndarray, degree: int) -> np.ndarray:
    """(powers, points): Legendre's polynomials on (0, 1), of size one in the mean square."""
    scale = np.sqrt(2 * np.arange(degree + 1) + 1)
    return (legendre.legvander(2 * x - 1, degree) * scale).T
