"""From few states to a result: the steady state, the traces, each with its error from a coarser solution."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from reduced1d.ladder.few_states import FewStates
from reduced1d.ladder.moments import FIRST_TIME
from reduced1d.ladder.steady import runaway_voltage, steady_state
from reduced1d.ladder.transient import trajectory
from reduced1d.time_grid import time_grid
from scenes.result import Estimate, Result, Traces
from scenes.sink import Sink

GROWTH, COARSE_GROWTH = 2.0, 2.8


def result(
    name: str, sink: Sink, fine: FewStates, coarse: FewStates, steady_only: bool, times: np.ndarray | None
) -> Result:
    """The answer of ``fine``; ``coarse`` is the same reduction less finely discretised, for the errors.

    ``times`` (s, ascending from 0) are those of the traces; without them, times so dense that linear interpolation
    stays within the sink's accuracy. Raises RunawayError.
    """
    values, other = steady(fine), steady(coarse)
    limit = runaway_voltage(fine)
    details: dict[str, Any] = {
        "states": fine.states,
        "time_constant_s": float(1 / fine.rates[0]),
        "air_loss_W": values["power_W"] - values["heat_out_W"],
        "runaway_voltage_V": limit if math.isfinite(limit) else None,
    }
    traces = None
    if not steady_only:
        if times is None:
            times = time_grid(lambda at: over_time(fine, at), sink.end_time, sink.accuracy)
        traces = _traces(sink, fine, coarse, np.asarray(times, float))
    return Result(name, {key: Estimate(v, abs(v - other[key])) for key, v in values.items()}, traces, details)


def steady(model: FewStates) -> dict[str, float]:
    """The steady quantities of summary.json."""
    state, current = steady_state(model)
    found = {name: float(row @ state) for name, row in model.outputs.items()}
    power = model.voltage * current
    beam = current**2 * (model.resistance_beam + model.coefficient * float(model.source_beam @ state))
    return {
        "peak_rise_K": found["peak"],
        "end_rise_K": found["end"],
        "mean_rise_K": found["mean"],
        "current_A": current,
        "power_W": power,
        "heat_out_W": power - found["air"],
        "anchor_resistance_K_per_W": found["end"] / ((beam - found["air_beam"]) / 2),
    }


def over_time(model: FewStates, times: np.ndarray, growth: float = GROWTH) -> dict[str, np.ndarray]:
    """The quantities of traces.csv at ``times`` (s), with rises in place of temperatures."""
    states, current = trajectory(model, times, growth)
    found = {f"{name}_K": states @ model.outputs[name] for name in ("peak", "end", "mean")}
    return {**found, "current_A": current, "power_W": model.voltage * current}


def _traces(sink: Sink, fine: FewStates, coarse: FewStates, times: np.ndarray) -> Traces:
    values, other = over_time(fine, times), over_time(coarse, times, COARSE_GROWTH)
    late = times >= min(FIRST_TIME, times[-1] if len(times) else 0.0)
    errors = {key: float(np.max(np.abs(values[key] - other[key])[late], initial=0.0)) for key in values}
    for key in ("peak_K", "end_K", "mean_K"):
        values[key] = sink.room_temperature + values[key]
    return Traces(times, values, errors)
