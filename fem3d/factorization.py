"""Sparse factorization of symmetric positive definite matrices."""

from __future__ import annotations

from typing import Any

from scipy.sparse import csc_array
from scipy.sparse.linalg import splu


def factorize(matrix: csc_array) -> Any:
    """LU factors, with a method ``solve``, of a symmetric positive definite matrix whose rows are in elimination order
    already; no pivoting."""
    return splu(csc_array(matrix), permc_spec="NATURAL", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
