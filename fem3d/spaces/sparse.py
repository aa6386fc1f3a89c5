"""Sparse matrices: sums of entries, pairs of matrices of one pattern, and submatrices.

A stiffness and a mass matrix are to have one pattern, for one elimination order and for quick sums, but SciPy drops the
entries of sums and products that become zero. Here alone complex numbers carry two real ones: the entries of two
matrices, which one conversion then adds up, or an entry and a one beside it, which keeps the entry.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from scipy.sparse import coo_array, csc_array

Entries = tuple[np.ndarray, np.ndarray, np.ndarray]
"""Entries of a matrix, which add up: their values (n,), or of two matrices (2, n), their rows and columns."""


def sum_entries(entries: Iterable[Entries], size: int) -> csc_array:
    """(size, size): the matrix of some entries."""
    none = np.empty(0, np.int32)
    values, rows, columns = (np.concatenate(each) for each in zip((np.empty(0), none, none), *entries, strict=True))
    return csc_array(coo_array((values, (rows, columns)), shape=(size, size)))


def sum_pairs(entries: Sequence[Entries], size: int, mirrored: bool = False) -> tuple[csc_array, csc_array]:
    """(size, size) twice: two matrices of one pattern; ``mirrored`` adds their transposed matrices."""
    none, both = np.empty(0, np.int32), np.empty(sum(len(rows) for _, rows, _ in entries), complex)
    for n, part in enumerate((both.real, both.imag)):
        part[:] = np.concatenate([np.empty(0), *(values[n] for values, _, _ in entries)])
    rows, columns = (np.concatenate([none, *(each[n] for each in entries)]) for n in (1, 2))
    matrix = csc_array(coo_array((both, (rows, columns)), shape=(size, size)))
    # To the last digit, so that entries that cancel are there on neither side of the diagonal or on both.
    matrix = csc_array(matrix + matrix.T) if mirrored else matrix
    return _part(matrix, "real"), _part(matrix, "imag")


def add(a: csc_array, b: csc_array) -> csc_array:
    """a + b, of the pattern of both."""
    return _part(csc_array(_marked(a) + _marked(b)), "real")


def congruent(a: csc_array, p: csc_array) -> csc_array:
    """p^T a p, also with the entries that become zero."""
    return _part(csc_array(p.T @ _marked(a) @ p), "real")


def _marked(matrix: csc_array) -> csc_array:
    """A matrix with an imaginary unit beside each entry."""
    return csc_array((matrix.data + 1j, matrix.indices, matrix.indptr), matrix.shape)


def _part(matrix: csc_array, name: str) -> csc_array:
    """The part of a complex matrix, "real" or "imag", of the same pattern."""
    return csc_array((getattr(matrix.data, name).copy(), matrix.indices, matrix.indptr), matrix.shape)


def submatrix(matrix: csc_array, kept: np.ndarray) -> csc_array:
    """The rows and columns (n,) of a square matrix, in their order; faster than by scipy's indices of rows."""
    place = np.full(matrix.shape[0], -1, matrix.indices.dtype)
    place[kept] = np.arange(len(kept))
    columns = csc_array(matrix[:, kept])
    rows = place[columns.indices]
    inside = rows >= 0
    if inside.all():
        return csc_array((columns.data, rows, columns.indptr), (len(kept),) * 2)
    starts = np.concatenate([[0], np.cumsum(inside)])[columns.indptr].astype(matrix.indptr.dtype)
    return csc_array((columns.data[inside], rows[inside], starts), (len(kept),) * 2)
