"""Quantities of a sink from the outputs of a solution."""

from __future__ import annotations

import numpy as np

from fem3d.results.outputs import Outputs
from fem3d.results.study import Quantities, Study
from meshes.symmetry import Symmetry
from scenes.sink import Sink

EARLIEST = 1e-5  # s: from here on the traces hold their accuracy
RISES = {"peak_rise_K": "peak", "end_rise_K": "end", "mean_rise_K": "mean"}
TRACES = {"peak_K": "peak", "end_K": "end", "mean_K": "mean"}
NOT_TRACED = ("heat_out_W", "anchor_resistance_K_per_W", "end_flow_W")


def study(sink: Sink, part: Symmetry) -> Study:
    """Return the quantities, scales and times of a sink."""
    return Study(
        part, sink.accuracy, sink.drive.value, sink.end_time, EARLIEST, (), RISES, TRACES, tuple(RISES),
        tuple(TRACES), {"anchor_resistance_K_per_W": "end_rise_K"},
        steady=lambda out: steady(sink, out), traces=lambda out: traces(sink, out),
        steady_scales=lambda out: sizes(steady(sink, out)), trace_scales=lambda out: trace_sizes(steady(sink, out)),
    )  # fmt: skip


def steady(sink: Sink, out: Outputs) -> Quantities:
    """Return the steady quantities of summary.json, and ``end_flow_W``, the heat through one end of the beam.

    The anchor resistance is the end's rise over ``end_flow_W``. This is half of the beam's own heat less its losses to
    air, gas and radiation; it holds for heated or cooled pads too.
    """
    entering = [flow for name, flow in out.items() if name.startswith("flow:substrate")]
    into_beam = [out[name] for name in ("flow:air-beam", "flow:substrate-gas-beam") if name in out]
    into_beam += [flow for name, flow in out.items() if name.startswith("flow:radiation-beam")]
    if "probe:below" in out:
        # Gas on a substrate's surface: linear from the beam's underside down.
        warmer = out["probe:underside"] - out["probe:below"]
        into_beam.append(-sink.gap_coefficient * sink.length * sink.width * warmer)
    end_flow = (out["joule:beam"] + sum(into_beam)) / 2
    return {name: out[f"probe:{probe}"] for name, probe in RISES.items()} | {
        "current_A": out["current:electrode-0"],
        "power_W": out["power"],
        "heat_out_W": -np.sum(entering, axis=0),
        "anchor_resistance_K_per_W": out["probe:end"] / end_flow,
        "end_flow_W": end_flow,
    }


def traces(sink: Sink, out: Outputs) -> Quantities:
    """Return the traces of traces.csv, without the model's name; temperatures in kelvin."""
    return {name: sink.room_temperature + out[f"probe:{probe}"] for name, probe in TRACES.items()} | {
        "current_A": out["current:electrode-0"],
        "power_W": out["power"],
    }


def sizes(values: Quantities) -> dict[str, float]:
    """Return the scale for the error of each steady quantity: its own size."""
    return {name: abs(float(v)) for name, v in values.items()}


def trace_sizes(values: Quantities) -> dict[str, float]:
    """Return the scale for the error of each trace: the final rise, or the final current, power or heat."""
    return {name.replace("_rise_K", "_K"): v for name, v in sizes(values).items() if name not in NOT_TRACED}
