"""The whole sensor in 1D: ``options`` are the ``scheme`` and the ``end_time``, for the accurate one ``accuracy``, for
the paper's ``dt``, ``nx`` and ``nt``. The paper's scheme runs here without the accurate one that measures it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from reduced1d.device import paper
from reduced1d.device.accurate import solve_accurate
from reduced1d.device.lumped import lump
from scenes.device import Device
from scenes.keys import DEVICE
from scenes.loading import load
from scenes.loop.controller import law
from scenes.loop.timetable import timetable


def prepare(options: dict[str, Any]) -> tuple[Callable[[], np.ndarray], Callable[[np.ndarray], dict[str, Any]]]:
    """Simulate; read the rises (K) of sink and sensor at every sample."""
    device = replace(load("device", [], of=DEVICE), end_time=options["end_time"])

    def solve() -> np.ndarray:
        if options["scheme"] == "paper":
            return _paper(device, paper.PaperScheme(options["dt"], options["nx"], options["nt"]))
        found = solve_accurate(replace(device, accuracy=options["accuracy"]))
        return np.array([found.sink_K, found.sensor_K]) - device.sink.room_temperature

    def read(rises: np.ndarray) -> dict[str, Any]:
        return {"values": {"sink": rises[0].tolist(), "sensor": rises[1].tolist()}, "set_rise": device.set_rise}

    return solve, read


def _paper(device: Device, scheme: paper.PaperScheme) -> np.ndarray:
    """(2, samples): as `paper.solve_paper` does it, up to the traces."""
    lumped, table = lump(device), timetable(device)
    per_sample = int(np.ceil(table.sample_time / scheme.dt - 1e-9))
    used = paper.PaperScheme(table.sample_time / per_sample, scheme.nx, scheme.nt)
    if paper.spectral_radius(lumped, used) > 1 + 1e-12:
        raise paper.UnstableStepError("the paper's scheme is unstable at this step")
    control = law(device, lumped.resistance, lumped.coefficient)
    steps = {k * per_sample + round(after / used.dt): outer for k, at in table.steps.items() for after, outer in at}
    traces = paper._march(lumped, control, used, table.samples, per_sample, steps)
    found: np.ndarray = traces[:, :2].T
    return found
