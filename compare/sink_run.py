"""A run of a sink: the 3D model, the 1D model at its times, checks, and the answer.

Nothing here imports numpy before it solves: the renderer's process, which takes the longest to get ready, is started
first.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

from compare.outcome import Clock, Outcome
from compare.plan import ONLY_1D, of_sink
from scenes.plan import Request, Step

if TYPE_CHECKING:
    from compare.against.data import Data
    from compare.verdict import Check
    from reduced1d.ladder.levels import Levels
    from scenes.result import Result
    from scenes.sink import Sink

FEW = 16
"""Instants at which a sink's temperatures are looked at: they grow evenly."""


def plan(sink: Sink, request: Request, data: Data | None = None) -> tuple[Step, ...]:
    """What `solve` will do, before it does it."""
    if "fem3d" not in request.models:
        return of_sink(sink, request, (ONLY_1D,), data)
    from fem3d.run import plan as plan_3d

    return of_sink(sink, request, plan_3d(sink, request), data)


def solve(
    sink: Sink, request: Request, say: Callable[[str], None], clock: Clock, data: Data | None = None
) -> Outcome[Sink]:  # fmt: skip
    """Both models, the checks, with those of a user's own ``data``, and the answer. Raises RunawayError (of either
    model) and NumericsError."""
    from compare.answer import answered

    levels = _levels(sink, request)
    outcome = _compared(sink, request, levels, say, clock, data=data)
    with clock.stage("checks"):
        warnings = (*outcome.warnings, *_too_hot(sink, outcome.fem3d, outcome.reduced1d))
    with clock.stage("answer"):
        outcome = answered(replace(outcome, warnings=warnings), levels)
    if data is None or outcome.fem3d is None:
        return outcome
    from compare.against.checks import evaluate

    checks = (*outcome.checks, *evaluate(sink, data, outcome.fem3d))
    warnings = (*outcome.warnings, *(f"{data.name}: {text}" for text in data.warnings))
    return replace(outcome, checks=checks, warnings=warnings, against=data)


def compared(sink: Sink, request: Request, earlier: Result | None = None) -> Outcome[Sink]:
    """Both models and the checks alone: no answer in words, no warnings of what gets too hot. ``earlier`` is the 3D
    result of the same sink at another voltage, whose meshes and fields may serve again. Raises as `solve` does."""
    return _compared(sink, request, _levels(sink, request), lambda _: None, Clock(), earlier)


def _compared(
    sink: Sink,
    request: Request,
    levels: Levels | None,
    say: Callable[[str], None],
    clock: Clock,
    earlier: Result | None = None,
    data: Data | None = None,
) -> Outcome[Sink]:
    fem3d = reduced1d = why = exported = None
    if request.export is not None and levels is not None:
        from reduced1d.export import export

        with clock.stage("export"):
            exported = export(levels, request.reduction, request.export)
    checks: tuple[Check, ...] = ()
    solver_steps: tuple[Step, ...] = (ONLY_1D,)
    if "fem3d" in request.models:
        with clock.stage("imports"):
            from fem3d.errors import NumericsError, RunawayError
            from fem3d.run import solve as solve_3d
            from scenes.extremes import cause
        say("solving in 3D")
        with clock.stage("fem3d"):
            try:
                fem3d = solve_3d(sink, request, say) if earlier is None else solve_3d(sink, request, say, earlier)
            except NumericsError as error:
                if isinstance(error, RunawayError):
                    raise
                raise NumericsError(
                    f"{error}{cause(sink, ', ask for less with --accuracy 1e-2, or see --only 1d')}"
                ) from None
        solver_steps = tuple(fem3d.details["plan"])
    if "reduced1d" in request.models:
        with clock.stage("reduced1d"):
            reduced1d = _reduction(sink, request, fem3d, levels)
    if fem3d is not None:
        from compare.checks import evaluate

        with clock.stage("checks"):
            checks = evaluate(sink, request, fem3d, reduced1d)
    if request.why and fem3d is not None and levels is not None:
        from compare.budget import budget

        with clock.stage("why"):
            why = budget(sink, request.reduction, fem3d, levels, say)
    warnings = tuple(text for model in (fem3d, reduced1d) if model for text in model.details.get("warnings", ()))
    steps = of_sink(sink, request, solver_steps, data)
    return Outcome(sink, request, steps, fem3d, reduced1d, checks, warnings, why=why, exported=exported)


def _too_hot(sink: Sink, fem3d: Result | None, reduced1d: Result | None) -> tuple[str, ...]:
    """The materials that get hotter than they are valid to, in 3D where that is solved."""
    from compare import hottest

    if fem3d is not None:
        reached = hottest.by_material(fem3d.details["fields"], hottest.moments(fem3d.traces, FEW))
    elif reduced1d is not None:
        from reduced1d.painted import of_result

        reached = hottest.of_painted(of_result(sink, reduced1d))
    else:
        return ()
    return tuple(hottest.warnings((sink.silicon, sink.oxide), reached))


def _levels(sink: Sink, request: Request) -> Levels | None:
    """The plate, where any of what is asked for stands on it; it is solved when first used."""
    if request.reduction == "paper" and not request.why and request.export is None:
        return None
    from reduced1d.ladder.levels import Levels

    return Levels(sink)


def _reduction(sink: Sink, request: Request, fem3d: Result | None, levels: Levels | None) -> Result:
    """The 1D model, at the times of the 3D model's traces where there are any."""
    from reduced1d.errors import RunawayError
    from reduced1d.ladder import solve as solve_1d

    times = fem3d.traces.time if fem3d is not None and fem3d.traces is not None else None
    try:
        return solve_1d(sink, request.reduction, steady_only=not request.transient, times=times, levels=levels)
    except RunawayError as error:
        if fem3d is None:
            raise
        raise RunawayError(f"in 1D (3D has a steady state, see --only 3d) {error}", error.limit_voltage) from None
