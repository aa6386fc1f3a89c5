"""Time steps from far below to far above the time constants: which methods ring; and the largest stable step of the
paper's explicit coupling, predicted and simulated."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
from scipy.sparse import diags_array, eye_array

from benchmarks import sdirk
from benchmarks.rows import Row
from fem3d.solution.exponential import integrate
from reduced1d.device.lumped import Lumped, Slab, lump
from reduced1d.device.schemes import PaperScheme, layer_step, stability_limit
from scenes.device import Device

RATES = np.geomspace(1e-6, 1e12, 400)  # decay rates times the step
COUNTS = np.arange(10, 42)  # numbers of steps; an L-stable method may overshoot in the first few
RINGING = 1e-3  # of the final rise
SIMULATED = 3000  # steps
AGREES = 0.02  # of the predicted limit: the precision of the bisection and of the count of steps

Method = Callable[[np.ndarray], np.ndarray]  # from rates times the step to the part of the final rise that is missing


def rows() -> Iterator[Row]:
    """Step y' = rate (1 - y) from rest: y never exceeds 1, but the growth factor R(-z)^n of some methods does."""
    methods: dict[str, tuple[Method, bool]] = {
        "exponential collocation": (_exponential, False),
        f"SDIRK of order {sdirk.ORDER} (second path)": (_sdirk, False),
        "backward Euler": (lambda z: 1 / (1 + z), True),
        "Crank-Nicolson": (lambda z: (1 - z / 2) / (1 + z / 2), True),
        "explicit Euler": (lambda z: 1 - z, True),
    }
    for name, (factor, foreign) in methods.items():
        with np.errstate(over="ignore"):
            missing = factor(RATES)[:, None] ** COUNTS
        worst = max(0.0, -float(missing.min()))
        at = RATES[int(missing.min(axis=1).argmin())]
        yield Row("time steps", f"{name}, rate times step {RATES[0]:g} to {RATES[-1]:g}",
                  f"overshoot over the final rise after {COUNTS[0]} steps", worst, RINGING,
                  relation="at most", foreign=foreign, note=f"largest at {at:.2g}" if worst > 1e-9 else "")  # fmt: skip


def _exponential(rates: np.ndarray) -> np.ndarray:
    """The product's own integrator over one step, under a source that brings every mode to 1."""
    run = integrate(rates, lambda since: lambda times, a: np.tile(rates, (len(a), 1)), 1.0, 1e300, 1.0)
    return np.asarray(1.0 - run(np.ones(1))[0][0])


def _sdirk(rates: np.ndarray) -> np.ndarray:
    problem = SimpleNamespace(
        size=len(rates), mass=eye_array(len(rates)), stiffness=diags_array(rates), load=lambda _: rates,
        factors=lambda mass, stiffness: lambda load: load / (mass + stiffness * rates),
    )  # fmt: skip
    *_, rise = sdirk.march(problem, np.array([0.0, 1.0]), 1e-14)
    return np.asarray(1.0 - rise)


def coupling(quick: bool) -> Iterator[Row]:
    """Find the largest stable step of the paper's coupling in devices with sensors of several thicknesses."""
    for thickness in (200e-9,) if quick else (50e-9, 200e-9, 1e-6):
        device = replace(Device(), sensor_thickness=thickness)
        predicted, lumped = stability_limit(device), lump(device)
        low, high = predicted / 2.7, predicted * 3.1
        while high - low > 1e-3 * high:
            middle = float(np.sqrt(low * high))
            low, high = (low, middle) if grows(lumped, middle, PaperScheme()) else (middle, high)
        yield Row("explicit coupling", f"the paper's partitioned scheme, sensor of {thickness * 1e9:g} nm",
                  "largest stable step", low * 1e6, predicted * 1e6, AGREES * predicted * 1e6, "us")  # fmt: skip


def grows(lumped: Lumped, dt: float, scheme: PaperScheme) -> bool:
    """Return whether films and layers, each stepped by itself as the paper does, get ever farther from rest."""
    sink, sensor, inner = 1.0, -1.0, [np.zeros(scheme.nx - 1), np.zeros(scheme.nx - 1)]
    layers = [layer_step(slab, scheme.nx, scheme.nt, dt) for slab in (lumped.insulator, lumped.polymer)]
    # Runge-Kutta of order 4 for a linear loss and a constant flow.
    loss = lumped.conductance / lumped.capacity[0] * dt
    decay, mean = 1 - loss + loss**2 / 2 - loss**3 / 6 + loss**4 / 24, 1 - loss / 2 + loss**2 / 6 - loss**3 / 24
    size = []
    for _ in range(SIMULATED):
        for i, faces in enumerate((np.array([sink, sensor]), np.array([sensor, 0.0]))):
            inner[i] = layers[i][0] @ inner[i] + layers[i][1] @ faces
        into = _flow(lumped.insulator, scheme, sink - inner[0][0])
        through = _flow(lumped.insulator, scheme, inner[0][-1] - sensor)
        out = _flow(lumped.polymer, scheme, sensor - inner[1][0])
        sink = sink * decay - mean * dt / lumped.capacity[0] * into
        sensor = sensor + dt / lumped.capacity[1] * (through - out)
        size.append(abs(sensor) + abs(sink))
        if size[-1] > 1e6:
            return True
    return size[-1] > 2 * max(size[: SIMULATED // 10])


def _flow(slab: Slab, scheme: PaperScheme, drop: float) -> float:
    return slab.conductivity * slab.area * scheme.nx / slab.thickness * drop
