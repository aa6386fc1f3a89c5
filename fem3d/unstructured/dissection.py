"""An order of elimination for nodes in space, by nested dissection of their coordinates.

Halves on either side of a plane come first, then the nodes that join them (George, SIAM J. Numer. Anal. 10, 1973).
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csc_array

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
