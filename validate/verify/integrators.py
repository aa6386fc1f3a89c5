"""The orders in time of every integrator that is used, each with fixed steps against an exact or a dense solution."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import eigh

from fem3d.exponential import integrate
from reduced1d.device.lumped import Slab
from reduced1d.device.paper import crank_nicolson, mesh_ratio
from scenes.sink import Sink
from validate.verify import orders
from validate.verify.manufactured import Heating, joule
from validate.verify.reference import FullOrder
from validate.verify.report import Row, observed_order, order_row

FAMILY = "order in time"


def exponential_collocation() -> Iterator[Row]:
    """The collocation of the source between exact exponentials: of order 2 q in non-stiff modes at degree q, like the
    Gauss-Lobatto rule whose points it takes (Hochbruck and Ostermann, Acta Numerica 19, 2010, section 2.2)."""
    rates, end = np.array([0.5, 1.0]), 1.5

    def source(a: np.ndarray) -> np.ndarray:
        found: np.ndarray = np.exp(0.2 * a.sum(axis=-1, keepdims=True)) * np.ones(2)
        return found

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

    Without any tolerance the integrator divides each run in the same proportions, so the order is that of its steps.
    """
    state = np.zeros(len(rates))
    for _ in range(steps):
        run = integrate(rates, lambda since: lambda times, a: source(a), end / steps, 1e300, 1.0, degree, state)
        state = run(np.array([end / steps]))[0][0]
    return state


def diagonally_implicit(heating: Heating) -> Iterator[Row]:
    """Alexander's method of order 3 of the second path, on the semi-discrete problem of a heater: exact by modes."""
    full, end = orders.second_path(heating.at(np.inf), 1, 1), 0.02
    exact = _exact_linear(full, end)
    off = [float(np.abs(orders.marched(full, end, steps) - exact).max()) for steps in (8, 16)]
    yield order_row(FAMILY, "SDIRK of order 3 (second path)", "nodal rise, linear", 3, observed_order(off, 2.0))
    coupled = orders.second_path(joule(), 1, 1)
    runs = [orders.marched(coupled, 0.004, steps) for steps in (8, 16, 32)]
    yield _of_three("SDIRK of order 3 (second path)", "nodal rise, resistivity of the temperature", 3, runs)


def _of_three(case: str, quantity: str, theory: int, runs: list[np.ndarray]) -> Row:
    gaps = [float(np.abs(b - a).max()) for a, b in pairwise(runs)]
    return order_row(FAMILY, case, quantity, theory, observed_order(gaps, 2.0), "from the differences of three runs")


def _exact_linear(full: FullOrder, end: float) -> np.ndarray:
    """The rise (nodes,) at an end time of M u' + K u = load from rest, by the modes of the free nodes."""
    free = full.free
    k, m = (np.asarray(a[free][:, free].todense()) for a in (full.stiffness, full.mass))
    rates, modes = eigh(k, m)
    rise = np.zeros(len(full.load))
    rise[free] = modes @ (-np.expm1(-rates * end) / rates * (modes.T @ full.load[free]))
    return rise


def runge_kutta() -> Iterator[Row]:
    """The paper's Runge-Kutta method of order 4 for eq 20, against eq 20's closed solution."""
    from reduced1d.device.paper import runge_kutta_step
    from reduced1d.lumped import rise_at
    from reduced1d.sink import lump

    model = lump(Sink(voltage=5.0))
    end = 2 * model.time_constant
    exact = rise_at(model, np.array([end]))[0]
    found = []
    for steps in (40, 80):
        rise = 0.0
        for _ in range(steps):
            rise = runge_kutta_step(rise, 0.0, model.conductance, model.voltage**2 / model.resistance,
                                    model.coefficient, end / steps / model.capacity)  # fmt: skip
        found.append(abs(rise - exact))
    yield order_row(FAMILY, "Runge-Kutta of order 4 (1D sink, eq 20)", "equivalent rise", 4, observed_order(found, 2.0))


def layer() -> Iterator[Row]:
    """The paper's Crank-Nicolson scheme for a layer (Appendix B) in space and time at once, on its slowest sine."""
    slab = Slab(10e-6, 1e-7, 0.15, 1.4e6)
    end = 0.5 * slab.thickness**2 / (np.pi**2 * slab.diffusivity)
    found = []
    for nx in (20, 40):
        dt, x = end / nx, np.linspace(0, np.pi, nx + 1)[1:-1]
        inner, none = np.sin(x), np.zeros((2,))
        for _ in range(nx):
            inner = crank_nicolson(inner, mesh_ratio(slab, nx, dt), none, none)
        found.append(float(np.abs(inner - np.sin(x) * np.exp(-0.5)).max()))
    yield order_row(FAMILY, "Crank-Nicolson in a layer (1D device)", "temperature, step and spacing halved", 2,
                    observed_order(found, 2.0))  # fmt: skip


def partitioned() -> Iterator[Row]:
    """The paper's whole scheme: each film sees a heat flow that is late by a step, so it is of order 1 in time."""
    from reduced1d.device.paper import PaperScheme, solve_paper
    from scenes.device import Device, External

    device = replace(Device(), end_time=2e-3, external=External(293.0, 293.0, 1.0))
    runs = [solve_paper(device, PaperScheme(dt)).trace("sink_K") for dt in (0.5e-6, 0.25e-6, 0.125e-6)]
    yield _of_three("the paper's partitioned scheme (1D device)", "sink temperature", 1, runs)


def device_estimate() -> Iterator[Row]:
    """The accurate device scheme has no fixed order; its error estimate is checked against a much finer run."""
    from reduced1d.device.accurate import solve_accurate
    from scenes.device import Device

    device = replace(Device(), end_time=0.02)
    rough, fine = (solve_accurate(replace(device, accuracy=a)) for a in (1e-4, 1e-8))
    for quantity, name in (("sink_K", "sink temperature"), ("sensor_K", "sensor temperature")):
        off = float(np.abs(rough.trace(quantity) - fine.trace(quantity)).max())
        yield Row(FAMILY, "collocation in powers of sqrt(t) (1D device)", f"{name}, distance from a finer run", "K",
                  0.0, off, rough.errors[quantity] + fine.errors[quantity])  # fmt: skip
