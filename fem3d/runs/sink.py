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
from fem3d.adaptivity.mesh import Answer
from fem3d.results.outputs import Outputs, Quantities, Study
from fem3d.runs import scene as scene_run
from fem3d.solution.march import AT_FULL_ORDER
from fem3d.solution.steady import SteadyState
from fem3d.solution.transient import Transient
from meshes import grid as grids
from meshes import symmetry
from meshes.symmetry import Symmetry
from scenes import laws, physics
from scenes.result import Estimate, Result, Step, Traces, noted, step
from scenes.sink import Sink, different

EARLIEST = 1e-5  # s: from here on the traces hold their accuracy
NOT_TRACED = ("heat_out_W", "anchor_resistance_K_per_W", "end_flow_W")


def study(sink: Sink, part: Symmetry) -> Study:
    """Return the quantities, scales and times of a sink."""
    rises = goals = over_time = ["peak", "end", "mean"]
    ratios = {"anchor_resistance_K_per_W": "end_rise_K"}
    if sink.spans > 1:
        spans, inner = _of_spans(sink), f"span{different(sink.spans)}"
        rises, over_time = [*rises, *spans], ["end", "span1_peak", "span1_mean", f"{inner}_peak", f"{inner}_mean"]
        # The middle is next to the peak and shares its error, which saves half of the dual problems.
        goals = ["end", *(n for n in spans if not n.endswith("middle"))]
        shared = {n: n.replace("middle", "peak") for n in spans if n.endswith("middle")}
        shared |= {"peak": f"{inner}_peak", "mean": "span1_mean"}
        ratios |= {f"{n}_rise_K": f"{goal}_rise_K" for n, goal in shared.items()}
    return Study(
        part, sink.accuracy, sink.drive.value, sink.end_time, EARLIEST, (),
        {f"{n}_rise_K": n for n in goals}, {f"{n}_K": n for n in goals},
        tuple(f"{n}_rise_K" for n in rises), tuple(f"{n}_K" for n in over_time), ratios,
        steady=lambda out: steady(sink, out), traces=lambda out: traces(sink, out),
        steady_scales=lambda out: sizes(steady(sink, out)), trace_scales=lambda out: trace_sizes(steady(sink, out)),
    )  # fmt: skip


def steady(sink: Sink, out: Outputs) -> Quantities:
    """Return the steady quantities of summary.json, and ``end_flow_W``, the heat through one end of the sink.

    The anchor resistance is the end's rise over ``end_flow_W``.
    """
    values = _common(sink, out)
    heat_out, end_flow = _heat_of_row(sink, out, values) if sink.spans > 1 else _heat_of_one(sink, out)
    rises = {f"{n.removesuffix('_K')}_rise_K" if n.endswith("_K") else n: v for n, v in values.items()}
    return rises | {
        "heat_out_W": heat_out, "anchor_resistance_K_per_W": values["end_K"] / end_flow, "end_flow_W": end_flow
    }  # fmt: skip


def traces(sink: Sink, out: Outputs) -> Quantities:
    """Return the traces of traces.csv, without the model's name; temperatures in kelvin."""
    values = _common(sink, out)
    return {n: v + sink.room_temperature if n.endswith("_K") else v for n, v in values.items()}


def sizes(values: Quantities) -> dict[str, float]:
    """Return the scale for the error of each steady quantity: its own size."""
    return {name: abs(float(v)) for name, v in values.items()}


def trace_sizes(values: Quantities) -> dict[str, float]:
    """Return the scale for the error of each trace: the final rise, or the final current, power or heat."""
    return {name.replace("_rise_K", "_K"): v for name, v in sizes(values).items() if name not in NOT_TRACED}


def _of_spans(sink: Sink) -> list[str]:
    """Return the probes of the spans of half a row."""
    return [f"span{k}_{kind}" for k in range(1, different(sink.spans) + 1) for kind in ("peak", "middle", "mean")]


def _common(sink: Sink, out: Outputs) -> Quantities:
    """Return the quantities common to steady state and traces, with rises in place of temperatures."""
    current = out["current:electrode-0"]
    if sink.spans == 1:
        rises = {f"{n}_K": out[f"probe:{n}"] for n in ("peak", "end", "mean")}
        return rises | {"current_A": current, "power_W": out["power"]}
    kinds, spans = different(sink.spans), {f"{n}_K": out[f"probe:{n}"] for n in _of_spans(sink)}
    means, inner = [spans[f"span{k}_mean_K"] for k in range(1, kinds + 1)], sink.spans - 2 * (kinds - 1)
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


