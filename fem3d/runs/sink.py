"""Solve a sink of one span or a row of spans in 3D: the plan of a run, its quantities, and its result.

A row has the mean over all spans and the largest peak. Each span and island of half the row, counted from its outer
end, adds ``span<k>_peak_rise_K``, ``span<k>_middle_rise_K``, ``span<k>_mean_rise_K``, ``island<k>_heat_W``, and
``anchor_heat_W`` of one anchor.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from fem3d.adaptivity.adapt import adapt
from fem3d.results.outputs import Outputs, Quantities, Study
from fem3d.runs import scene as scene_run
from fem3d.solution.steady import SteadyState
from meshes import grid, symmetry
from meshes.symmetry import Symmetry
from scenes import laws, physics
from scenes.result import Estimate, Result, Step, Traces, step
from scenes.sink import Sink, different


def study(sink: Sink, part: Symmetry) -> Study:
    """Return the quantities, scales and times of a sink.

    The scale of an error is the steady value of the quantity: the final rise, current, power or heat. Traces hold their
    accuracy from 10 us on.
    """
    goals = ["peak", "end", "mean"]
    ratios = {"anchor_resistance_K_per_W": "end_rise_K"}
    if sink.spans > 1:
        spans, inner = _of_spans(sink), f"span{different(sink.spans)}"
        # The middle is next to the peak and shares its error, which saves half of the dual problems.
        goals = ["end", *(n for n in spans if not n.endswith("middle"))]
        shared = {n: n.replace("middle", "peak") for n in spans if n.endswith("middle")}
        shared |= {"peak": f"{inner}_peak", "mean": "span1_mean"}
        ratios |= {f"{n}_rise_K": f"{goal}_rise_K" for n, goal in shared.items()}

    def sizes(out: Outputs) -> dict[str, float]:
        return {name: abs(float(v)) for name, v in steady(sink, out).items()}

    not_traced = "heat_out_W", "anchor_resistance_K_per_W", "end_flow_W"
    return Study(
        part, sink.accuracy, drive=sink.drive.value, end=sink.end_time, earliest=1e-5, instants=(),
        goals={f"{n}_rise_K": n for n in goals}, trace_goals={f"{n}_K": n for n in goals}, ratios=ratios,
        steady=lambda out: steady(sink, out), traces=lambda out: traces(sink, out), steady_scales=sizes,
        trace_scales=lambda out: {n.replace("_rise_K", "_K"): v for n, v in sizes(out).items() if n not in not_traced},
    )  # fmt: skip


def steady(sink: Sink, out: Outputs) -> Quantities:
    """Return the steady quantities of summary.json, and ``end_flow_W``, the heat through one end of the sink.

    The anchor resistance is the end's rise over ``end_flow_W``.
    """
    values, end_flow = _common(sink, out), _end_flow(sink, out)
    heat_out = -sum(flow for name, flow in out.items() if name.startswith("flow:substrate"))
    rises = {f"{n.removesuffix('_K')}_rise_K" if n.endswith("_K") else n: v for n, v in values.items()}
    return rises | {
        "heat_out_W": np.asarray(heat_out), "anchor_resistance_K_per_W": values["end_K"] / end_flow,
        "end_flow_W": end_flow,
    }  # fmt: skip


def traces(sink: Sink, out: Outputs) -> Quantities:
    """Return the traces of traces.csv, without the model's name; temperatures in kelvin."""
    values = _common(sink, out)
    return {n: v + sink.room_temperature if n.endswith("_K") else v for n, v in values.items()}


def _of_spans(sink: Sink) -> list[str]:
    """Return the probes of the spans of half a row."""
    return [f"span{k}_{kind}" for k in range(1, different(sink.spans) + 1) for kind in ("peak", "middle", "mean")]


