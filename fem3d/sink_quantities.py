"""The sink's quantities from the outputs of a solution."""

from __future__ import annotations

import numpy as np

from fem3d.outputs import Outputs
from scenes.sink import Sink

Quantities = dict[str, np.ndarray]


def steady(sink: Sink, out: Outputs) -> Quantities:
    """Steady quantities of summary.json, and ``end_flow_W``, the heat through one end of the beam.

    The anchor resistance is the end's rise over that heat, which is the beam's own heat less what the air takes from
    the beam, half to each end; it holds for heated or cooled pads too.
    """
    end_flow = (out["joule:beam"] + out.get("flow:air-beam", np.float64(0.0))) / 2
    return {
        "peak_rise_K": out["rise:peak"],
        "end_rise_K": out["rise:end"],
        "mean_rise_K": out["rise:mean"],
        "current_A": out["current:electrode-0"],
        "power_W": out["power"],
        "heat_out_W": -(out["flow:substrate-0"] + out["flow:substrate-1"]),
        "anchor_resistance_K_per_W": out["rise:end"] / end_flow,
        "end_flow_W": end_flow,
    }


def traces(sink: Sink, out: Outputs) -> Quantities:
    """Traces of traces.csv, without the model's name; temperatures in kelvin."""
    room = sink.room_temperature
    return {
        "peak_K": room + out["rise:peak"],
        "end_K": room + out["rise:end"],
        "mean_K": room + out["rise:mean"],
        "current_A": out["current:electrode-0"],
        "power_W": out["power"],
    }


def trace_scales(sink: Sink, steady_values: Quantities) -> dict[str, float]:
    """What an error of a trace is relative to: the final rise, or for current and power their final value."""
    return {
        "peak_K": abs(float(steady_values["peak_rise_K"])),
        "end_K": abs(float(steady_values["end_rise_K"])),
        "mean_K": abs(float(steady_values["mean_rise_K"])),
        "current_A": abs(float(steady_values["current_A"])),
        "power_W": abs(float(steady_values["power_W"])),
    }
