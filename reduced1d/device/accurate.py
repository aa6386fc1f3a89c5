"""The accurate scheme: all layers at once, exact between samples but for the powers, with its error estimated."""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

import numpy as np

from reduced1d.device.findings import findings
from reduced1d.device.lumped import Lumped, Modes, around, lump, modes
from scenes.device import Device
from statespace.march import March, march
from statespace.result import QUANTITIES, DeviceResult, device_result

ROUNDS, LARGEST_DEGREE, LARGEST_NODES = 4, 36, 18
"""How often the resolution is raised at most, and the largest degree in space and number of time nodes."""
LESS = 3
"""The run that estimates the error in space has elements of a degree lower by this."""


class Resolution(NamedTuple):
    """Degree of the elements in space, and number of unknown powers per element and interval in time."""

    degree: int
    nodes: int


FIRST = Resolution(12, 6)  # The resolution of the first run; it is raised until the error is small enough.


def imbalance(lumped: Lumped, modes: Modes, run: March) -> float:
    """The imbalance of heat of sink, insulator and sensor over a run, as a part of the
    heat (J) that was generated or passed the boundaries: to substrate and air, and into the polymer.

    The time integral of each mode is exact, from its own equation. The heat into the polymer is that of the reported
    flux, from the temperature's slope at the sensor, not the flux that the discretisation balances by construction.
    """
    m = modes.modal
    heat = (run.energy @ m.shape - run.change + run.stepped) / m.rates
    generated = float(run.energy.sum())
    anchors = float(lumped.conductance * (m.shape[0] @ heat + m.external[0] * run.outer_time))
    polymer = float(m.flux[0] @ heat + m.flux_external[0] * run.outer_time)
    stored = float(modes.content @ run.change + modes.content_external * run.outer)
    total = abs(generated) + abs(anchors) + abs(polymer)
    return (generated - anchors - polymer - stored) / total if total else 0.0


def solve_accurate(
    device: Device, *, meter: tuple[float, float] = (0.0, 0.0), start: Literal["cold", "settled"] = "cold",
    with_findings: bool = True,
) -> DeviceResult:  # fmt: skip
    """Traces of a device, to its ``accuracy`` where that can be reached.

    Three resolutions are run: the answer, one with elements of a degree LESS lower, and one with two powers
    fewer between samples. The differences estimate the errors of the coarser runs in space and in time
    and whatever exceeds the accuracy is refined, as long as that helps. ``meter`` is the resolution in ohm to which the
    resistances of (sink, sensor) are measured, 0 for an ideal meter. ``start`` "settled" begins in the steady state at
    the initial outer temperature, "cold" at room temperature without voltage. Without
    findings no limits of stability are sought, which of slowly sampled loops takes as long as the run. Raises
    ValueError for values that make no device, and ArithmeticError where the powers between two samples do not converge.
    """
    goal, lumped = device.accuracy * device.set_rise, lump(device)
    resolution, before = FIRST, math.inf
    for attempt in range(ROUNDS):
        degree, nodes = resolution
        spectrum, tolerance = modes(lumped, degree), min(1e-4 * goal, 1e-8)
        coarser = modes(lumped, degree - LESS)
        run, less_space, less_time = (
            march(each.modal, q, device, tolerance, meter, start)
            for each, q in ((spectrum, nodes), (coarser, nodes), (spectrum, nodes - 2))
        )
        parts = {"space": run.distance(less_space), "time": run.distance(less_time)}
        space, time = (max(part["sink_K"], part["sensor_K"]) for part in parts.values())
        finer = Resolution(
            min(degree + 6 * (space > goal / 2), LARGEST_DEGREE), min(nodes + 4 * (time > goal / 2), LARGEST_NODES)
        )
        if finer == resolution or attempt == ROUNDS - 1 or space + time > before / 2:
            break
        resolution, before = finer, space + time
    errors = {q: parts["space"][q] + parts["time"][q] + 1e-12 * float(np.abs(run.traces[:, i]).max())
              for i, q in enumerate(QUANTITIES)}  # fmt: skip
    said = findings(device, run, max(errors["sink_K"], errors["sensor_K"]), goal) if with_findings else ()
    return device_result(
        "accurate", device, run.traces, errors, **around(device), error_parts=parts, findings=said,
        details={
            "states": spectrum.modal.count, "degree": degree, "nodes": nodes, "rounds": attempt + 1,
            "energy_imbalance": imbalance(lumped, spectrum, run), "stopped": run.stopped,
        },
    )  # fmt: skip
