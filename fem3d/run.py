"""The 3D model of a sink: the plan of a run, and its result."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from fem3d import adapt, alike, rescaled, sink_quantities, span_quantities
from fem3d.adapt import Answer
from fem3d.fields import Fields, grid_of
from fem3d.steady import SteadyState
from meshes import connected, statistics, symmetry
from meshes.symmetry import Symmetry
from scenes.plan import Request, Step
from scenes.result import Result
from scenes.sink import Sink, different


def solve(
    sink: Sink, request: Request, progress: Callable[[str], None] | None = None, earlier: Result | None = None
) -> Result:
    """Steady state and, if asked for, transient of a sink in 3D, every number with its estimated error.

    ``earlier`` is a result of the same sink, perhaps at another voltage: its meshes, factors and fields serve again.
    Raises fem3d.errors.RunawayError where no steady state exists, NumericsError where the numerics fail.
    """
    count = alike.modelled(sink)
    while True:
        part = symmetry.reduce(sink.scene(count))
        answer = _answer(sink, count, part, request, progress or (lambda _: None), earlier)
        off = alike.apart(sink, count, answer)
        if off.within(sink.accuracy):
            break
        count = alike.allowed(sink, count + 2)
    state, response = answer.fine.state, answer.response
    steady, traces = alike.of_all(sink, count, answer, off)
    values = answer.fine.quantities
    details: dict[str, Any] = {
        "unknowns": state.heat.free,
        "electric_unknowns": 0 if state.conductor is None else len(state.conductor.free),
        "steps": 0 if response is None else len(response.transient.trajectory.steps),
        "levels": answer.levels,
        "energy_imbalance": _imbalance(sink, state, part),
        "transient_imbalance": None if response is None else response.imbalance,
        "mesh": statistics.of(grid_of(state.heat)),
        "symmetry": part.part,
        "plan": _plan(sink, part, request, answer),
        "warnings": _warnings(sink, float(values["peak_rise_K"])),
        "profile": _profile(sink, count, state, part),
        "sink": sink,
        "spans_solved": count,
        "alike_error": off.spans,
        "answer": answer,
        "fields": Fields(state.heat, state, part, None if response is None else response.transient),
    }
    return Result("fem3d", steady, traces, details)


def _answer(
    sink: Sink, count: int, part: Symmetry, request: Request, progress: Callable[[str], None], earlier: Result | None
) -> Answer:
    """The answer of ``count`` spans, where that can be from that of an earlier voltage."""
    study = sink_quantities.study(sink, part) if sink.spans == 1 else span_quantities.study(sink, count, part)
    answer = None
    if earlier is not None and earlier.details["spans_solved"] == count:
        first, before = earlier.details["sink"], earlier.details["answer"]
        if replace(first, voltage=sink.voltage) == sink and request.transient == (before.response is not None):
            answer = rescaled.solve(study, before, sink.voltage / first.voltage)
    return answer or adapt.solve(study, request.transient, progress)


def plan(sink: Sink, request: Request) -> tuple[Step, ...]:
    """What `solve` will do for a scene and a request, before it does it."""
    return _plan(sink, symmetry.reduce(sink.scene(alike.modelled(sink))), request, None)


def _plan(sink: Sink, part: Symmetry, request: Request, answer: Answer | None) -> tuple[Step, ...]:
    """The lines; with an answer, those that depend on the solution say what it turned out to be."""
    if "fem3d" not in request.models:
        return (Step("3D model", "skipped", "only the 1D model was asked for"),)
    steps = [part.step]
    count = sum(b.name.startswith("span-") for b in part.scene.boxes)
    if count and sink.spans > 2 * count:
        reason = f"the {count} outermost of each half are solved; the innermost of them stands for the others"
        steps.append(Step(f"{sink.spans} spans", "done", reason))
    steps.append(Step("steady state", "done", f"refined until every estimated error is below {sink.accuracy:g}"))
    steps.append(Step("thermal factorization", "done", "one per mesh: the conductivity doesn't depend on temperature"))
    steps += _electric_steps(sink, part, answer)
    if request.transient:
        fields = "a few Krylov fields" if answer is None else f"{_states(answer)} fields"
        steps.append(Step("transient", "done", f"to {sink.end_time * 1e3:g} ms, projected on {fields}"))
    else:
        steps.append(Step("transient", "skipped", "only the steady state was asked for"))
    return tuple(steps)


def _electric_steps(sink: Sink, part: Symmetry, answer: Answer | None) -> list[Step]:
    grid, boxes = connected.coarsest(part.scene), part.scene.boxes
    live = {boxes[n].name for n in np.unique(grid.owner[connected.live(part.scene)])}
    dead = [b.name for b in boxes if b.name not in live]
    steps = [Step("electric problem", "done", f"in {', '.join(sorted(live))}, factorized once per mesh")]
    if dead:
        steps.append(Step(f"electric unknowns in {', '.join(sorted(dead))}", "skipped", "no current flows there"))
    what = "current pattern when hot"
    if not sink.silicon.temperature_coefficient:
        return steps
    if answer is None:
        steps.append(Step("electric iteration", "done", "the resistance follows the temperature"))
        steps.append(
            Step(what, "done", "checked once at the hot state; followed only if that matters at this accuracy")
        )
    else:
        state = answer.fine.state
        steps.append(Step("electric iteration", "done", f"{state.steps} coupled steps to the steady state"))
        moved = f"heating moves it by {state.pattern_change:.0e} in terms of the rise"
        steps.append(Step(what, "done" if state.follows_pattern else "skipped", moved))
    return steps


def _states(answer: Answer) -> int:
    assert answer.response is not None
    return answer.response.transient.reduced.states


def _imbalance(sink: Sink, state: SteadyState, part: Symmetry) -> float:
    """|power - heat that leaves| over the power; the power from the electrodes, the heat from the reactions."""
    from fem3d import outputs

    out = outputs.of_steady(state, part)
    left = -sum(float(v) for name, v in out.items() if name.startswith("flow:"))
    return abs(float(out["power"]) - left) / float(out["power"])


def _warnings(sink: Sink, peak: float) -> list[str]:
    hottest = sink.room_temperature + peak - sink.silicon.reference_temperature
    change = sink.silicon.temperature_coefficient * hottest
    if abs(change) <= 0.1:
        return []
    return [
        f"the linear resistivity law is used {hottest:.0f} K from its reference, where it changes the resistivity by "
        f"{change:+.0%}; constant conductivity and linear resistivity are rarely true that far"
    ]


def _profile(sink: Sink, count: int, state: SteadyState, part: Symmetry) -> dict[str, np.ndarray]:
    """The steady rise along the axis of the whole row: that of a span that is not solved is the innermost's."""
    y = np.linspace(0.0, sink.row_length, 401 if sink.spans == 1 else 100 * sink.spans + 1)
    outward, period = np.minimum(y, sink.row_length - y), sink.length + sink.island
    before = np.minimum(outward // period, different(count) - 1)
    solved = np.where(outward // period > before, before * period + outward % period, outward)
    points = part.mirrored(np.column_stack([np.zeros_like(y), solved, np.full_like(y, sink.thickness / 2)]))
    space: Any = state.heat.domain.space
    rise = space.sample(state.heat.field(state.rise), points[:1, 0], points[:, 1], points[:1, 2])
    return {"y_m": y, "rise_K": rise[0, :, 0]}
