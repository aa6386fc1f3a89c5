"""GMRES for linear systems without restarts (Saad and Schultz, SIAM J. Sci. Stat. Comput. 7, 1986)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.sparse.linalg import LinearOperator, gmres

from scenes.errors import NumericsError

# Steps, as long as seven factorizations: what needs more needs other factors.
MOST_GMRES = 100


def solve_by_gmres(
    product: Callable[[np.ndarray], np.ndarray], right: np.ndarray, tolerance: float, most: int = MOST_GMRES
) -> tuple[np.ndarray, int]:
    """The solution (n,) of ``product`` (x) = ``right`` to a relative residual, and the number of steps. The product is
    of a preconditioned matrix. Raises NumericsError where ``most`` steps do not suffice."""
    operator, norms = LinearOperator((len(right),) * 2, product, dtype=float), list[float]()
    solution, failed = gmres(
        operator, right, rtol=tolerance, restart=most, maxiter=1, callback=norms.append, callback_type="pr_norm"
    )
    # Rounding may leave a residual above the one that GMRES follows, which counts.
    if failed and not norms[-1] <= tolerance:
        raise NumericsError(f"properties vary so much with the temperature that {most} steps of GMRES find no solution")
    return solution, len(norms)
