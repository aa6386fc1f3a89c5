"""The 3D model of a sink: the plan of a run, and its result."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from fem3d import adapt, rescaled, sink_quantities
from fem3d.adapt import Answer
from fem3d.fields import Fields, grid_of
from fem3d.steady import SteadyState
from meshes import connected, statistics, symmetry
from meshes.symmetry import Symmetry
from scenes.plan import Request, Step
from scenes.result import Estimate, Result, Traces
from scenes.sink import Sink


def solve(
    sink: Sink, request: Request, progress: Callable[[str], None] | None = None, earlier: Result | None = None
) -> Result:
    """Steady state and, if asked for, transient of a sink in 3D, every number with its estimated error.

    ``earlier`` is a result of the same sink, perhaps at another voltage: its meshes, factors and fields serve again.
    Raises fem3d.errors.RunawayError where no steady state exists, NumericsError where the numerics fail.
    """
    part = symmetry.reduce(sink.scene())
    study = sink_quantities.study(sink, part)
    answer = None
    if earlier is not None:
        first, before = earlier.details["sink"], earlier.details["answer"]
        if replace(first, voltage=sink.voltage) == sink and request.transient == (before.response is not None):
            answer = rescaled.solve(study, before, sink.voltage / first.voltage)
    if answer is None:
        answer = adapt.solve(study, request.transient, progress or (lambda _: None))
    state, values = answer.fine.state, answer.fine.quantities
    steady = {name: Estimate(float(values[name]), answer.errors[name]) for name in values}
    response = answer.response
    traces = None if response is None else Traces(response.times, response.traces, response.errors)
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
        "profile": _profile(sink, state, part),
        "sink": sink,
        "answer": answer,
        "fields": Fields(state.heat, state, part, None if response is None else response.transient),
    }
    return Result("fem3d", steady, traces, details)


def plan(sink: Sink, request: Request) -> tuple[Step, ...]:
    """What `solve` will do for a scene and a request, before it does it."""
    return _plan(sink, symmetry.reduce(sink.scene()), request, None)


def _plan(sink: Sink, part: Symmetry, request: Request, answer: Answer | None) -> tuple[Step, ...]:
    """The lines; with an answer, those that depend on the solution say what it turned out to be."""
    if "fem3d" not in request.models:
        return (Step("3D model", "skipped", "only the 1D model was asked for"),)
    steps = [part.step]
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


def _profile(sink: Sink, state: SteadyState, part: Symmetry) -> dict[str, np.ndarray]:
    """The steady rise along the beam's axis."""
    y = np.linspace(0.0, sink.length, 401)
    points = part.mirrored(np.column_stack([np.zeros_like(y), y, np.full_like(y, sink.thickness / 2)]))
    space: Any = state.heat.domain.space
    rise = space.sample(state.heat.field(state.rise), points[:1, 0], points[:, 1], points[:1, 2])
    return {"y_m": y, "rise_K": rise[0, :, 0]}
