"""The unsymmetric rest R of a nonlinear problem's tangent K + R, and solutions with both.

(K + R) d = b is solved as (1 + K^-1 R) d = K^-1 b by GMRES (Saad and Schultz, SIAM J. Sci. Stat. Comput. 7, 1986), many
right-hand sides side by side. K^-1 R is compact where R has fewer derivatives than K, and a few steps do.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_array

from fem3d.problems.cholesky import part
from scenes.errors import NumericsError

MOST = 80  # steps of GMRES
SOLVED = 1e-6  # relative residual of a dual solution


@dataclass(frozen=True, eq=False)
class Rest:
    """``matrix`` (n, n) + ``columns``^T ``rows``, the latter two (k, n) each."""

    matrix: csc_array
    columns: np.ndarray
    rows: np.ndarray

    def __call__(self, u: np.ndarray) -> np.ndarray:
        """(..., n): its product with vectors (..., n)."""
        return (self.matrix @ u.T).T + (u @ self.rows.T) @ self.columns

    def transposed(self) -> Rest:
        """The transposed one."""
        return Rest(csc_array(self.matrix.T), self.rows, self.columns)

    def times(self, factor: float) -> Rest:
        """The same, some times as large."""
        return Rest(csc_array(factor * self.matrix), factor * self.columns, self.rows)

    def part(self, kept: np.ndarray) -> Rest:
        """The rows and columns of some unknowns."""
        return Rest(part(self.matrix, kept), self.columns[:, kept], self.rows[:, kept])

    def solve(
        self, inverse: Callable[[np.ndarray], np.ndarray], loads: np.ndarray, solved: float = SOLVED
    ) -> np.ndarray:
        """(k, n): the solutions of (K + R) d = load for loads (k, n) and the ``inverse`` of K, to a relative residual
        of ``solved``. Raises NumericsError where that isn't reached."""
        right = inverse(loads)
        size = np.linalg.norm(right, axis=1)
        # A load of nothing has nothing for its answer.
        basis = [right / np.where(size > 0, size, 1.0)[:, None]]
        count = len(right)
        upper = np.zeros((count, MOST + 1, MOST))
        solutions = np.zeros_like(right)
        first = np.zeros((count, MOST + 1))
        first[:, 0] = size
        for step in range(MOST):
            new = basis[-1] + inverse(self(basis[-1]))
            for _ in range(2):
                for i, v in enumerate(basis):
                    share = (v * new).sum(axis=1)
                    upper[:, i, step] += share
                    new -= share[:, None] * v
            length = np.linalg.norm(new, axis=1)
            upper[:, step + 1, step] = length
            shares, errors = _least(upper[:, : step + 2, : step + 1], first[:, : step + 2])
            if (errors <= solved * size).all():
                solutions = sum((shares[:, i, None] * v for i, v in enumerate(basis)), solutions)
                return solutions
            basis.append(new / np.where(length > 1e-300, length, 1.0)[:, None])
        raise NumericsError("the problem linearized about a state is singular, or close to it")


def _least(matrices: np.ndarray, right: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The least-squares solutions (k, m) of matrices (k, m + 1, m), and their residuals (k,)."""
    shares = np.array([np.linalg.lstsq(m, r, rcond=None)[0] for m, r in zip(matrices, right, strict=True)])
    return shares, np.linalg.norm(right - np.einsum("kij,kj->ki", matrices, shares), axis=1)
