"""Eq 3 in one layer: Appendix A against Appendix B, both as printed and as corrected.

Appendix A corrected: T = u + w, with u = T1 + (T2 - T1) x/L (A.9) and w = sum_n b_n sin(n pi x/L) exp(-alpha n^2 pi^2
t'/L^2) (A.14). When the end temperatures change, b_n changes by the sine coefficients of a straight line: the modes
propagate exactly, and the paper's oscillatory integrals never arise. (Printed: A.9 and A.13 with a bracket misplaced,
A.15 with 2n + 1 for n.)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from numpy.testing import assert_allclose

from reduced1d.device.lumped import Slab
from reduced1d.device.paper import crank_nicolson, layer_step, mesh_ratio


@dataclass(frozen=True)
class ExactLayer:
    """A layer's temperature in K: ``ends``, its faces at x = 0 and x = L, and ``b`` (N,), the b_n of w."""

    slab: Slab
    ends: tuple[float, float]
    b: np.ndarray

    def hold(self, ends: tuple[float, float], duration: float) -> ExactLayer:
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

    def heat_flow(self) -> tuple[float, float]:
        """Heat flow -k A dT/dx in W, along x, at x = 0 and at x = L."""
        n = np.arange(1, len(self.b) + 1)
        slope = self.ends[1] - self.ends[0] + np.array([np.sum(n * self.b), np.sum(n * (-1.0) ** n * self.b)]) * np.pi
        lower, upper = -self.slab.conductance * slope
        return float(lower), float(upper)


def uniform_layer(slab: Slab, temperature: float, modes: int) -> ExactLayer:
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


def test_heat_flow_is_minus_conductivity_times_area_times_the_slope():
    layer = exact()
    h = 1e-6 * SLAB.thickness
    slope = np.diff(layer.temperature(np.array([0.0, h, SLAB.thickness - h, SLAB.thickness])))[[0, 2]] / h
    assert_allclose(layer.heat_flow(), -SLAB.conductivity * SLAB.area * slope, rtol=1e-3)


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


def tridiagonal(gamma, n):
    return (1 + gamma) * np.eye(n) - gamma / 2 * (np.eye(n, k=1) + np.eye(n, k=-1))


def march_by_matrices(gamma, right, boundary, ends, steps, n=24):
    T, b = np.zeros(n), np.zeros(n)
    b[[0, -1]] = boundary * np.array(ends)
    for _ in range(steps):
        T = np.linalg.solve(tridiagonal(gamma, n), right @ T + b)
    return T


def test_b6_and_b8_as_printed_never_reach_the_line_between_the_faces():
    gamma, n, ends = 0.7, 24, (4.0, 10.0)
    line = np.linspace(*ends, n + 2)[1:-1]
    corrected = march_by_matrices(gamma, tridiagonal(-gamma, n), gamma, ends, 3000)
    assert_allclose(corrected, line, rtol=1e-9)
    printed_b6 = march_by_matrices(gamma, tridiagonal(gamma, n), gamma, ends, 3000)
    printed_b8 = march_by_matrices(gamma, tridiagonal(-gamma, n), 1.0, ends, 3000)
    assert np.abs(printed_b6 - line).max() > 100  # it adds the boundary's share for ever
    assert np.abs(printed_b8 - line).max() > 1  # settles at 1/gamma times the faces


def test_b3_and_b4_as_printed_have_the_wrong_diffusivity():
    nx, nt, each = 100, 100, 0.02 * TIME
    oracle = exact().temperature(np.linspace(0, SLAB.thickness, nx + 1))
    assert np.abs(by_crank_nicolson(nx, nt)[1] - oracle).max() < 0.02
    printed = each / nt / (SLAB.diffusivity * (SLAB.thickness / nx) ** 2)
    assert np.abs(by_crank_nicolson(nx, nt, gamma=printed)[1] - oracle).max() > 1


def printed_a9(x, T1, T2, L):
    return (T1 + (T2 - T1) * x) / L


def test_a9_as_printed_misses_the_faces():
    layer = uniform_layer(SLAB, 0.0, 50).hold((5.0, 8.0), 20 * TIME)
    x = np.array([0.0, SLAB.thickness])
    assert_allclose(layer.temperature(x), [5.0, 8.0], rtol=1e-12)
    assert np.abs(printed_a9(x, 5.0, 8.0, SLAB.thickness) - [5.0, 8.0]).max() > 1


def sine_coefficients(f, modes):
    s, w = np.polynomial.legendre.leggauss(400)
    s, w = (s + 1) / 2, w / 2
    return 2 * np.sin(np.pi * np.outer(np.arange(1, modes + 1), s)) @ (w * f(s))


def test_a13_as_printed_does_not_start_from_the_given_temperature():
    T1, T2, modes = 5.0, 8.0, 200
    s = np.linspace(0.2, 0.8, 7)

    def given(s):
        return T1 + (T2 - T1) * s + 4 * s * (1 - s)

    def start(b):
        return T1 + (T2 - T1) * s + np.sin(np.pi * np.outer(s, np.arange(1, modes + 1))) @ b

    corrected = sine_coefficients(lambda s: given(s) - (T1 + (T2 - T1) * s), modes)
    printed = sine_coefficients(lambda s: given(s) - T1 + (T2 - T1) * s, modes)
    assert_allclose(start(corrected), given(s), atol=1e-5)
    assert np.abs(start(printed) - given(s)).max() > 1


def test_a15_needs_n_where_it_prints_2n_plus_1():
    T1, T2, modes, t = 5.0, 8.0, 400, 0.01 * TIME
    s, n = np.linspace(0.1, 0.9, 9), np.arange(1, modes + 1)
    decay = np.exp(-SLAB.diffusivity * (n * np.pi / SLAB.thickness) ** 2 * t)
    start = line_coefficients(2.0, 2.0, modes)  # a uniform 2 K, the last integral of A.15

    def a15(denominator):
        faces = 2 / np.pi * (T2 * np.cos(n * np.pi) - T1) / denominator
        return T1 + (T2 - T1) * s + np.sin(np.pi * np.outer(s, n)) @ ((faces + start) * decay)

    layer = uniform_layer(SLAB, 2.0, modes).hold((T1, T2), t)
    x, inner = np.linspace(0, SLAB.thickness, 401), np.full(399, 2.0)
    for _ in range(400):
        inner = crank_nicolson(inner, mesh_ratio(SLAB, 400, t / 400), np.array([T1, T2]), np.array([T1, T2]))
    independent = np.interp(s * SLAB.thickness, x, np.r_[T1, inner, T2])
    assert_allclose(a15(n), layer.temperature(s * SLAB.thickness), atol=1e-10)
    assert_allclose(a15(n), independent, atol=2e-3)
    assert np.abs(a15(2 * n + 1) - independent).max() > 0.3
