"""The whole sensor in 1D: run time against error of the accurate scheme and of the paper's own."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from validate.bench import measure
from validate.bench.entries import Entry

ACCURATE, PAPER = "accurate scheme", "the paper's scheme"
ACCURACIES = (1e-3, 1e-4, 1e-5, 1e-6)
SCHEMES = ((1e-6, 25, 10), (5e-7, 50, 10), (2.5e-7, 100, 10))
END, QUICK_END = 0.05, 0.005  # s: the start from cold, where the schemes differ most
FINEST = 1e-8


def run(quick: bool, count: int, progress: Callable[[str], None]) -> dict[str, Any]:
    """Rows of both schemes, with the error (largest of sink and sensor over time, relative to the set rise) against the
    accurate scheme at FINEST; and ``uncertainty``, how far from it the paper's scheme stays when its two finest grids
    are extrapolated at first order in space, at most and at the end: the only check by another scheme."""
    end = {"end_time": QUICK_END if quick else END}
    finest = Entry(ACCURATE, "finest", "device_run", {**end, "scheme": "accurate", "accuracy": FINEST})
    progress("device: reference")
    reference = measure.once(finest)
    entries = [
        Entry(ACCURATE, f"accuracy {a:.0e}", "device_run", {**end, "scheme": "accurate", "accuracy": a})
        for a in ACCURACIES
    ] + [
        Entry(PAPER, f"dt {dt * 1e6:g} us, {nx} intervals", "device_run",
              {**end, "scheme": "paper", "dt": dt, "nx": nx, "nt": nt})
        for dt, nx, nt in SCHEMES[: 2 if quick else None]
    ]  # fmt: skip
    measured = measure.in_turns(entries, count, progress, not quick)
    rows = [
        {"tool": m.entry.tool, "label": m.entry.label, "failure": m.failure, "median_s": m.median_s,
         "error": _error(m.found, reference) if m.found else None,
         "error_at_end": _error(m.found, reference, slice(-1, None)) if m.found else None}
        for m in measured
    ]  # fmt: skip
    return {"rows": rows, "end_time_s": end["end_time"], "uncertainty": _extrapolated(measured, reference)}


def _error(found: dict[str, Any], reference: dict[str, Any], samples: slice = slice(None)) -> float:
    pairs = ((found["values"][q][samples], reference["values"][q][samples]) for q in ("sink", "sensor"))
    return max(_apart(a, b) for a, b in pairs) / float(reference["set_rise"])


def _apart(a: list[float], b: list[float]) -> float:
    return float(np.abs(np.array(a) - np.array(b)).max())


def _extrapolated(measured: list[measure.Measured], reference: dict[str, Any]) -> tuple[float, float] | None:
    grids = [m.found for m in measured if m.entry.tool == PAPER and m.found]
    if len(grids) < 2:
        return None
    coarse, fine = grids[-2]["values"], grids[-1]["values"]
    values = {q: (2 * np.array(fine[q]) - np.array(coarse[q])).tolist() for q in fine}
    found = {"values": values}
    return _error(found, reference), _error(found, reference, slice(-1, None))
