"""Probes against time: traces.csv, and their values at some times."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from scenes.result import Result, Traces
from validate.report.traces import write_columns


def write_traces(path: Path, result: Result) -> str:
    """Writes time_s and a column for each probe, by its name (K, V, W or A); returns the file's name."""
    traces = traces_of(result)
    return write_columns(path, {"time_s": traces.time, **traces.values})


def traces_of(result: Result) -> Traces:
    """The traces of a transient; ValueError where the result has none."""
    if result.traces is None:
        raise ValueError("the result has no traces")
    return result.traces


def at(traces: Traces, name: str, times: np.ndarray) -> np.ndarray:
    """A trace at some times (s): linear between its own; where there are two values at a time, the later one."""
    own, values = traces.time, traces.values[name]
    after = np.clip(np.searchsorted(own, times, side="right"), 1, len(own) - 1)
    before = after - 1
    # The last time is not before any other, and two equal ones make a jump.
    step = own[after] - own[before]
    part = np.clip((times - own[before]) / np.where(step > 0, step, 1.0), 0.0, 1.0)
    found: np.ndarray = values[before] + np.where(step > 0, part, 1.0) * (values[after] - values[before])
    return found
