"""The accurate scheme: all layers at once, exact between samples but for the powers, with its error estimated."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np

from reduced1d.device.lumped import Lumped, Modes, around, lump, modes, steady
from reduced1d.device.stability import findings
from scenes.device import Device
from scenes.loop import march as sampled
from scenes.loop.controller import Law, Timetable, law, timetable
from scenes.loop.march import Start
from scenes.loop.result import QUANTITIES, DeviceResult, device_result

RESOLUTIONS = 3
ROUNDS, LARGEST_DEGREE, LARGEST_NODES = 4, 36, 18


class Resolution(NamedTuple):
    """Degree of the elements in space, and number of unknown powers per element and interval in time."""

    degree: int
    nodes: int


FIRST = Resolution(12, 6)


class March(NamedTuple):
    """A run: traces (samples, resolutions, 7) in the order of QUANTITIES, as rises; the modes of its first resolution,
    and all else that the loop gives."""

    traces: np.ndarray
    modes: Modes
    run: sampled.March


def march(
    lumped: Lumped, law: Law, table: Timetable, resolutions: Sequence[Resolution], tolerance: float,
    start: Start | None = None, watched: int | None = None,
) -> March:  # fmt: skip
    """Run the closed loop of a device, as `scenes.loop.march.march` does."""
    spectra = [modes(lumped, r.degree) for r in resolutions]
    models = [sampled.Resolution(m.modal, r.nodes) for m, r in zip(spectra, resolutions, strict=True)]
    run = sampled.march(models, law, table, tolerance, start, watched)
    return March(np.concatenate([run.rises, run.voltages, run.powers, run.flows], axis=2), spectra[0], run)


def imbalance(lumped: Lumped, run: March) -> float:
    """What is missing in the heat balance of sink, insulator and sensor over a run's first resolution, as a part of the
    heat (J) that was generated or passed the boundaries: to substrate and air, and into the polymer.

    The time integral of each mode is exact, from its own equation. The heat into the polymer is that of the reported
    flux, from the temperature's slope at the sensor, not what the discretisation balances by construction.
    """
    m, found = run.modes.modal, run.run
    heat = (found.energy @ m.shape - found.change + found.stepped) / m.rates
    generated = float(found.energy.sum())
    anchors = float(lumped.conductance * (m.shape[0] @ heat + m.external[0] * found.outer_time))
    polymer = float(m.flux[0] @ heat + m.flux_external[0] * found.outer_time)
    stored = float(run.modes.content @ found.change + run.modes.content_external * found.outer)
    total = abs(generated) + abs(anchors) + abs(polymer)
    return (generated - anchors - polymer - stored) / total if total else 0.0


def solve_accurate(
    device: Device, *, meter: tuple[float, float] = (0.0, 0.0), start: Literal["cold", "settled"] = "cold",
    with_findings: bool = True,
) -> DeviceResult:  # fmt: skip
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
    begin = None
    if start == "settled":
        outer = device.external.initial_temperature
        state = steady(device, outer)
        power, voltage = [state.sink_power_W, state.sensor_power_W], [state.sink_V, state.sensor_V]
        begin = Start([np.array(power)] * RESOLUTIONS, np.array(voltage), outer - device.sink.room_temperature)
    goal = device.accuracy * lumped.set_rise
    resolution, before = FIRST, math.inf
    for attempt in range(ROUNDS):
        degree, nodes = resolution
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
    said = findings(device, run.run, max(errors["sink_K"], errors["sensor_K"]), goal) if with_findings else ()
    return device_result(
        "accurate", table.times[: len(run.traces)], run.traces[:, 0], device.sink.room_temperature, errors,
        **around(device), error_parts=parts, findings=said,
        details={
            "states": run.modes.modal.count, "degree": degree, "nodes": nodes, "rounds": attempt + 1,
            "energy_imbalance": imbalance(lumped, run), "stopped": run.run.stopped,
        },
    )  # fmt: skip


def _difference(run: March, other: int) -> dict[str, float]:
    """Largest difference of each quantity over time between the answer and another resolution."""
    worst = np.abs(run.traces[:, 0] - run.traces[:, other]).max(axis=0)
    if not np.isfinite(worst).all():
        raise ArithmeticError("the simulated device has left the range of numbers")
    return dict(zip(QUANTITIES, worst.tolist(), strict=True))
