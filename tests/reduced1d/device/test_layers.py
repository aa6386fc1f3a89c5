"""Eq 3 in one layer: Crank-Nicolson (Appendix B) against the series of Appendix A, and B.3 and B.4 as printed.

Appendix A corrected: T = u + w, with u = T1 + (T2 - T1) x/L (A.9) and w = sum_n b_n sin(n pi x/L) exp(-alpha n^2 pi^2
t'/L^2) (A.14). When the end temperatures change, b_n changes by the sine coefficients of a straight line.
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from reduced1d.device.lumped import Slab
from reduced1d.device.schemes import crank_nicolson, layer_step, mesh_ratio

SLAB = Slab(thickness=10e-6, area=1e-7, conductivity=0.15, heat_capacity=970.0 * 1460.0)
TIME = SLAB.thickness**2 / SLAB.diffusivity
HISTORY = ((5.0, 1.0), (9.0, -2.0), (3.0, 3.5))


def exact(x, modes=400, each=0.02 * TIME):
    """T at the heights x after a history of end temperatures, each held for the same time."""
    n = np.arange(1, modes + 1)
    decay = np.exp(-SLAB.diffusivity * (n * np.pi / SLAB.thickness) ** 2 * each)
    T1, T2, b = 0.0, 0.0, np.zeros(modes)
    for new1, new2 in HISTORY:
        line = 2 / (n * np.pi) * ((T1 - new1) - (T2 - new2) * (-1.0) ** n)
        T1, T2, b = new1, new2, (b + line) * decay
    s = x / SLAB.thickness
    return T1 + (T2 - T1) * s + np.sin(np.pi * np.multiply.outer(s, n)) @ b


def by_crank_nicolson(nx, nt, each=0.02 * TIME, gamma=None):
    x = np.linspace(0, SLAB.thickness, nx + 1)
    inner = np.zeros(nx - 1)
    gamma = mesh_ratio(SLAB, nx, each / nt) if gamma is None else gamma
    for ends in HISTORY:
        ends = np.array(ends)
        for _ in range(nt):
            inner = crank_nicolson(inner, gamma, ends, ends)
    return x, np.r_[HISTORY[-1][0], inner, HISTORY[-1][1]]


def test_appendix_b_agrees_with_appendix_a():
    x, T = by_crank_nicolson(nx=200, nt=400)
    assert np.abs(T - exact(x)).max() < 2e-3
    x, T = by_crank_nicolson(nx=25, nt=400)
    assert np.abs(T - exact(x)).max() > 2e-3  # the tolerance sees a grid eight times coarser


@pytest.mark.parametrize("direction", ["time", "space"])
def test_crank_nicolson_is_of_second_order(direction):
    def error(nx, nt):
        x = np.linspace(0, 1, nx + 1)[1:-1]
        inner = np.sin(np.pi * x)
        gamma, zero = mesh_ratio(SLAB, nx, 0.2 * TIME / nt), np.zeros(2)
        for _ in range(nt):
            inner = crank_nicolson(inner, gamma, zero, zero)
        return np.abs(inner - np.sin(np.pi * x) * np.exp(-0.2 * np.pi**2)).max()

    errors = [error(400, n) for n in (5, 10, 20)] if direction == "time" else [error(n, 2000) for n in (8, 16, 32)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert_allclose(orders, 2.0, atol=0.1)


def test_step_matrices_are_the_steps_taken_one_by_one():
    by_inner, by_ends = layer_step(SLAB, 25, 10, 1e-6)
    inner, ends = np.linspace(2.0, 7.0, 24) ** 2, np.array([3.0, 40.0])
    slow = inner
    for _ in range(10):
        slow = crank_nicolson(slow, mesh_ratio(SLAB, 25, 1e-7), ends, ends)
    assert_allclose(by_inner @ inner + by_ends @ ends, slow, rtol=1e-13)


def test_b3_and_b4_as_printed_have_the_wrong_diffusivity():
    nx, nt, each = 100, 100, 0.02 * TIME
    oracle = exact(np.linspace(0, SLAB.thickness, nx + 1))
    assert np.abs(by_crank_nicolson(nx, nt)[1] - oracle).max() < 0.02
    printed = each / nt / (SLAB.diffusivity * (SLAB.thickness / nx) ** 2)
    assert np.abs(by_crank_nicolson(nx, nt, gamma=printed)[1] - oracle).max() > 1
