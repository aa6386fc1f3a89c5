"""Functions and integrals on a block of bricks, one axis at a time.

A function on a block is an array of nodal values (nx, ny, nz); at the Gauss points it is an array (qx, qy, qz). Each
operation applies three 1D matrices in turn, which costs a few products of small dense matrices.
"""

from __future__ import annotations

import numpy as np

from meshes.axis import Part

Parts = tuple[Part, Part, Part]


def along(a: np.ndarray, b: np.ndarray, c: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Apply a along x, b along y, c along z to an array (nx, ny, nz)."""
    first = (a @ u.reshape(u.shape[0], -1)).reshape(a.shape[0], *u.shape[1:])
    return b @ first @ c.T


def values(parts: Parts, u: np.ndarray) -> np.ndarray:
    """u at the Gauss points."""
    x, y, z = parts
    return along(x.values, y.values, z.values, u)


def gradient(parts: Parts, u: np.ndarray) -> np.ndarray:
    """(3, qx, qy, qz): grad u at the Gauss points."""
    x, y, z = parts
    return np.stack([
        along(x.slopes, y.values, z.values, u),
        along(x.values, y.slopes, z.values, u),
        along(x.values, y.values, z.slopes, u),
    ])  # fmt: skip


def weights(parts: Parts) -> np.ndarray:
    """Quadrature weights at the Gauss points (m3)."""
    x, y, z = parts
    return x.weights[:, None, None] * y.weights[:, None] * z.weights


def load(parts: Parts, f: np.ndarray) -> np.ndarray:
    """Integral of f v for every basis function v; f is given at the Gauss points."""
    x, y, z = parts
    return along(x.values.T, y.values.T, z.values.T, weights(parts) * f)


def gradient_load(parts: Parts, f: np.ndarray) -> np.ndarray:
    """Integral of f . grad v for every basis function v; f (3, qx, qy, qz) is given at the Gauss points."""
    x, y, z = parts
    f = weights(parts) * f
    return (
        along(x.slopes.T, y.values.T, z.values.T, f[0])
        + along(x.values.T, y.slopes.T, z.values.T, f[1])
        + along(x.values.T, y.values.T, z.slopes.T, f[2])
    )


def integral(parts: Parts) -> np.ndarray:
    """(nx, ny, nz): integral of every basis function."""
    x, y, z = parts
    return x.integral[:, None, None] * y.integral[:, None] * z.integral


def pattern(parts: Parts, numbers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows and columns (global numbers) of the block's matrices, in the order of `mass` and `stiffness`."""
    x, y, z = parts
    rows = numbers[x.rows[:, None, None], y.rows[:, None], z.rows]
    columns = numbers[x.columns[:, None, None], y.columns[:, None], z.columns]
    return rows.ravel(), columns.ravel()


def mass(parts: Parts) -> np.ndarray:
    """Integrals of u v on the pattern."""
    x, y, z = parts
    return (x.mass[:, None, None] * (y.mass[:, None] * z.mass)).ravel()


def stiffness(parts: Parts) -> np.ndarray:
    """Integrals of grad u . grad v on the pattern."""
    x, y, z = parts
    in_x = x.stiffness[:, None, None] * (y.mass[:, None] * z.mass)
    across = y.stiffness[:, None] * z.mass + y.mass[:, None] * z.stiffness
    return (in_x + x.mass[:, None, None] * across).ravel()
