"""Steps, ramps and square waves of the voltage: a bar between cold ends against its series, and heat balances."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from fem3d.solve_scene import solve
from scenes.model import Box, Probe, Scene, Schedule, Value
from scenes.sink import SILICON
from validate.stress.report import Row
from validate.verify.exact_bodies import cold_electrodes
from validate.verify.series import heated_middle

GROUP = "drives"
LENGTH, VOLTS, ROOM, ACCURACY = 1e-3, 2.0, 293.0, 1e-3
SLOW = LENGTH**2 / 4 * SILICON.heat_capacity / SILICON.thermal_conductivity  # s: l^2/alpha of half the length


def rows(quick: bool) -> Iterator[Row]:
    """The voltage in steps, in ramps and as square waves of 1 kHz and 10 kHz."""
    waves = {"square wave of 10 kHz": (1e-4, 5)} if quick else {
        "square wave of 1 kHz": (1e-3, 10), "square wave of 10 kHz": (1e-4, 20),
    }  # fmt: skip
    yield _against_series("step", VOLTS, [(0.0, 1.0)], 4 * SLOW)
    for name, (period, count) in waves.items():
        edges = [(i * period / 2, 1.0 - 2.0 * (i % 2)) for i in range(2 * count)]
        times = [t for i in range(2 * count) for t in (i * period / 2, (i + 1) * period / 2)]
        values = [VOLTS * (1 - i % 2) for i in range(2 * count) for _ in (0, 1)]
        yield _against_series(name, Schedule(tuple(times), tuple(values)), edges, count * period)
    ramp = Schedule((0.0, SLOW, 2 * SLOW), (0.0, VOLTS, -VOLTS))
    for coefficient in (-5e-4, 5e-4):
        scene = _bar(ramp, coefficient, 2 * SLOW)
        found, best = solve(scene), solve(replace(scene, accuracy=ACCURACY / 10))
        assert found.traces is not None
        assert best.traces is not None
        times = scene.output_times  # type: ignore[assignment]
        a, b = (np.interp(times, r.traces.time, r.traces.values["middle"]) for r in (found, best))  # type: ignore[union-attr]
        error = found.traces.errors["middle"] + best.traces.errors["middle"]
        yield Row(GROUP, "ramp up and down through zero", f"TCR {coefficient:g} 1/K",
                  "true error over the estimated one", float(np.abs(a - b).max() / error), 1.0)  # fmt: skip
        yield Row(GROUP, "ramp up and down through zero", f"TCR {coefficient:g} 1/K", "heat balance",
                  float(found.details["energy_imbalance"]), 10 * ACCURACY)  # fmt: skip


def _against_series(name: str, voltage: Value, edges: list[tuple[float, float]], end: float) -> Row:
    """The middle of a bar without a temperature coefficient, against the superposed series of its steps."""
    scene = _bar(voltage, 0.0, end)
    found = solve(scene)
    assert found.traces is not None
    assert SILICON.resistivity is not None
    peak = VOLTS**2 / (8 * SILICON.thermal_conductivity * SILICON.resistivity)
    times = np.array(scene.output_times)
    exact = np.full(len(times), ROOM)
    for start, size in edges:
        since = np.maximum(times - start, 0.0)
        exact += size * peak * np.where(since > 0, heated_middle(since / SLOW), 0.0)
    values = np.interp(times, found.traces.time, found.traces.values["middle"])
    off = float(np.abs(values - exact).max() / found.traces.errors["middle"])
    said = f"{found.details['steps']} steps for {len(edges)} edges"
    return Row(GROUP, name, f"bar of 1 mm, {VOLTS:g} V", "true error over the estimated one", off, 1.0, said=said)


def _bar(voltage: Value, coefficient: float, end: float) -> Scene:
    upper = (20e-6, LENGTH, 2e-6)
    ends = [((0.0, y, 0.0), (upper[0], y, upper[2])) for y in (0.0, LENGTH)]
    middle = (10e-6, LENGTH / 2, 1e-6)
    material = replace(SILICON, temperature_coefficient=coefficient)
    times = tuple((end * np.linspace(0.02, 1.0, 50)).tolist())
    return Scene("bar", (Box("bar", material, (0.0, 0.0, 0.0), upper),), cold_electrodes(ends, voltage),
                 (Probe("middle", middle, middle),), ROOM, end, ACCURACY, False, times)  # fmt: skip