def _heat_of_one(sink: Sink, out: Outputs) -> tuple[np.ndarray, np.ndarray]:
    """Return the heat that leaves one span, and the heat through one end: half of the beam's own heat less its losses
    to air, gas and radiation, which holds for heated or cooled pads too."""
    into_beam = [out[name] for name in ("flow:air-beam", "flow:substrate-gas-beam") if name in out]
    into_beam += [flow for name, flow in out.items() if name.startswith("flow:radiation-beam")]
    if "probe:below" in out:
        # Gas on a substrate's surface: linear from the beam's underside down.
        warmer = out["probe:underside"] - out["probe:below"]
        into_beam.append(-sink.gap_coefficient * sink.length * sink.width * warmer)
    entering = [flow for name, flow in out.items() if name.startswith("flow:substrate")]
    return -np.sum(entering, axis=0), (out["joule:beam"] + sum(into_beam)) / 2


def _heat_of_row(sink: Sink, out: Outputs, values: Quantities) -> tuple[np.ndarray, np.ndarray]:
    """Return the heat that leaves a row, and the heat through one end: the anchor's less the pad's Joule heat, plus
    the loss at the pad's faces."""
    pad = [v for n, v in out.items() if n == "joule:pad-0" or n.startswith(("flow:air-pad-0", "flow:radiation-pad-0"))]
    kinds = sink.spans // 2
    heats = [values[f"island{k}_heat_W"] for k in range(1, kinds + 1)]
    of_islands = 2 * sum(heats[:-1]) + (sink.spans - 1 - 2 * (kinds - 1)) * heats[-1]
    return 2 * values["anchor_heat_W"] + of_islands, values["anchor_heat_W"] - sum(pad, np.float64(0.0))


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
        "plan": noted(_plan(sink, part, transient), _found(sink, answer)),
        "warnings": [*details["warnings"], *_warnings(sink, float(answer.fine.quantities["peak_rise_K"]))],
        "profile": _profile(sink, answer.fine.state, part),
        "sink": sink,
        "answer": answer,
    }
    return Result("fem3d", steady, traces, details)


def plan(sink: Sink, transient: bool) -> tuple[Step, ...]:
    """Return the steps of `solve` before it takes them."""
    return _plan(sink, symmetry.reduce(sink.scene()), transient)


def _plan(sink: Sink, part: Symmetry, transient: bool) -> tuple[Step, ...]:
    grid, boxes = grids.coarsest(part.scene), part.scene.boxes
    live = {boxes[n].name for n in np.unique(grid.owner[grids.live(part.scene)])}
    dead = sorted(b.name for b in boxes if b.name not in live)
    newton = physics.nonlinear(part.scene, transient)
    factors = (
        f"for Newton's steps: {newton}" if newton else "one per mesh: the conductivity doesn't depend on temperature"
    )
    steps = [
        part.step,
        Step("steady state", "done", f"refined until every estimated error is below {sink.accuracy:g}"),
        Step("thermal factorization", "done", factors),
        Step("electric problem", "done", f"in {', '.join(sorted(live))}, factorized once per mesh"),
    ]
    if dead:
        steps.append(Step(f"electric unknowns in {', '.join(dead)}", "skipped", "no current flows there"))
    if newton:
        steps.append(Step("Newton's method", "done", "with the current of the hot state at each step"))
    elif sink.silicon.temperature_coefficient:
        steps.append(Step("electric iteration", "done", "the resistance follows the temperature"))
    lasts = f"{_lasts(sink)}{AT_FULL_ORDER if newton else 'projected on a few Krylov fields'}"
    return *steps, step("transient", lasts, "" if transient else "only the steady state was asked for")


def _found(sink: Sink, answer: Answer) -> list[Step]:
    """Return the lines of the plan that only a run determines: numbers of steps and of fields."""
    state = answer.fine.state
    over_time = []
    if answer.response is not None:
        response = answer.response.transient
        how = f"projected on {response.reduced.states} fields" if isinstance(response, Transient) else AT_FULL_ORDER
        over_time.append(Step("transient", "done", f"{_lasts(sink)}{how}"))
    if state.heat.about is not None:
        return [Step("Newton's method", "done", f"{state.steps} steps on the last mesh's finest space"), *over_time]
    return [Step("electric iteration", "done", f"{state.steps} coupled steps to the steady state"), *over_time]


def _lasts(sink: Sink) -> str:
    return f"to {sink.end_time * 1e3:g} ms, "


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
    rise = space.sample(state.heat.field(state.rise), points[:1, 0], points[:, 1], points[:1, 2])
    return {"y_m": y, "rise_K": rise[0, :, 0], "points_m": points}
