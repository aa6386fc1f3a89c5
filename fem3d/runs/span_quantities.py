"""Quantities of a sink of several spans.

They include the quantities of one span (`fem3d.runs.sink_quantities`), with the mean over all spans and the largest
peak. Each span and island of half the row, counted from its outer end, adds ``span<k>_peak_rise_K``,
``span<k>_middle_rise_K``, ``span<k>_mean_rise_K``, ``island<k>_heat_W``, and ``anchor_heat_W`` of one anchor.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from fem3d.results.outputs import Outputs
from fem3d.results.study import Quantities, Study
from fem3d.runs import sink_quantities
from meshes.symmetry import Symmetry
from scenes.sink import Sink, different

OF_SPAN = ("peak", "middle", "mean")


def study(sink: Sink, part: Symmetry) -> Study:
    """Return the quantities, scales and times of a sink of several spans."""
    names = [f"span{k}_{kind}" for k in range(1, different(sink.spans) + 1) for kind in OF_SPAN]
    middles = {f"{n}_rise_K": f"{n.replace('middle', 'peak')}_rise_K" for n in names if n.endswith("middle")}
    # The middle is next to the peak and shares its error, which saves half of the dual problems.
    goals = ["end", *(n for n in names if not n.endswith("middle"))]
    inner = f"span{different(sink.spans)}"

    def read(out: Outputs) -> Quantities:
        return steady(sink, out)

    return replace(
        sink_quantities.study(sink, part),
        goals={f"{n}_rise_K": n for n in goals}, trace_goals={f"{n}_K": n for n in goals},
        rises=tuple(f"{n}_rise_K" for n in ("peak", "mean", "end", *names)),
        trace_rises=("end_K", "span1_peak_K", "span1_mean_K", f"{inner}_peak_K", f"{inner}_mean_K"),
        ratios={
            "anchor_resistance_K_per_W": "end_rise_K", "peak_rise_K": f"{inner}_peak_rise_K",
            "mean_rise_K": "span1_mean_rise_K", **middles,
        },
        steady=read, traces=lambda out: traces(sink, out),
        steady_scales=lambda out: sink_quantities.sizes(read(out)),
        trace_scales=lambda out: sink_quantities.trace_sizes(read(out)),
    )  # fmt: skip


def steady(sink: Sink, out: Outputs) -> Quantities:
    """Return the steady quantities of summary.json, and ``end_flow_W``, the heat through one end of the row.

    ``end_flow_W`` is the anchor heat less the pad's Joule heat, plus the loss at the pad's faces.
    """
    values = _both(sink, out)
    entering = [
        v for n, v in out.items() if n == "joule:pad-0" or n.startswith(("flow:air-pad-0", "flow:radiation-pad-0"))
    ]
    end_flow = values["anchor_heat_W"] - sum(entering, np.float64(0.0))
    rises = {f"{n.removesuffix('_K')}_rise_K" if n.endswith("_K") else n: v for n, v in values.items()}
    return rises | {
        "heat_out_W": 2 * values["anchor_heat_W"] + _over_islands(sink, values),
        "anchor_resistance_K_per_W": values["end_K"] / end_flow,
        "end_flow_W": end_flow,
    }


def traces(sink: Sink, out: Outputs) -> Quantities:
    """Return the traces of traces.csv, without the model's name; temperatures in kelvin."""
    values = _both(sink, out)
    return {n: v + sink.room_temperature if n.endswith("_K") else v for n, v in values.items()}


def _both(sink: Sink, out: Outputs) -> Quantities:
    """Return the quantities common to steady state and traces, with rises in place of temperatures."""
    kinds = different(sink.spans)
    spans = {f"span{k}_{kind}_K": out[f"probe:span{k}_{kind}"] for k in range(1, kinds + 1) for kind in OF_SPAN}
    means = [spans[f"span{k}_mean_K"] for k in range(1, kinds + 1)]
    inner = sink.spans - 2 * (kinds - 1)
    current = out["current:electrode-0"]
    return {
        "peak_K": np.max([spans[f"span{k}_peak_K"] for k in range(1, kinds + 1)], axis=0),
        "end_K": out["probe:end"],
        "mean_K": (2 * sum(means[:-1]) + inner * means[-1]) / sink.spans,
        "current_A": current,
        "power_W": sink.spans * sink.voltage * current,
        **spans,
        "anchor_heat_W": -out["flow:substrate-0"],
        **{f"island{k}_heat_W": -out[f"flow:substrate-island-{k}"] for k in range(1, sink.spans // 2 + 1)},
    }


def _over_islands(sink: Sink, values: Mapping[str, np.ndarray]) -> np.ndarray:
    """Return the heat (W) through all islands."""
    kinds = sink.spans // 2
    heats = [values[f"island{k}_heat_W"] for k in range(1, kinds + 1)]
    return 2 * sum(heats[:-1]) + (sink.spans - 1 - 2 * (kinds - 1)) * heats[-1]
