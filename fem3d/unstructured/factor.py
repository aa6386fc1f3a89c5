"""Sparse factorization of symmetric positive definite matrices of nodes in space.

Nested dissection by coordinates gives the order of elimination: halves on either side of a plane first, then the nodes
that join them (George, SIAM J. Numer. Anal. 10, 1973).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.sparse import csc_array
from scipy.sparse.linalg import splu

LEAF = 60


def dissection(points: np.ndarray, matrix: csc_array) -> np.ndarray:
    """(n,): the nodes (points (n, 3)) in an order in which a matrix of their neighbourhood fills in little."""
    coo = matrix.tocoo()
    pieces: list[np.ndarray] = []
    side = np.zeros(len(points), np.int8)

    def split(nodes: np.ndarray, rows: np.ndarray, columns: np.ndarray) -> None:
        if len(nodes) <= LEAF:
            pieces.append(nodes)
            return
        along = points[nodes][:, int(np.ptp(points[nodes], axis=0).argmax())]
        right = along > np.median(along)
        if not right.any():
            pieces.append(nodes)
            return
        side[nodes] = np.where(right, 2, 1)
        # What is left of the plane and has a neighbour right of it joins the halves.
        joins = np.unique(rows[(side[rows] == 1) & (side[columns] == 2)])
        side[joins] = 3
        inner = []
        for which in (1, 2):
            within = (side[rows] == which) & (side[columns] == which)
            inner.append((nodes[side[nodes] == which], rows[within], columns[within]))
        for half in inner:
            split(*half)
        pieces.append(joins)

    split(np.arange(len(points)), coo.row, coo.col)
    return np.concatenate(pieces)


def factorize(matrix: csc_array) -> Any:
    """What solves with a matrix whose rows are in order of elimination, with one step of refinement."""
    solve = splu(
        csc_array(matrix), permc_spec="NATURAL", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
    ).solve  # fmt: skip

    def refined(load: np.ndarray) -> np.ndarray:
        found: np.ndarray = solve(load)
        found += solve(load - matrix @ found)
        return found

    return refined
