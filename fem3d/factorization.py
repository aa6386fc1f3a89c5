"""Sparse factorization of symmetric positive definite matrices."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csc_array, eye_array
from scipy.sparse.linalg import splu

SYMMETRIC = {"diag_pivot_thresh": 0.0, "options": {"SymmetricMode": True}}
MANY = 2_500  # groups from which on a dissection is tried beside minimum degree: below it takes longer than it saves
LEAF = 40  # groups up to which a piece isn't dissected further


class Factors:
    """LU factors of a symmetric positive definite matrix without pivoting, its unknowns eliminated by ``groups`` (n,):
    all functions of one vertex, edge, facet or cell at once, for orderings of the matrix itself are slow and poor on
    the cliques of high degrees. The groups go by minimum degree or, where that fills in less, as a large solid body's
    do, by nested dissection of their ``places`` (groups of all unknowns, 3).
    """

    def __init__(self, matrix: csc_array, groups: np.ndarray, places: np.ndarray) -> None:
        own, group = np.unique(groups, return_inverse=True)
        n = len(own)
        columns = np.repeat(group, np.diff(matrix.indptr))
        graph = csc_array((np.full(matrix.nnz, -1.0), (group[matrix.indices], columns)), shape=(n, n))
        # Made definite, for what is known of an ordering comes with factors of it.
        graph = csc_array(graph - graph.sum() * eye_array(n))
        # Of groups of one function each its factors take as long as the matrix's: none are made to choose by.
        single = MANY < n == len(group)
        rank = np.argsort(dissection(places[own], graph)) if single else _better(graph, places[own])
        self._order = np.argsort(rank[group], kind="stable")
        ordered = csc_array(csc_array(matrix[self._order])[:, self._order])
        self._lu = splu(ordered, permc_spec="NATURAL", **SYMMETRIC)

    def solve(self, b: np.ndarray) -> np.ndarray:
        """The solution for one right-hand side (n,)."""
        x = np.empty_like(b)
        x[self._order] = self._lu.solve(b[self._order])
        return x


def _better(graph: csc_array, places: np.ndarray) -> np.ndarray:
    """(n,): when each node of a graph is eliminated, in that of two orders which fills in less."""
    by_degree = splu(graph, permc_spec="MMD_AT_PLUS_A", **SYMMETRIC)
    if len(places) > MANY:
        order = dissection(places, graph)
        if splu(csc_array(graph[order][:, order]), permc_spec="NATURAL", **SYMMETRIC).L.nnz < by_degree.L.nnz:
            return np.argsort(order)
    found: np.ndarray = by_degree.perm_c
    return found


def dissection(places: np.ndarray, graph: csc_array) -> np.ndarray:
    """(n,): an order of elimination in which a graph of neighbours at some places (n, 3) fills in little.

    Halves on either side of a plane come first, then what joins them (George, SIAM J. Numer. Anal. 10, 1973).
    """
    coo = graph.tocoo()
    found: list[np.ndarray] = []
    side = np.zeros(len(places), np.int8)

    def split(nodes: np.ndarray, rows: np.ndarray, columns: np.ndarray) -> None:
        along = places[nodes][:, int(np.ptp(places[nodes], axis=0).argmax())]
        right = along > np.median(along)
        if len(nodes) <= LEAF or not right.any():
            found.append(nodes)
            return
        side[nodes] = np.where(right, 2, 1)
        # What is left of the plane and has a neighbour right of it joins the halves.
        joins = np.unique(rows[(side[rows] == 1) & (side[columns] == 2)])
        side[joins] = 3
        halves = []
        for which in (1, 2):
            within = (side[rows] == which) & (side[columns] == which)
            halves.append((nodes[side[nodes] == which], rows[within], columns[within]))
        for half in halves:
            if len(half[0]):
                split(*half)
        found.append(joins)

    split(np.arange(len(places)), coo.row, coo.col)
    return np.concatenate(found)
