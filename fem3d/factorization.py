"""Sparse factorization of symmetric positive definite matrices."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.sparse import csc_array, eye_array
from scipy.sparse.linalg import splu

SYMMETRIC = {"diag_pivot_thresh": 0.0, "options": {"SymmetricMode": True}}
MANY = 2_500  # groups from which on a dissection is tried beside minimum degree: below it takes longer than it saves
LEAF = 40  # groups up to which a piece isn't dissected further


def entities(mesh: Any, dofs: Any, vertices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(functions,): a number for each vertex, edge, facet and cell of scikit-fem's numbering that has functions; and
    where each is (entities, 3), the mean of its ``vertices`` (3, vertices)."""
    found, places = np.empty(int(dofs.N), int), [np.empty((0, 3))]
    kinds = (
        (dofs.nodal_dofs, lambda: np.arange(vertices.shape[1])[None]), (dofs.edge_dofs, lambda: mesh.edges),
        (dofs.facet_dofs, lambda: mesh.facets), (dofs.interior_dofs, lambda: mesh.t),
    )  # fmt: skip
    for part, corners in kinds:
        if part is not None and part.size:
            found[part] = sum(map(len, places)) + np.arange(part.shape[1])
            places.append(vertices[:, corners()].mean(axis=1).T)
    return found, np.concatenate(places)


class Ordering:
    """When the groups of a mesh's functions, those of one vertex, edge, facet or cell at ``places`` (groups, 3), are
    eliminated: a group at once, for orderings of a matrix itself are slow and poor on the cliques of high degrees.

    The groups go by minimum degree or, where that fills in less, as a large solid body's do, by nested dissection. It
    is found for the first matrix, and serves all others whose groups that one has too.
    """

    def __init__(self, places: np.ndarray) -> None:
        self._places, self._rank = places, np.full(len(places), -1)

    def rank(self, matrix: csc_array, groups: np.ndarray) -> np.ndarray:
        """(n,): when the group of each unknown of a matrix is eliminated."""
        if (self._rank[groups] < 0).any():
            own, group = np.unique(groups, return_inverse=True)
            self._rank[own] = self._found(matrix, self._places[own], group)
        return self._rank[groups]

    @staticmethod
    def _found(matrix: csc_array, places: np.ndarray, group: np.ndarray) -> np.ndarray:
        """(places,): when each group is eliminated, in that of two orders which fills in less."""
        n = len(places)
        columns = np.repeat(group, np.diff(matrix.indptr))
        graph = csc_array((np.full(matrix.nnz, -1.0), (group[matrix.indices], columns)), shape=(n, n))
        # Made definite, for what is known of an ordering comes with factors of it.
        graph = csc_array(graph - graph.sum() * eye_array(n))
        if MANY < n == len(group):
            # Of groups of one function each factors take as long as the matrix's: none are made to choose by.
            return np.argsort(dissection(places, graph))
        by_degree = splu(graph, permc_spec="MMD_AT_PLUS_A", **SYMMETRIC)
        if n > MANY:
            order = dissection(places, graph)
            if splu(part(graph, order), permc_spec="NATURAL", **SYMMETRIC).L.nnz < by_degree.L.nnz:
                return np.argsort(order)
        return by_degree.perm_c


class Factors:
    """LU factors of a symmetric positive definite matrix without pivoting, its unknowns being of ``groups`` (n,)."""

    def __init__(self, matrix: csc_array, groups: np.ndarray, ordering: Ordering) -> None:
        self._order = np.argsort(ordering.rank(matrix, groups), kind="stable")
        self._lu = splu(part(matrix, self._order), permc_spec="NATURAL", **SYMMETRIC)

    def solve(self, b: np.ndarray) -> np.ndarray:
        """The solution for one right-hand side (n,)."""
        x = np.empty_like(b)
        x[self._order] = self._lu.solve(b[self._order])
        return x


def part(matrix: csc_array, kept: np.ndarray) -> csc_array:
    """The rows and columns (n,) of a square matrix, in their order; faster than by scipy's indices of rows."""
    place = np.full(matrix.shape[0], -1, matrix.indices.dtype)
    place[kept] = np.arange(len(kept))
    columns = csc_array(matrix[:, kept])
    rows = place[columns.indices]
    there = rows >= 0
    starts = np.concatenate([[0], np.cumsum(there)])[columns.indptr]
    return csc_array((columns.data[there], rows[there], starts), (len(kept),) * 2)


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
        # What has a neighbour across the plane joins the halves: of its two sides the smaller one.
        across = (side[rows] == 1) & (side[columns] == 2)
        joins = min((np.unique(each[across]) for each in (rows, columns)), key=len)
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
