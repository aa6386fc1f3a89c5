"""The accurate scheme: all layers at once, exact between samples but for the powers, with its error estimated."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np

from reduced1d.device.balance import balance
from reduced1d.device.findings import findings
from reduced1d.device.lumped import lump
from reduced1d.device.march import March, Resolution, march
from reduced1d.device.steady import around, steady
from scenes.device import Device
from scenes.loop.controller import law, timetable
from scenes.loop.march import Start
from scenes.loop.result import QUANTITIES, DeviceResult, device_result

FIRST = Resolution(12, 6)
RESOLUTIONS = 3
ROUNDS, LARGEST_DEGREE, LARGEST_NODES = 4, 36, 18


def solve_accurate(
    device: Device,
    *,
    meter: tuple[float, float] = (0.0, 0.0),
    start: Literal["cold", "settled"] = "cold",
    with_findings: bool = True,
) -> DeviceResult:
    """Traces of a device, to its ``accuracy`` where that can be reached.

    Three resolutions run side by side: the answer, one with elements three degrees lower, and one with two powers
    fewer between samples. The differences estimate the error in space and in time (of the coarser ones, so generously)
    and whatever exceeds the accuracy is refined, as long as that helps. ``meter`` is the resolution in ohm to which the
    resistances of (sink, sensor) are measured, 0 for an ideal meter. ``start`` "settled" begins in the steady state at
    the initial outer temperature, "cold" at room temperature without voltage. Without
    findings no limits of stability are sought, which of slowly sampled loops takes as long as the run. Raises
    ValueError for values that make no device, and ArithmeticError where the powers between two samples cannot be found.
    """
    lumped, table = lump(device), timetable(device)
    control = law(device, lumped.resistance, lumped.coefficient, meter)
    begin = _settled(device) if start == "settled" else None
    goal = device.accuracy * lumped.set_rise
    resolution, before = FIRST, math.inf
    for attempt in range(ROUNDS):
        degree, nodes = resolution.degree, resolution.nodes
        ladder = (resolution, Resolution(degree - 3, nodes), Resolution(degree, nodes - 2))
        run = march(lumped, control, table, ladder, min(1e-4 * goal, 1e-8), begin)
        parts = {name: _difference(run, i) for i, name in ((1, "space"), (2, "time"))}
        space, time = (max(part["sink_K"], part["sensor_K"]) for part in parts.values())
        finer = Resolution(
            min(degree + 6 * (space > goal / 2), LARGEST_DEGREE), min(nodes + 4 * (time > goal / 2), LARGEST_NODES)
        )
        if finer == resolution or attempt == ROUNDS - 1 or space + time > before / 2:
            break
        resolution, before = finer, space + time
    errors = {q: parts["space"][q] + parts["time"][q] + 1e-12 * float(np.abs(run.traces[:, 0, i]).max())
              for i, q in enumerate(QUANTITIES)}  # fmt: skip
    heat = balance(lumped, run)
    said = findings(device, run.run, max(errors["sink_K"], errors["sensor_K"]), goal) if with_findings else ()
    return device_result(
        "accurate", table.times[: len(run.traces)], run.traces[:, 0], device.sink.room_temperature, errors,
        **around(device), error_parts=parts, findings=said,
        details={
            "states": run.modes.modal.count, "degree": degree, "nodes": nodes, "rounds": attempt + 1,
            "balance": heat, "energy_imbalance": heat.imbalance, "stopped": run.run.stopped,
        },
    )  # fmt: skip


def _settled(device: Device) -> Start:
    state = steady(device, device.external.initial_temperature)
    power = np.array([state.sink_power_W, state.sensor_power_W])
    return Start(
        [power] * RESOLUTIONS, np.array([state.sink_V, state.sensor_V]),
        device.external.initial_temperature - device.sink.room_temperature,
    )  # fmt: skip


def _difference(run: March, other: int) -> dict[str, float]:
    """Largest difference of each quantity over time between the answer and another resolution."""
    worst = np.abs(run.traces[:, 0] - run.traces[:, other]).max(axis=0)
    if not all(math.isfinite(x) for x in worst):
        raise ArithmeticError("the simulated device has left the range of numbers")
    return dict(zip(QUANTITIES, worst.tolist(), strict=True))
