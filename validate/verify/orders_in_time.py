"""Observed orders of convergence in time of every integrator, with fixed steps against an exact or a dense solution."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np
from scipy.integrate import solve_ivp

from benchmarks.rows import Row
from fem3d.solution.exponential import integrate
from reduced1d.device.lumped import Slab
from reduced1d.device.schemes import (
    PaperScheme,
    layer_step,
    mesh_ratio,
    runge_kutta_step,
    solve_accurate,
    solve_paper,
)
from scenes.device import Device, External
from validate.verify.expected import observed_order, order_row

FAMILY = "observed orders of convergence in time"


def exponential_collocation() -> Iterator[Row]:
    """The collocation of the source between exact exponentials: of order 2 q in non-stiff modes at degree q, like the
    Gauss-Lobatto rule whose points it takes (Hochbruck and Ostermann, Acta Numerica 19, 2010, section 2.2)."""
    rates, end = np.array([0.5, 1.0]), 1.5

    def source(a: np.ndarray) -> np.ndarray:
        return np.exp(0.2 * a.sum(axis=-1, keepdims=True)) * np.ones(2)

    exact = solve_ivp(
        lambda _, a: source(a) - rates * a, (0, end), np.zeros(2), "DOP853", rtol=1e-13, atol=1e-15
    ).y[:, -1]  # fmt: skip
    for degree, steps in ((2, (4, 8)), (3, (2, 4)), (4, (2, 3))):
        off = [float(np.linalg.norm(_fixed_steps(rates, source, end, n, degree) - exact)) for n in steps]
        yield order_row(FAMILY, f"exponential collocation of degree {degree}", "modal state", 2 * degree,
                        observed_order(off, steps[1] / steps[0]))  # fmt: skip


def _fixed_steps(
    rates: np.ndarray, source: Callable[[np.ndarray], np.ndarray], end: float, steps: int, degree: int
) -> np.ndarray:
    """The final state after equal steps, each a run of the integrator of its own.

    Without any tolerance the integrator divides each run in the same proportions, which leaves the order of its steps.
    """
    state = np.zeros(len(rates))
    for _ in range(steps):
        run = integrate(rates, lambda since: lambda times, a: source(a), end / steps, 1e300, 1.0, degree, state)
        state = run(np.array([end / steps]))[0][0]
    return state


def runge_kutta() -> Iterator[Row]:
    """The paper's Runge-Kutta method of order 4 for eq 20, dx/ds = 1/(1 + b x) - x when scaled."""
    feedback, end, errors = 0.17, 2.0, []
    exact = solve_ivp(lambda _, x: 1 / (1 + feedback * x) - x, (0, end), [0.0], "DOP853", rtol=1e-13, atol=1e-15)
    for steps in (40, 80):
        rise = 0.0
        for _ in range(steps):
            rise = runge_kutta_step(rise, 0.0, 1.0, 1.0, feedback, end / steps)
        errors.append(abs(rise - float(exact.y[0, -1])))
    yield order_row(
        FAMILY, "Runge-Kutta of order 4 (1D sink, eq 20)", "equivalent rise", 4, observed_order(errors, 2.0)
    )


def layer() -> Iterator[Row]:
    """The paper's Crank-Nicolson scheme for a layer (Appendix B) in space and time at once, on its slowest sine."""
    slab = Slab(10e-6, 1e-7, 0.15, 1.4e6)
    end = 0.5 * slab.thickness**2 / (np.pi**2 * slab.diffusivity)
    errors = []
    for nx in (20, 40):
        dt, x = end / nx, np.linspace(0, np.pi, nx + 1)[1:-1]
        inner = layer_step(mesh_ratio(slab, nx, dt), nx, nx)[0] @ np.sin(x)
        errors.append(float(np.abs(inner - np.sin(x) * np.exp(-0.5)).max()))
    yield order_row(FAMILY, "Crank-Nicolson in a layer (1D device)", "temperature, step and spacing halved", 2,
                    observed_order(errors, 2.0))  # fmt: skip


def partitioned() -> Iterator[Row]:
    """The paper's whole scheme: each film sees a heat flow that is late by a step, so it is of order 1 in time."""

    device = replace(Device(), end_time=2e-3, external=External(293.0, 293.0, 1.0))
    runs = [solve_paper(device, PaperScheme(dt)).trace("sink_K") for dt in (0.5e-6, 0.25e-6, 0.125e-6)]
    gaps = [float(np.abs(b - a).max()) for a, b in pairwise(runs)]
    yield order_row(FAMILY, "the paper's partitioned scheme (1D device)", "sink temperature", 1,
                    observed_order(gaps, 2.0), "from the differences of three runs")  # fmt: skip


def device_estimate() -> Iterator[Row]:
    """The accurate device scheme has no fixed order; its error estimate is checked against a much finer run."""

    device = replace(Device(), end_time=0.02)
    rough, fine = (solve_accurate(replace(device, accuracy=a)) for a in (1e-4, 1e-8))
    for quantity, name in (("sink_K", "sink temperature"), ("sensor_K", "sensor temperature")):
        off = float(np.abs(rough.trace(quantity) - fine.trace(quantity)).max())
        yield Row(FAMILY, "collocation in powers of sqrt(t) (1D device)", f"{name}, distance from a finer run", off,
                  0.0, rough.errors[quantity] + fine.errors[quantity], "K")  # fmt: skip
