"""Eq 3 in one layer by Crank-Nicolson: Appendix B with its misprints corrected.

    A(gamma) T_(j+1) = A(-gamma) T_j + b,   gamma = alpha dt/dx^2,   b = gamma/2 (f(t_j) + f(t_(j+1))) at both ends

with A(gamma) tridiagonal, 1 + gamma on the diagonal and -gamma/2 beside it, of size N_x - 1. The paper prints alpha and
gamma inverted (B.3, B.4), A(gamma) on both sides (B.6) and b without gamma (B.8).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_banded

from reduced1d.device.lumped import Slab


@dataclass(frozen=True)
class LayerStep:
    """Some steps with constant end temperatures as one map: inner' = ``inner`` @ inner + ``ends`` @ (lower, upper).

    ``inner`` (nx - 1, nx - 1) and ``ends`` (nx - 1, 2).
    """

    inner: np.ndarray
    ends: np.ndarray


def mesh_ratio(slab: Slab, nx: int, dt: float) -> float:
    """The paper's gamma = alpha dt/dx^2 for nx intervals and a step dt in s (B.4 corrected)."""
    return slab.diffusivity * dt / (slab.thickness / nx) ** 2


def crank_nicolson(inner: np.ndarray, gamma: float, before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """One step of Crank-Nicolson for the inner temperatures (nx - 1, ...), any unit of temperature.

    ``before`` and ``after`` (2, ...) are the temperatures of the lower and upper face at the step's two ends.
    """
    n = len(inner)
    padded = np.concatenate([before[:1], inner, before[1:]])
    right = (1 - gamma) * inner + gamma / 2 * (padded[:-2] + padded[2:])
    right[0] += gamma / 2 * after[0]
    right[-1] += gamma / 2 * after[1]
    bands = np.zeros((3, n))
    bands[0, 1:] = bands[2, :-1] = -gamma / 2
    bands[1] = 1 + gamma
    return np.asarray(solve_banded((1, 1), bands, right))


def layer_step(slab: Slab, nx: int, nt: int, dt: float) -> LayerStep:
    """nt steps of Crank-Nicolson over dt (s) on nx intervals, with end temperatures that do not change meanwhile."""
    gamma = mesh_ratio(slab, nx, dt / nt)
    inner, ends = np.eye(nx - 1), np.zeros((nx - 1, 2))
    none, unit = np.zeros((2, nx - 1)), np.eye(2)
    for _ in range(nt):
        inner, ends = crank_nicolson(inner, gamma, none, none), crank_nicolson(ends, gamma, unit, unit)
    return LayerStep(inner, ends)