def _common(sink: Sink, out: Outputs) -> Quantities:
    """Return the quantities common to steady state and traces, with rises in place of temperatures."""
    electric = {"current_A": out["current:electrode-0"], "power_W": out["power"]}
    if sink.spans == 1:
        return {f"{n}_K": out[f"probe:{n}"] for n in ("peak", "end", "mean")} | electric
    spans, kinds = {f"{n}_K": out[f"probe:{n}"] for n in _of_spans(sink)}, different(sink.spans)
    # Each span stands for two, except the middle span of an odd row.
    weights = np.array([*[2] * (kinds - 1), sink.spans - 2 * (kinds - 1)]) / sink.spans
    peaks, means = (np.array([spans[f"span{k}_{n}_K"] for k in range(1, kinds + 1)]) for n in ("peak", "mean"))
    return {
        "peak_K": peaks.max(axis=0), "end_K": out["probe:end"], "mean_K": weights @ means, **electric, **spans,
        "anchor_heat_W": -out["flow:substrate-0"],
        **{f"island{k}_heat_W": -out[f"flow:substrate-island-{k}"] for k in range(1, sink.spans // 2 + 1)},
    }  # fmt: skip


def _end_flow(sink: Sink, out: Outputs) -> np.ndarray:
    """Return the heat (W) through one end of the sink.

    For one span it is half of the beam's own heat less its losses to air, gas and radiation, which holds for heated or
    cooled pads too; for a row the anchor's heat less the pad's Joule heat, plus the loss at the pad's faces.
    """

    def total(*prefixes: str) -> Any:
        return sum(v for n, v in out.items() if n.startswith(prefixes))

    if sink.spans > 1:
        pad = out.get("joule:pad-0", 0.0) + total("flow:air-pad-0", "flow:radiation-pad-0")
        return np.asarray(-out["flow:substrate-0"] - pad)
    heat = out["joule:beam"] + total("flow:air-beam", "flow:substrate-gas-beam", "flow:radiation-beam")
    if "probe:below" in out:
        # Gas on a substrate's surface: linear from the beam's underside down.
        warmer = out["probe:underside"] - out["probe:below"]
        heat = heat - sink.gap_coefficient * sink.length * sink.width * warmer
    return heat / 2


def solve(sink: Sink, transient: bool = True, progress: Callable[[str], None] | None = None) -> Result:
    """Solve the steady state and, with ``transient``, the transient of a sink in 3D, with estimated errors.

    Raises scenes.errors.RunawayError where no steady state exists, NumericsError where the numerics fail.
    """
    part = symmetry.reduce(sink.scene())
    physics.refuse_following(part.scene, transient)
    answer = adapt(study(sink, part), transient, progress or (lambda _: None))
    steady = {n: Estimate(float(v), answer.errors[n]) for n, v in answer.fine.quantities.items()}
    response = answer.response
    traces = None if response is None else Traces(response.times, response.traces, response.errors)
    details = scene_run.described(study(sink, part), answer)
    details |= {
        "plan": plan(sink, transient, part),
        "warnings": [*details["warnings"], *_warnings(sink, float(answer.fine.quantities["peak_rise_K"]))],
        "profile": _profile(sink, answer.fine.state, part),
        "sink": sink,
        "answer": answer,
    }
    return Result("fem3d", steady, traces, details)


def plan(sink: Sink, transient: bool, part: Symmetry | None = None) -> tuple[Step, ...]:
    """Return the steps of `solve` before it takes them, perhaps for the ``part`` that is known to be solved."""
    part = part or symmetry.reduce(sink.scene())
    lasts = f"to {sink.end_time * 1e3:g} ms, {scene_run.transient_method(part.scene)}"
    return (
        part.step, scene_run.heat_step(part.scene, transient), scene_run.electric_step(grid.graph(part.scene)),
        Step("steady state", "done", f"refined until every estimated error is below {sink.accuracy:g}"),
        step("transient", lasts, "" if transient else "only the steady state was asked for"),
    )  # fmt: skip


def _warnings(sink: Sink, peak: float) -> list[str]:
    hottest = sink.room_temperature + peak - sink.silicon.reference_temperature
    change = sink.silicon.temperature_coefficient * hottest
    if abs(change) <= 0.1:
        return []
    constant = "" if laws.varies(sink.silicon.thermal_conductivity) else "constant conductivity or "
    return [
        f"the linear resistivity law is used {hottest:.0f} K from its reference, where it changes the resistivity by "
        f"{change:+.0%}; {constant}linear resistivity is rarely true that far"
    ]


def _profile(sink: Sink, state: SteadyState, part: Symmetry) -> dict[str, np.ndarray]:
    """Return the steady rise (K) along the axis of the whole row."""
    y = np.linspace(0.0, sink.row_length, 401 if sink.spans == 1 else 100 * sink.spans + 1)
    points = part.mirrored(np.column_stack([np.zeros_like(y), y, np.full_like(y, sink.thickness / 2)]))
    space: Any = state.heat.domain.space
    return {"y_m": y, "rise_K": space.sample(state.heat.field(state.rise), points.T), "points_m": points}
