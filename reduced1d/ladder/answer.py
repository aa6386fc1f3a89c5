"""From few states to a result: the steady state, the traces, each with its error from a coarser solution."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from reduced1d.ladder.few_states import FewStates, runaway_voltage, steady_state, trajectory
from reduced1d.ladder.moments import FIRST_TIME
from reduced1d.sink import time_grid
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
    found = {name.replace("_K", "_rise_K"): float(value) for name, value in _read(model, state).items()}
    power = model.voltage * current
    end_flow = found.get("anchor_heat_W", 0.0)
    if not end_flow:
        beam = current**2 * (model.resistance_beam + model.coefficient * float(model.source_beam @ state))
        end_flow = (beam - float(model.outputs["air_beam"] @ state)) / 2
    return found | {
        "current_A": current,
        "power_W": power,
        "heat_out_W": power - float(model.outputs["air"] @ state),
        "anchor_resistance_K_per_W": found["end_rise_K"] / end_flow,
    }


def over_time(model: FewStates, times: np.ndarray, growth: float = GROWTH) -> dict[str, np.ndarray]:
    """The quantities of traces.csv at ``times`` (s), with rises in place of temperatures."""
    states, current = trajectory(model, times, growth)
    return {**_read(model, states), "current_A": current, "power_W": model.voltage * current}


def _read(model: FewStates, states: np.ndarray) -> dict[str, np.ndarray]:
    """The rises (K) and heats (W) at states (..., n); of a row of spans the peak is the largest of theirs."""
    found = {}
    for name, row in model.outputs.items():
        if not name.startswith("air"):
            value = states @ row.T
            found[f"{name}_W" if name.endswith("_heat") else f"{name}_K"] = _top(value) if row.ndim > 1 else value
    if "peak_K" not in found:
        found["peak_K"] = np.max([v for name, v in found.items() if name.endswith("_peak_K")], axis=0)
    return found


def _top(values: np.ndarray) -> np.ndarray:
    """(...,): the top of a profile known at equally spaced places (..., places), by the parabola through three."""
    at = np.clip(values.argmax(axis=-1), 1, values.shape[-1] - 2)[..., None]
    low, top, high = (np.take_along_axis(values, at + d, axis=-1)[..., 0] for d in (-1, 0, 1))
    bend = 2 * top - low - high
    inside = (bend > 0) & (np.abs(high - low) <= 2 * bend)
    above = np.where(inside, (high - low) ** 2 / (8 * np.where(inside, bend, 1.0)), np.maximum(low, high) - top)
    found: np.ndarray = top + np.maximum(above, 0.0)
    return found


def _traces(sink: Sink, fine: FewStates, coarse: FewStates, times: np.ndarray) -> Traces:
    values, other = over_time(fine, times), over_time(coarse, times, COARSE_GROWTH)
    late = times >= min(FIRST_TIME, times[-1] if len(times) else 0.0)
    errors = {key: float(np.max(np.abs(values[key] - other[key])[late], initial=0.0)) for key in values}
    values = {key: sink.room_temperature + v if key.endswith("_K") else v for key, v in values.items()}
    return Traces(times, values, errors)
