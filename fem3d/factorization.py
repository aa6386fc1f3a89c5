"""Sparse factorization of symmetric positive definite matrices."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csc_array, eye_array
from scipy.sparse.linalg import splu

SYMMETRIC = {"diag_pivot_thresh": 0.0, "options": {"SymmetricMode": True}}


class Factors:
    """LU factors of a symmetric positive definite matrix without pivoting, its unknowns eliminated by ``groups`` (n,):
    all functions of one vertex, edge, facet or cell at once, these by minimum degree of their graph. Minimum degree of
    the matrix itself is slow and poor on the cliques of high degrees."""

    def __init__(self, matrix: csc_array, groups: np.ndarray) -> None:
        group = np.unique(groups, return_inverse=True)[1]
        n = int(group.max(initial=-1)) + 1
        columns = np.repeat(group, np.diff(matrix.indptr))
        graph = csc_array((np.full(matrix.nnz, -1.0), (group[matrix.indices], columns)), shape=(n, n))
        # Made definite, for the ordering comes with factors of it.
        graph = csc_array(graph - graph.sum() * eye_array(n))
        rank = splu(graph, permc_spec="MMD_AT_PLUS_A", **SYMMETRIC).perm_c[group]
        self._order = np.argsort(rank, kind="stable")
        ordered = csc_array(csc_array(matrix[self._order])[:, self._order])
        self._lu = splu(ordered, permc_spec="NATURAL", **SYMMETRIC)

    def solve(self, b: np.ndarray) -> np.ndarray:
        """The solution for one right-hand side (n,)."""
        x = np.empty_like(b)
        x[self._order] = self._lu.solve(b[self._order])
        return x
