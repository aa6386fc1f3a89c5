"""Eq 3 in one layer: Crank-Nicolson (Appendix B) against the series of Appendix A, and B.3 and B.4 as printed.

Appendix A corrected: T = u + w, with u = T1 + (T2 - T1) x/L (A.9) and w = sum_n b_n sin(n pi x/L) exp(-alpha n^2 pi^2
t'/L^2) (A.14). When the end temperatures change, b_n changes by the sine coefficients of a straight line.
"""

from dataclasses import dataclass

import numpy as np
import pytest
from numpy.testing import assert_allclose

from reduced1d.device.lumped import Slab
from reduced1d.device.schemes import crank_nicolson, layer_step, mesh_ratio


@dataclass(frozen=True)
class ExactLayer:
    """A layer's temperature in K: ``ends``, its faces at x = 0 and x = L, and ``b`` (N,), the b_n of w."""

    slab: Slab
    ends: tuple[float, float]
    b: np.ndarray

    def hold(self, ends: tuple[float, float], duration: float) -> "ExactLayer":
        """The layer after its faces were put to ``ends`` (K) and held there for a ``duration`` in s."""
        n = np.arange(1, len(self.b) + 1)
        change = line_coefficients(self.ends[0] - ends[0], self.ends[1] - ends[1], len(n))
        rate = self.slab.diffusivity * (n * np.pi / self.slab.thickness) ** 2
        return ExactLayer(self.slab, ends, (self.b + change) * np.exp(-rate * duration))

    def temperature(self, x: np.ndarray) -> np.ndarray:
        """T in K at the heights x in m."""
        s = np.asarray(x) / self.slab.thickness
        n = np.arange(1, len(self.b) + 1)
        return self.ends[0] + (self.ends[1] - self.ends[0]) * s + np.sin(np.pi * np.multiply.outer(s, n)) @ self.b


def uniform_layer(slab: Slab, temperature: float, modes: int) -> "ExactLayer":
    """A layer at one temperature in K, to be followed with some number of modes."""
    return ExactLayer(slab, (temperature, temperature), np.zeros(modes))


def line_coefficients(T1: float, T2: float, modes: int) -> np.ndarray:
    """Sine coefficients on (0, L) of the straight line from T1 to T2: 2/(n pi) (T1 - T2 cos(n pi)), n = 1 .. modes."""
    n = np.arange(1, modes + 1)
    return 2 / (n * np.pi) * (T1 - T2 * (-1.0) ** n)


SLAB = Slab(thickness=10e-6, area=1e-7, conductivity=0.15, heat_capacity=970.0 * 1460.0)
TIME = SLAB.thickness**2 / SLAB.diffusivity
HISTORY = ((5.0, 1.0), (9.0, -2.0), (3.0, 3.5))


def exact(modes=400, each=0.02 * TIME):
    layer = uniform_layer(SLAB, 0.0, modes)
    for ends in HISTORY:
        layer = layer.hold(ends, each)
    return layer


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
    assert np.abs(T - exact().temperature(x)).max() < 2e-3
    x, T = by_crank_nicolson(nx=25, nt=400)
    assert np.abs(T - exact().temperature(x)).max() > 2e-3  # the tolerance sees a grid eight times coarser


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
    oracle = exact().temperature(np.linspace(0, SLAB.thickness, nx + 1))
    assert np.abs(by_crank_nicolson(nx, nt)[1] - oracle).max() < 0.02
    printed = each / nt / (SLAB.diffusivity * (SLAB.thickness / nx) ** 2)
    assert np.abs(by_crank_nicolson(nx, nt, gamma=printed)[1] - oracle).max() > 1
