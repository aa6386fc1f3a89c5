"""The whole sensor in 1D: run time against error of the accurate scheme and of the paper's own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from validate.bench import measure
from validate.bench.entries import Entry

ACCURATE, PAPER = "accurate scheme", "the paper's scheme"
ACCURACIES = (1e-3, 1e-4, 1e-5, 1e-6)
SCHEMES = ((1e-6, 25, 10), (5e-7, 50, 10), (2.5e-7, 100, 10))
END, QUICK_END = 0.05, 0.005  # s: the start from cold, where the schemes differ most
FINEST = 1e-8
Values = dict[str, Any]


def run(quick: bool, count: int, progress: Callable[[str], None]) -> dict[str, Any]:
    """Rows of both schemes, with the error (largest of sink and sensor over time, relative to the set rise) against the
    accurate scheme at FINEST; and ``uncertainty``, how far from it the paper's scheme stays when its two finest grids
    are extrapolated at first order in space, at most and at the end: the only check by another scheme."""
    end = {"end_time": QUICK_END if quick else END}
    progress("device: reference")
    reference = measure.once(Entry(ACCURATE, "finest", "device", {**end, "accuracy": FINEST}))
    entries = [Entry(ACCURATE, f"accuracy {a:.0e}", "device", {**end, "accuracy": a}) for a in ACCURACIES]
    for dt, nx, nt in SCHEMES[: 2 if quick else None]:
        entries.append(Entry(PAPER, f"dt {dt * 1e6:g} us, {nx} intervals", "device", {**end, "scheme": (dt, nx, nt)}))

    def errors(values: Values) -> tuple[float, float]:
        """The largest of both, over time and at the end."""
        off = np.array([np.array(values[q]) - reference["values"][q] for q in ("sink", "sensor")])
        off = np.abs(off) / reference["set_rise"]
        return float(off.max()), float(off[:, -1].max())

    rows = measure.in_turns(entries, count, progress, not quick)
    grids = [row["values"] for row in rows if row["tool"] == PAPER and not row["failure"]][-2:]
    for row in rows:
        over, last = (None, None) if row["failure"] else errors(row.pop("values"))
        row |= {"error": over, "error_at_end": last}
    uncertainty = None
    if len(grids) == 2:
        uncertainty = errors({q: 2 * np.array(grids[1][q]) - grids[0][q] for q in ("sink", "sensor")})
    return {"rows": rows, "end_time_s": end["end_time"], "uncertainty": uncertainty}


def prepare(options: dict[str, Any]) -> tuple[Callable[[], np.ndarray], Callable[[np.ndarray], dict[str, Any]]]:
    """Simulate to the ``end_time``, by the accurate scheme at an ``accuracy`` or by the paper's ``scheme``; read the
    rises (K) of sink and sensor at every sample. The paper's runs here without the accurate one that measures it."""
    from reduced1d.device.accurate import solve_accurate
    from reduced1d.device.paper import PaperScheme, paper_traces
    from scenes.keys import DEVICE
    from scenes.loading import load

    device = replace(load("device", [], scene_type=DEVICE), end_time=options["end_time"])

    def solve() -> np.ndarray:
        if "scheme" in options:
            return paper_traces(device, PaperScheme(*options["scheme"]))[0][:, :2].T
        traces = solve_accurate(replace(device, accuracy=options["accuracy"]))
        return np.array([traces.sink_K, traces.sensor_K]) - device.sink.room_temperature

    def read(rises: np.ndarray) -> dict[str, Any]:
        return {"values": {"sink": rises[0].tolist(), "sensor": rises[1].tolist()}, "set_rise": device.set_rise}

    return solve, read
