"""Reference cells in VTK's order of nodes, and their shape functions.

Lagrange's on the tetrahedron (total degree at most the order) and the hexahedron (degree in each coordinate), and the
serendipity functions of the hexahedron of 20 nodes.
"""

from __future__ import annotations

from functools import cache
from itertools import product

import numpy as np

TETRA, HEXAHEDRON = "tetra", "hexahedron"

_T = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
_T_EDGES = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]
_H = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
_H_EDGES = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]

FACETS = {
    TETRA: np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)]),
    HEXAHEDRON: np.array(
        [(0, 4, 7, 3), (1, 2, 6, 5), (0, 1, 5, 4), (3, 7, 6, 2), (0, 3, 2, 1), (4, 5, 6, 7)]
    ),
}  # fmt: skip
"""The corners of each face of a cell, anticlockwise seen from outside."""


@cache
def nodes(kind: str, order: int) -> np.ndarray:
    """(nodes, 3): the reference coordinates of a cell's nodes, order 1 or 2 (27 of a hexahedron)."""
    corners, edges = (_T, _T_EDGES) if kind == TETRA else (_H, _H_EDGES)
    found = np.array(corners, float)
    if order == 1:
        return found
    middles = [(found[a] + found[b]) / 2 for a, b in edges]
    if kind == TETRA:
        return np.concatenate([found, middles])
    faces = [found[f].mean(axis=0) for f in FACETS[HEXAHEDRON]]
    return np.concatenate([found, middles, faces, [[0.5, 0.5, 0.5]]])


def values(kind: str, order: int, x: np.ndarray) -> np.ndarray:
    """(points, nodes): the shape functions at reference points (points, 3)."""
    found: np.ndarray = _monomials(_exponents(kind, order), x) @ _inverse(kind, order)
    return found


def gradients(kind: str, order: int, x: np.ndarray) -> np.ndarray:
    """(3, points, nodes): their derivatives along the reference coordinates."""
    powers, found = _exponents(kind, order), []
    for d in range(3):
        less = powers.copy()
        less[:, d] = np.maximum(less[:, d] - 1, 0)
        found.append((_monomials(less, x) * powers[:, d]) @ _inverse(kind, order))
    return np.array(found)


@cache
def serendipity() -> np.ndarray:
    """(7, 20): the last 7 of a hexahedron's 27 nodes from its first 20."""
    own = [p for p in product(range(3), repeat=3) if sum(e for e in p if e > 1) <= 2]
    powers, at = np.array(own), nodes(HEXAHEDRON, 2)
    found: np.ndarray = _monomials(powers, at[20:]) @ np.linalg.inv(_monomials(powers, at[:20]))
    return found


def jacobians(kind: str, order: int, corners: np.ndarray, x: np.ndarray) -> np.ndarray:
    """(cells, points): the determinants of the maps of cells with nodes (cells, nodes, 3) at reference points."""
    slopes = np.einsum("dpn,cne->cpde", gradients(kind, order, x), corners)
    return np.linalg.det(slopes)


@cache
def _exponents(kind: str, order: int) -> np.ndarray:
    powers = product(range(order + 1), repeat=3)
    return np.array([p for p in powers if kind == HEXAHEDRON or sum(p) <= order])


@cache
def _inverse(kind: str, order: int) -> np.ndarray:
    return np.linalg.inv(_monomials(_exponents(kind, order), nodes(kind, order)))


def _monomials(powers: np.ndarray, x: np.ndarray) -> np.ndarray:
    found: np.ndarray = np.prod(x[:, None, :] ** powers, axis=-1)
    return found
