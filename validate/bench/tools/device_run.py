"""The whole sensor in 1D: ``options`` are the ``scheme`` and the ``end_time``, for the accurate one ``accuracy``, for
the paper's ``dt``, ``nx`` and ``nt``. The paper's scheme runs here without the accurate one that measures it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from reduced1d.device.accurate import solve_accurate
from reduced1d.device.paper import PaperScheme, paper_traces
from scenes.keys import DEVICE
from scenes.loading import load


def prepare(options: dict[str, Any]) -> tuple[Callable[[], np.ndarray], Callable[[np.ndarray], dict[str, Any]]]:
    """Simulate; read the rises (K) of sink and sensor at every sample."""
    device = replace(load("device", [], of=DEVICE), end_time=options["end_time"])

    def solve() -> np.ndarray:
        if options["scheme"] == "paper":
            traces, _ = paper_traces(device, PaperScheme(options["dt"], options["nx"], options["nt"]))
            return traces[:, :2].T
        found = solve_accurate(replace(device, accuracy=options["accuracy"]))
        return np.array([found.sink_K, found.sensor_K]) - device.sink.room_temperature

    def read(rises: np.ndarray) -> dict[str, Any]:
        return {"values": {"sink": rises[0].tolist(), "sensor": rises[1].tolist()}, "set_rise": device.set_rise}

    return solve, read
