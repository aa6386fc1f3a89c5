"""Solve a sink in 3D: the plan of a run, and its result."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from fem3d.adaptivity.adapt import adapt
from fem3d.adaptivity.mesh import Answer
from fem3d.runs import scene as scene_run
from fem3d.runs.sink_quantities import study
from fem3d.solution.march import AT_FULL_ORDER
from fem3d.solution.steady import SteadyState
from fem3d.solution.transient import Transient
from meshes import connected, symmetry
from meshes.symmetry import Symmetry
from scenes import laws, physics
from scenes.plan import Step, noted, step
from scenes.result import Estimate, Result, Traces
from scenes.sink import Sink


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
    grid, boxes = connected.coarsest(part.scene), part.scene.boxes
    live = {boxes[n].name for n in np.unique(grid.owner[connected.live(part.scene)])}
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
