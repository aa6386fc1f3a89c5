"""The explicit coupling of the paper's device scheme: its largest stable step, predicted and found by simulation."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from reduced1d.device.crank_nicolson import layer_step
from reduced1d.device.lumped import Lumped, Slab, lump
from reduced1d.device.paper import PaperScheme, stability_limit
from scenes.device import Device
from validate.stress.rows import Row

GROUP = "explicit coupling"
STEPS = 3000
AGREES = 0.02  # of the predicted limit; the bisection and the count of steps leave that much


def rows(quick: bool) -> Iterator[Row]:
    """Devices with sensors of several thicknesses: films that see the layers' heat flows a step late."""
    for thickness in (200e-9,) if quick else (50e-9, 200e-9, 1e-6):
        device = replace(Device(), sensor_thickness=thickness)
        predicted = stability_limit(device)
        found = simulated_limit(lump(device), predicted)
        yield Row(GROUP, "the paper's partitioned scheme", f"sensor of {thickness * 1e9:g} nm",
                  f"largest stable step found / predicted {predicted * 1e6:.3g} us, less 1",
                  abs(found / predicted - 1), AGREES, said=f"found {found * 1e6:.3g} us by simulation")  # fmt: skip


def simulated_limit(lumped: Lumped, guess: float, scheme: PaperScheme | None = None) -> float:
    """The step (s) beyond which a simulation without power grows, by bisection to 1e-3."""
    scheme = scheme or PaperScheme()
    low, high = guess / 2.7, guess * 3.1
    while high - low > 1e-3 * high:
        middle = float(np.sqrt(low * high))
        low, high = (low, middle) if grows(lumped, middle, scheme) else (middle, high)
    return low


def grows(lumped: Lumped, dt: float, scheme: PaperScheme) -> bool:
    """Whether films and layers, each stepped by itself as the paper does, get ever farther from rest."""
    sink, sensor, inner = 1.0, -1.0, [np.zeros(scheme.nx - 1), np.zeros(scheme.nx - 1)]
    layers = [layer_step(slab, scheme.nx, scheme.nt, dt) for slab in (lumped.insulator, lumped.polymer)]
    size = []
    for _ in range(STEPS):
        for i, faces in enumerate((np.array([sink, sensor]), np.array([sensor, 0.0]))):
            inner[i] = layers[i].inner @ inner[i] + layers[i].ends @ faces
        into = _flow(lumped.insulator, scheme, sink - inner[0][0])
        through = _flow(lumped.insulator, scheme, inner[0][-1] - sensor)
        out = _flow(lumped.polymer, scheme, sensor - inner[1][0])
        loss = lumped.sink.conductance / lumped.sink.capacity * dt
        # Runge-Kutta of order 4 for a linear loss and a constant flow.
        decay, mean = 1 - loss + loss**2 / 2 - loss**3 / 6 + loss**4 / 24, 1 - loss / 2 + loss**2 / 6 - loss**3 / 24
        sink = sink * decay - mean * dt / lumped.sink.capacity * into
        sensor = sensor + dt / lumped.sensor.capacity * (through - out)
        size.append(abs(sensor) + abs(sink))
        if size[-1] > 1e6:
            return True
    return size[-1] > 2 * max(size[: STEPS // 10])


def _flow(slab: Slab, scheme: PaperScheme, drop: float) -> float:
    return slab.conductivity * slab.area * scheme.nx / slab.thickness * drop
